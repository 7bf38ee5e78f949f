# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What the base predicts for a drive, in bins, and how that depends on its parameters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from lg_husky_sim.diagnosis.before_after.base import Base
from lg_husky_sim.diagnosis.before_after.base_names import OUTPUTS, ROBOT
from lg_husky_sim.diagnosis.before_after.drives import Bins, Drive
from lg_husky_sim.diagnosis.before_after.means import mean_in_bins
from lg_husky_sim.diagnosis.before_after.motion import distinct, Memory, moved, side_by_side
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np
from numpy.typing import NDArray

#: Channels by stream; those of the pose are movements from one bin to the next, in the frame of
#: the middle between them.
CHANNELS = {'wheels': ('left', 'right'), 'imu': ('yaw', 'accel_x', 'accel_y'),
            'pose': ('ahead', 'aside', 'turn')}
#: First of the outputs that go on where a simulation ends, as rates do not.
PLACES = ('x', 'angle_left')
#: Their kinds in ``config/before_after.yaml``.
KINDS = {'left': 'wheels', 'right': 'wheels', 'yaw': 'yaw', 'accel_x': 'accel',
         'accel_y': 'accel', 'ahead': 'place', 'aside': 'place', 'turn': 'heading'}


def _read(base: Base, drive: Drive, stream: str, motion: FloatArray, first: str, last: str,
          later: FloatArray) -> FloatArray:
    # Means in the bins of a stream, of the outputs from the first to the last, for each robot:
    # of its lane, or of the only one.
    bins, begin, lanes = drive.bins[stream], OUTPUTS.index(first), motion.shape[2]
    times, which = distinct(later[:, None])
    found = np.empty((len(times), bins.edges.size, OUTPUTS.index(last) + 1 - begin, lanes))
    for (one,), out in zip(times, found, strict=True):
        mean_in_bins(motion, begin, drive.start, base.settings.simulation['step'], bins.times,
                     bins.edges, one, first in PLACES, out)
    lane = np.minimum(np.arange(later.size), lanes - 1)
    return np.moveaxis(found[which, :, :, lane], 0, -1)


def movements(path: FloatArray) -> FloatArray:
    """
    Return the movement between bins in the frame of their mean heading.

    Parameters
    ----------
    path : numpy.ndarray, shape (n, 3, ...)
        x, y and heading.

    Returns
    -------
    numpy.ndarray, shape (n - 1, 3, ...)

    """
    step = np.diff(path, axis=0)
    heading = 0.5 * (path[1:, 2] + path[:-1, 2])
    cos, sin = np.cos(heading), np.sin(heading)
    return np.stack([cos * step[:, 0] + sin * step[:, 1],
                     cos * step[:, 1] - sin * step[:, 0], step[:, 2]], axis=1)


def predicted(base: Base, drive: Drive, robots: FloatArray, motion: FloatArray
              ) -> dict[str, FloatArray]:
    """
    Return what the bins of each stream should read of some robots.

    Parameters
    ----------
    base : Base
        Says how wide bins are, and whether the wheels turn as measured.
    drive : Drive
        Its bins are predicted.
    robots : numpy.ndarray, shape (m, n)
        Their parameters, in units.
    motion : numpy.ndarray, shape (n_steps + 1, n_outputs, n_lanes)
        As of :func:`moved`; of one robot, if the others only differ by how they are read.

    Returns
    -------
    dict of str to numpy.ndarray
        By stream, shape (n_bins, n_channels, m).

    """
    value = dict(zip(base.names, robots.T, strict=True))
    found = {}
    if not base.given and 'wheels' in drive.bins:
        half = 0.5 * value['wheels_window']
        before, after = (_read(base, drive, 'wheels', motion, 'angle_left', 'angle_right',
                               side - value['wheels_late'])
                         for side in (-half, half))
        found['wheels'] = (after - before) / (2.0 * half)
    if 'imu' in drive.bins:
        rows = _read(base, drive, 'imu', motion, 'yaw', 'accel_y', -value['imu_late'])
        rate, along, across = rows[:, 0], rows[:, 3], rows[:, 4]
        turning = np.gradient(rate, base.settings.bins['yaw'], axis=0)
        # Of the IMU from the centre of mass, whose acceleration is simulated.
        ahead, aside = value['imu_x'] - value['com_x'], -value['com_y']
        found['imu'] = np.stack([
            value['gyro_factor'] * rate + value['gyro_bias'],
            along - ahead * rate ** 2 - aside * turning + value['accel_bias_x'],
            across + ahead * turning - aside * rate ** 2 + value['accel_bias_y']], axis=1)
    if 'pose' in drive.bins:
        found['pose'] = movements(_read(base, drive, 'pose', motion, 'x', 'heading',
                                        -value['pose_late']))
        if drive.gyro.size:
            found['pose'][:, 2] = _turn_by_gyro(drive, drive.bins['pose'], value)
    return found


def _turn_by_gyro(drive: Drive, bins: Bins, value: Mapping[str, FloatArray]) -> FloatArray:
    # A relation of two sensors, linear in the gyro's factor and offset: what the gyro has turned
    # is to be the factor times what the pose has. No error of the robot's model can enter. Most
    # robots' are the same.
    pose = np.diff(bins.values[:, 2])
    rows, which = distinct(np.column_stack([value[name] for name in (
        'pose_late', 'imu_late', 'gyro_factor', 'gyro_bias')]))
    found = []
    for pose_late, imu_late, factor, bias in rows:
        times = bins.times - pose_late + imu_late
        turned = np.diff(bins.mean(np.interp(times, drive.gyro[:, 0], drive.gyro[:, 1])))
        found.append(pose - (turned - factor * pose - bias * np.diff(bins.mean(times))))
    return np.asarray(np.column_stack(found)[:, which])


def measured(base: Base, drive: Drive) -> dict[str, FloatArray]:
    """Return what each stream's bins read."""
    found = {name: bins.values for name, bins in drive.bins.items()
             if name != 'pose' and not (base.given and name == 'wheels')}
    if 'pose' in drive.bins:
        found['pose'] = movements(drive.bins['pose'].values)
    return found


_MEMORY = Memory()


def _several(base: Base, drive: Drive, robots: Sequence[FloatArray],
             commands: Sequence[TimeSeries] = ()
             ) -> Iterator[tuple[FloatArray, dict[str, FloatArray]]]:
    # Motion and prediction of as many robots at a time as go together.
    for first in range(0, len(robots), side_by_side(base)):
        together = slice(first, first + side_by_side(base))
        some = np.array(robots[together])
        motion = moved(base, drive, some, _MEMORY, commands[together])
        yield motion, predicted(base, drive, some, motion)


def residuals(base: Base, drive: Drive, places: Sequence[FloatArray],
              commands: Sequence[TimeSeries] = ()) -> list[dict[str, FloatArray]]:
    """
    Return measured less predicted at each of some places.

    Parameters
    ----------
    base : Base
        Robot, with the scale of its parameters.
    drive : Drive
        Its bins are what was measured.
    places : sequence of numpy.ndarray, shape (n,)
        On the scale of the estimates.
    commands : sequence of TimeSeries
        What the robot is sent at each of them, if not what the drive holds.

    Returns
    -------
    list of dict of str to numpy.ndarray
        By stream, shape (n_bins, n_channels).

    """
    there = measured(base, drive)
    return [{name: there[name] - rows[..., k] for name, rows in should.items()}
            for _, should in _several(base, drive, [base.values(z) for z in places], commands)
            for k in range(next(iter(should.values())).shape[-1])]


def residual(base: Base, drive: Drive, z: FloatArray) -> dict[str, FloatArray]:
    """Return measured less predicted, by stream; `z` on the scale of the estimates."""
    return residuals(base, drive, [z])[0]


def jacobian(base: Base, drive: Drive, z: FloatArray, free: NDArray[np.bool_]
             ) -> tuple[Mapping[str, FloatArray], Mapping[str, FloatArray]]:
    """
    Return the residual and its difference quotients, by stream.

    A robot whose commands act later by some time moves later by as much, and so do its streams
    read; one whose wheels are read later has turned them earlier. So the dead time (or, at the
    measured wheel rates, their delay) has the column of the delays of all streams, in each its
    own. By a quotient of its own it would have nearly the same, and which of equal changes (an IMU
    that is late, or wheels and commands that are early) is likelier would be a matter of rounding.

    Parameters
    ----------
    base : Base
        Robot, with the step of each difference quotient.
    drive : Drive
        Its bins are what was measured.
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
    quantities, upper = base.settings.quantities, base.bounds()[1]
    deltas = np.array([q.delta if place + q.delta <= most else -q.delta
                       for q, place, most in zip(quantities, z, upper, strict=True)])
    late = {stream: base.names.index(f'{stream}_late') for stream in CHANNELS}
    clock = base.names.index('wheels_late' if base.given else 'dead_time')
    near = {k: base.values(z + deltas[k] * (np.arange(z.size) == k))
            for k in sorted({*np.flatnonzero(free), *late.values()} - {clock})}
    moves = [k for k in near if quantities[k].name in ROBOT]
    reads = [k for k in near if quantities[k].name not in ROBOT]
    there, x = measured(base, drive), base.values(z)
    columns = {name: np.zeros((*rows.shape, z.size)) for name, rows in there.items()}
    diverged = base.settings.simulation['diverged']
    should: dict[str, FloatArray] = {}

    def fill(ks: Sequence[int], others: Mapping[str, FloatArray]) -> None:
        fine = np.all([np.all(np.abs(rows) < diverged, axis=(0, 1)) for rows in others.values()],
                      axis=0)
        own = np.array(ks)[fine]
        for name, rows in others.items():
            columns[name][:, :, own] = (should[name][..., None] - rows[..., fine]) / deltas[own]
    done = 0
    for motion, others in _several(base, drive, [x, *(near[k] for k in moves)]):
        if not should:
            should = {name: rows[..., 0] for name, rows in others.items()}
            others = {name: rows[..., 1:] for name, rows in others.items()}
            if reads:
                fill(reads, predicted(base, drive, np.array([near[k] for k in reads]),
                                      np.ascontiguousarray(motion[:, :, :1])))
        count = next(iter(others.values())).shape[-1]
        fill(moves[done:done + count], others)
        done += count
    for stream, column in columns.items():
        column[:, :, clock] = (-1.0 if base.given else 1.0) * column[:, :, late[stream]]
        if stream == 'pose' and drive.gyro.size:
            column[:, 2, clock] = 0.0
        column[:, :, ~free] = 0.0
    return {name: there[name] - should[name] for name in should}, columns
