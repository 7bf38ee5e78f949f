# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Compile a function with numba where it is installed, and leave it plain Python elsewhere."""

from __future__ import annotations

from collections.abc import Callable
import functools
import importlib.util
import os
from pathlib import Path
import threading
from typing import Any, cast, TypeVar

Function = TypeVar('Function', bound=Callable[..., Any])

#: Environment variable: any value but '' and '0' keeps the kernel in plain Python.
SWITCH = 'LG_HUSKY_NO_NUMBA'


def compiled() -> bool:
    """Return whether the kernel is machine code here (numba present and not switched off)."""
    if os.environ.get(SWITCH, '0') not in ('', '0'):
        return False
    return importlib.util.find_spec('numba') is not None


class Kernel:
    """
    A function that becomes machine code when it is first called.

    Numba is imported then, not before: a program that ends without a simulation never waits for
    it.

    Parameters
    ----------
    function : callable
        Without fast-math: every operation is IEEE, in the order in which it is written, so that
        the compiled and the plain function give the same numbers.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        functools.update_wrapper(self, function)
        #: The function in plain Python, with the parts that it calls.
        self.plain = function
        self._machine: Any = None
        self._postponed = False
        self._seen: tuple[Any, ...] = ()

    def __call__(self, *arguments: Any) -> Any:
        """Call the machine code, or plain Python while :meth:`soon` waits for it."""
        if self._postponed:
            if not self._seen:
                import numba
                # Now: an array may be read-only later, which is another type.
                self._seen = tuple(map(numba.typeof, arguments))
            return self.plain(*arguments)
        machine = self._machine or self._made()
        return machine(*arguments)

    def on_disk(self) -> bool:
        """Return whether there is machine code on disk, as far as can be told without a call."""
        return any(_index_files(self._made(), self.plain))

    def soon(self, elsewhere: Callable[[], object]) -> threading.Event:
        """
        Let calls run in plain Python until machine code has been put on disk.

        Parameters
        ----------
        elsewhere : callable
            Does that, in a thread of its own. Where it could not, the thread compiles.

        Returns
        -------
        threading.Event
            Set from when on calls run in machine code.
        """
        self._postponed, done = True, threading.Event()

        def load() -> None:
            try:
                elsewhere()
                if self._seen:
                    self._made().compile(self._seen)
            finally:
                self._postponed, self._seen = False, ()
                done.set()

        threading.Thread(target=load, daemon=True, name='machine code').start()
        return done

    @property
    def _numba_type_(self) -> Any:
        # What numba asks of an object that it meets where it compiles another function.
        return (self._machine or self._made())._numba_type_

    def _made(self) -> Any:
        import numba
        with _MAKING:
            if self._machine is None:
                while _PARTS:
                    part, options = _PARTS.pop()
                    machine = numba.njit(**_known(options))(part)
                    # The type only has a weak reference.
                    part.__dict__.update(_machine=machine, _numba_type_=machine._numba_type_)
                made = numba.njit(cache=True, nogil=True, error_model='numpy')(self.plain)
                if _SOURCES:
                    forget_outdated(_index_files(made, self.plain),
                                    max(path.stat().st_mtime for path in _SOURCES))
                self._machine = made
        return self._machine


def jit(function: Function) -> Function:
    """Return a function as a :class:`Kernel` where numba is used, and else as it is."""
    if not compiled():
        return function
    _remember_source(function)
    return cast(Function, Kernel(function))


def jit_part(function: Function) -> Function:
    """
    Return a function as it is, and let kernels compile it into their own code.

    It must not allocate, slice or return an array: its arrays are not counted, which takes an
    atomic increment and decrement for each one and call.
    """
    return _part(function, {'forceinline': True})


def jit_call(function: Function) -> Function:
    """
    Let kernels call a function's machine code, as :func:`jit_part` does.

    Its code stays by itself, which compiles faster where it is called from several places.
    """
    return _part(function, {})


def _part(function: Function, options: dict[str, Any]) -> Function:
    if compiled():
        _remember_source(function)
        _PARTS.append((function, options))
    return function


def _known(options: dict[str, Any]) -> dict[str, Any]:
    # Options of a part; it is never called from Python, and shares no machine code but by its
    # callers. Not all are public: a numba without them only makes slower code, or more of it.
    from numba.core.options import DefaultOptions
    wanted = {'_nrt': False, 'no_cpython_wrapper': True, 'no_cfunc_wrapper': True, **options}
    return {'nogil': True, 'error_model': 'numpy',
            **{name: value for name, value in wanted.items() if hasattr(DefaultOptions, name)}}


def _remember_source(function: Callable[..., Any]) -> None:
    source = Path(function.__code__.co_filename)
    if source.is_file():
        _SOURCES.add(source)


#: Parts that no kernel has been compiled with so far, and how they are to be compiled.
_PARTS: list[tuple[Callable[..., Any], dict[str, Any]]] = []
_MAKING = threading.RLock()
#: Files of kernels and parts so far. What a kernel calls was imported before it is called.
_SOURCES: set[Path] = set()


def _index_files(made: Any, function: Callable[..., Any]) -> list[Path]:
    # Those of numba's cache for a function.
    beginning = f'{Path(function.__code__.co_filename).stem}.{function.__name__}-'
    return list(Path(made.stats.cache_path).glob(f'{beginning}*.nbi'))


def forget_outdated(indices: list[Path], newest: float) -> None:
    """
    Remove machine code that is older than a source.

    The cache only looks at the file of the function itself; its machine code also holds that of
    the functions which it calls, and those may lie in other files.

    Parameters
    ----------
    indices : list of pathlib.Path
        Index files of the cache.
    newest : float
        Time of the last change of a source [s since the epoch].
    """
    for index in indices:
        try:
            if index.stat().st_mtime <= newest:
                index.unlink()
        except FileNotFoundError:
            continue  # another process was quicker
