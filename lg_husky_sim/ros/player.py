# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Play a recording's streams into the ROS graph, at the pace of the clock."""

from __future__ import annotations

from collections.abc import Callable, Mapping
import time
from typing import Any

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.ros import api
from lg_husky_sim.ros.commands import Commands, NAMES
from lg_husky_sim.ros.conversions import (
    fill_odometry,
    imu_message,
    joint_state_message,
    odometry_message,
    set_stamp,
)
from lg_husky_sim.ros.graph import Endpoint, publishers
from lg_husky_sim.ros.settings import Settings
from lg_husky_sim.ros.tool import Say, Tool
from lg_husky_sim.signals import BodyTwist, Pose, TimeSeries
import numpy as np

NAME = 'lg_husky_player'


class _Stream:
    # One stream of what was measured, with its publisher, and how a row becomes a message.

    def __init__(self, node: api.Node, settings: Settings, name: str) -> None:
        self._name = name
        kind, topic, self._message = {
            'wheels': ('sensor_msgs/msg/JointState', settings.joint_states_topic,
                       joint_state_message(settings)),
            'imu': ('sensor_msgs/msg/Imu', settings.imu_topic, imu_message(settings)),
            'pose': ('nav_msgs/msg/Odometry', settings.odometry_topic,
                     odometry_message(settings, truth=False)),
        }[name]
        self.topic = node.resolve_topic_name(topic)
        self.publisher = node.create_publisher(api.message_type(kind), topic, 10)

    def send(self, row: Any, nanoseconds: int) -> None:
        message: Any = self._message
        if self._name == 'wheels':
            set_stamp(message.header.stamp, nanoseconds)
            message.velocity = [row[0], row[1]] * 2
        elif self._name == 'imu':
            set_stamp(message.header.stamp, nanoseconds)
            message.angular_velocity.z = row[0]
            message.linear_acceleration.x, message.linear_acceleration.y = row[1], row[2]
        else:
            fill_odometry(message, nanoseconds, Pose(*row), BodyTwist(0.0, 0.0))
        self.publisher.publish(message)


def play(tool: Tool, streams: Mapping[str, TimeSeries], settings: Settings, *,
         wait: float = 10.0, speed: float = 1.0, say: Say = print,
         progress: Callable[[float], object] | None = None) -> int:
    """
    Send what a robot was told and measured to whoever listens, then zero commands.

    Parameters
    ----------
    tool : Tool
        Joins the graph; its clock paces the messages.
    streams : mapping of str to TimeSeries
        Those of command, wheels, imu and pose that are there are sent, stamped now. The pose
        goes out as odometry without a velocity.
    settings : Settings
        Topics, types and limits.
    wait : float
        How long to wait for a listener to any of them [s].
    speed : float
        How many times as fast as it was recorded.
    say : callable
        Is told what listens, before anything moves.
    progress : callable, optional
        Receives the time within the recording [s].

    Returns
    -------
    int
        Number of messages sent, without the zeros at the end.

    Raises
    ------
    RecordingError
        If there is nothing to send, or nobody listens.
    Ended
        If the tool was asked to end; the robot is stopped then.

    """
    names = [n for n in ('command', 'wheels', 'imu', 'pose') if n in streams]
    if not names:
        raise RecordingError('the recording has no command, wheels, imu or pose to play')
    senders = {name: _Stream(tool.node, settings, name) for name in names if name != 'command'}
    with Commands(tool, settings) as commands:
        end = time.monotonic() + wait
        told = 'command' in names
        while not (told and commands.heard()) and not any(
                one.publisher.get_subscription_count() for one in senders.values()):
            tool.serve()
            if time.monotonic() > end:
                raise RecordingError(f'no node subscribes to any of the topics after {wait:g} s')
        commands.settle()
        _say_who(tool, commands, senders, told, say)
        tool.wait_for_time(wait)
        times = np.concatenate([streams[name].times for name in names])
        which = np.repeat(np.arange(len(names)), [len(streams[name]) for name in names])
        rows = np.concatenate([np.arange(len(streams[name])) for name in names])
        order = np.argsort(times, kind='stable')
        values = [streams[name].values.tolist() for name in names]
        first, start = float(times[order[0]]), tool.now()
        for place in order:
            tool.serve_until(start + (float(times[place]) - first) / speed)
            tool.orderly.check()
            row, name = values[which[place]][rows[place]], names[which[place]]
            if name == 'command':
                commands.send(row[0], row[1])
            else:
                senders[name].send(row, tool.node.get_clock().now().nanoseconds)
            if progress is not None:
                progress(float(times[place]) - first)
    return int(order.size)


def _others(tool: Tool, senders: Mapping[str, _Stream]) -> dict[str, tuple[Endpoint, ...]]:
    """Return who else publishes each topic, once they are known by name or that took too long."""
    own = tool.node.get_fully_qualified_name()
    end = time.monotonic() + NAMES
    while True:
        found = {sender.topic: tuple(one for one in publishers(tool.node, sender.topic)
                                     if one.node != own) for sender in senders.values()}
        if time.monotonic() > end or all(
                one.is_named for others in found.values() for one in others):
            return found
        tool.serve()


def _say_who(tool: Tool, commands: Commands, senders: Mapping[str, _Stream], told: bool, say: Say
             ) -> None:
    robots = commands.robots() if told else ()
    if robots:
        commands.wait(0.0, say)
    else:
        say('no commands are sent that move a robot' if not told else
            f'no robot subscribes to {commands.topic}')
    for topic, others in _others(tool, senders).items():
        if others:
            known = [one.node for one in others if one.is_named]
            say(f'{topic} is published by {known[0] if known else "another node"} as well: '
                'subscribers receive both')
