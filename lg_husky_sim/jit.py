# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Compile a function with numba where it is installed, and leave it plain Python elsewhere."""

from __future__ import annotations

from collections.abc import Callable
import importlib.util
import os
from pathlib import Path
from typing import Any, TypeVar

Function = TypeVar('Function', bound=Callable[..., Any])

#: Environment variable: any value but '' and '0' keeps the kernel in plain Python.
SWITCH = 'LG_HUSKY_NO_NUMBA'


def compiled() -> bool:
    """Return whether the kernel is machine code here (numba present and not switched off)."""
    if os.environ.get(SWITCH, '0') not in ('', '0'):
        return False
    return importlib.util.find_spec('numba') is not None


def jit(function: Function) -> Function:
    """
    Compile ``function`` on first call, caching the machine code on disk.

    Without fast-math: every operation is IEEE, in the order in which it is written, so that the
    compiled and the plain function give the same numbers.
    """
    return _compiled(function, {})


def jit_part(function: Function) -> Function:
    """
    Compile a function that compiled ones call in their inner loop, as :func:`jit` does.

    It must not allocate, slice or return an array: its code goes into its callers', and its
    arrays are not counted, which takes an atomic increment and decrement for each one and call.
    """
    return _compiled(function, {'_nrt': False, 'forceinline': True})


def jit_call(function: Function) -> Function:
    """
    Compile a function that compiled ones call from several places, as :func:`jit_part` does.

    Its code stays by itself, which compiles faster and runs nearly as fast.
    """
    return _compiled(function, {'_nrt': False})


def _compiled(function: Function, options: dict[str, bool]) -> Function:
    if not compiled():
        return function
    import numba
    from numba.core.options import DefaultOptions

    # '_nrt' is no public option: a numba that no longer has it only makes slower code.
    known = {name: value for name, value in options.items() if hasattr(DefaultOptions, name)}
    wrapped = numba.njit(cache=True, nogil=True, error_model='numpy', **known)(function)
    source = Path(function.__code__.co_filename)
    if source.is_file():
        _SOURCES.add(source)
        forget_outdated(Path(wrapped.stats.cache_path), f'{source.stem}.{function.__name__}-',
                        max(path.stat().st_mtime for path in _SOURCES))
    compiled_function: Function = wrapped
    return compiled_function


#: Files of the compiled functions so far. What a function calls was compiled before it.
_SOURCES: set[Path] = set()


def forget_outdated(folder: Path, beginning: str, newest: float) -> None:
    """
    Remove machine code that is older than a source.

    The cache only looks at the file of the function itself; its machine code also holds that of
    the functions which it calls, and those may lie in other files.

    Parameters
    ----------
    folder : Path
        Of the cache.
    beginning : str
        Of the names of its index files.
    newest : float
        Time of the last change of a source [s since the epoch].
    """
    for index in folder.glob(f'{beginning}*.nbi'):
        try:
            if index.stat().st_mtime <= newest:
                index.unlink()
        except FileNotFoundError:
            continue  # another process was quicker
