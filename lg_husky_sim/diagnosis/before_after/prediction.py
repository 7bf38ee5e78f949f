# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What the base predicts for a drive, in bins, and how that depends on its parameters."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property

from lg_husky_sim.diagnosis.before_after.base_robot import (
    FIXED,
    mean_in_bins,
    OUTPUTS,
    ROBOT,
    simulate,
)
from lg_husky_sim.diagnosis.before_after.commands import accepted
from lg_husky_sim.diagnosis.before_after.drives import Bins, Drive
from lg_husky_sim.diagnosis.before_after.settings import Quantity, Settings
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray

#: Channels by stream; those of the pose are movements from one bin to the next, in the frame of
#: the middle between them.
CHANNELS = {'wheels': ('left', 'right'), 'imu': ('yaw', 'accel_x', 'accel_y'),
            'pose': ('ahead', 'aside', 'turn')}
#: Their kinds in ``config/before_after.yaml``.
KINDS = {'left': 'wheels', 'right': 'wheels', 'yaw': 'yaw', 'accel_x': 'accel',
         'accel_y': 'accel', 'ahead': 'place', 'aside': 'place', 'turn': 'heading'}


def _columns(first: str, last: str) -> slice:
    return slice(OUTPUTS.index(first), OUTPUTS.index(last) + 1)


@dataclass(frozen=True, eq=False)
class Base:
    """
    The base robot of one nominal model.

    Parameters
    ----------
    settings : Settings
    start, sd : numpy.ndarray, shape (n,)
        Means and standard deviations of the priors, on the scale of the estimates.
    fixed : numpy.ndarray
        Numbers that are not estimated.
    kinds : tuple of mapping of str to float
        Values of robots of other kinds, from which a fit begins as well.
    reference : int
        Index of the delay of the stream against which those of the others are.
    given : bool
        Whether the wheels turn as measured, which leaves the body's motion to be explained.
    """

    settings: Settings
    start: FloatArray
    sd: FloatArray
    fixed: FloatArray
    kinds: tuple[Mapping[str, float], ...]
    reference: int
    given: bool = False

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Of the parameters."""
        return tuple(q.name for q in self.settings.quantities)

    @cached_property
    def _logarithmic(self) -> NDArray[np.bool_]:
        return np.array([q.logarithmic for q in self.settings.quantities])

    def values(self, z: FloatArray) -> FloatArray:
        """Return parameters [their units] from the scale of the estimates."""
        logs = self._logarithmic
        return np.where(logs, np.exp(np.where(logs, z, 0.0)), z)

    def place(self, name: str, value: float) -> float:
        """Return a parameter on the scale of the estimates."""
        quantity = self.settings.quantities[self.names.index(name)]
        return float(np.log(value)) if quantity.logarithmic else value

    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Return the bounds on the scale of the estimates."""
        def scaled(q: Quantity, value: float) -> float:
            return float(np.log(value)) if q.logarithmic else value
        quantities = self.settings.quantities
        return (np.array([scaled(q, q.lower) for q in quantities]),
                np.array([scaled(q, q.upper) for q in quantities]))


def base_of(settings: Settings, nominal: Parameters, given: bool = False,
            interval: float = 0.0, streams: Collection[str] = CHANNELS) -> Base:
    """
    Return the base for the model in doubt.

    Parameters
    ----------
    settings : Settings
    nominal : Parameters
    given : bool
        Whether the wheels turn as measured.
    interval : float
        Of the wheel rates [s].
    streams : collection of str
        That every drive has: delays are against the pose, or else the IMU, or else the wheels.

    Returns
    -------
    Base
    """
    start = [nominal[q.nominal] if q.start is None else q.start for q in settings.quantities]
    logs = [q.logarithmic for q in settings.quantities]
    z = np.array([np.log(x) if log else x for x, log in zip(start, logs, strict=True)])
    names = [q.name for q in settings.quantities]
    late = names.index('wheels_late')
    z[late] += 0.5 * interval
    sd = np.array([q.sd for q in settings.quantities])
    sd[late] += 0.5 * interval
    reference = next((one for one in ('pose', 'imu', 'wheels') if one in streams), 'pose')
    against = names.index(f'{reference}_late')
    sd[against] = settings.fit['reference']
    numbers = {**settings.simulation,
               'wheelbase': nominal['wheelbase'], 'wheel_radius': nominal['wheel_radius'],
               'motor_resistance': nominal['motor_resistance'],
               'transmission': nominal['torque_constant'] * nominal['gear_ratio']}
    # Without a speed loop the model in doubt says what voltage a command gives.
    voltages = {
        'loop_feedforward':
            nominal['supply_voltage'] * nominal['command_gain'] * nominal['wheel_radius'],
        'turn_width': 2.0 * nominal['turn_ratio'], 'yaw_damping': nominal['yaw_damping']}
    return Base(settings, z, sd, np.array([numbers[name] for name in FIXED]),
                tuple({**kind, **voltages} for kind in settings.kinds), against, given)


def _accepted(base: Base, drive: Drive, x: FloatArray, begin: FloatArray) -> FloatArray:
    value = dict(zip(base.names, x, strict=True))
    wheels = base.fixed[FIXED.index('wheel_radius')] * begin[3:]
    now = (0.5 * (wheels[0] + wheels[1]) / value['speed_gain'],
           (wheels[1] - wheels[0]) / value['turn_width'])
    rows = np.zeros((2, drive.steps))
    for row, values, axis, place in zip(rows, drive.command.values.T, ('forward', 'yaw'), now,
                                        strict=True):
        accepted(drive.command.times, np.ascontiguousarray(values), value['dead_time'],
                 value[f'limit_{axis}'], value[f'slew_{axis}'], place, drive.start,
                 base.settings.simulation['step'], row)
    return np.ascontiguousarray(rows.T)


def moved(base: Base, drive: Drive, x: FloatArray) -> FloatArray:
    """Simulate a drive, in columns as `OUTPUTS`; `x` in units."""
    step = base.settings.simulation['step']
    names = base.names
    robot = np.concatenate([x[:len(ROBOT)], base.fixed])
    out = np.empty((drive.steps + 1, len(OUTPUTS)))
    begin = np.array(drive.begin)
    mean_rim = (x[names.index('radius_left')] * begin[3]
                + x[names.index('radius_right')] * begin[4]) / 2.0
    begin[0] = mean_rim
    wheels, command = np.zeros((drive.steps + 1, 2)), np.zeros((drive.steps, 2))
    if base.given:
        at = drive.start + step * np.arange(drive.steps + 1) + x[names.index('wheels_late')]
        wheels = np.column_stack([np.interp(at, drive.wheels.times, column)
                                  for column in drive.wheels.values.T])
    else:
        command = _accepted(base, drive, x, begin)
    simulate(robot, step, command, drive.level, wheels, base.given, begin, out)
    return out


def _read(base: Base, drive: Drive, stream: str, motion: FloatArray, first: str,
          last: str, later: float) -> FloatArray:
    # Means in the bins of a stream, of the outputs from the first to the last.
    bins, rows = drive.bins[stream], motion[:, _columns(first, last)]
    out = np.empty((bins.edges.size, rows.shape[1]))
    mean_in_bins(rows, drive.start, base.settings.simulation['step'], bins.times, bins.edges,
                 later, out)
    return out


def movements(path: FloatArray) -> FloatArray:
    """Return the movement between bins in the frame of their mean heading, shape (n - 1, 3)."""
    step = np.diff(path, axis=0)
    heading = 0.5 * (path[1:, 2] + path[:-1, 2])
    cos, sin = np.cos(heading), np.sin(heading)
    return np.column_stack([cos * step[:, 0] + sin * step[:, 1],
                            cos * step[:, 1] - sin * step[:, 0], step[:, 2]])


def predicted(base: Base, drive: Drive, x: FloatArray, motion: FloatArray
              ) -> dict[str, FloatArray]:
    """Return what each stream's bins should read, by stream."""
    value = dict(zip(base.names, x, strict=True))
    found = {}
    if not base.given and 'wheels' in drive.bins:
        half = 0.5 * value['wheels_window']
        before, after = (_read(base, drive, 'wheels', motion, 'angle_left', 'angle_right',
                               side - value['wheels_late'])
                         for side in (-half, half))
        found['wheels'] = (after - before) / (2.0 * half)
    if 'imu' in drive.bins:
        rate, _, _, along, across = _read(base, drive, 'imu', motion, 'yaw', 'accel_y',
                                          -value['imu_late']).T
        turning = np.gradient(rate, base.settings.bins['yaw'])
        # Of the IMU from the centre of mass, whose acceleration is simulated.
        ahead, aside = value['imu_x'] - value['com_x'], -value['com_y']
        found['imu'] = np.column_stack([
            value['gyro_factor'] * rate + value['gyro_bias'],
            along - ahead * rate ** 2 - aside * turning + value['accel_bias_x'],
            across + ahead * turning - aside * rate ** 2 + value['accel_bias_y']])
    if 'pose' in drive.bins:
        bins = drive.bins['pose']
        found['pose'] = movements(_read(base, drive, 'pose', motion, 'x', 'heading',
                                        -value['pose_late']))
        if drive.gyro.size:
            found['pose'][:, 2] = _turn_by_gyro(drive, bins, value)
    return found


def _turn_by_gyro(drive: Drive, bins: Bins, value: Mapping[str, float]) -> FloatArray:
    # A relation of two sensors, linear in the gyro's factor and offset: what the gyro has turned
    # is to be the factor times what the pose has. No error of the robot's model can enter.
    times = bins.times - value['pose_late'] + value['imu_late']
    turned = np.diff(bins.mean(np.interp(times, drive.gyro[:, 0], drive.gyro[:, 1])))
    pose = np.diff(bins.values[:, 2])
    less = turned - value['gyro_factor'] * pose - value['gyro_bias'] * np.diff(bins.mean(times))
    return np.asarray(pose - less)


def measured(base: Base, drive: Drive) -> dict[str, FloatArray]:
    """Return what each stream's bins read."""
    found = {name: bins.values for name, bins in drive.bins.items()
             if name != 'pose' and not (base.given and name == 'wheels')}
    if 'pose' in drive.bins:
        found['pose'] = movements(drive.bins['pose'].values)
    return found


def residual(base: Base, drive: Drive, z: FloatArray) -> dict[str, FloatArray]:
    """Return measured less predicted, by stream; `z` on the scale of the estimates."""
    x = base.values(z)
    there = measured(base, drive)
    should = predicted(base, drive, x, moved(base, drive, x))
    return {name: there[name] - should[name] for name in should}


def jacobian(base: Base, drive: Drive, z: FloatArray, free: NDArray[np.bool_]
             ) -> tuple[Mapping[str, FloatArray], Mapping[str, FloatArray]]:
    """
    Return the residual and its difference quotients, by stream.

    Parameters
    ----------
    base : Base
    drive : Drive
    z : numpy.ndarray, shape (n,)
        On the scale of the estimates.
    free : numpy.ndarray of bool, shape (n,)
        Which columns to work out; the others are zero.

    Returns
    -------
    mapping of str to numpy.ndarray
        Residual, shape (n_bins, n_channels).
    mapping of str to numpy.ndarray
        Its derivatives, shape (n_bins, n_channels, n); zero where the simulation breaks down a
        step away.
    """
    x = base.values(z)
    motion = moved(base, drive, x)
    there, should = measured(base, drive), predicted(base, drive, x, motion)
    columns = {name: np.zeros((*rows.shape, z.size)) for name, rows in should.items()}
    upper = base.bounds()[1]
    moving = {*ROBOT, 'wheels_late' if base.given else 'dead_time'}
    for k, quantity in enumerate(base.settings.quantities):
        if not free[k]:
            continue
        delta = quantity.delta if z[k] + quantity.delta <= upper[k] else -quantity.delta
        near = np.array(z)
        near[k] += delta
        changed = base.values(near)
        path = moved(base, drive, changed) if quantity.name in moving else motion
        other = predicted(base, drive, changed, path)
        diverged = base.settings.simulation['diverged']
        if all(np.all(np.abs(rows) < diverged) for rows in other.values()):
            for name, rows in other.items():
                columns[name][:, :, k] = (should[name] - rows) / delta
    return {name: there[name] - should[name] for name in should}, columns
