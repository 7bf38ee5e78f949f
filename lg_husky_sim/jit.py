# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Compile a function with numba where it is installed, and leave it plain Python elsewhere."""

from __future__ import annotations

from collections.abc import Callable
import importlib.util
import os
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
    if not compiled():
        return function
    import numba
    wrapped: Function = numba.njit(cache=True, nogil=True, error_model='numpy')(function)
    return wrapped
