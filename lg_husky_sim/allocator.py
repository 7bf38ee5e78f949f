# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Arrays that go back to the system when they are freed.

The GNU C library takes large blocks from the system one by one, but only until the first of them
is freed: from then on blocks of its size come from the heap, where one small block behind them
keeps them. A diagnosis makes and frees arrays of a megabyte by the thousand. A threshold that is
set stays.
"""

from __future__ import annotations

import ctypes
import sys

#: ``M_MMAP_THRESHOLD`` and ``M_ARENA_MAX`` of ``malloc.h``.
_MMAP_THRESHOLD, _ARENA_MAX = -3, -8
#: From which size on a block is one of its own [byte].
LARGE = 1 << 20


def give_back_large_blocks() -> bool:
    """Set the threshold, and one heap for all threads; return whether the library has them."""
    if sys.platform != 'linux':
        return False
    choose = getattr(ctypes.CDLL(None), 'mallopt', None)
    return choose is not None and bool(choose(_MMAP_THRESHOLD, LARGE) and choose(_ARENA_MAX, 1))
