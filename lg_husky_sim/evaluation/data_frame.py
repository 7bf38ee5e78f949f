# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Read the columns of a pickled table without trusting the file and without pandas.

A pickle is a program. Here it may name a closed list of classes and functions, and each of them
is a stand-in of ours that only keeps its arguments; NumPy's own arrays and dtypes are the sole
exception. Anything else is refused before it is called.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
import os
from pathlib import Path
import pickle
from typing import Any

from lg_husky_sim.errors import RecordingError
import numpy as np
from numpy.typing import NDArray

#: Largest file that is read [bytes].
LARGEST = 512_000_000


class _Kept:
    """Keep what a pickle would have made an object of."""

    def __init__(self, *arguments: Any) -> None:
        self.arguments = arguments
        self.state: Any = None

    def __setstate__(self, state: Any) -> None:
        self.state = state


class _Frame(_Kept):
    pass


def _empty(kind: Any, shape: Any, code: Any) -> NDArray[Any]:
    # Stand-in of numpy's _reconstruct: an array that __setstate__ will fill.
    if kind is not np.ndarray:
        raise RecordingError('the pickle builds an array of a kind that is not numpy.ndarray')
    made: NDArray[Any] = np.ndarray((0,), dtype='b')
    return made


def _from_buffer(buffer: Any, dtype: Any, shape: Any, order: Any, *rest: Any) -> NDArray[Any]:
    return np.frombuffer(bytes(buffer), dtype=dtype).reshape(shape, order=order)


def _dtype(*arguments: Any) -> np.dtype[Any]:
    return np.dtype(str(arguments[0]))


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
    ('numpy', 'ndarray'): np.ndarray,
    ('numpy', 'dtype'): _dtype,
    ('builtins', 'slice'): _slice,
}


class _Reader(pickle.Unpickler):
    """An unpickler that knows the names of :data:`_ALLOWED` and no others."""

    def find_class(self, module_name: str, global_name: str, /) -> Any:
        try:
            return _ALLOWED[module_name, global_name]
        except KeyError:
            raise RecordingError(
                f'the pickle names {module_name}.{global_name}, which a table of numbers has no '
                'use for; it is refused') from None

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
        with place.open('rb') as stream:
            frame = _Reader(stream).load()
        return _columns(frame)
    except RecordingError as error:
        raise RecordingError(f'{place}: {error}') from error
    except OSError as error:
        raise RecordingError(f'{place}: {error.strerror}') from error
    except (pickle.UnpicklingError, EOFError, AttributeError, ValueError, TypeError, KeyError,
            IndexError, ImportError, MemoryError, OverflowError, RecursionError) as error:
        raise RecordingError(f'{place}: not a pickled table ({type(error).__name__})') from error


def _columns(frame: Any) -> dict[str, NDArray[Any]]:
    if not isinstance(frame, _Frame) or not isinstance(frame.state, dict):
        raise RecordingError('not a pickled table')
    blocks, axes = frame.state['_mgr'].arguments[:2]
    names = [str(name) for name in axes[0]['data']]
    columns: dict[str, NDArray[Any]] = {}
    for values, placement in blocks:
        places: Iterable[int] = (range(len(names))[placement] if isinstance(placement, slice)
                                 else [int(p) for p in placement])
        for place, row in zip(places, values, strict=True):
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
    convert: Callable[[Any], float] = float
    try:
        return np.array([convert(cell) for cell in column], dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise RecordingError(f'column {name}: {error}') from error
