# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Nav2's velocity smoother and collision monitor, unmodified, between a command and the node."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

from lg_husky_sim.testing.live import LiveHusky, Probe
import pytest

PARAMETERS = Path(__file__).resolve().parents[4] / 'config' / 'nav2.yaml'
#: Where the robot begins, the inner side of the wall before it, and half its length [m].
BEGIN, WALL, HALF_LENGTH = 3.0, 6.0, 0.495
#: Commanded speed [m/s], seconds between two commands, and for how long: 1.1 s until it is there,
#: then 0.8 m at that speed, then down to a hundredth in five times `time_before_collision` [s].
SPEED, EVERY, LONG = 1.0, 0.05, 9.0
#: The smoother's step: its acceleration over its frequency [m/s].
STEP = 1.0 / 20.0
#: The monitor looks ahead in steps of 0.1 s: at 1 m/s so far from the wall it stops at most [m],
#: and as much again for the scan and the footprint, which are published a few times a second.
SHORT = 0.1 + 0.1


@pytest.mark.realtime
def test_what_is_told_to_drive_into_a_wall_is_stopped_before_it(
        start: Callable[..., LiveHusky], probe: Probe, nav2: Callable[..., Any],
        program: Callable[[str, str], Path], real_husky: Path) -> None:
    """The node itself drives through walls; the monitor knows of them by the node's scan alone."""
    for package in ('nav2_velocity_smoother', 'nav2_collision_monitor'):
        program(package, '')
    start(arguments=('--params-file', str(PARAMETERS)), preset='clearpath_jazzy',
          model=str(real_husky), initial_x=BEGIN)
    # Before there is who says it, so that nothing is missed.
    heard = probe.listen('geometry_msgs/msg/TwistStamped', '/platform/cmd_vel', 1000)
    navigator = nav2(whole=False)
    send, message = probe.talk('geometry_msgs/msg/TwistStamped', '/cmd_vel_nav')
    assert probe.until(lambda: send.get_subscription_count() == 1)
    command = message()
    command.twist.linear.x = SPEED
    begun = navigator.now()
    while navigator.now() < begun + LONG:
        send.publish(command)
        probe.spin(EVERY)
    left = WALL - HALF_LENGTH - navigator.where().x
    speeds = [each.twist.linear.x for each in heard]
    fastest = speeds.index(max(speeds))
    steepest = max(after - before for before, after in pairwise([0.0, *speeds[:fastest + 1]]))
    print(f'figure: told to drive into a wall at {SPEED:g} m/s, stopped {left:.2f} m before it; '
          f'commands up to {speeds[fastest]:.2f} m/s in steps of at most {steepest:.3f} m/s')
    assert 0.0 < left < SHORT
    assert speeds[fastest] == pytest.approx(SPEED)
    assert steepest == pytest.approx(STEP)
