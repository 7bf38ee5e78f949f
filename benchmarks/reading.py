# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
What reading a recording costs, beside the bare decoding of its messages by the library.

Usage: ``python benchmarks/reading.py [REC ...]``; without a recording, one of ten minutes is
simulated first.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
import sys
import tempfile
import time

from lg_husky_sim.comparison.models import load_plants
from lg_husky_sim.comparison.output import simulate_commands
from lg_husky_sim.manoeuvres import Manoeuvre, Step
from lg_husky_sim.recording import read_recording, write_recording

REPEATS = 5
NEEDED = {'geometry_msgs/msg/TwistStamped', 'sensor_msgs/msg/JointState', 'sensor_msgs/msg/Imu',
          'tf2_msgs/msg/TFMessage'}


def best_of(*runs: Callable[[], object]) -> list[float]:
    """Return the shortest time of each [s], of several turns: the one least disturbed."""
    shortest = [float('inf')] * len(runs)
    for _ in range(REPEATS):
        for place, run in enumerate(runs):
            before = time.perf_counter()
            run()
            shortest[place] = min(shortest[place], time.perf_counter() - before)
    return shortest


def decode(path: Path) -> int:
    """Decode the messages that a recording is made of, and nothing more; return their number."""
    from rosbags.highlevel import AnyReader
    count = 0
    with AnyReader([path]) as reader:
        connections = [each for each in reader.connections if each.msgtype in NEEDED]
        for connection, _, raw in reader.messages(connections=connections):
            reader.deserialize(raw, connection.msgtype)
            count += 1
    return count


def report(path: Path) -> None:
    """Measure one recording and print a line."""
    count = decode(path)
    bare, whole = best_of(lambda: decode(path), lambda: read_recording(path))
    print(f'{path.name:<24}{count:>10}{1e3 * whole:>12.1f}{1e6 * whole / count:>12.2f}'
          f'{whole / bare:>12.2f}')


def main() -> None:
    """Print one line for each recording."""
    print(f'{"recording":<24}{"messages":>10}{"read [ms]":>12}{"[µs/msg]":>12}{"of bare":>12}')
    if len(sys.argv) > 1:
        for name in sys.argv[1:]:
            report(Path(name))
        return
    steps = tuple(Step(6.0, 0.4, 0.3 * (-1) ** k) for k in range(100))
    commands = Manoeuvre('ten_minutes', steps).commands()
    (named,) = load_plants()
    with tempfile.TemporaryDirectory() as folder:
        report(write_recording(Path(folder) / 'ten_minutes',
                               simulate_commands(named.plant, commands, 3.5)))


if __name__ == '__main__':
    main()
