# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Runs of NorLab's DRIVE data set as streams.

Raw runs (``raw_dataframe.pkl``) are rows at 20 Hz in which slower sensors repeat their last
value; a value counts as measured where it changes. Processed runs (``torch_ready_dataframe.pkl``)
are windows of 2 s in frames of their own; their poses are chained.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
import os
from typing import Any

from lg_husky_sim.errors import RecordingError, SettingsError
from lg_husky_sim.evaluation.data_frame import numbers, read_columns
from lg_husky_sim.resources import config_path
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.yaml_files import shown
import numpy as np
from numpy.typing import NDArray
import yaml

#: A value that stays the same for longer is taken as measured again [s].
HELD = 0.3
#: Time zero of a run without dates [ns].
EPOCH = 1_700_000_000_000_000_000


@dataclass(frozen=True, eq=False)
class DriveRun:
    """
    One run.

    Parameters
    ----------
    streams : mapping of str to TimeSeries
        As :func:`lg_husky_sim.recording.write_recording` takes them.
    start_ns : int
        Time zero [ns].

    """

    streams: Mapping[str, TimeSeries]
    start_ns: int


@cache
def drive_config() -> Mapping[str, Any]:
    """
    Return the content of ``config/drive.yaml``.

    Raises
    ------
    SettingsError
        If the file is of another schema.

    """
    path = config_path('drive.yaml')
    data = yaml.safe_load(path.read_text(encoding='utf-8'))
    if not isinstance(data, dict) or data.get('schema') != 'lg_husky_sim/drive/1':
        raise SettingsError(f'{path}: schema is not lg_husky_sim/drive/1')
    return data


def read_drive(path: str | os.PathLike[str], robot: str = 'husky') -> DriveRun:
    """
    Read a run, raw or processed.

    Parameters
    ----------
    path : path-like
        ``raw_dataframe.pkl`` or ``torch_ready_dataframe.pkl``.
    robot : str
        ``husky`` or ``warthog``: its sizes turn wheel rates back into commands.

    Returns
    -------
    DriveRun

    Raises
    ------
    RecordingError
        If it is neither.
    SettingsError
        If the robot is unknown.

    """
    robots = drive_config()['robots']
    if robot not in robots:
        raise SettingsError(f'no robot {robot!r} in drive.yaml (there are {", ".join(robots)})')
    columns = read_columns(path)
    if {'ros_time', 'calib_state', 'cmd_vel_x'} <= set(columns):
        return _raw(columns)
    if {'cmd_left_0', 'icp_x_0', 'gt_icp_yaw'} <= set(columns):
        return _processed(columns, robots[robot])
    raise RecordingError(f'{path}: neither a raw nor a processed run of the DRIVE data set; '
                         f'columns: {", ".join(map(shown, list(columns)[:8]))}, …')


def _raw(columns: Mapping[str, NDArray[Any]]) -> DriveRun:
    # Between two commanded steps the robot is driven by hand, with no command recorded.
    driven = np.array([str(state) == 'calib' for state in columns['calib_state']])
    if not driven.any():
        raise RecordingError('the run has no row with calib_state = calib')

    def column(name: str) -> FloatArray:
        if name not in columns:
            raise RecordingError(f'the run has no column {name}')
        return numbers(columns[name][driven], name)
    stamps = np.array([_stamp(text) for text in columns['ros_time'][driven]], dtype=np.int64)
    order = np.argsort(stamps, kind='stable')
    stamps = stamps[order]
    start = int(stamps[0])
    times: FloatArray = (stamps - start).astype(np.float64) * 1e-9

    def group(*names: str) -> FloatArray:
        return np.column_stack([column(name)[order] for name in names])
    quaternion = group('icp_quat_x', 'icp_quat_y', 'icp_quat_z', 'icp_quat_w')
    pose = np.column_stack([group('icp_pos_x', 'icp_pos_y'), _yaw(quaternion)])
    streams = {
        'command': TimeSeries(times, group('cmd_vel_x', 'cmd_vel_omega'), ('forward', 'yaw')),
        'wheels': _changes(times, group('meas_left_vel', 'meas_right_vel'), ('left', 'right')),
        'pose': _changes(times, pose, ('x', 'y', 'heading'), group('icp_index')),
    }
    imu = group('imu_z', 'imu_acceleration_x', 'imu_acceleration_y')
    if np.any(imu):
        streams['imu'] = TimeSeries(times, imu, ('yaw_rate', 'accel_x', 'accel_y'))
    if 'left_wheel_current' in columns:
        streams['currents'] = _changes(
            times, group('left_wheel_current', 'right_wheel_current'), ('left', 'right'))
        volts = group('left_wheel_voltage', 'right_wheel_voltage').mean(axis=1)
        streams['voltage'] = _changes(times, volts[:, None], ('bus',))
    return DriveRun(streams, start)


def _stamp(text: Any) -> int:
    try:
        stamp = int(float(text)) if '.' in str(text) else int(text)
    except (ValueError, OverflowError, TypeError):
        stamp = -1
    if not 0 <= stamp < 2 ** 63:
        raise RecordingError(f'ros_time {shown(text)} is not a stamp in nanoseconds')
    return stamp


def _yaw(quaternion: FloatArray) -> FloatArray:
    x, y, z, w = quaternion.T
    heading = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    unwrapped: FloatArray = np.unwrap(heading)
    return unwrapped


def _changes(times: FloatArray, values: FloatArray, names: tuple[str, ...],
             by: FloatArray | None = None) -> TimeSeries:
    # Rows in which the sensor spoke: its values (or a counter) changed, or they stayed long.
    watched = values if by is None else by
    changed = np.concatenate([[True], np.any(np.diff(watched, axis=0) != 0.0, axis=1)])
    keep, last = np.zeros(times.size, dtype=bool), -np.inf
    for k in range(times.size):
        if changed[k] or times[k] - last > HELD:
            keep[k], last = True, times[k]
    return TimeSeries(times[keep], values[keep], names)


def _processed(columns: Mapping[str, NDArray[Any]], robot: Mapping[str, float]) -> DriveRun:
    count = sum(1 for name in columns if name.startswith('cmd_left_'))
    step = 1.0 / float(drive_config()['rate'])

    def windows(name: str) -> FloatArray:
        return np.column_stack([numbers(columns[f'{name}_{k}'], name) for k in range(count)])
    rows = len(columns['cmd_left_0'])
    # Without times the windows follow each other.
    begin = (numbers(columns['start_time'], 'start_time') if 'start_time' in columns
             else count * step * np.arange(rows, dtype=np.float64))
    order = np.argsort(begin, kind='stable')
    begin = begin[order]
    times = (begin[:, None] - begin[0] + step * np.arange(count)).ravel()
    left, right = windows('cmd_left')[order].ravel(), windows('cmd_right')[order].ravel()
    radius, track = robot['wheel_radius'], robot['track']
    command = np.column_stack([0.5 * radius * (left + right), radius * (right - left) / track])
    local = np.stack([windows(f'icp_{name}')[order] for name in ('x', 'y', 'yaw')], axis=2)
    ends = np.column_stack([numbers(columns[f'gt_icp_{name}'], name)[order]
                            for name in ('x', 'y', 'yaw')])
    pose = _chained(local, ends)
    wheels = np.column_stack([windows(f'{side}_wheel_vel')[order].ravel()
                              for side in ('left', 'right')])
    imu = np.column_stack([windows(name)[order].ravel() for name in (
        'imu_yaw', 'imu_acceleration_x', 'imu_acceleration_y')])
    ascending = np.concatenate([[True], np.diff(np.maximum.accumulate(times)) > 1e-6])
    times = times[ascending]
    return DriveRun({
        'command': TimeSeries(times, command[ascending], ('forward', 'yaw')),
        'wheels': _changes(times, wheels[ascending], ('left', 'right')),
        'imu': TimeSeries(times, imu[ascending], ('yaw_rate', 'accel_x', 'accel_y')),
        'pose': TimeSeries(times, pose[ascending], ('x', 'y', 'heading')),
    }, EPOCH)


def _chained(local: FloatArray, ends: FloatArray) -> FloatArray:
    # Each window starts where the one before ended; after a gap it starts there too, for what
    # was driven in between is not known.
    at, rows = np.zeros(3), []
    for k in range(len(local)):
        c, s = np.cos(at[2]), np.sin(at[2])

        def world(points: FloatArray, cosine: float = c, sine: float = s,
                  origin: FloatArray = at) -> FloatArray:
            return np.column_stack([
                origin[0] + cosine * points[:, 0] - sine * points[:, 1],
                origin[1] + sine * points[:, 0] + cosine * points[:, 1],
                origin[2] + points[:, 2]])
        turns = np.unwrap(np.concatenate([[0.0], local[k, :, 2], [ends[k, 2]]]))
        path = np.column_stack([np.vstack([local[k, :, :2], ends[k, :2]]), turns[1:]])
        placed = world(path)
        rows.append(placed[:-1])
        at = placed[-1]
    return np.vstack(rows)
