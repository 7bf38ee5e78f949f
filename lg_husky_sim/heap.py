# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Keep memory that is freed for a while, where arrays of megabytes come and go all the time.

By default, the C library gives each of them back to the system and gets fresh pages for the next,
which the system fills with zeros: a sixth of a diagnosis.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
import ctypes
import platform

#: Parameters of `mallopt` in glibc's malloc.h.
TRIM_THRESHOLD, TOP_PAD, MMAP_THRESHOLD, ARENA_MAX = -1, -2, -3, -8
#: The largest array that glibc may keep [bytes].
LARGEST = 32 * 2**20
#: What glibc chooses by itself once arrays of that size come and go [bytes].
USUAL_TRIM, USUAL_PAD = 2 * LARGEST, 128 * 2**10


@contextmanager
def kept_memory() -> Iterator[None]:
    """Keep memory that is freed until the end, and give it back then; with glibc only."""
    library = ctypes.CDLL(None) if platform.libc_ver()[0] == 'glibc' else None
    if library is None:
        yield
        return
    # Threads share one heap: each would keep what is freed in its own.
    for name, value in ((MMAP_THRESHOLD, LARGEST), (TRIM_THRESHOLD, 2**31 - 1),
                        (TOP_PAD, LARGEST), (ARENA_MAX, 1)):
        library.mallopt(name, value)
    try:
        yield
    finally:
        library.mallopt(TRIM_THRESHOLD, USUAL_TRIM)
        library.mallopt(TOP_PAD, USUAL_PAD)
        library.mallopt(ARENA_MAX, 0)
        library.malloc_trim(0)
