# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Tiny bags, written message by message."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip('rosbags')

NS = 1_000_000_000
EPOCH = 1_700_000_000 * NS


class BagWriter:
    """Collects messages and writes them as a bag of one of three kinds."""

    def __init__(self, kind: str = 'mcap') -> None:
        from rosbags.typesys import get_types_from_msg, get_typestore, Stores
        self.kind = kind
        self.store = get_typestore(
            Stores.ROS1_NOETIC if kind == 'ros1' else Stores.ROS2_JAZZY)
        if kind == 'ros1':  # rosbags does not list it for ROS 1
            self.store.register(get_types_from_msg(
                'geometry_msgs/TransformStamped[] transforms\n', 'tf2_msgs/msg/TFMessage'))
        self.rows: list[tuple[str, str, int, Any]] = []

    def new(self, name: str, *values: Any) -> Any:
        return self.store.types[name](*values)

    def header(self, stamp: int, frame: str = '') -> Any:
        time = self.new('builtin_interfaces/msg/Time', stamp // NS, stamp % NS)
        if self.kind == 'ros1':
            return self.new('std_msgs/msg/Header', 0, time, frame)
        return self.new('std_msgs/msg/Header', time, frame)

    def vector(self, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Any:
        return self.new('geometry_msgs/msg/Vector3', x, y, z)

    def add(self, topic: str, kind: str, logged: float, message: Any) -> None:
        self.rows.append((topic, kind, EPOCH + round(logged * NS), message))

    def twist(self, logged: float, forward: float, yaw: float, *, topic: str = '/cmd_vel',
              stamp: float | None = None) -> None:
        twist = self.new('geometry_msgs/msg/Twist', self.vector(forward), self.vector(z=yaw))
        if stamp is None:
            self.add(topic, 'geometry_msgs/msg/Twist', logged, twist)
        else:
            kind = 'geometry_msgs/msg/TwistStamped'
            self.add(topic, kind, logged,
                     self.new(kind, self.header(self._stamp(stamp)), twist))

    def joints(self, logged: float, names: Sequence[str], velocity: Sequence[float],
               position: Sequence[float] = (), *, topic: str = '/joint_states',
               stamp: float | None = None) -> None:
        kind = 'sensor_msgs/msg/JointState'
        header = self.header(self._stamp(logged if stamp is None else stamp))
        self.add(topic, kind, logged, self.new(
            kind, header, list(names), np.array(position, dtype=np.float64),
            np.array(velocity, dtype=np.float64), np.zeros(0)))

    def imu(self, logged: float, rate: float, ahead: float = 0.0, *,
            stamp: float | None = None, topic: str = '/imu/data') -> None:
        kind = 'sensor_msgs/msg/Imu'
        none = np.zeros(9)
        header = self.header(self._stamp(logged if stamp is None else stamp), 'imu_link')
        self.add(topic, kind, logged, self.new(
            kind, header, self.new('geometry_msgs/msg/Quaternion', 0.0, 0.0, 0.0, 1.0), none,
            self.vector(z=rate), none, self.vector(ahead, 0.0, 9.81), none))

    def transforms(self, logged: float,
                   entries: Sequence[tuple[str, str, float, float, float]], *,
                   scale: float = 1.0, topic: str = '/tf',
                   stamp: float | None = None) -> None:
        kind = 'tf2_msgs/msg/TFMessage'
        made = []
        for parent, child, x, y, heading in entries:
            turn = self.new('geometry_msgs/msg/Quaternion', 0.0, 0.0,
                            scale * float(np.sin(heading / 2)),
                            scale * float(np.cos(heading / 2)))
            made.append(self.new(
                'geometry_msgs/msg/TransformStamped',
                self.header(self._stamp(logged if stamp is None else stamp), parent), child,
                self.new('geometry_msgs/msg/Transform', self.vector(x, y), turn)))
        self.add(topic, kind, logged, self.new(kind, made))

    def odometry(self, logged: float, x: float, y: float, heading: float, *,
                 topic: str = '/odom') -> None:
        kind = 'nav_msgs/msg/Odometry'
        pose = self.new('geometry_msgs/msg/Pose', self.new('geometry_msgs/msg/Point', x, y, 0.0),
                        self.new('geometry_msgs/msg/Quaternion', 0.0, 0.0,
                                 float(np.sin(heading / 2)), float(np.cos(heading / 2))))
        twist = self.new('geometry_msgs/msg/Twist', self.vector(), self.vector())
        self.add(topic, kind, logged, self.new(
            kind, self.header(self._stamp(logged), 'odom'), 'base_link',
            self.new('geometry_msgs/msg/PoseWithCovariance', pose, np.zeros(36)),
            self.new('geometry_msgs/msg/TwistWithCovariance', twist, np.zeros(36))))

    def number(self, logged: float, value: float, topic: str) -> None:
        kind = 'std_msgs/msg/Float32'
        self.add(topic, kind, logged, self.new(kind, value))

    def write(self, path: Path) -> Path:
        """Write what was added; ros1 makes a file, the others a folder."""
        connections: dict[tuple[str, str], Any] = {}
        writer: Any
        if self.kind == 'ros1':
            from rosbags.rosbag1 import Writer as Writer1
            writer, serialize = Writer1(path), self.store.serialize_ros1
        else:
            from rosbags.rosbag2 import StoragePlugin, Writer
            plugin = StoragePlugin.MCAP if self.kind == 'mcap' else StoragePlugin.SQLITE3
            writer = Writer(path, version=9, storage_plugin=plugin)
            serialize = self.store.serialize_cdr
        with writer:
            for topic, kind, logged, message in self.rows:
                if (topic, kind) not in connections:
                    connections[topic, kind] = writer.add_connection(
                        topic, kind, typestore=self.store)
                writer.write(connections[topic, kind], logged, serialize(message, kind))
        return path

    @staticmethod
    def _stamp(stamp: float) -> int:
        """Return a header stamp [ns]: 0 stays 0, others count from the epoch."""
        return 0 if stamp == 0.0 else EPOCH + round(stamp * NS)


HUSKY = ('front_left_wheel', 'front_right_wheel', 'rear_left_wheel', 'rear_right_wheel')


@pytest.fixture
def bag() -> BagWriter:
    """Return an empty MCAP bag."""
    return BagWriter()


@pytest.fixture
def bag_writer() -> type[BagWriter]:
    """Return the writer, for other kinds of bags."""
    return BagWriter


def fill_drive(writer: BagWriter, seconds: float = 2.0) -> BagWriter:
    """Add commands, wheels, imu and pose at 20 Hz: ahead at 0.5 m/s, turning left."""
    for k in range(int(seconds * 20)):
        t = 0.05 * (k + 1)
        writer.twist(t, 0.5, 0.2, stamp=t, topic='/husky_velocity_controller/cmd_vel')
        writer.joints(t, HUSKY, (2.0, 3.0, 2.0, 3.0), (2 * t, 3 * t, 2 * t, 3 * t))
        writer.imu(t, 0.2, 0.1)
        writer.transforms(t, [('odom', 'base_link', 0.5 * t, 0.0, 0.2 * t)])
    return writer


@pytest.fixture
def drive(bag: BagWriter) -> BagWriter:
    """Return an MCAP bag with a drive of two seconds."""
    return fill_drive(bag)
