# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Integrals of what the streams of a segment measure, with their stamps; None without a stream."""

from __future__ import annotations

from lg_husky_sim.diagnosis.evidence.drives import are_derived
from lg_husky_sim.diagnosis.sensors.regression import Way
from lg_husky_sim.recording import Segment
from lg_husky_sim.recording.wheels import unwrapped
from lg_husky_sim.signals import FloatArray
import numpy as np


def integral(times: FloatArray, rates: FloatArray) -> Way:
    """Return stamps with the integral of rates from the first of them on."""
    steps = 0.5 * (rates[1:] + rates[:-1]) * np.diff(times)
    return times, np.concatenate([[0.0], np.cumsum(steps)])


def heading(part: Segment) -> Way | None:
    """Return the heading of the pose [rad]."""
    pose = part.streams.get('pose')
    return None if pose is None else (pose.times, np.unwrap(pose.column('heading')))


def advance(part: Segment) -> Way | None:
    """Return the distance driven along the heading of the pose [m]."""
    pose = part.streams.get('pose')
    if pose is None:
        return None
    angle = np.unwrap(pose.column('heading'))
    middle = 0.5 * (angle[1:] + angle[:-1])
    steps = (np.cos(middle) * np.diff(pose.column('x'))
             + np.sin(middle) * np.diff(pose.column('y')))
    return pose.times, np.concatenate([[0.0], np.cumsum(steps)])


def gyro(part: Segment) -> Way | None:
    """Return the angle by which the gyro has turned [rad]."""
    imu = part.streams.get('imu')
    return None if imu is None else integral(imu.times, imu.column('yaw_rate'))


def wheel_angles(part: Segment) -> tuple[FloatArray, FloatArray] | None:
    """Return stamps and angles (left, right) [rad]; counted ones where rates come of them."""
    rates, angles = part.streams.get('wheels'), part.streams.get('wheel_angles')
    if angles is not None and len(angles) and (rates is None or are_derived(rates, angles)):
        return angles.times, np.column_stack([
            unwrapped(angles.column(side)) for side in ('left', 'right')])
    return None if rates is None else (rates.times, np.column_stack([
        integral(rates.times, rates.column(side))[1] for side in ('left', 'right')]))


def turned_left(part: Segment) -> Way | None:
    """Return the angle of the left wheels [rad]."""
    wheels = wheel_angles(part)
    return None if wheels is None else (wheels[0], wheels[1][:, 0])


def turned_right(part: Segment) -> Way | None:
    """Return the angle of the right wheels [rad]."""
    wheels = wheel_angles(part)
    return None if wheels is None else (wheels[0], wheels[1][:, 1])


def commanded_turn(part: Segment) -> Way | None:
    """Return the angle by which the base was told to turn [rad]."""
    command = part.streams.get('command')
    if command is None or len(command) < 2:
        return None
    # A command holds until the next one.
    steps = command.column('yaw')[:-1] * np.diff(command.times)
    return command.times, np.concatenate([[0.0], np.cumsum(steps)])


def wheel_difference(part: Segment) -> Way | None:
    """Return by how much the right wheels have turned further than the left ones [rad]."""
    wheels = wheel_angles(part)
    return None if wheels is None else (wheels[0], wheels[1][:, 1] - wheels[1][:, 0])


def mean_wheel(part: Segment) -> Way | None:
    """Return the mean angle of the wheels [rad]."""
    wheels = wheel_angles(part)
    return None if wheels is None else (wheels[0], wheels[1].mean(axis=1))
