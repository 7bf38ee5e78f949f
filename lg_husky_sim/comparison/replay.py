# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A segment's commands through a model, from the state that the robot was in."""

from __future__ import annotations

from dataclasses import dataclass
import math

from lg_husky_sim.comparison.slopes import local_fit
from lg_husky_sim.husky.plant import ENCODER_WINDOW, Plant
from lg_husky_sim.recording import Segment
from lg_husky_sim.signals import BodyTwist, FloatArray, Pose, TimeSeries
from lg_husky_sim.simulation import Simulator
from lg_husky_sim.simulation.events import COLUMNS, Events
from lg_husky_sim.simulation.starting import commanded_until
import numpy as np

PERIOD = 0.01
"""Step of a replay, and the shortest time after which one may start anew [s]."""
WINDOW = 0.4
"""Length of the samples that the initial pose is estimated from [s]."""

STILL = 0.02
"""Wheel rates below this are rest [rad/s]."""


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

    Where the wheels stand still at first, so does the robot, and the pose is the median over that
    time. Otherwise the pose is the value at the start of a straight line through the first
    samples, which takes most of the sensor's noise out; the speed is that of the wheels as if
    they did not slip, or the slope of the pose without them; the yaw rate is the gyro's, or else
    the slope of the heading, or else the wheels'. A slope at the start that points against the
    way that follows is that of a curve through a rest and a departure, and is taken as rest.

    Parameters
    ----------
    segment : Segment
        Its pose, wheels and imu are read, as far as it has them.
    plant : Plant
        For the ratio of wheel speed to speed.
    window : float
        Length of the samples that the line is fitted to [s]; at least two samples are.

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
        still = streams['pose'].slice(start, start + rest).values
        if len(still):
            value = np.median(still, axis=0)
        pose = Pose(*(float(part) for part in value))
        _, mean = local_fit(streams['pose'], start + 0.5 * window, window)
        own = np.array([[np.cos(pose.heading), np.sin(pose.heading), 0.0], [0.0, 0.0, 1.0]])
        at_start, on_average = own @ slope, own @ mean
        forward, yaw = np.where(at_start * on_average < 0.0, 0.0, at_start).tolist()
    if 'wheels' in streams:
        left, right = (float(rate) for rate in streams['wheels'].values[0])
        rates = (left, right)
        rolling = Simulator(plant, PERIOD).rolling(left, right)
        forward = rolling.forward
        yaw = yaw if 'pose' in streams else rolling.yaw
    if 'imu' in streams:
        yaw = float(streams['imu'].column('yaw_rate')[0])
    if 'wheel_angles' in streams:
        first = streams['wheel_angles'].values[0]
        angles = (float(first[0]), float(first[1]))
    if rest >= 0.0:
        forward = yaw = 0.0
        rates = (0.0, 0.0)
    return InitialState(pose, BodyTwist(forward, yaw), rates, angles)


def replay(
    plant: Plant, segment: Segment, period: float = PERIOD, start: InitialState | None = None,
) -> TimeSeries:
    """
    Drive a plant with a segment's commands.

    Parameters
    ----------
    plant : Plant
        Robot to drive, taken as it is in the segment's recording.
    segment : Segment
        With a stream ``command``.
    period : float
        Longest time between two samples [s].
    start : InitialState, optional
        Where to start; estimated from the segment if not given.

    Returns
    -------
    TimeSeries
        The simulator's columns as its sensors read them, from the segment's start to its end: at
        every step, and exact at every stamp of the segment's streams.

    """
    plant = plant.in_recording(segment.recording)
    at = start or initial_state(segment, plant)
    commands = segment.streams['command']
    before = commanded_until(segment.start, commands, at.twist, at.wheel_rates)
    simulator = Simulator(plant, period)
    state = simulator.initial(at.pose, at.twist, segment.start, at.wheel_rates, at.wheel_angles,
                              before)
    times = _times(plant, segment, period)
    events = Events(commands, times[1:], start=segment.start, fresh=True)
    out = simulator.propagator.run(events, state.flat)
    return plant.observe(TimeSeries(times, np.vstack([state.row, out]), COLUMNS))


def _times(plant: Plant, segment: Segment, period: float) -> FloatArray:
    # A grid to one period beyond the end, the stamps of all streams, and what their sensors look
    # back to: delays, and the time over which encoders count.
    count = math.ceil((segment.end - segment.start) / period - 1e-9) + 1
    times = [segment.start + period * np.arange(count + 1)]
    for name, delays in (('wheels', 'delay_wheels'), ('wheel_angles', 'delay_wheels'),
                         ('imu', 'delay_imu'), ('pose', 'delay_pose')):
        if name not in segment.streams:
            continue
        for delay in {getattr(one.sensors, delays) for one in plant.sets} | {0.0}:
            stamps = segment.streams[name].times - delay
            times.extend((stamps, stamps - ENCODER_WINDOW) if 'wheel' in name else (stamps,))
    every = np.unique(np.concatenate(times))
    end = segment.start + period * count
    return every[(every >= segment.start) & (every <= end)]


def _rest(segment: Segment) -> float:
    """Return how long the wheels stand still at first [s]; -1 if they do not, or are unknown."""
    if 'wheels' not in segment.streams:
        return -1.0
    wheels = segment.streams['wheels']
    moving = np.any(np.abs(wheels.values) > STILL, axis=1)
    if moving[0]:
        return -1.0
    last = int(np.argmax(moving)) - 1 if np.any(moving) else len(wheels) - 1
    return float(wheels.times[last]) - segment.start
