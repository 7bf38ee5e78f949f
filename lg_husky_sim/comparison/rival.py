# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Another simulator's recording of the same drive, as if it were a prediction.

Any recording can stand here: a run of a physics engine under the same commands (the paper's
Gazebo), or the robot itself on another day.
"""

from __future__ import annotations

from lg_husky_sim.comparison.replay import PERIOD
from lg_husky_sim.comparison.slopes import body_rates, local_fit
from lg_husky_sim.errors import RecordingError
from lg_husky_sim.recording import Recording, Segment
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np

COLUMNS = ('wheel_left', 'wheel_right', 'forward', 'yaw_rate', 'accel_x', 'heading', 'x', 'y')


def rival_prediction(rival: Recording, recording: Recording, segment: Segment) -> TimeSeries:
    """
    Put a rival's recording on a segment's clock and at its starting pose.

    Where both were stamped by one clock (the bags overlap in time) the stamps are taken as they
    are; otherwise the first commands of both are taken as one moment.

    Parameters
    ----------
    rival : Recording
        Of the same drive, by another simulator or on another day.
    recording : Recording
        The one that the segment belongs to.
    segment : Segment
        Stretch of the recording that the prediction is for.

    Returns
    -------
    TimeSeries
        Columns wheel_left, wheel_right, forward, yaw_rate, accel_x, heading, x, y over the
        segment; NaN where the rival recorded nothing. The pose is turned and moved so that the
        rival starts the segment where the robot did.

    Raises
    ------
    RecordingError
        If the rival recorded nothing during the segment.

    """
    shift = clock_shift(rival, recording)
    count = int(np.floor((segment.end - segment.start) / PERIOD)) + 2
    times: FloatArray = segment.start + PERIOD * np.arange(count, dtype=np.float64)
    columns = {name: np.full(count, np.nan) for name in COLUMNS}

    def put(name: str, series: TimeSeries, channel: str) -> None:
        columns[name] = np.interp(times, series.times + shift, series.column(channel),
                                  left=np.nan, right=np.nan)
    streams = rival.streams
    if 'wheels' in streams:
        put('wheel_left', streams['wheels'], 'left')
        put('wheel_right', streams['wheels'], 'right')
    if 'pose' in streams:
        rates = body_rates(streams['pose'])
        if len(rates):
            put('forward', rates, 'forward')
            put('yaw_rate', rates, 'yaw_rate')
        for name in ('x', 'y', 'heading'):
            put(name, streams['pose'], name)
        _start_together(columns, segment)
    if 'imu' in streams:
        put('yaw_rate', streams['imu'], 'yaw_rate')
        put('accel_x', streams['imu'], 'accel_x')
    values = np.column_stack([columns[name] for name in COLUMNS])
    if not np.any(np.isfinite(values)):
        raise RecordingError(
            f'rival {rival.path} recorded nothing between {segment.start:.1f} s and '
            f'{segment.end:.1f} s of {recording.name}')
    return TimeSeries(times, values, COLUMNS)


def clock_shift(rival: Recording, recording: Recording) -> float:
    """
    Return what to add to a rival's times [s] to have them on the recording's clock.

    Raises
    ------
    RecordingError
        If the clocks differ and one of the two has no commands to align them by.

    """
    absolute = (rival.start_ns - recording.start_ns) * 1e-9
    if -rival.duration < absolute < recording.duration:
        return absolute
    first = []
    for each in (recording, rival):
        command = each.stream('command')
        moving = np.flatnonzero(np.any(command.values != 0.0, axis=1))
        first.append(float(command.times[moving[0] if moving.size else 0]))
    return first[0] - first[1]


def _start_together(columns: dict[str, FloatArray], segment: Segment) -> None:
    """Turn and move the rival's pose onto the measured one at the segment's start."""
    if 'pose' not in segment.streams:
        return
    known = np.flatnonzero(np.isfinite(columns['x']))
    if not known.size:
        return
    k = int(known[0])
    time = segment.start + PERIOD * k
    wanted, _ = local_fit(segment.streams['pose'], time, 0.4, ahead=True)
    turn = float(wanted[2] - columns['heading'][k])
    dx, dy = columns['x'] - columns['x'][k], columns['y'] - columns['y'][k]
    columns['x'] = wanted[0] + np.cos(turn) * dx - np.sin(turn) * dy
    columns['y'] = wanted[1] + np.sin(turn) * dx + np.cos(turn) * dy
    columns['heading'] = columns['heading'] + turn
