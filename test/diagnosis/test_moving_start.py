# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a drive begins that begins in motion, as one does after a gap in a stream."""

from __future__ import annotations

from dataclasses import dataclass

from lg_husky_sim.diagnosis.evidence.drives import Drive, drives_of
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np
import pytest

#: Of wheels without slip: radius and track [m].
RADIUS, TRACK = 0.165, 0.57


@dataclass(frozen=True)
class Arc:
    """A robot on an arc: speed [m/s], yaw rate [rad/s]."""

    speed: float
    turn: float

    def pose(self, times: FloatArray) -> FloatArray:
        """Return x, y and heading, shape (n, 3)."""
        heading = 0.4 + self.turn * times
        half = 0.5 * self.turn * times
        chord = self.speed * times * np.sinc(half / np.pi)
        return np.column_stack([2.0 + chord * np.cos(0.4 + half),
                                -1.0 + chord * np.sin(0.4 + half), heading])

    def angles(self, times: FloatArray) -> FloatArray:
        """Return the angles of the left and the right wheels, shape (n, 2)."""
        apart = 0.5 * TRACK * self.turn
        return np.outer(times, [self.speed - apart, self.speed + apart]) / RADIUS + 3.0


def driven(arc: Arc, pose_rate: float, wheel_rate: float, noise: float = 0.0) -> Drive:
    """Return ten seconds of an arc, with wheels known by their angles alone."""
    rng = np.random.default_rng(3)

    def stamps(rate: float, first: float) -> FloatArray:
        return np.arange(first, 10.0, 1.0 / rate)
    commands, wheels = stamps(20.0, 0.0), stamps(wheel_rate, 0.013)
    imu, pose = stamps(100.0, 0.004), stamps(pose_rate, 0.5 / pose_rate)
    seen = arc.pose(pose)
    streams = {
        'command': TimeSeries(commands, np.tile([arc.speed, arc.turn], (commands.size, 1)),
                              ('forward', 'yaw')),
        'wheel_angles': TimeSeries(wheels, arc.angles(wheels), ('left', 'right')),
        'imu': TimeSeries(imu, np.tile([arc.turn, 0.0, 0.0], (imu.size, 1)),
                          ('yaw_rate', 'accel_x', 'accel_y')),
        'pose': TimeSeries(pose, seen + noise * rng.standard_normal(seen.shape),
                           ('x', 'y', 'heading'))}
    middles = 0.5 * (wheels[1:] + wheels[:-1])
    streams['wheels'] = TimeSeries(
        middles, np.diff(arc.angles(wheels), axis=0) / np.diff(wheels)[:, None],
        ('left', 'right'))
    return drives_of([Recording('arc', 'arc', streams, 0, frames=('odom', 'base_link'))])[0]


@pytest.mark.parametrize('arc', [Arc(0.8, 0.0), Arc(0.7, 0.6), Arc(-0.5, 0.3)])
@pytest.mark.parametrize(('pose_rate', 'wheel_rate'), [(5.0, 50.0), (25.0, 20.0), (50.0, 50.0)])
def test_a_drive_begins_where_the_robot_is_and_not_where_it_is_first_seen(
        arc: Arc, pose_rate: float, wheel_rate: float) -> None:
    """The first of five poses a second comes when the robot has gone on."""
    own = driven(arc, pose_rate, wheel_rate)
    expected = arc.pose(np.array([own.start]))[0]
    assert not own.still
    assert own.twist.forward == pytest.approx(arc.speed, abs=0.02)
    assert (own.pose.x, own.pose.y) == pytest.approx(expected[:2], abs=0.01)
    assert own.pose.heading == pytest.approx(expected[2], abs=0.02)
    assert own.wheel_angles == pytest.approx(arc.angles(np.array([own.start]))[0], abs=1e-6)


def test_noise_of_the_first_poses_is_no_speed() -> None:
    """A robot at rest begins where the middle of its first poses is."""
    own = driven(Arc(0.0, 0.0), 50.0, 50.0, noise=0.003)
    assert own.still
    assert (own.pose.x, own.pose.y) == pytest.approx((2.0, -1.0), abs=0.005)
    assert own.wheel_angles == (3.0, 3.0)
