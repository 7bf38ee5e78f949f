# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Freed arrays go back to the system."""

from __future__ import annotations

from pathlib import Path
import platform
import subprocess
import sys

import pytest

#: After a block of 20 MB was freed, ten of 8 MB, each with a small one behind it, are as well.
SCRIPT = """
import sys
import numpy as np
from lg_husky_sim.allocator import give_back_large_blocks

def held():
    with open('/proc/self/status') as status:
        return next(int(line.split()[1]) for line in status if line.startswith('VmRSS'))

if sys.argv[1] == 'back':
    assert give_back_large_blocks()
large = np.ones(2_500_000)
del large
before, kept, blocks = held(), [], []
for _ in range(10):
    blocks.append(np.ones(1_000_000))
    kept.append(np.ones(10_000))
most = held()
blocks.clear()
print(most - before, held() - before)
"""


@pytest.mark.skipif(platform.libc_ver()[0] != 'glibc' or not Path('/proc/self/status').exists(),
                    reason='not the GNU C library')
def test_freed_arrays_go_back_to_the_system() -> None:
    most, left = {}, {}
    for how in ('back', 'as it is'):
        done = subprocess.run([sys.executable, '-c', SCRIPT, how], text=True,
                              capture_output=True, timeout=60, check=True)
        most[how], left[how] = map(int, done.stdout.split())
    assert min(most.values()) > 70_000
    assert left['back'] < 5_000
    assert left['as it is'] > 10 * left['back']
