# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
A simulated day of the node's engine, with every message filled, as fast as possible.

Usage: ``python benchmarks/soak.py [--hours 24] [--rate 200] [--preset clearpath_jazzy]``. The
robot drives the same minute again and again, in simulated time that is never reset. Printed:
memory at the start and the end, whether stamps are exactly a period apart, and by how much any
minute differs from the second one, seen from where each began. Exit code 1 if anything is not
finite, a stamp is wrong, a minute differs by more than a micrometre, or memory grows by more than
10 MB.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
import sys
import time

from lg_husky_sim.ros import conversions
from lg_husky_sim.ros.engine import Reading
from lg_husky_sim.signals import BodyTwist, Pose
from lg_husky_sim.testing.lockstep import LockStepHusky

#: Most by which a minute may differ from another [m, rad], and memory may grow [MB].
DIFFERENCE, GROWTH = 1e-6, 10.0
#: Time at the end of each minute for which nothing is commanded [s].
REST = 10.0


def command(second: float) -> BodyTwist:
    """Return what is commanded at a second of a minute."""
    if second >= 60.0 - REST:
        return BodyTwist()
    return BodyTwist(0.5 + 0.3 * math.sin(0.4 * second), 0.8 * math.sin(0.7 * second))


def resident() -> float:
    """Return this process's memory [MB]."""
    text = Path('/proc/self/status').read_text(encoding='utf-8')
    return int(next(r for r in text.splitlines() if r.startswith('VmRSS')).split()[1]) / 1024.0


def seen_from(start: Pose, end: Pose) -> tuple[float, float, float]:
    """Return a pose in the frame of another one [m, m, rad]."""
    x, y = end.x - start.x, end.y - start.y
    cos, sin = math.cos(start.heading), math.sin(start.heading)
    return cos * x + sin * y, cos * y - sin * x, end.heading - start.heading


def main() -> int:
    """Drive, and print what came of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--hours', type=float, default=24.0)
    parser.add_argument('--rate', type=float, default=200.0)
    parser.add_argument('--preset', default='clearpath_jazzy')
    words = parser.parse_args()
    husky = LockStepHusky(preset=words.preset, rate=words.rate, publish_clock=True,
                          scan='none', sensor_noise=False)
    one = husky.settings
    messages = (
        (conversions.odometry_message(one, truth=True),
         lambda m, s, r: conversions.fill_odometry(m, s, r.pose, r.twist)),
        (conversions.odometry_message(one, truth=False),
         lambda m, s, r: conversions.fill_odometry(m, s, r.wheel_pose, r.wheel_twist)),
        (conversions.joint_state_message(one), conversions.fill_joint_state),
        (conversions.imu_message(one), conversions.fill_imu),
        (conversions.battery_message(one), conversions.fill_battery))
    period_ns = 1e9 / words.rate
    each_minute = round(60.0 * words.rate)
    commands = [command(k / words.rate) for k in range(each_minute)]
    minutes = round(60.0 * words.hours)
    wrong = 0
    ways: list[tuple[float, float, float]] = []
    memory: list[float] = []
    begun, busy = time.monotonic(), time.process_time()
    reading: Reading = husky.reading
    for minute in range(minutes):
        start = reading.pose
        for k in range(each_minute):
            reading = husky.step(commands[k])
            stamp = round(reading.time * 1e9)
            for message, fill in messages:
                fill(message, stamp, reading)
            wrong += stamp != round((minute * each_minute + k + 1) * period_ns)
        ways.append(seen_from(start, reading.pose))
        wrong += not all(map(math.isfinite, (*ways[-1], *reading.measured.accel,
                                             *reading.torques, reading.voltage)))
        if minute % 60 == 59 or minute in (1, minutes - 1):
            memory.append(resident())
            print(f'{minute + 1} min simulated', file=sys.stderr, flush=True)
    # The first minute begins without the commands of one before.
    worst = max(max(abs(a - b) for a, b in zip(way, ways[1], strict=True)) for way in ways[1:])
    growth = memory[-1] - memory[0]
    waited, worked = (time.monotonic() - begun) / 60.0, (time.process_time() - busy) / 60.0
    print(f'{minutes * each_minute:,} steps at {words.rate:g} Hz: {minutes / 60.0:g} h in '
          f'{waited:.1f} min ({worked:.1f} min of processor)')
    print(f'wrong stamps or numbers: {wrong}; at the end {reading.time:.9f} s simulated')
    print(f'minutes differ by at most {worst:.1e} m or rad; turned by '
          f'{reading.pose.heading:.1f} rad, wheels by {reading.measured.wheel_angles[0]:,.0f} rad')
    print(f'memory {memory[0]:.1f} MB after two minutes, {memory[-1]:.1f} MB at the end')
    return int(wrong > 0 or not worst < DIFFERENCE or growth > GROWTH)


if __name__ == '__main__':
    sys.exit(main())
