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
import sys
import numpy as np
from lg_husky_sim.allocator import give_back_large_blocks

class Information(ctypes.Structure):
    _fields_ = [(name, ctypes.c_size_t) for name in (
        'arena', 'ordblks', 'smblks', 'hblks', 'hblkhd', 'usmblks', 'fsmblks', 'uordblks',
        'fordblks', 'keepcost')]

ask = ctypes.CDLL(None).mallinfo2
ask.restype = Information
if sys.argv[1] == 'back':
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
@pytest.mark.parametrize(('how', 'own'), [('back', True), ('as it is', False)])
def test_large_arrays_are_blocks_of_their_own(how: str, own: bool) -> None:
    done = subprocess.run([sys.executable, '-c', SCRIPT, how], text=True, capture_output=True,
                          timeout=60, check=True)
    assert (int(done.stdout) >= 8_000_000) is own
