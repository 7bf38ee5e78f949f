# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Large arrays are blocks of their own, which go back to the system when they are freed."""

from __future__ import annotations

import ctypes
import platform
import subprocess
import sys

import pytest

#: What the C library takes from the system for an array, once a larger one was freed.
SCRIPT = """
import ctypes
import numpy as np
from lg_husky_sim.allocator import give_back_large_blocks

class Information(ctypes.Structure):
    _fields_ = [(name, ctypes.c_size_t) for name in (
        'arena', 'ordblks', 'smblks', 'hblks', 'hblkhd', 'usmblks', 'fsmblks', 'uordblks',
        'fordblks', 'keepcost')]

ask = ctypes.CDLL(None).mallinfo2
ask.restype = Information
assert give_back_large_blocks()
large = np.ones(2_500_000)
del large
before = ask().hblkhd
array = np.ones(1_000_000)
print(ask().hblkhd - before)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != 'glibc'
                    or not hasattr(ctypes.CDLL(None), 'mallinfo2'),
                    reason='no GNU C library that tells of its blocks')
def test_a_large_array_is_a_block_of_its_own_after_a_larger_one_was_freed() -> None:
    done = subprocess.run([sys.executable, '-c', SCRIPT], text=True, capture_output=True,
                          timeout=60, check=True)
    assert int(done.stdout) >= 8_000_000
