# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What the sensors of a hidden robot publish, by the conventions of its log."""

from __future__ import annotations

from dataclasses import dataclass

from lg_husky_sim.proof.bags import Published
from lg_husky_sim.proof.commands import Sent
from lg_husky_sim.proof.conventions import Conventions, Gyro, Wheels
from lg_husky_sim.proof.integrate import COLUMNS
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Rng = np.random.Generator

SIDES = ('left', 'right')


@dataclass(frozen=True)
class Faults:
    """
    Faults of the sensors; zero (factors one) when off.

    Rates in rad/s (`gyro_drift` over the whole recording), times in s; `late` names the
    stream whose stamps are `late_by` seconds late; `since` is when faults begin.
    `on_motor`: 'yes' where the encoder sits on the motor's shaft.
    """

    since: float = -1.0
    gyro_bias: float = 0.0
    gyro_drift: float = 0.0
    gyro_factor: float = 1.0
    gyro_clip: float = 0.0
    encoder_left: float = 1.0
    encoder_right: float = 1.0
    on_motor: str = 'no'
    late: str = ''
    late_by: float = 0.0


def column(table: Vector, name: str, times: Vector) -> Vector:
    """Return a column of the motion at some times."""
    return np.interp(times, table[:, 0], table[:, COLUMNS.index(name)])


def _filtered(table: Vector, values: Vector, lag: float, times: Vector) -> Vector:
    """First-order low-pass with time constant `lag` [s]."""
    from scipy.signal import lfilter
    keep = float(np.exp(-(table[1, 0] - table[0, 0]) / lag))
    smooth = lfilter([1.0 - keep], [1.0, -keep], values)
    result: Vector = np.interp(times, table[:, 0], smooth)
    return result


def _mean(table: Vector, values: Vector, window: float, times: Vector) -> Vector:
    """Mean over the `window` seconds before each time."""
    step = table[1, 0] - table[0, 0]
    total = np.concatenate([[0.0], np.cumsum(0.5 * (values[1:] + values[:-1])) * step])
    result: Vector = (np.interp(times, table[:, 0], total)
                      - np.interp(times - window, table[:, 0], total)) / window
    return result


def faulty_angle(table: Vector, side: str, faults: Faults) -> Vector:
    """Angle that an encoder sees; a wrong factor acts on what it counts from its onset on."""
    source = 'motor' if faults.on_motor == 'yes' else 'angle'
    angle = table[:, COLUMNS.index(f'{source}_{side}')]
    factor = faults.encoder_left if side == 'left' else faults.encoder_right
    if factor == 1.0:
        return angle
    moved = np.concatenate([[0.0], np.diff(angle)])
    moved[table[:, 0] > faults.since] *= factor
    result: Vector = angle[0] + np.cumsum(moved)
    return result


def wheel_speeds(table: Vector, angle: Vector, how: Wheels, times: Vector, radius: float,
                 rng: Rng | None) -> tuple[Vector, Vector]:
    """
    Return counted angle [rad] and speed [rad/s] of one encoder at some times.

    'difference': counts over the window before; 'instant': the rate itself, with noise;
    'lowpass': filtered; 'rounded': to steps of metres per second; 'positions': none (zeros).
    Without `rng` there is no noise and no tick.
    """
    def count(when: Vector) -> Vector:
        exact = np.interp(when, table[:, 0], angle)
        if rng is None:
            return exact
        return np.asarray(np.floor((exact + start) / how.tick) * how.tick)

    start = 0.0 if rng is None else float(rng.uniform(0.0, how.tick))
    counted = count(times)
    if how.kind == 'positions':
        return counted, np.zeros(times.size)
    if how.kind == 'difference':
        return counted, (counted - count(times - how.window)) / how.window
    rate = np.gradient(angle, table[:, 0])
    if how.kind == 'lowpass':
        speed = _filtered(table, rate, how.window, times)
    else:
        speed = np.interp(times, table[:, 0], rate)
    if rng is not None:
        speed = speed + rng.standard_normal(times.size) * (
            0.3 * how.noise if how.kind in ('rounded', 'lowpass') else how.noise)
        if how.kind == 'rounded':
            speed = np.round(speed * radius / how.step) * how.step / radius
    return counted, speed


def gyro_rate(table: Vector, how: Gyro, faults: Faults, times: Vector,
              rng: Rng | None) -> Vector:
    """Return the yaw rate [rad/s] that a gyro reads at some times."""
    seen = through(table, 'yaw_rate', how, times)
    late = np.clip((times - times[0]) / max(times[-1] - times[0], 1.0), 0.0, 1.0)
    wrong = seen * faults.gyro_factor + faults.gyro_bias + faults.gyro_drift * late
    if faults.gyro_clip > 0.0:
        wrong = np.clip(wrong, -faults.gyro_clip, faults.gyro_clip)
    seen = np.where(times >= faults.since, wrong, seen)
    if rng is None:
        return seen
    seen = seen + how.bias + rng.standard_normal(times.size) * how.noise
    return np.round(seen / how.step) * how.step if how.step > 0.0 else seen


def through(table: Vector, name: str, how: Gyro, times: Vector) -> Vector:
    """Return a column of the motion as an inertial unit of this kind passes it on."""
    values = table[:, COLUMNS.index(name)]
    if how.kind == 'instant':
        return np.interp(times, table[:, 0], values)
    if how.kind == 'mean':
        return _mean(table, values, how.window, times)
    return _filtered(table, values, how.window, times)


def _ticks(start: float, end: float, rate: float, rng: Rng) -> Vector:
    """Return sampling times [s]: regular, with the scheduler's own unrest."""
    times = np.arange(start + rng.uniform(0.0, 1.0 / rate), end, 1.0 / rate)
    moved = times + rng.uniform(0.0, min(0.1 / rate, 0.001), times.size)
    result: Vector = moved[moved < end]
    return result


class Clock:
    """The stamps of one recording: when it was switched on, jitter and lateness."""

    def __init__(self, how: Conventions, faults: Faults, start: float, rng: Rng) -> None:
        self.how, self.faults, self.start, self.rng = how, faults, start, rng

    def jitter(self, count: int) -> Vector:
        """Return errors of stamps [s]."""
        size, form = self.how.jitter, self.how.jitter_form
        if form == 'uniform':
            return self.rng.uniform(-size, size, count)
        if form == 'normal':
            return self.rng.normal(0.0, 0.5 * size, count)
        return self.rng.exponential(0.5 * size, count)

    def stamps(self, times: Vector, stream: str, early: float = 0.0) -> Vector:
        """Return what is written on messages of `times`, `early` seconds before them."""
        late = self.faults.late_by if self.faults.late == stream else 0.0
        written = times - early + self.jitter(times.size)
        written = written + np.where(times >= self.faults.since, late, 0.0) - self.start
        result: Vector = np.maximum.accumulate(written)
        return result


def publish(table: Vector, sent: Sent, how: Conventions, faults: Faults, start: float,
            radius: float, rng: Rng) -> Published:
    """
    Return what the robot published while it moved as in `table` (`integrate`).

    Parameters
    ----------
    table
        Its motion.
    sent
        Its commands.
    how
        The conventions of its log.
    faults
        Hidden faults of its sensors.
    start
        When the recorder was switched on [s]; stamps count from there.
    radius
        Wheel radius by which a driver rounds its speeds [m].
    rng
        Where noise comes from.

    """
    end = float(table[-1, 0])
    clock = Clock(how, faults, start, rng)
    first = max(start, 0.2)
    joints = imu = poses = np.zeros((0, 9))
    if 'wheels' not in how.missing:
        times = _ticks(first, end, how.wheels.rate, rng)
        columns = [wheel_speeds(table, faulty_angle(table, side, faults), how.wheels, times,
                                radius, rng) for side in SIDES]
        (left, left_speed), (right, right_speed) = columns
        stamps = clock.stamps(times, 'wheels', how.wheels.stamp * how.wheels.window)
        # The recorder's bag begins with the count at that time, as after any power cycle.
        joints = np.column_stack([stamps, left, right, left, right, left_speed, right_speed,
                                  left_speed, right_speed])
    if 'imu' not in how.missing:
        times = _ticks(first, end, how.gyro.rate, rng)
        noise = rng.standard_normal((2, times.size)) * how.gyro.accelerometer
        imu = np.column_stack([
            clock.stamps(times, 'imu', how.gyro.stamp * how.gyro.window),
            gyro_rate(table, how.gyro, faults, times, rng),
            *(through(table, name, how.gyro, times) + bias + part for name, bias, part in zip(
                ('accel_x', 'accel_y'), how.gyro.accelerometer_bias, noise, strict=True))])
    if 'pose' not in how.missing:
        times = _ticks(first, end, how.poses.rate, rng)
        seen = np.ones(times.size, dtype=bool)
        for _ in range(how.poses.gaps):
            gap = float(rng.uniform(first + 2.0, max(end - 3.0, first + 2.1)))
            seen &= ~((times >= gap) & (times < gap + float(rng.uniform(0.15, 1.2))))
        unit = rng.standard_normal((3, times.size))
        poses = np.column_stack([
            clock.stamps(times, 'pose'),
            column(table, 'x', times) + unit[0] * how.poses.noise,
            column(table, 'y', times) + unit[1] * how.poses.noise,
            column(table, 'heading', times) + unit[2] * how.poses.heading])[seen]
    kept = sent.logged & (sent.times >= start)
    commands = np.column_stack([sent.times - start, sent.commands])[kept]
    if not how.link.stamped:
        # The recorder's own clock is all there is.
        commands[:, 0] = np.maximum.accumulate(commands[:, 0] + clock.jitter(len(commands)))
    return Published(commands, joints, imu, poses, how.link.stamped, how.wheels.suffix,
                     velocities=how.wheels.kind != 'positions', positions=how.wheels.positions,
                     order=how.wheels.order)


def ideal(table: Vector, sent: Sent, how: Conventions, faults: Faults,
          rate: float = 100.0) -> Published:
    """
    Return what noiseless sensors would publish at `rate` [Hz]; conventions and faults stay.

    It is the yardstick for held-out data: the hidden robot itself, without chance.
    """
    times = np.arange(0.2, float(table[-1, 0]), 1.0 / rate)

    def written(stream: str, early: float = 0.0) -> Vector:
        return times - early + (faults.late_by if faults.late == stream else 0.0)

    columns = [wheel_speeds(table, faulty_angle(table, side, faults), how.wheels, times, 1.0,
                            None) for side in SIDES]
    (left, left_speed), (right, right_speed) = columns
    joints = np.column_stack([
        written('wheels', how.wheels.stamp * how.wheels.window), left, right, left, right,
        left_speed, right_speed, left_speed, right_speed])
    imu = np.column_stack([written('imu', how.gyro.stamp * how.gyro.window),
                           gyro_rate(table, how.gyro, faults, times, None),
                           *(through(table, name, how.gyro, times)
                             for name in ('accel_x', 'accel_y'))])
    poses = np.column_stack([written('pose'), *(column(table, name, times)
                                                for name in ('x', 'y', 'heading'))])
    return Published(np.column_stack([sent.times, sent.commands]), joints, imu, poses)
