# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A segment's commands through a model, from the state that the robot was in."""

from __future__ import annotations

from dataclasses import dataclass

from lg_husky_sim.comparison.slopes import local_fit
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.recording import Segment
from lg_husky_sim.signals import BodyTwist, Pose, TimeSeries
from lg_husky_sim.simulation import rollout, Simulator
import numpy as np

PERIOD = 0.01
"""Step of a replay [s]."""
WINDOW = 0.4
"""Length of the samples that the initial state is estimated from [s]."""

STILL = 0.02
"""Wheel rates [rad/s] and commands [m/s, rad/s] below this are rest."""


@dataclass(frozen=True)
class InitialState:
    """
    State of the robot at the start of a segment, as far as it was measured.

    Parameters
    ----------
    pose : Pose
        At the origin, heading along x, where no pose was recorded.
    twist : BodyTwist
    wheel_rates : tuple of float or None
        Left and right [rad/s]; None where no wheel speeds were recorded.
    wheel_angles : tuple of float
        Left and right [rad]; zeros where not recorded.
    """

    pose: Pose
    twist: BodyTwist
    wheel_rates: tuple[float, float] | None
    wheel_angles: tuple[float, float] = (0.0, 0.0)


def initial_state(segment: Segment, plant: Plant, window: float = WINDOW) -> InitialState:
    """
    Estimate the state at the start of a segment from its first samples.

    Where the robot stands still at first, the pose is the median over that time. Otherwise it is
    the value at the start of a straight line through the first samples, which takes most of the
    sensor's noise out. The speed is that of the wheels as if they did not slip, or the slope of
    the pose without them; the yaw rate is the gyro's, or else the slope of the heading, or else
    the wheels'.

    Parameters
    ----------
    segment : Segment
    plant : Plant
        For the ratio of wheel speed to speed.
    window : float
        Length of the samples used [s]; at least two samples are.

    Returns
    -------
    InitialState
    """
    streams, start = segment.streams, segment.start
    forward = yaw = 0.0
    pose = Pose()
    rates: tuple[float, float] | None = None
    angles = (0.0, 0.0)
    rest = _rest(segment)
    if 'pose' in streams:
        value, slope = local_fit(streams['pose'], start, window, ahead=True)
        if rest >= window:
            value = np.median(streams['pose'].slice(start, start + rest).values, axis=0)
            slope = np.zeros(3)
        pose = Pose(*(float(part) for part in value))
        forward = float(np.cos(pose.heading) * slope[0] + np.sin(pose.heading) * slope[1])
        yaw = float(slope[2])
    if 'wheels' in streams:
        left, right = _mean(streams['wheels'], start, 0.5 * window)
        rates = (left, right)
        forward, turning = _rolling(plant, left, right)
        yaw = yaw if 'pose' in streams else turning
    if 'imu' in streams:
        yaw = _mean(streams['imu'], start, 0.5 * window)[0]
    if 'wheel_angles' in streams:
        value, _ = local_fit(streams['wheel_angles'], start, window, ahead=True)
        angles = (float(value[0]), float(value[1]))
    if rest >= window:
        forward = yaw = 0.0
    return InitialState(pose, BodyTwist(forward, yaw), rates, angles)


def replay(
    plant: Plant, segment: Segment, period: float = PERIOD, start: InitialState | None = None,
) -> TimeSeries:
    """
    Drive a plant with a segment's commands.

    Parameters
    ----------
    plant : Plant
    segment : Segment
        With a stream ``command``.
    period : float
        Step [s].
    start : InitialState, optional
        Where to start; estimated from the segment if not given.

    Returns
    -------
    TimeSeries
        The simulator's columns as its sensors read them, from the segment's start to its end.
    """
    at = start or initial_state(segment, plant)
    end = segment.end + period  # the last sample lies inside the grid
    truth = rollout(plant, segment.streams['command'], end, period, segment.start, at.pose,
                    at.twist, at.wheel_rates, at.wheel_angles)
    return plant.observe(truth)


def _rest(segment: Segment) -> float:
    """Return how long wheels and command stay at zero at first [s]; 0 without wheels."""
    streams = segment.streams
    if 'wheels' not in streams:
        return 0.0
    ends = [segment.end]
    for series in (streams['wheels'], streams['command']):
        moving = np.any(np.abs(series.values) > STILL, axis=1)
        if np.any(moving):
            ends.append(float(series.times[np.argmax(moving)]))
    still = streams['wheels'].times
    # The last wheel sample that is still at zero: the robot may start right after it.
    before = still[still < min(ends)]
    return float(before[-1]) - segment.start if before.size else 0.0


def _mean(series: TimeSeries, start: float, window: float) -> tuple[float, ...]:
    part = series.slice(start, start + window)
    rows = part.values if len(part) else series.values[:1]
    return tuple(float(value) for value in rows.mean(axis=0))


def _rolling(plant: Plant, left: float, right: float) -> tuple[float, float]:
    """Return speed [m/s] and yaw rate [rad/s] at which wheels of these rates do not slip."""
    simulator = Simulator(plant, PERIOD)
    ahead = sum(simulator.initial(twist=BodyTwist(1.0, 0.0)).wheel_rates) / 2.0
    turning = simulator.initial(twist=BodyTwist(0.0, 1.0)).wheel_rates
    return (0.5 * (left + right) / ahead, (right - left) / (turning[1] - turning[0]))
