# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Compile a function with numba where it is installed, and leave it plain Python elsewhere."""

from __future__ import annotations

from collections.abc import Callable
import functools
import importlib.util
import os
from pathlib import Path
import signal
import subprocess
import sys
import threading
import time
from typing import Any, cast, TypeVar

Function = TypeVar('Function', bound=Callable[..., Any])

#: Environment variable: any value but '' and '0' keeps the kernel in plain Python.
SWITCH = 'LG_HUSKY_NO_NUMBA'
#: What calls may take in plain Python before they wait for machine code after all [s]: about what
#: the compiler takes, so that no program takes twice as long as one that had waited at once.
PATIENCE = 20.0
#: How a process ends that was told to stop, as all of a terminal are by Ctrl-C.
_STOPPED = (-signal.SIGINT, -signal.SIGTERM)


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
    compiler : str
        Name of a module that puts the machine code on disk when it is run. Where there is none
        yet, calls do not wait for it: they run in plain Python meanwhile, unless that takes so
        long that they had better waited.

    """

    def __init__(self, function: Callable[..., Any], compiler: str = '') -> None:
        functools.update_wrapper(self, function)
        #: The function in plain Python, with the parts that it calls.
        self.plain = function
        self._compiler = compiler
        self._machine: Any = None
        self._postponed = bool(compiler)
        self._ready: threading.Event | None = None
        self._seen: tuple[Any, ...] = ()
        #: What calls may still take in plain Python [s].
        self.patience = PATIENCE

    def __call__(self, *arguments: Any) -> Any:
        """Call the machine code, or plain Python while that is compiled elsewhere."""
        if self._postponed:
            ready = self.soon()
            if self.patience <= 0.0:
                ready.wait()
                if self._postponed:
                    raise KeyboardInterrupt
        if self._postponed:
            if not self._seen:
                import numba
                # Now: an array may be read-only later, which is another type.
                self._seen = tuple(map(numba.typeof, arguments))
            began = time.thread_time()
            try:
                return self.plain(*arguments)
            finally:
                self.patience -= time.thread_time() - began
        machine = self._machine or self._made()
        return machine(*arguments)

    def at_once(self) -> None:
        """Let the first call wait until the machine code is there."""
        self._postponed, self._compiler = False, ''

    def on_disk(self) -> bool:
        """Return whether there is machine code on disk, as far as can be told without a call."""
        return any(_index_files(self._made(), self.plain))

    def soon(self) -> threading.Event:
        """
        Let a process of its own put the machine code on disk, unless it is there.

        Where that process could not, a thread of this one compiles.

        Returns
        -------
        threading.Event
            Set from when on calls run in machine code.

        """
        with _MAKING:
            if self._ready is None:
                self._ready = threading.Event()
                if self._compiler and not self.on_disk():
                    threading.Thread(target=self._load, args=(self._ready,), daemon=True,
                                     name='machine code').start()
                else:
                    self._postponed = False
                    self._ready.set()
            return self._ready

    def _load(self, ready: threading.Event) -> None:
        stopped = False
        try:
            stopped = compile_elsewhere(self._compiler) in _STOPPED
            if self._seen and not stopped:
                self._made().compile(self._seen)
        finally:
            if stopped:
                # Who waits is stopped, too; a later call begins anew.
                self._ready, self.patience = None, max(self.patience, PATIENCE)
            else:
                self._postponed = False
            self._seen = ()
            ready.set()

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
                    newest = max(path.stat().st_mtime for path in
                                 _SOURCES | {Path(numba.__file__)})
                    forget_outdated(_index_files(made, self.plain), newest)
                self._machine = made
        return self._machine


def compile_elsewhere(module: str) -> int:
    """Run a module that compiles, return how it ended; at the latest with its standard input."""
    with subprocess.Popen([sys.executable, '-m', module],  # noqa: S603 (our own)
                          stdin=subprocess.PIPE,
                          stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        return process.wait()


def jit(function: Function) -> Function:
    """Return a function as a :class:`Kernel` where numba is used, and else as it is."""
    return jit_by('')(function)


def jit_by(compiler: str) -> Callable[[Function], Function]:
    """Return a decorator like :func:`jit` for a kernel that the named module compiles."""
    def decorate(function: Function) -> Function:
        if not compiled():
            return function
        _remember_source(function)
        return cast(Function, Kernel(function, compiler))
    return decorate


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
    # Those of numba's cache for a function; another Python over the same files has its own.
    beginning = f'{Path(function.__code__.co_filename).stem}.{function.__name__}-'
    python = f'py{sys.version_info.major}{sys.version_info.minor}{getattr(sys, "abiflags", "")}'
    return list(Path(made.stats.cache_path).glob(f'{beginning}*.{python}.nbi'))


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
