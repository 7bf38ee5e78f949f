# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Steps are neither lost nor invented, whatever the clock does."""

from __future__ import annotations

from lg_husky_sim.ros.pacing import Pace, Stamps
from lg_husky_sim.ros.wheel_odometry import WheelOdometry
from lg_husky_sim.signals import BodyTwist, Pose
import numpy as np
import pytest

SECOND = 10**9


def test_jittered_calls_do_as_many_steps_as_periods_have_passed() -> None:
    """T18: N steps are N·dt after an hour of jitter at 50 and 200 Hz, at odd speeds too."""
    random = np.random.default_rng(7)
    for rate, speed in ((50.0, 1.0), (200.0, 1.0), (50.0, 0.37), (30.0, 7.3)):
        pace = Pace(5 * SECOND, 0, rate, speed)
        now, done = 5 * SECOND, 0
        while now < 3605 * SECOND:
            now += int(random.exponential(0.05) * SECOND)
            done += pace.due(now, done)
        passed = (now - 5 * SECOND) / SECOND
        assert done == int(passed * rate * speed + 1e-6)


def test_a_clock_that_runs_back_gives_no_steps() -> None:
    """The state is kept until the time is made up."""
    pace = Pace(10 * SECOND, 100, 50.0, 1.0)
    assert pace.due(9 * SECOND, 100) == 0
    assert pace.due(11 * SECOND, 100) == 50
    assert pace.due(11 * SECOND, 160) == 0


def test_a_step_is_due_at_its_moment_and_not_before() -> None:
    """The moment of a step and the count of due steps agree."""
    pace = Pace(0, 0, 50.0, 1.0)
    for step in (1, 2, 1000, 123_456):
        moment = pace.moment(step)
        assert pace.due(moment, step - 1) == 1
        assert pace.due(moment - 100_000, step - 1) == 0


def test_a_change_of_speed_begins_where_the_old_pace_stands() -> None:
    """No step is repeated or skipped when the speed changes."""
    pace = Pace(0, 0, 50.0, 1.0)
    changed = pace.changed(2 * SECOND, 100, 10.0)
    assert changed.due(2 * SECOND, 100) == 0
    assert changed.due(3 * SECOND, 100) == 500


def test_stamps_are_evenly_spaced() -> None:
    """Rounding does not add up over a day at 30 Hz."""
    stamps = Stamps(0, 0, SECOND / 30.0)
    day = 30 * 86_400
    assert stamps.of(day) == 86_400 * SECOND
    assert stamps.of(day + 1) - stamps.of(day) in (33_333_333, 33_333_334)


def test_wheel_odometry_closes_a_circle() -> None:
    """A full turn of constant wheel rates ends where it began, whatever the period."""
    for count in (7, 1000):
        odometry = WheelOdometry(0.1651, 1.07, 2, Pose(1.0, 2.0, 0.3))
        turn = 2.0 * np.pi / count * 1.07 / 0.1651
        for _ in range(count):
            odometry.update(1.0, 1.0 + turn, 0.02)
        assert (odometry.pose.x, odometry.pose.y) == pytest.approx((1.0, 2.0), abs=1e-9)
        assert odometry.pose.heading == pytest.approx(0.3 + 2.0 * np.pi)


def test_the_twist_is_averaged_over_the_window() -> None:
    """The controller's rolling window: two velocities on the Husky."""
    odometry = WheelOdometry(0.5, 1.0, 2, Pose())
    assert odometry.twist == BodyTwist()
    for angle in (0.1, 0.2, 0.4):
        odometry.update(angle, angle, 0.1)
    assert odometry.twist.forward == pytest.approx(0.5 * 0.3 / 0.1)
