# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Rate, lateness and memory of the live node, and how fast it runs when nobody waits.

    python benchmarks/node_timing.py                         60 s at 50 and at 200 Hz, then free
    python benchmarks/node_timing.py --rates 200 --seconds 1800    the soak
"""

from __future__ import annotations

import argparse
import itertools
from pathlib import Path
import time
from typing import Any

from lg_husky_sim.ros import api
from lg_husky_sim.testing.live import LiveHusky, Probe, probed_domain
import numpy as np


def stamp(message: Any) -> int:
    """Return the header's stamp [ns]."""
    return int(message.header.stamp.sec) * 10**9 + int(message.header.stamp.nanosec)


def resident(pid: int) -> float:
    """Return the memory of a process [MiB]."""
    text = Path(f'/proc/{pid}/status').read_text(encoding='utf-8')
    line = next(row for row in text.splitlines() if row.startswith('VmRSS'))
    return int(line.split()[1]) / 1024.0


def steady(probe: Probe, rate: float, seconds: float) -> None:
    """Measure one rate and print."""
    topic = f'/timing_{rate:g}'
    rows: list[tuple[int, int]] = []
    kind = api.message_type('nav_msgs/msg/Odometry')
    probe.node.create_subscription(
        kind, topic, lambda m: rows.append((stamp(m), time.time_ns())), 5000)
    husky = LiveHusky(probe, {'rate': rate, 'ground_truth_topic': topic})
    husky.ready(rows)
    probe.spin(2.0)
    memory = [resident(husky.node.process.pid)]
    rows.clear()
    while not rows or rows[-1][0] - rows[0][0] < seconds * 1e9:
        probe.spin(min(10.0, seconds / 4.0))
        memory.append(resident(husky.node.process.pid))
    stamps, arrivals = np.array(rows, dtype=np.int64).T
    period = 1e9 / rate
    steps = np.round((stamps - stamps[0]) / period)
    passed = arrivals[-1] - arrivals[0]
    achieved = (len(rows) - 1) / passed * 1e9
    late = (arrivals - stamps) / 1e6
    late -= np.min(late)
    gaps = {int(b - a) for a, b in itertools.pairwise(steps.tolist())}
    drift = (stamps[-1] - stamps[0]) / 1e9 - (len(rows) - 1) / rate
    print(f'{rate:g} Hz for {passed / 1e9:.1f} s: {len(rows)} steps, rate error '
          f'{(achieved / rate - 1.0) * 100.0:+.4f} %')
    print(f'  step numbers of following messages differ by {sorted(gaps)}; '
          f'N·dt against the stamps {drift:+.9f} s')
    print(f'  lateness on arrival: median {np.median(late):.3f} ms, p99 '
          f'{np.quantile(late, 0.99):.3f} ms, largest {late.max():.3f} ms')
    print(f'  memory {memory[0]:.1f} MiB at the start, {memory[-1]:.1f} MiB at the end, '
          f'largest {max(memory):.1f} MiB')
    print(f'  exit code {husky.node.stop()}')


def free(probe: Probe) -> None:
    """Run a minute of simulated time as fast as possible and print."""
    stamps: list[int] = []
    probe.node.create_subscription(
        api.message_type('nav_msgs/msg/Odometry'), '/free', lambda m: stamps.append(stamp(m)),
        10_000)
    husky = LiveHusky(probe, {
        'speed': 0.0, 'publish_clock': True, 'ground_truth_topic': '/free'})
    husky.ready(stamps)
    probe.until(lambda: stamps[-1] > 2e9, 30.0)
    begun, first = time.perf_counter(), stamps[-1]
    stamps.clear()
    probe.until(lambda: stamps and stamps[-1] - first > 60e9, 120.0)
    took = time.perf_counter() - begun
    simulated = (stamps[-1] - first) / 1e9
    print(f'as fast as possible, all topics: {simulated:.1f} simulated seconds in {took:.2f} s, '
          f'{simulated / took:.0f} times real time; {len(stamps)} of {simulated * 50.0:.0f} '
          'steps received')
    print(f'  exit code {husky.node.stop()}')


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--rates', type=float, nargs='*', default=[50.0, 200.0])
    parser.add_argument('--seconds', type=float, default=60.0)
    parser.add_argument('--no-free', action='store_true')
    given = parser.parse_args()
    with probed_domain() as probe:
        print(api.describe_backend())
        for rate in given.rates:
            steady(probe, rate, given.seconds)
        if not given.no_free:
            free(probe)


if __name__ == '__main__':
    main()
