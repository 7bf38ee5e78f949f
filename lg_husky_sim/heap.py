# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Keep memory that is freed for a while, where arrays of megabytes come and go all the time.

Arrays that go back to the system one by one get fresh pages the next time, which it fills with
zeros: two million of them in a diagnosis of three drives, with arrays from 1 MB on.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import ctypes
import platform

#: Parameters of `mallopt` in glibc's malloc.h.
TRIM_THRESHOLD, TOP_PAD, MMAP_THRESHOLD, ARENA_MAX = -1, -2, -3, -8
#: Arrays from this size on still go back [bytes]: derivatives of long recordings, of which few are
#: made, and which leave holes that are of no use.
LARGE = 4 * 2**20
#: What glibc comes to by itself where arrays of that size come and go [bytes].
USUAL_TRIM, USUAL_PAD = 2 * LARGE, 128 * 2**10


@contextmanager
def kept_memory() -> Iterator[None]:
    """Keep memory that is freed until the end, and give it back then; with glibc only."""
    library = ctypes.CDLL(None) if platform.libc_ver()[0] == 'glibc' else None
    if library is None:
        yield
        return
    # Threads share one heap: each would keep what is freed in its own.
    for name, value in ((MMAP_THRESHOLD, LARGE), (TRIM_THRESHOLD, 2**31 - 1),
                        (TOP_PAD, LARGE), (ARENA_MAX, 1)):
        library.mallopt(name, value)
    try:
        yield
    finally:
        library.mallopt(TRIM_THRESHOLD, USUAL_TRIM)
        library.mallopt(TOP_PAD, USUAL_PAD)
        library.mallopt(ARENA_MAX, 0)
        library.malloc_trim(0)
