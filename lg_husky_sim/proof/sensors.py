# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""From what a hidden robot was asked to what its sensors publish."""

from __future__ import annotations

from dataclasses import dataclass

from lg_husky_sim.proof import world as w
from lg_husky_sim.proof.bags import Published
from lg_husky_sim.proof.integrate import COLUMNS, STEP
from lg_husky_sim.proof.manoeuvres import Manoeuvre
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class CommandPath:
    """
    The way from the publisher to the voltage; the last ten are effects, zero when off.

    Times in seconds, rates in m/s² and rad/s², limits in m/s and rad/s (0: none),
    `since` the time from which effects hold, `loop_lag` the time constant of a speed
    loop's reference, `loop_yaw_ratio` its wheel-to-yaw multiplier. `own` are latency,
    slews and limits that hold until then: a robot as sold has some of its own.
    """

    gain: float = w.COMMAND_GAIN
    delay_low: float = 0.0
    delay_high: float = 0.0
    loss: float = 0.0
    since: float = -1.0
    latency: float = 0.0
    slew_forward: float = 0.0
    slew_yaw: float = 0.0
    limit_forward: float = 0.0
    limit_yaw: float = 0.0
    stutter_period: float = 0.0
    stutter_hold: float = 0.0
    loop_lag: float = 0.0
    loop_yaw_ratio: float = 1.875
    cutback: float = 0.0
    own: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)

    @property
    def limits(self) -> tuple[float, float, float, float, float]:
        """Latency, slews forward and yaw, limits forward and yaw."""
        return (self.latency, self.slew_forward, self.slew_yaw, self.limit_forward,
                self.limit_yaw)


@dataclass(frozen=True)
class Senses:
    """
    Noise and faults of the sensors; faults are zero (factors one) when off.

    Angles in rad, rates in rad/s, accelerations in m/s², times in s; `late` names the
    stream whose stamps are `late_by` seconds late; `since` is when faults begin.
    """

    tick: float = 1e-3
    stamp_jitter: float = 5e-4
    gyro_noise: float = 0.008
    accel_noise: float = 0.12
    accel_bias: float = 0.0
    pose_rate: float = 50.0
    pose_noise: float = 0.006
    heading_noise: float = 0.004
    gaps: tuple[tuple[float, float], ...] = ()
    nuisance_bias: float = 0.0
    stamped: bool = True
    suffix: str = ''
    since: float = -1.0
    gyro_bias: float = 0.0
    gyro_factor: float = 1.0
    gyro_clip: float = 0.0
    encoder_left: float = 1.0
    encoder_right: float = 1.0
    late: str = ''
    late_by: float = 0.0


def received(drive: Manoeuvre, path: CommandPath, rng: np.random.Generator | None,
             step: float = STEP) -> Vector:
    """
    Return the command that reaches the driver at every fine step, shape (n, 2).

    Without `rng` nothing is lost and every command takes the mean nuisance delay.
    """
    count = round(drive.duration / step)
    times = np.arange(count) * step
    publish = drive.times
    if rng is None:
        arrive = publish + 0.5 * (path.delay_low + path.delay_high)
        kept = np.ones(publish.size, dtype=bool)
    else:
        arrive = publish + rng.uniform(path.delay_low, path.delay_high + 1e-9, publish.size)
        kept = rng.random(publish.size) >= path.loss
    active = publish >= path.since
    arrive = arrive + np.where(active, path.latency, path.own[0])
    if path.stutter_period > 0.0:
        phase = np.mod(arrive, path.stutter_period)
        frozen = active & (phase < path.stutter_hold)
        arrive = np.where(frozen, arrive - phase + path.stutter_hold, arrive)
    kept[0] = True
    arrive = np.maximum.accumulate(arrive[kept])
    which = np.searchsorted(arrive, times, side='right') - 1
    held = drive.commands[kept][np.maximum(which, 0)]
    held[which < 0] = 0.0
    on = times >= path.since
    for column in (0, 1):
        # 0 stands for no limit.
        limit = np.where(on, path.limits[3 + column], path.own[3 + column])
        limit[limit <= 0.0] = np.inf
        held[:, column] = np.clip(held[:, column], -limit, limit)
    for column in (0, 1):
        slew = np.where(on, path.limits[1 + column], path.own[1 + column])
        if np.any(slew > 0.0):
            slew[slew <= 0.0] = np.inf
            held[:, column] = _slewed(held[:, column], slew * step)
    if path.cutback > 0.0:
        busy = np.mod(times, 11.0) > 8.5
        held[on & busy] *= 1.0 - path.cutback
    if path.loop_lag > 0.0:
        held = _lagged(held, step / path.loop_lag)
    return held


def _slewed(values: Vector, most: Vector) -> Vector:
    """Limit the change per step."""
    result = values.copy()
    for k in range(1, values.size):
        change = values[k] - result[k - 1]
        if change > most[k]:
            result[k] = result[k - 1] + most[k]
        elif change < -most[k]:
            result[k] = result[k - 1] - most[k]
    return result


def _lagged(values: Vector, share: float) -> Vector:
    from scipy.signal import lfilter
    result: Vector = lfilter([share], [1.0, share - 1.0], values, axis=0)
    return result


def demanded(commands: Vector, path: CommandPath, loop: bool, radius: float,
             track: float) -> Vector:
    """Return voltages [V], or wheel speeds [rad/s] with a speed loop; shape (n, 2)."""
    forward, yaw = commands[:, 0], commands[:, 1]
    if loop:
        split = 0.5 * track * path.loop_yaw_ratio * yaw
        return np.column_stack([(forward - split) / radius, (forward + split) / radius])
    volts = w.NOMINAL_SUPPLY * path.gain
    return np.column_stack([volts * (forward - w.TURN_RATIO * yaw),
                            volts * (forward + w.TURN_RATIO * yaw)])


def _at(table: Vector, name: str, times: Vector) -> Vector:
    return np.interp(times, table[:, 0], table[:, COLUMNS.index(name)])


def _mean_before(table: Vector, name: str, times: Vector, window: float) -> Vector:
    """Mean of a column over the `window` seconds before each time (anti-alias filter)."""
    step = table[1, 0] - table[0, 0]
    total = np.concatenate([[0.0], np.cumsum(table[:, COLUMNS.index(name)]) * step])
    edges = np.concatenate([table[:, 0], [table[-1, 0] + step]])
    before = np.interp(times - window, edges, total)
    result: Vector = (np.interp(times, edges, total) - before) / window
    return result


def _ticks(end: float, rate: float, rng: np.random.Generator) -> Vector:
    phase = rng.uniform(0.0, 1.0 / rate)
    times: Vector = np.arange(0.02 + phase, end, 1.0 / rate)
    return times


def publish(table: Vector, drive: Manoeuvre, senses: Senses,
            rng: np.random.Generator) -> Published:
    """
    Return what the robot published while it moved as in `table` (`integrate`).

    Wheel speeds are differences of counted encoder ticks; stamps jitter; the gyro and
    the accelerometer average the last 10 ms; poses have gaps.
    """
    end = float(table[-1, 0])
    times = _ticks(end, 50.0, rng)
    on = times >= senses.since
    sides = []
    for side, factor in (('left', senses.encoder_left), ('right', senses.encoder_right)):
        angle = _at(table, f'angle_{side}', np.concatenate([[times[0] - 0.02], times]))
        change = np.diff(angle) * np.where(on, factor, 1.0)
        counted = np.concatenate([[0.0], np.cumsum(change)]) + rng.uniform(0.0, senses.tick)
        counted = np.floor(counted / senses.tick) * senses.tick
        speed = np.diff(counted) / np.diff(np.concatenate([[times[0] - 0.02], times]))
        sides.append((counted[1:], speed))
    (left, left_speed), (right, right_speed) = sides
    joints = np.column_stack([
        _stamps(times, senses, 'wheels', rng), left, right, left, right,
        left_speed, right_speed, left_speed, right_speed])

    times = _ticks(end, 50.0, rng)
    on = times >= senses.since
    rate = _mean_before(table, 'yaw_rate', times, 0.01)
    faulty = rate * senses.gyro_factor + senses.gyro_bias
    if senses.gyro_clip > 0.0:
        faulty = np.clip(faulty, -senses.gyro_clip, senses.gyro_clip)
    rate = np.where(on, faulty, rate) + senses.nuisance_bias
    imu = np.column_stack([
        _stamps(times, senses, 'imu', rng),
        rate + rng.standard_normal(times.size) * senses.gyro_noise,
        _mean_before(table, 'accel_x', times, 0.01) + senses.accel_bias
        + rng.standard_normal(times.size) * senses.accel_noise,
        _mean_before(table, 'accel_y', times, 0.01)
        + rng.standard_normal(times.size) * senses.accel_noise])

    times = _ticks(end, senses.pose_rate, rng)
    poses = np.column_stack([
        _stamps(times, senses, 'pose', rng),
        _at(table, 'x', times) + rng.standard_normal(times.size) * senses.pose_noise,
        _at(table, 'y', times) + rng.standard_normal(times.size) * senses.pose_noise,
        _at(table, 'heading', times)
        + rng.standard_normal(times.size) * senses.heading_noise])
    seen = np.ones(times.size, dtype=bool)
    for start, length in senses.gaps:
        seen &= ~((times >= start) & (times < start + length))
    commands = np.column_stack([drive.times, drive.commands])
    return Published(commands, joints, imu, poses[seen], senses.stamped, senses.suffix)


def ideal(table: Vector, drive: Manoeuvre, senses: Senses, rate: float = 200.0) -> Published:
    """
    Return what noiseless sensors would publish at `rate` [Hz]; their faults stay.

    It is the yardstick for held-out data: the hidden robot itself, without chance.
    """
    times = np.arange(0.02, float(table[-1, 0]), 1.0 / rate)
    late = {name: senses.late_by if senses.late == name else 0.0
            for name in ('wheels', 'imu', 'pose')}
    columns = []
    for side, factor in (('left', senses.encoder_left), ('right', senses.encoder_right)):
        angle = _at(table, f'angle_{side}', times) * factor
        before = _at(table, f'angle_{side}', times - 0.02) * factor
        columns.append((angle, (angle - before) / 0.02))
    (left, left_speed), (right, right_speed) = columns
    gyro = _mean_before(table, 'yaw_rate', times, 0.01) * senses.gyro_factor + senses.gyro_bias
    if senses.gyro_clip > 0.0:
        gyro = np.clip(gyro, -senses.gyro_clip, senses.gyro_clip)
    joints = np.column_stack([times + late['wheels'], left, right, left, right,
                              left_speed, right_speed, left_speed, right_speed])
    imu = np.column_stack([times + late['imu'], gyro,
                           _mean_before(table, 'accel_x', times, 0.01),
                           _mean_before(table, 'accel_y', times, 0.01)])
    poses = np.column_stack([times + late['pose'], _at(table, 'x', times),
                             _at(table, 'y', times), _at(table, 'heading', times)])
    return Published(np.column_stack([drive.times, drive.commands]), joints, imu, poses)


def _stamps(times: Vector, senses: Senses, stream: str, rng: np.random.Generator) -> Vector:
    late = senses.late_by if senses.late == stream else 0.0
    stamps = times + rng.standard_normal(times.size) * senses.stamp_jitter
    stamps = stamps + np.where(times >= senses.since, late, 0.0)
    result: Vector = np.maximum.accumulate(np.maximum(stamps, 0.0))
    return result
