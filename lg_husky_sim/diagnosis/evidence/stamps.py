# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Stamps that jitter while the sensor reads at even times: which of both, the likelihood says.

A stamp is given when a message is made or received, on a busy computer milliseconds after the
reading. Where commands and readings keep step with each other, each reading of a drive lies at the
same phase of a command, before or behind the bend of the rates at it: an error of the stamp across
the bend does not vanish on the mean, and looks like a delay in this drive alone. A number t_k of
a series of even readings is ``a + b n_k`` with whole n_k, slowly drifting; what t_k deviates from
that by is the jitter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from lg_husky_sim.diagnosis.evidence.drives import Channel, Drive, smoothed
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, evidence_of, Fit
from lg_husky_sim.diagnosis.evidence.point import Point
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Streams by the field of their stamps: unknown of their delay, channels that they are read by.
STREAMS = {'wheel_times': ('delay_wheels', (Channel.WHEEL_LEFT, Channel.WHEEL_RIGHT,
                                            Channel.ANGLE_LEFT, Channel.ANGLE_RIGHT)),
           'imu_times': ('delay_imu', (Channel.YAW_RATE,)),
           'pose_times': ('delay_pose', (Channel.X, Channel.Y, Channel.HEADING))}


def evened(times: FloatArray) -> FloatArray:
    """
    Return the even times that stamps deviate from.

    Parameters
    ----------
    times : numpy.ndarray, shape (n,)
        Rising [s]; messages may be missing.

    Returns
    -------
    numpy.ndarray, shape (n,)
        As they are where they do not tell which of an even series each is, or are even enough.

    """
    if times.size < int(setting('stamps_even')):
        return times
    number = np.cumsum(np.round(np.diff(times, prepend=times[0]) / np.median(np.diff(times))))
    period = float(np.polyfit(number, times, 1)[0])
    for _ in range(3):
        number = _numbers(times, period)
        period = float(np.polyfit(number, times, 1)[0])
    drift = smoothed(period * number, times - period * number, setting('stamp_drift'))
    even = period * number + drift
    # Beyond half a period a stamp might be its neighbour's.
    sure = float(np.max(np.abs(times - even))) < 0.5 * period and np.all(np.diff(even) > 0.0)
    return even if sure and np.std(times - even) > setting('stamp_digit') else times


def _numbers(times: FloatArray, period: float) -> FloatArray:
    # Of the stamps in an even series, which is followed (a phase-locked loop).
    found, even, number = np.zeros(times.size), float(times[0]), 0.0
    slowest = 1.0 / setting('stamps_even')
    for k, time in enumerate(times[1:].tolist(), 1):
        steps = max(1.0, round((time - even) / period))
        even += steps * period
        even += max(slowest, 1.0 / (k + 1.0)) * (time - even)
        number += steps
        found[k] = number
    return found


def _restamped(drive: Drive, stream: str) -> Drive:
    own = {'wheel_times': drive.wheel_times, 'imu_times': drive.imu_times,
           'pose_times': drive.pose_times}
    times = evened(own[stream])
    if times is own[stream]:
        return drive
    jitter = float(np.std(own[stream] - times))
    own[stream] = times
    every = np.array(drive.times)
    for channel in STREAMS[stream][1]:
        part = drive.slice_of(channel)
        if part.stop > part.start:
            every[part] = times
    return replace(drive, times=every, wheel_times=own['wheel_times'],
                   imu_times=own['imu_times'], pose_times=own['pose_times'],
                   jitter={**drive.jitter, stream: jitter})


def likeliest_stamps(evidence: Evidence, fit: Fit) -> tuple[Evidence, Point]:
    """
    Return evidence with even stamps for the streams where they are likelier than the logged ones.

    Parameters
    ----------
    evidence : Evidence
        With the stamps as they were logged.
    fit : Fit
        Made under this evidence.

    Returns
    -------
    Evidence
        The same noise; the given one where no stream is read more evenly than it is stamped.
    Point
        Of the fit, with the delays of these streams.

    """
    best, point = evidence, fit.point
    for stream, (delay, _) in STREAMS.items():
        drives = [_restamped(drive, stream) for drive in best.drives]
        moved = [getattr(a, stream) - getattr(b, stream)
                 for a, b in zip(drives, best.drives, strict=True) if a is not b]
        if not moved:
            continue
        jitter = float(np.std(np.concatenate(moved)))
        logged = _read_at(best.drives, best, point, delay, jitter)
        even = _read_at(drives, best, point, delay, jitter)
        if even[0] < logged[0] - setting('reading_gain'):
            _, best, point = even
    return best, point


def _read_at(drives: Sequence[Drive], evidence: Evidence, point: Point, delay: str, jitter: float
             ) -> tuple[float, Evidence, Point]:
    # Surprise, evidence and point at the likeliest of some delays: the bend at a command hides it
    # from a derivative.
    other = evidence_of(drives, evidence.names, point, evidence.noise, evidence.pool)
    place = [u.name for u in point.unknowns].index(delay)

    def at(times: float) -> tuple[float, Point]:
        places = np.array(point.places)
        places[place] += times * jitter
        shifted = point.at(places)
        return other.surprise_at(shifted), shifted
    surprise, best = min((at(times) for times in (0.0, 1.0, -1.0, 2.0, -2.0)),
                         key=lambda one: one[0])
    return surprise, other, best
