# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Put the machine code of every kernel on disk, so that no test has to wait for the compiler.

    python scripts/compile_all.py
"""

from __future__ import annotations

from lg_husky_sim import Husky
from lg_husky_sim.jit import compiled
from lg_husky_sim.simulation.compiling import compile_here


def main() -> None:
    """Simulate, diagnose, and compare with a baseline, once each and briefly."""
    if not compiled():
        return
    compile_here()
    husky = Husky()
    drives = [husky.simulate(name) for name in ('s_bend', 'circle')]
    husky.diagnose(drives[:1], progress=False)
    husky.diagnose(drives[:1], baseline=drives[1:], progress=False)


if __name__ == '__main__':
    main()
