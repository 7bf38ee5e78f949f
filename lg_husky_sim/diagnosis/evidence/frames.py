# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What the whitener needs of a drive and does not depend on the noise."""

from __future__ import annotations

from dataclasses import dataclass

from lg_husky_sim.diagnosis.evidence.drives import Channel, Drive
from lg_husky_sim.diagnosis.evidence.observation import command_lag, Motion, probe_times
from lg_husky_sim.diagnosis.evidence.reading import Reading, wheel_lag
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import FloatArray
import numpy as np


@dataclass(frozen=True, eq=False)
class Frame:
    """
    What the whitener needs of a drive and does not depend on the noise.

    Parameters
    ----------
    drive : Drive
    times : numpy.ndarray, shape (n,)
        When each reading was true [s].
    order : numpy.ndarray of int, shape (n,)
        Readings in the order of time.
    cosine, sine : numpy.ndarray, shape (n,)
        Direction of the base at each reading.
    slopes : numpy.ndarray, shape (n,)
        Rate of change of each reading [its unit/s].
    kicks : numpy.ndarray, shape (n_kicks, 6)
        Times of commands [s], variances of the wheels' rates where one seems lost [(rad/s)²],
        steps of the voltages [V], and how far from its time a step may come [s].

    """

    drive: Drive
    times: FloatArray
    order: np.typing.NDArray[np.int64]
    cosine: FloatArray
    sine: FloatArray
    slopes: FloatArray
    kicks: FloatArray


def frame_of(drive: Drive, plant: Plant, motion: Motion, predicted: FloatArray,
             reading: Reading, reach: float) -> Frame:
    """
    Return the frame of a drive, from a simulation of it.

    Parameters
    ----------
    drive : Drive
        Whose readings are to be whitened.
    plant : Plant
        Whose command stage makes voltages of commands.
    motion : Motion
        A simulation of the drive that was looked at by the probe, too.
    predicted : numpy.ndarray, shape (n,)
        Observed of the motion.
    reading : Reading
        How the log was made: its delays and the windows of its rates.
    reach : float
        How much earlier or later than on the mean a command may come [s].

    """
    times = np.array(drive.times)
    lag = wheel_lag(reading, drive.wheel_period)
    is_wheel = drive.channels <= int(Channel.WHEEL_RIGHT)
    times[is_wheel] -= lag
    np.clip(times, drive.start, None, out=times)
    heading = (np.interp(times, drive.pose_times, drive.heading) if drive.pose_times.size else
               np.interp(times, probe_times(drive), motion.column('heading', 'probe')))
    slopes = np.zeros(times.size)
    for channel in Channel:
        part = drive.slice_of(channel)
        if part.stop - part.start > 3:
            slopes[part] = _slopes(drive.times[part], predicted[part])
    late = command_lag(drive, reading) + plant.sets[0].command.latency
    kicks = np.vstack([_lost_commands(drive, motion, late), _steps(drive, plant, late, reach)])
    # In the order in which they have come for sure: one that is at its time waits for no other.
    kicks = kicks[np.argsort(kicks[:, 0] + kicks[:, 5], kind='stable')]
    order = np.argsort(times, kind='stable')
    return Frame(drive, times, order, np.cos(heading), np.sin(heading), slopes, kicks)


def _slopes(times: FloatArray, values: FloatArray) -> FloatArray:
    # Backward over one interval: what a wheel has done before its stamp; forward at the first.
    span = np.maximum(np.diff(times), 1e-4)
    rate = np.diff(values) / span
    slopes = np.concatenate([rate[:1], rate])
    # A step between two stamps counts at both of them.
    slopes[:-1] = np.where(np.abs(rate) > np.abs(slopes[:-1]), rate, slopes[:-1])
    return slopes


def _lost_commands(drive: Drive, motion: Motion, late: float) -> FloatArray:
    # Where a command seems lost: when it would have acted and when the next one did, so late,
    # with half of the step of the wheels' rates, squared.
    stamps = drive.commands.times
    found = []
    if stamps.size > 3:
        gaps = np.diff(stamps)
        usual = float(np.median(gaps))
        for place in np.flatnonzero((gaps > setting('lost_gap') * usual)
                                    & (gaps < setting('pause') * usual)):
            begin, end = stamps[place] + 0.5 * usual + late, stamps[place + 1] + late
            steps = []
            for side in ('left', 'right'):
                before, after = np.interp([begin, end + usual], probe_times(drive),
                                          motion.column(f'wheel_{side}', 'probe'))
                steps.append((0.5 * (after - before)) ** 2)
            found += [[begin, *steps, 0.0, 0.0, 0.0], [end, *steps, 0.0, 0.0, 0.0]]
    return np.array(found).reshape(-1, 6)


def _steps(drive: Drive, plant: Plant, late: float, reach: float) -> FloatArray:
    # Steps of the voltages at the commands, where the command stage puts them.
    stage = plant.sets[0].command
    values = drive.commands.values
    if not len(values):
        return np.zeros((0, 6))
    forward = stage.volts_per_speed * np.clip(
        values[:, 0], -stage.limit_forward, stage.limit_forward)
    turn = stage.volts_per_rate * np.clip(values[:, 1], -stage.limit_yaw, stage.limit_yaw)
    steps = np.diff(np.column_stack([forward - turn, forward + turn]), axis=0)
    times = drive.commands.times[1:] + late
    moved = np.any(steps != 0.0, axis=1)
    return np.column_stack([times, np.zeros((times.size, 2)), steps,
                            np.full(times.size, reach)])[moved]
