# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Samples to ROS messages, as the Husky sends them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np

WHEELS = ('front_left_wheel', 'front_right_wheel', 'rear_left_wheel', 'rear_right_wheel')
"""Joint names of the Husky, in its order: left and right take turns."""

STANDARD_GRAVITY = 9.80665
"""What an accelerometer at rest reads upwards [m/s²], REP-145."""

Maker = tuple[str, str, FloatArray, Callable[[int, int], Any]]
"""Topic, message type, times [s] and a function (place, stamp [ns]) -> message."""


class Messages:
    """
    Makes messages of a library's types.

    Parameters
    ----------
    types : mapping of str to callable
        What makes a message from its fields in order, by the full name of its type.
    frames : tuple of str
        Parent and child frame of the pose.

    """

    def __init__(self, types: Mapping[str, Callable[..., Any]], frames: tuple[str, str]) -> None:
        self._types = types
        self._frames = frames

    def makers(self, streams: Mapping[str, TimeSeries]) -> list[Maker]:
        """Return a maker for each topic that the streams fill."""
        made: list[Maker] = []
        if 'command' in streams:
            made.append(self._commands(streams['command']))
        if 'wheels' in streams:
            made.append(self._joints(streams))
        if 'imu' in streams:
            made.append(self._imu(streams['imu']))
        if 'pose' in streams:
            made.append(self._transforms(streams['pose']))
        if 'currents' in streams:
            made += [self._current(streams['currents'], side) for side in ('left', 'right')]
        if 'voltage' in streams:
            made.append(self._battery(streams['voltage']))
        return made

    def _new(self, name: str, *values: Any) -> Any:
        return self._types[name](*values)

    def _header(self, stamp: int, frame: str) -> Any:
        time = self._new('builtin_interfaces/msg/Time', stamp // 10**9, stamp % 10**9)
        return self._new('std_msgs/msg/Header', time, frame)

    def _vector(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Any:
        return self._new('geometry_msgs/msg/Vector3', float(x), float(y), float(z))

    def _commands(self, series: TimeSeries) -> Maker:
        kind = 'geometry_msgs/msg/TwistStamped'

        def make(place: int, stamp: int) -> Any:
            forward, yaw = series.values[place]
            twist = self._new('geometry_msgs/msg/Twist', self._vector(forward),
                              self._vector(z=yaw))
            return self._new(kind, self._header(stamp, self._frames[1]), twist)
        return '/husky_velocity_controller/cmd_vel', kind, series.times, make

    def _joints(self, streams: Mapping[str, TimeSeries]) -> Maker:
        kind = 'sensor_msgs/msg/JointState'
        times = streams['wheels'].times
        angles, torques = (_at(times, streams.get(name))
                           for name in ('wheel_angles', 'wheel_torques'))
        rates = np.tile(streams['wheels'].values, 2)

        def make(place: int, stamp: int) -> Any:
            return self._new(kind, self._header(stamp, ''), list(WHEELS),
                             angles[place], rates[place], torques[place])
        return '/joint_states', kind, times, make

    def _imu(self, series: TimeSeries) -> Maker:
        kind = 'sensor_msgs/msg/Imu'
        unknown = np.array([-1.0] + [0.0] * 8)  # REP-145: no orientation is estimated
        none = np.zeros(9)

        def make(place: int, stamp: int) -> Any:
            rate, ahead, left = series.values[place]
            return self._new(
                kind, self._header(stamp, 'imu_link'),
                self._new('geometry_msgs/msg/Quaternion', 0.0, 0.0, 0.0, 1.0), unknown,
                self._vector(z=rate), none,
                self._vector(ahead, left, STANDARD_GRAVITY), none)
        return '/imu_um7/data', kind, series.times, make

    def _transforms(self, series: TimeSeries) -> Maker:
        kind = 'tf2_msgs/msg/TFMessage'
        parent, child = self._frames

        def make(place: int, stamp: int) -> Any:
            x, y, heading = series.values[place]
            transform = self._new('geometry_msgs/msg/Transform', self._vector(x, y),
                                  self._quaternion(heading))
            return self._new(kind, [self._new(
                'geometry_msgs/msg/TransformStamped', self._header(stamp, parent), child,
                transform)])
        return '/tf', kind, series.times, make

    def number(self, topic: str, series: TimeSeries) -> Maker:
        """Return a maker of plain numbers, the series' first channel."""
        kind = 'std_msgs/msg/Float64'
        values = series.values[:, 0]

        def make(place: int, stamp: int) -> Any:
            return self._new(kind, float(values[place]))
        return topic, kind, series.times, make

    def posed(self, topic: str, series: TimeSeries) -> Maker:
        """Return a maker of poses from x, y and heading."""
        kind = 'geometry_msgs/msg/PoseStamped'

        def make(place: int, stamp: int) -> Any:
            x, y, heading = (float(value) for value in series.values[place])
            pose = self._new(
                'geometry_msgs/msg/Pose', self._new('geometry_msgs/msg/Point', x, y, 0.0),
                self._quaternion(heading))
            return self._new(kind, self._header(stamp, self._frames[0]), pose)
        return topic, kind, series.times, make

    def _quaternion(self, heading: float) -> Any:
        return self._new('geometry_msgs/msg/Quaternion', 0.0, 0.0,
                         float(np.sin(heading / 2.0)), float(np.cos(heading / 2.0)))

    def _current(self, series: TimeSeries, side: str) -> Maker:
        kind = 'std_msgs/msg/Float32'
        values = series.column(side)

        def make(place: int, stamp: int) -> Any:
            return self._new(kind, float(values[place]))
        return f'/{side}_driver_current', kind, series.times, make

    def _battery(self, series: TimeSeries) -> Maker:
        kind = 'sensor_msgs/msg/BatteryState'
        nothing = np.zeros(0, dtype=np.float32)
        unknown = float('nan')

        def make(place: int, stamp: int) -> Any:
            return self._new(
                kind, self._header(stamp, ''), float(series.values[place, 0]), unknown, unknown,
                unknown, unknown, unknown, unknown, 0, 0, 0, True, nothing, nothing, '', '')
        return '/battery_state', kind, series.times, make


def _at(times: FloatArray, series: TimeSeries | None) -> FloatArray:
    """Return values of both sides for four wheels at other times; no column without a series."""
    if series is None:
        return np.zeros((times.size, 0))
    sides = np.column_stack([np.interp(times, series.times, series.values[:, k])
                             for k in range(2)])
    return np.tile(sides, 2)
