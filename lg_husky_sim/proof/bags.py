# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Write and read the rosbags of the trial (rosbag2, MCAP)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
import math
import os
from pathlib import Path
import shutil
from typing import Any

from lg_husky_sim.errors import RecordingError
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

COMMAND = '/husky_velocity_controller/cmd_vel'
WHEELS = ('front_left_wheel', 'front_right_wheel', 'rear_left_wheel', 'rear_right_wheel')


@dataclass(frozen=True)
class Published:
    """
    What a robot published during one manoeuvre.

    Attributes
    ----------
    commands
        Columns stamp [s], forward [m/s], yaw [rad/s].
    joints
        Columns stamp, angles of front left, front right, rear left, rear right [rad],
        their speeds [rad/s].
    imu
        Columns stamp, yaw rate [rad/s], specific force ahead and to the left [m/s²].
    poses
        Columns stamp, x, y [m], heading [rad].
    stamped
        The commands carry a stamp (TwistStamped).
    suffix
        Ending of the wheel joints' names.
    velocities, positions
        Whether JointState has them.
    order
        Order of the wheels in JointState.

    A stream without rows is not in the bag.

    """

    commands: Vector
    joints: Vector
    imu: Vector
    poses: Vector
    stamped: bool = True
    suffix: str = ''
    velocities: bool = True
    positions: bool = True
    order: tuple[int, ...] = (0, 1, 2, 3)


@cache
def _store() -> Any:
    from rosbags.typesys import get_typestore, Stores
    return get_typestore(Stores.ROS2_JAZZY)


def _types() -> Mapping[str, Any]:
    types: Mapping[str, Any] = _store().types
    return types


def _stamp(seconds: float, start_ns: int) -> tuple[Any, int]:
    total = start_ns + round(seconds * 1e9)
    time = _types()['builtin_interfaces/msg/Time'](
        sec=total // 10 ** 9, nanosec=total % 10 ** 9)
    return time, total


def _vector3(x: float, y: float, z: float) -> Any:
    return _types()['geometry_msgs/msg/Vector3'](x=x, y=y, z=z)


def _quaternion(heading: float) -> Any:
    return _types()['geometry_msgs/msg/Quaternion'](
        x=0.0, y=0.0, z=math.sin(0.5 * heading), w=math.cos(0.5 * heading))


def write_bag(path: Path, data: Published, start_ns: int) -> None:
    """
    Write one recording, complete or not at all.

    Parameters
    ----------
    path
        Directory of the bag; replaced if it exists.
    data
        What was published.
    start_ns
        Time of second zero [ns since the epoch].

    """
    from rosbags.rosbag2 import StoragePlugin, Writer
    types = _types()
    header = types['std_msgs/msg/Header']
    twist = types['geometry_msgs/msg/Twist']
    rows: list[tuple[int, str, Any]] = []
    for row in data.commands:
        time, stamp = _stamp(float(row[0]), start_ns)
        message = twist(linear=_vector3(float(row[1]), 0.0, 0.0),
                        angular=_vector3(0.0, 0.0, float(row[2])))
        if data.stamped:
            message = types['geometry_msgs/msg/TwistStamped'](
                header=header(stamp=time, frame_id='base_link'), twist=message)
        rows.append((stamp, COMMAND, message))
    names = [WHEELS[k] + data.suffix for k in data.order]
    order = np.array(data.order)
    for row in data.joints:
        time, stamp = _stamp(float(row[0]), start_ns)
        rows.append((stamp, '/joint_states', types['sensor_msgs/msg/JointState'](
            header=header(stamp=time, frame_id=''), name=names,
            position=row[1 + order] if data.positions else np.zeros(0),
            velocity=row[5 + order] if data.velocities else np.zeros(0), effort=np.zeros(0))))
    none = np.zeros(9)
    none[0] = -1.0
    for row in data.imu:
        time, stamp = _stamp(float(row[0]), start_ns)
        rows.append((stamp, '/imu_um7/data', types['sensor_msgs/msg/Imu'](
            header=header(stamp=time, frame_id='imu_link'), orientation=_quaternion(0.0),
            orientation_covariance=none, angular_velocity=_vector3(0.0, 0.0, float(row[1])),
            angular_velocity_covariance=np.zeros(9),
            linear_acceleration=_vector3(float(row[2]), float(row[3]), 9.81),
            linear_acceleration_covariance=np.zeros(9))))
    for row in data.poses:
        time, stamp = _stamp(float(row[0]), start_ns)
        rows.append((stamp, '/tf', types['tf2_msgs/msg/TFMessage'](transforms=[
            types['geometry_msgs/msg/TransformStamped'](
                header=header(stamp=time, frame_id='odom'), child_frame_id='base_link',
                transform=types['geometry_msgs/msg/Transform'](
                    translation=_vector3(float(row[1]), float(row[2]), 0.0),
                    rotation=_quaternion(float(row[3]))))])))
    rows.sort(key=lambda item: item[0])

    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(path.name + '.part')
    if draft.exists():
        shutil.rmtree(draft)
    with Writer(draft, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connections = {}
        for _, topic, message in rows:
            if topic not in connections:
                connections[topic] = writer.add_connection(
                    topic, message.__msgtype__, typestore=_store())
        for stamp, topic, message in rows:
            writer.write(connections[topic], stamp,
                         _store().serialize_cdr(message, message.__msgtype__))
    _rename_inside(draft, path.name)
    if path.exists():
        shutil.rmtree(path)
    os.replace(draft, path)


def _rename_inside(draft: Path, name: str) -> None:
    """Give the file inside a drafted bag its final name."""
    old = f'{draft.name}.mcap'
    os.replace(draft / old, draft / f'{name}.mcap')
    metadata = draft / 'metadata.yaml'
    text = metadata.read_text(encoding='utf-8').replace(old, f'{name}.mcap')
    metadata.write_text(text, encoding='utf-8')


def _seconds(stamp: Any) -> int:
    return int(stamp.sec) * 10 ** 9 + int(stamp.nanosec)


def read_bag(path: Path) -> dict[str, Vector]:
    """
    Return what a bag of these topics says; used for the answers of `lg_husky simulate`.

    Returns
    -------
    dict
        'commands' (stamp, forward, yaw; may be empty), 'joints' (stamp, left, right wheel
        speed), 'imu' (stamp, yaw rate, accelerations) and 'poses' (stamp, x, y, heading
        unwrapped), stamps in seconds since the epoch.

    Raises
    ------
    RecordingError
        The bag cannot be read or lacks one of these topics.

    """
    from rosbags.rosbag2 import Reader, ReaderError
    commands: list[list[float]] = []
    joints: list[list[float]] = []
    imu: list[list[float]] = []
    poses: list[list[float]] = []
    try:
        with Reader(path) as reader:
            for connection, time, raw in reader.messages():
                message: Any
                if connection.topic == COMMAND:
                    message = _store().deserialize_cdr(raw, connection.msgtype)
                    twist = getattr(message, 'twist', message)
                    commands.append([time, twist.linear.x, twist.angular.z])
                elif connection.topic == '/joint_states':
                    message = _store().deserialize_cdr(raw, connection.msgtype)
                    sides = [np.mean([s for n, s in zip(message.name, message.velocity,
                                                        strict=True)
                                      if side in n]) for side in ('left', 'right')]
                    joints.append([_seconds(message.header.stamp) or time, *sides])
                elif connection.topic == '/imu_um7/data':
                    message = _store().deserialize_cdr(raw, connection.msgtype)
                    imu.append([_seconds(message.header.stamp) or time,
                                message.angular_velocity.z, message.linear_acceleration.x,
                                message.linear_acceleration.y])
                elif connection.topic == '/tf':
                    message = _store().deserialize_cdr(raw, connection.msgtype)
                    for item in message.transforms:
                        turn = item.transform.rotation
                        poses.append([_seconds(item.header.stamp) or time,
                                      item.transform.translation.x,
                                      item.transform.translation.y,
                                      2.0 * math.atan2(turn.z, turn.w)])
    except (OSError, ValueError, RuntimeError, ReaderError) as error:
        reason = str(error).splitlines()[0]
        raise RecordingError(f'{path} cannot be read as a rosbag2: {reason}') from error
    if not (joints and imu and poses):
        raise RecordingError(f'{path} lacks /joint_states, /imu_um7/data or /tf')
    result = {}
    for name, rows in (('commands', commands), ('joints', joints), ('imu', imu), ('poses', poses)):
        table = np.array(rows, dtype=np.float64).reshape(len(rows), -1)
        if rows:
            table[:, 0] *= 1e-9
            table = table[np.argsort(table[:, 0], kind='stable')]
        result[name] = table
    result['poses'][:, 3] = np.unwrap(result['poses'][:, 3])
    return result
