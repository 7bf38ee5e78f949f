# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Read the columns of a pickled table without trusting the file and without pandas.

A pickle is a program. Here it may name a closed list of classes and functions, and each of them
is a stand-in of ours that only keeps its arguments, NumPy's arrays and dtypes too: what a damaged
file says of their insides ends the process. Anything else is refused before it is called. The
reader is the one in plain Python: the one in C takes memory for the largest number in the file.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
import io
import math
import os
from pathlib import Path
import pickle
import struct
import sys
from typing import Any, ClassVar

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.yaml_files import shown
import numpy as np
from numpy.typing import NDArray

#: Largest file that is read [bytes].
LARGEST = 512_000_000
#: Bits of the largest whole number that a float can be.
WIDEST = 1024


class _Kept:
    """Keep what a pickle would have made an object of."""

    def __init__(self, *arguments: Any) -> None:
        self.arguments = arguments
        self.state: Any = None

    def __setstate__(self, state: Any) -> None:
        self.state = state


class _Frame(_Kept):
    pass


class _Dtype:
    # Stand-in of numpy.dtype: a name and a byte order, nothing else of its state.
    def __init__(self, name: Any, *rest: Any) -> None:
        if not isinstance(name, str):
            raise RecordingError('the pickle describes a dtype that is not one of numbers')
        self._name, self._swapped = name, False

    def __setstate__(self, state: Any) -> None:
        if state[1] not in ('<', '>', '=', '|') or any(part is not None for part in state[2:5]):
            raise RecordingError('the pickle describes a dtype that is not one of numbers')
        self._swapped = state[1] == {'little': '>', 'big': '<'}[sys.byteorder]

    def made(self) -> np.dtype[Any]:
        """Return the dtype."""
        dtype = np.dtype(self._name)
        if dtype.kind not in 'biufO' or dtype.hasobject != (dtype.kind == 'O'):
            raise RecordingError(f'the pickle holds {dtype}, not numbers and texts')
        return dtype.newbyteorder('S') if self._swapped else dtype


class _Ndarray:
    # Stands for numpy.ndarray where it is named; not to be called.
    def __init__(self, *arguments: Any) -> None:
        raise RecordingError('the pickle builds an array by hand')


class _Array:
    """Stand-in of an array: its values, made once its shape and their number agree."""

    def __init__(self) -> None:
        self.values: NDArray[Any] = np.empty(0)

    def __setstate__(self, state: Any) -> None:
        _, shape, dtype, fortran, raw = state
        self.values = _array(raw, dtype, shape, 'F' if fortran else 'C')


def _array(raw: Any, dtype: Any, shape: Any, order: str) -> NDArray[Any]:
    if not isinstance(dtype, _Dtype) or not isinstance(shape, tuple) or not all(
            isinstance(size, int) and size >= 0 for size in shape):
        raise RecordingError('the pickle holds an array without shape or dtype')
    count, kind = math.prod(shape), dtype.made()
    made: NDArray[Any]
    if kind.kind == 'O':
        if not isinstance(raw, list) or len(raw) != count:
            raise RecordingError('the pickle holds an array of another size than its shape')
        made = np.empty(count, dtype=object)
        for place, cell in enumerate(raw):
            made[place] = _cell(cell)
    else:
        if not isinstance(raw, (bytes, bytearray)) or len(raw) != count * kind.itemsize:
            raise RecordingError('the pickle holds an array of another size than its shape')
        made = np.frombuffer(bytes(raw), dtype=kind)
    return made.reshape(shape, order='F' if order == 'F' else 'C')


def _cell(value: Any) -> Any:
    # A list of two lists, each of two and so on, would be written out for ever.
    if value is not None and not isinstance(value, (str, bytes, int, float)):
        raise RecordingError(f'the pickle holds a {type(value).__name__} among numbers and texts')
    if isinstance(value, int) and value.bit_length() > WIDEST:
        raise RecordingError(f'the pickle holds a number of {value.bit_length()} bits')
    return value


def _empty(kind: Any, shape: Any, code: Any) -> _Array:
    # Stand-in of numpy's _reconstruct: an array that __setstate__ will fill.
    if kind is not _Ndarray:
        raise RecordingError('the pickle builds an array of a kind that is not numpy.ndarray')
    return _Array()


def _from_buffer(buffer: Any, dtype: Any, shape: Any, order: Any, *rest: Any) -> NDArray[Any]:
    return _array(buffer, dtype, shape, order)


def _values(array: Any) -> NDArray[Any]:
    values = array.values if isinstance(array, _Array) else array
    if not isinstance(values, np.ndarray):
        raise RecordingError('the pickle holds something else where an array should be')
    return values


def _index(kind: Any, state: Any) -> Any:
    return state


def _block(values: Any, placement: Any, ndim: Any = 2) -> tuple[Any, Any]:
    return values, placement


class _Block:
    # Stand-in of functools.partial, by which older pandas names the making of a block.
    def __init__(self, function: Any) -> None:
        if function is not _block:
            raise RecordingError('the pickle prepares a call that is not that of a block')

    def __setstate__(self, state: Any) -> None:
        if state[0] is not _block or state[1]:
            raise RecordingError('the pickle prepares a call that is not that of a block')

    def __call__(self, values: Any, placement: Any) -> tuple[Any, Any]:
        return values, placement


def _slice(*arguments: int) -> slice:
    return slice(*arguments)


_ALLOWED: Mapping[tuple[str, str], Any] = {
    ('pandas.core.frame', 'DataFrame'): _Frame,
    # pandas 3 says whole names by the package.
    ('pandas', 'DataFrame'): _Frame,
    ('pandas', 'Index'): _Kept,
    ('pandas', 'RangeIndex'): _Kept,
    ('pandas.core.internals.managers', 'BlockManager'): _Kept,
    ('pandas._libs.internals', '_unpickle_block'): _block,
    ('pandas.core.internals.blocks', 'new_block'): _block,
    ('functools', 'partial'): _Block,
    ('pandas.core.indexes.base', '_new_Index'): _index,
    ('pandas.core.indexes.base', 'Index'): _Kept,
    ('pandas.core.indexes.range', 'RangeIndex'): _Kept,
    ('pandas.core.indexes.numeric', 'Int64Index'): _Kept,
    ('numpy.core.multiarray', '_reconstruct'): _empty,
    ('numpy._core.multiarray', '_reconstruct'): _empty,
    ('numpy.core.numeric', '_frombuffer'): _from_buffer,
    ('numpy._core.numeric', '_frombuffer'): _from_buffer,
    ('numpy', 'ndarray'): _Ndarray,
    ('numpy', 'dtype'): _Dtype,
    ('builtins', 'slice'): _slice,
}


_PLAIN: dict[int, Callable[[Any], None]] = dict(pickle._Unpickler.dispatch)


def _refuse_keys(target: Any, keys: Iterable[Any]) -> None:
    # A pair of two pairs, each of two and so on, would be hashed for ever.
    if type(target) is not dict or not all(isinstance(key, str) for key in keys):
        raise RecordingError('the pickle holds a mapping from something else than texts')


class _Reader(pickle._Unpickler):
    """An unpickler that knows the names of :data:`_ALLOWED` and no others."""

    stack: list[Any]
    metastack: list[list[Any]]
    read: Callable[[int], bytes]

    def _build(self) -> None:
        # Stand-ins get their state; functions and classes keep theirs.
        if not isinstance(self.stack[-2], (_Kept, _Block, _Dtype, _Array)):
            raise RecordingError('the pickle changes something that is not a table')
        _PLAIN[pickle.BUILD[0]](self)

    def _bytearray(self) -> None:
        # The plain reader makes one as long as the file says, before it looks what is there.
        (size,) = struct.unpack('<Q', self.read(8))
        if size > LARGEST:
            raise RecordingError(f'the pickle announces {size} bytes')
        self.stack.append(bytearray(self.read(size)))

    def _item(self) -> None:
        _refuse_keys(self.stack[-3], self.stack[-2:-1])
        _PLAIN[pickle.SETITEM[0]](self)

    def _items(self) -> None:
        _refuse_keys(self.metastack[-1][-1], self.stack[::2])
        _PLAIN[pickle.SETITEMS[0]](self)

    def _dict(self) -> None:
        _refuse_keys({}, self.stack[::2])
        _PLAIN[pickle.DICT[0]](self)

    dispatch: ClassVar[dict[int, Callable[[Any], None]]] = {
        # A table has no sets.
        **{code: load for code, load in _PLAIN.items()
           if code not in (pickle.EMPTY_SET[0], pickle.FROZENSET[0])},
        pickle.BUILD[0]: _build, pickle.BYTEARRAY8[0]: _bytearray, pickle.SETITEM[0]: _item,
        pickle.SETITEMS[0]: _items, pickle.DICT[0]: _dict}

    def find_class(self, module_name: str, global_name: str, /) -> Any:
        try:
            return _ALLOWED[module_name, global_name]
        except KeyError:
            raise RecordingError(
                f'the pickle names {shown(f"{module_name}.{global_name}")}, which a table of '
                'numbers has no use for; it is refused') from None

    def persistent_load(self, pid: Any) -> Any:
        raise RecordingError('the pickle refers to something outside itself; it is refused')


def read_columns(path: str | os.PathLike[str]) -> dict[str, NDArray[Any]]:
    """
    Read a pickled pandas table.

    Parameters
    ----------
    path : path-like
        Written by ``DataFrame.to_pickle`` of pandas 1 to 3, not compressed; texts as objects.

    Returns
    -------
    dict of str to numpy.ndarray, shape (n_rows,)
        Columns as they are in the file: numbers, or texts.

    Raises
    ------
    RecordingError
        If the file is no such table, or names anything that a table has no use for.

    """
    place = Path(path)
    try:
        if place.stat().st_size > LARGEST:
            raise RecordingError(f'{place}: larger than {LARGEST} bytes')
        # From memory: a file would be asked for as much as the pickle says there is.
        return _columns(_Reader(io.BytesIO(place.read_bytes())).load())
    except RecordingError as error:
        raise RecordingError(f'{place}: {error}') from error
    except OSError as error:
        raise RecordingError(f'{place}: {error.strerror}') from error
    except (pickle.UnpicklingError, EOFError, AttributeError, ValueError, TypeError, KeyError,
            IndexError, ImportError, MemoryError, OverflowError, RecursionError,
            struct.error) as error:
        raise RecordingError(f'{place}: not a pickled table ({type(error).__name__})') from error


def _columns(frame: Any) -> dict[str, NDArray[Any]]:
    if not isinstance(frame, _Frame) or not isinstance(frame.state, dict):
        raise RecordingError('not a pickled table')
    blocks, axes = frame.state['_mgr'].arguments[:2]
    names = [str(name) for name in _values(axes[0]['data'])]
    columns: dict[str, NDArray[Any]] = {}
    for values, placement in blocks:
        places: Iterable[int] = (range(len(names))[placement] if isinstance(placement, slice)
                                 else [int(p) for p in placement])
        for place, row in zip(places, _values(values), strict=True):
            columns[names[place]] = row
    if sorted(columns) != sorted(names):
        raise RecordingError('the table lacks columns that it names')
    return {name: columns[name] for name in names}


def numbers(column: NDArray[Any], name: str) -> NDArray[np.float64]:
    """
    Return a column as numbers.

    Raises
    ------
    RecordingError
        If a cell is none.

    """
    return np.array([_number(cell, name) for cell in column], dtype=np.float64)


def _number(cell: Any, name: str) -> float:
    try:
        return float(cell)
    except (TypeError, ValueError, OverflowError) as error:
        raise RecordingError(f'column {name}: {shown(cell)} is not a number') from error
