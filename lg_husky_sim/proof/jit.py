# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Compile a function with numba where numba is installed; run it as it is where not."""

from __future__ import annotations

from collections.abc import Callable
import importlib.util
from typing import Any, cast, TypeVar

Function = TypeVar('Function', bound=Callable[..., Any])

COMPILED = importlib.util.find_spec('numba') is not None


def compiled(function: Function) -> Function:
    """Return `function` compiled, or `function` itself (same numbers, far slower)."""
    if not COMPILED:
        return function
    import numba
    return cast(Function, numba.njit(cache=True, error_model='numpy')(function))
