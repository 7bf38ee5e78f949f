# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
From the start of a process to its first odometry: sim_node beside the smallest node.

    python benchmarks/node_startup.py

Both start in turn, so that a busy machine slows both.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import statistics
import subprocess
import sys
import time

from lg_husky_sim.testing.live import Probe, probed_domain

SMALLEST = [sys.executable, str(Path(__file__).parent / 'minimal_node.py'), '50']
NODE = [sys.executable, '-m', 'lg_husky_sim.ros.sim_node']


def first_odometry(probe: Probe, received: list[object], command: list[str]) -> float:
    """Start a node, return when its first odometry comes [s], and end it."""
    begun = time.monotonic()
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    try:
        received.clear()
        if not probe.until(lambda: received, 60.0):
            raise SystemExit(f'{command} does not publish')
        return time.monotonic() - begun
    finally:
        process.terminate()
        process.wait()
        # Nothing of this one may be taken for the next one's.
        probe.spin(0.2)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--repeats', type=int, default=7)
    repeats = parser.parse_args().repeats
    with probed_domain() as probe:
        received = probe.listen('nav_msgs/msg/Odometry', '/husky_velocity_controller/odom')
        for command in (SMALLEST, NODE):    # once for the caches
            first_odometry(probe, received, command)
        pairs = [(first_odometry(probe, received, SMALLEST),
                  first_odometry(probe, received, NODE)) for _ in range(repeats)]
    smallest, node = (statistics.median(column) for column in zip(*pairs, strict=True))
    ratio = statistics.median(mine / least for least, mine in pairs)
    print(f'first odometry, median of {repeats}: smallest node {smallest:.2f} s, '
          f'sim_node {node:.2f} s, ratio {ratio:.2f}')


if __name__ == '__main__':
    main()
