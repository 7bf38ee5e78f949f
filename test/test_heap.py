# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Memory that is freed is kept where it is soon needed again."""

from __future__ import annotations

import ctypes
from pathlib import Path
import platform
import resource

from lg_husky_sim.heap import kept_memory
from lg_husky_sim.threads import threads
import numpy as np
import pytest

#: Numbers of an array; NumPy asks for huge pages for larger ones.
SIZE = 2**18


def faults(times: int) -> int:
    """Return how many fresh pages arrays took that came and went so many times."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(times):
        np.ones(SIZE)
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before


def resident() -> int:
    """Return the memory of this process [bytes]."""
    return int(Path('/proc/self/statm').read_text().split()[1]) * resource.getpagesize()


@pytest.mark.skipif(platform.libc_ver()[0] != 'glibc', reason='another C library')
def test_arrays_that_come_and_go_take_no_fresh_pages() -> None:
    pages = 8 * SIZE // resource.getpagesize()
    with kept_memory():
        faults(1)
        assert faults(100) < pages
    with threads(1) as pool:
        list(pool.map(faults, [1]))
        assert next(iter(pool.map(faults, [100]))) < pages


@pytest.mark.skipif(platform.libc_ver()[0] != 'glibc', reason='another C library')
def test_what_was_kept_is_given_back_at_the_end() -> None:
    before = resident()
    with kept_memory():
        several = [np.ones(SIZE) for _ in range(32)]
        del several
        kept = resident() - before
    assert kept > 24 * 8 * SIZE
    assert resident() - before < 8 * 8 * SIZE


def test_another_c_library_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(platform, 'libc_ver', lambda: ('', ''))
    monkeypatch.setattr(ctypes, 'CDLL', None)
    with kept_memory():
        assert np.ones(3).sum() == 3.0
