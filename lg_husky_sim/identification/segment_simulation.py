# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Simulate one segment of a recording by its commands, from where it was measured to be."""

from __future__ import annotations

from functools import lru_cache

from lg_husky_sim.husky.plant import SensorModel
from lg_husky_sim.identification.fit_segments import FitSegment, PERIOD
from lg_husky_sim.signals import BodyTwist, FloatArray, Pose, TimeSeries
from lg_husky_sim.simulation.event_kernel import COLUMNS, run
from lg_husky_sim.simulation.events import Events
from lg_husky_sim.simulation.simulator import Simulator
from lg_husky_sim.simulation.starting import commanded_until
import numpy as np

#: Time between two resets of the simulated pose and wheel angles to the measured ones [s].
RESET = 4.0
#: Columns of the wheel angles.
ANGLES = [COLUMNS.index('angle_left'), COLUMNS.index('angle_right')]


def simulate_segment(simulator: Simulator, segment: FitSegment, latency: float = 0.0,
                     correction: FloatArray | None = None) -> FloatArray:
    """
    Simulate a segment on its grid.

    Parameters
    ----------
    simulator : Simulator
        At :data:`PERIOD`.
    segment : FitSegment
        With its commands, and what was measured at the start and at the resets.
    latency : float
        Further dead time of the commands [s].
    correction : numpy.ndarray, shape (4,), optional
        Of the measured state at the start.

    Returns
    -------
    numpy.ndarray, shape (count + 1, 15)
        The kernel's columns; pose columns follow the measured pose at the resets. What depends on
        a wheel's angle follows the measured one there, too, read as by the sensors before an
        onset: it would be out of phase after a few turns otherwise. The angle columns go on
        without a jump.

    """
    events, before = _events(segment, latency)
    twist, rates = segment.twist, segment.wheel_rates
    if correction is not None:
        forward, yaw, left, right = (float(c) for c in np.add(segment.initial_state, correction))
        twist, rates = BodyTwist(forward, yaw), (left, right)
    # Whether or not something is known there: steps of the simulation end at the resets.
    stride = max(1, round(RESET / PERIOD))
    poses = _poses(segment, stride)
    angles = _angles(segment, stride, simulator.plant.sets[0].sensors)
    state = simulator.initial(poses[0], twist, segment.start, rates, segment.wheel_angles, before)
    flat = np.array(state.flat)
    out = np.empty((segment.count + 1, len(COLUMNS)))
    out[0] = state.row
    ahead = np.zeros(2)
    longest = max(one.command.latency for one in simulator.plant.sets)
    for first in range(0, segment.count, stride):
        last = min(first + stride, segment.count)
        if segment.pose is not None and first:
            now = poses[first // stride]
            flat[state.n + 3:state.n + 6] = now.heading, now.x, now.y
        if angles is not None and first:
            ahead += flat[state.n:state.n + 2] - angles[first // stride]
            flat[state.n:state.n + 2] = angles[first // stride]
        given = max(int(np.searchsorted(events.stamps, flat[state.n + 6] - longest)) - 1, 0)
        run(flat, events.stamps[given:], events.values[given:], events.times[first:last],
            events.places[:last - first], out[first + 1:last + 1], events.times[last - 1],
            simulator.fine_pose, simulator.propagator.packed)
        for column, lead in zip(ANGLES, ahead.tolist(), strict=True):
            out[first + 1:last + 1, column] += lead
    return out


@lru_cache(maxsize=256)
def _events(segment: FitSegment, latency: float) -> tuple[Events, BodyTwist]:
    # Commands and the grid, and what was commanded until the start. Measured and not corrected
    # motion tells whether the segment begins at rest: a start that is estimated would switch it
    # over.
    commands = segment.commands
    before = commanded_until(segment.start, commands, segment.twist, segment.initial_wheel_rates)
    if latency:
        times, values = commands.times + latency, commands.values
        if times.size and times[0] > segment.start:
            # Late by the dead time, the commands leave a gap that those before them fill.
            times = np.insert(times, 0, segment.start)
            values = np.insert(values, 0, (before.forward, before.yaw), axis=0)
        commands = TimeSeries(times, values, commands.names)
    grid = segment.start + PERIOD * np.arange(1, segment.count + 1)
    return Events(commands, grid, start=segment.start, fresh=True), before


def _angles(segment: FitSegment, stride: int, sensors: SensorModel) -> FloatArray | None:
    # Wheel angles at the start and at each reset, by what the encoders read; shape (n, 2).
    if segment.turned is None:
        return None
    times = _resets(segment, stride) + sensors.delay_wheels
    angles = np.empty((times.size, 2))
    for k, (side, factor) in enumerate((('left', sensors.encoder_left),
                                        ('right', sensors.encoder_right))):
        read = np.interp(times, segment.turned.times, segment.turned.column(side))
        angles[:, k] = segment.wheel_angles[k] + (read - read[0]) / factor
    return angles


def _resets(segment: FitSegment, stride: int) -> FloatArray:
    steps = np.arange(0, max(segment.count, 1), stride, dtype=np.float64)
    times: FloatArray = segment.start + steps * PERIOD
    return times


@lru_cache(maxsize=256)
def _poses(segment: FitSegment, stride: int) -> tuple[Pose, ...]:
    # Measured poses at the start and at each reset.
    if segment.pose is None:
        return (Pose(),)
    times = _resets(segment, stride)
    columns = [np.interp(times, segment.pose.times, segment.pose.values[:, i]) for i in range(3)]
    return tuple(Pose(*row) for row in np.column_stack(columns).tolist())
