# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Nav2's controller and costmap in lock step with the node: the same drive twice, bit for bit."""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import Any

from lg_husky_sim.testing.live import Probe
import pytest

#: A goal with nothing on the way, and how near the robot must come to it [m].
CLEAR, NEAR = (3.5, -2.5, -0.5), 0.25 + 0.05
#: Nav2's commands per second of the clock, slow enough for all that follows from one to come
#: before the next, and steps of 20 ms for each.
SLOW, EVERY = 2.0, 10


@pytest.mark.realtime
def test_a_path_is_followed_twice_alike_in_lock_step(
        probe: Probe, nav2: Callable[..., Any], lock_step: Callable[..., Any]) -> None:
    """
    Controller, costmap and node, bit for bit: each command of Nav2 is followed by 0.2 s.

    The plan is made once. What plans again (the behaviour tree) and what costmaps hold depends on
    the system's clock in Nav2 itself, so the way is clear of obstacles.
    """
    held = lock_step(EVERY, math.inf)
    navigator = nav2(frequency=SLOW, whole=False, lock_step=held)
    path = navigator.plan(CLEAR)
    assert path is not None
    # Of no time, since time begins anew before it is followed.
    for one in (path, *path.poses):
        one.header.stamp.sec = one.header.stamp.nanosec = 0
    held.node.pause(True)
    drives = []
    for _ in range(2):
        # Of time as well: what is left of a period depends on it in the last bit.
        held.node.reset(time=True)
        held.node.advance(EVERY)
        probe.spin(1.0)
        held.heard.clear()
        held.due = False
        assert navigator.follow(path)
        # The zero that comes last, at about the same time.
        probe.spin(1.0)
        drives.append(list(held.heard))
    first, second = drives
    print(f'figure: {len(first)} commands in lock step, twice alike: {first == second}')
    assert len(first) > 30
    assert math.dist((first[-1][1].x, first[-1][1].y), CLEAR[:2]) < NEAR
    assert first == second
