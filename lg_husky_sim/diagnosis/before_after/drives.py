# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings as what is compared with the base: samples averaged in bins."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from lg_husky_sim.recording import Recording, segments
from lg_husky_sim.recording.recording import CHANNELS
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Bins:
    """
    The samples of one stream in bins of time.

    Parameters
    ----------
    times : numpy.ndarray, shape (n_samples,)
        Stamps of those that lie in a bin that is kept [s].
    edges : numpy.ndarray, shape (n_bins,)
        Index of each bin's first sample.
    values : numpy.ndarray, shape (n_bins, n_channels)
        Means of what was measured.

    """

    times: FloatArray
    edges: NDArray[np.intp]
    values: FloatArray

    def mean(self, samples: FloatArray) -> FloatArray:
        """Return the means over the bins of values at `times` along the first axis."""
        counts = np.diff(np.append(self.edges, self.times.size))
        sums = np.add.reduceat(samples, self.edges, axis=0)
        return np.asarray(sums / counts.reshape((-1,) + (1,) * (samples.ndim - 1)))

    def centres(self) -> FloatArray:
        """Return the mean stamps of the bins [s]."""
        return self.mean(self.times)


@dataclass(frozen=True, eq=False)
class Drive:
    """
    A stretch of a recording, ready to be predicted.

    Parameters
    ----------
    recording : str
    start : float
        Of the simulation [s].
    steps : int
        Of the simulation.
    command : TimeSeries
        Each held until the next.
    level : numpy.ndarray, shape (steps, 2)
        Cosine and sine of the measured heading; zeros without a pose.
    wheels : TimeSeries
        Measured rates; empty without them.
    begin : numpy.ndarray, shape (5,)
        Speeds at the start: forward, lateral, yaw, wheels.
    bins : mapping of str to Bins
        By stream: wheels, imu, pose.
    gyro : numpy.ndarray, shape (n, 2)
        Stamps [s] and the integral of the yaw rate to each [rad]; none without an IMU.
    vigour : mapping of str to numpy.ndarray, shape (n_rows, 2)
        By stream, in each bin or from one to the next (pose): squares of the yaw rate [(rad/s)^2]
        and of the acceleration of the wheels [(rad/s^2)^2], as measured about that time; NaN while
        nothing has been asked for.

    """

    recording: str
    start: float
    steps: int
    command: TimeSeries
    level: FloatArray
    wheels: TimeSeries
    begin: FloatArray
    bins: Mapping[str, Bins]
    gyro: FloatArray
    vigour: Mapping[str, FloatArray]

    def largest_command(self, column: int) -> float:
        """Return the largest command forward or in yaw (0 or 1), of either sign [m/s, rad/s]."""
        return float(np.max(np.abs(self.command.values[:, column])))


def _binned(times: FloatArray, values: FloatArray, start: float, width: float) -> Bins:
    width = max(width, float(np.median(np.diff(times)))) if times.size > 1 else width
    index = np.floor((times - start) / width).astype(np.intp)
    _, counts = np.unique(index, return_counts=True)
    enough = counts >= 0.5 * np.median(counts)
    keep = np.repeat(enough, counts)
    edges = np.concatenate([[0], np.cumsum(counts[enough])[:-1]]).astype(np.intp)
    bins = Bins(times[keep], edges, np.zeros((0, 0)))
    return Bins(bins.times, bins.edges, bins.mean(values[keep]))


def drives(recording: Recording, step: float, widths: Mapping[str, float], settle: float,
           shortest: float, early: float = 0.0) -> tuple[Drive, ...]:
    """
    Cut a recording at its gaps and bin its samples.

    Parameters
    ----------
    recording : Recording
        With commands, and at least one of wheels, imu and pose.
    step : float
        Of the simulation [s].
    widths : mapping of str to float
        Width of a bin of each kind of channel [s].
    settle : float
        Left out at the start of each stretch, whose state is not known [s].
    shortest : float
        Shortest stretch that is used [s].
    early : float
        Left out at the end of each stretch, by as much as a stream may be early [s].

    Returns
    -------
    tuple of Drive

    """
    recording.stream('command')
    if not {'wheels', 'imu', 'pose'} & set(recording.streams):
        recording.stream('wheels')  # says what it has
    found = []
    for part in segments(recording):
        if part.duration < shortest:
            continue
        found.append(_drive(part.recording, part.start, part.end, part.streams, step, widths,
                            settle, early))
    return tuple(found)


def _drive(name: str, start: float, end: float, streams: Mapping[str, TimeSeries], step: float,
           widths: Mapping[str, float], settle: float, early: float) -> Drive:
    steps = int(np.floor((end - start) / step))
    middle = start + step * (np.arange(steps) + 0.5)
    command = streams['command']
    level = np.zeros((steps, 2))
    bins: dict[str, Bins] = {}

    def binned(stream: str, values: FloatArray, kind: str) -> None:
        times = streams[stream].times
        kept = (times >= start + settle) & (times <= end - early)
        bins[stream] = _binned(times[kept], values[kept], start, widths[kind])

    begin = np.zeros(5)
    gyro = np.zeros((0, 2))
    wheels = TimeSeries(np.zeros(0), np.zeros((0, 2)), CHANNELS['wheels'])
    if 'wheels' in streams:
        wheels = streams['wheels']
        binned('wheels', wheels.values, 'wheels')
        begin[3:] = np.median(wheels.values[:5], axis=0)
    if 'imu' in streams:
        binned('imu', streams['imu'].values, 'yaw')
        begin[2] = float(np.median(streams['imu'].values[:5, 0]))
        stamps, rate = streams['imu'].times, streams['imu'].values[:, 0]
        gyro = np.column_stack([stamps, np.concatenate([[0.0], np.cumsum(
            0.5 * np.diff(stamps) * (rate[1:] + rate[:-1]))])])
    if 'pose' in streams:
        pose = streams['pose']
        heading = np.unwrap(pose.values[:, 2])
        binned('pose', np.column_stack([pose.values[:, :2], heading]), 'place')
        at = np.interp(middle, pose.times, heading)
        level = np.column_stack([np.cos(at), np.sin(at)])
    return Drive(name, start, steps, command, level, wheels, begin, bins, gyro,
                 _vigour(bins, max(widths.values()), command, settle))


def _vigour(bins: Mapping[str, Bins], reach: float, command: TimeSeries, settle: float
            ) -> dict[str, FloatArray]:
    # By gyro or else the pose or the wheels; by wheels or else by changes of the yaw rate.
    centres = {name: one.centres() for name, one in bins.items()}

    def changing(name: str, values: FloatArray) -> FloatArray:
        # A single bin does not change.
        return np.asarray(np.gradient(values, centres[name], axis=0)) if (
            values.shape[0] > 1) else np.zeros(values.shape)
    if 'imu' in bins:
        source, turning = 'imu', bins['imu'].values[:, 0]
    elif 'pose' in bins:
        source, turning = 'pose', changing('pose', bins['pose'].values[:, 2])
    else:
        source, turning = 'wheels', np.diff(bins['wheels'].values, axis=1)[:, 0]
    stamps = centres[source]
    hurry = stamps, changing(source, turning)
    if 'wheels' in bins:
        hurry = centres['wheels'], np.max(np.abs(changing('wheels', bins['wheels'].values)),
                                          axis=1)

    def about(at: FloatArray, times: FloatArray, values: FloatArray) -> FloatArray:
        # Mean square over the widest bin to either side.
        total = np.concatenate([[0.0], np.cumsum(values ** 2)])
        first = np.minimum(np.searchsorted(times, at - reach), times.size - 1)
        last = np.maximum(np.searchsorted(times, at + reach), first + 1)
        return np.asarray((total[last] - total[first]) / (last - first))
    found = {}
    for name, at in centres.items():
        rows = 0.5 * (at[1:] + at[:-1]) if name == 'pose' else at
        found[name] = np.column_stack([about(rows, stamps, turning), about(rows, *hurry)])
        asked = np.concatenate([[0], np.cumsum(np.any(command.values != 0.0, axis=1))])
        first, last = (np.searchsorted(command.times, rows - ago, side='right')
                       for ago in (settle, 0.0))
        found[name][asked[last] == asked[np.maximum(first - 1, 0)]] = np.nan
    return found


def all_drives(recordings: Sequence[Recording], step: float, widths: Mapping[str, float],
               settle: float, shortest: float, early: float = 0.0) -> tuple[Drive, ...]:
    """Return the drives of several recordings, in order."""
    return tuple(d for r in recordings
                 for d in drives(r, step, widths, settle, shortest, early))
