# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Play a recording's streams into the ROS graph, at the pace of the clock."""

from __future__ import annotations

from collections.abc import Callable, Mapping
import time
from typing import Any

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.ros import api
from lg_husky_sim.ros.conversions import (
    fill_odometry,
    imu_message,
    joint_state_message,
    odometry_message,
    set_stamp,
)
from lg_husky_sim.ros.settings import Settings
from lg_husky_sim.signals import BodyTwist, Pose, TimeSeries
import numpy as np

NAME = 'lg_husky_player'


class _Stream:
    # One stream with its publisher, and how a row becomes a message.

    def __init__(self, node: api.Node, settings: Settings, name: str) -> None:
        self._name = name
        self._stamped = name == 'command' and settings.command_type == 'TwistStamped'
        kind, topic, self._message = {
            'command': (f'geometry_msgs/msg/{settings.command_type}', settings.command_topic,
                        None),
            'wheels': ('sensor_msgs/msg/JointState', settings.joint_states_topic,
                       joint_state_message(settings)),
            'imu': ('sensor_msgs/msg/Imu', settings.imu_topic, imu_message(settings)),
            'pose': ('nav_msgs/msg/Odometry', settings.odometry_topic,
                     odometry_message(settings, truth=False)),
        }[name]
        self._class = api.message_type(kind)
        self.publisher = node.create_publisher(self._class, topic, 10)

    def send(self, row: Any, nanoseconds: int) -> None:
        message: Any = self._message if self._message is not None else self._class()
        if self._name == 'command':
            twist = message.twist if self._stamped else message
            twist.linear.x, twist.angular.z = row[0], row[1]
            if self._stamped:
                set_stamp(message.header.stamp, nanoseconds)
        elif self._name == 'wheels':
            set_stamp(message.header.stamp, nanoseconds)
            message.velocity = [row[0], row[1]] * 2
        elif self._name == 'imu':
            set_stamp(message.header.stamp, nanoseconds)
            message.angular_velocity.z = row[0]
            message.linear_acceleration.x, message.linear_acceleration.y = row[1], row[2]
        else:
            fill_odometry(message, nanoseconds, Pose(*row), BodyTwist(0.0, 0.0))
        self.publisher.publish(message)


def play(streams: Mapping[str, TimeSeries], settings: Settings, *, wait: float = 10.0,
         speed: float = 1.0, progress: Callable[[float], object] | None = None) -> int:
    """
    Send what a robot was told and measured to whoever listens; needs :func:`api.init` before.

    Parameters
    ----------
    streams : mapping of str to TimeSeries
        Those of command, wheels, imu and pose that are there are sent, stamped now. The pose
        goes out as odometry without a velocity.
    settings : Settings
        Topics and types.
    wait : float
        How long to wait for a listener to any of them [s].
    speed : float
        How many times as fast as it was recorded.
    progress : callable, optional
        Receives the time within the recording [s].

    Returns
    -------
    int
        Number of messages sent.

    Raises
    ------
    RecordingError
        If there is nothing to send, or nobody listens.
    """
    names = [n for n in ('command', 'wheels', 'imu', 'pose') if n in streams]
    if not names:
        raise RecordingError('the recording has no command, wheels, imu or pose to play')
    node = api.Node(NAME)
    executor = api.SingleThreadedExecutor()
    executor.add_node(node)
    try:
        senders = [_Stream(node, settings, name) for name in names]
        end = time.monotonic() + wait
        while not any(one.publisher.get_subscription_count() for one in senders):
            executor.spin_once(timeout_sec=0.05)
            if time.monotonic() > end:
                raise RecordingError(f'nobody listens to any of the topics after {wait:g} s')
        times = np.concatenate([streams[name].times for name in names])
        which = np.repeat(np.arange(len(names)), [len(streams[name]) for name in names])
        rows = np.concatenate([np.arange(len(streams[name])) for name in names])
        order = np.argsort(times, kind='stable')
        values = [streams[name].values.tolist() for name in names]
        first, start = float(times[order[0]]), time.monotonic()
        for place in order:
            moment = (float(times[place]) - first) / speed
            while (left := start + moment - time.monotonic()) > 0.0:
                executor.spin_once(timeout_sec=left)
            senders[which[place]].send(values[which[place]][rows[place]],
                                       node.get_clock().now().nanoseconds)
            if progress is not None:
                progress(float(times[place]) - first)
        return int(order.size)
    finally:
        executor.shutdown()
        node.destroy_node()
