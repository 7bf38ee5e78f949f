# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Send a manoeuvre as velocity commands, at the pace of the clock."""

from __future__ import annotations

from collections.abc import Callable
import time

from lg_husky_sim.errors import CommandError
from lg_husky_sim.manoeuvres import Manoeuvre
from lg_husky_sim.ros import api
from lg_husky_sim.ros.conversions import set_stamp
from lg_husky_sim.ros.settings import Settings

NAME = 'lg_husky_driver'


def drive(manoeuvre: Manoeuvre, settings: Settings, *, wait: float = 10.0,
          progress: Callable[[float], object] | None = None) -> int:
    """
    Send the commands of a manoeuvre to whoever listens; needs :func:`api.init` before.

    Parameters
    ----------
    manoeuvre : Manoeuvre
        What to drive.
    settings : Settings
        Topic and type of the command.
    wait : float
        How long to wait for a listener [s].
    progress : callable, optional
        Receives the time within the manoeuvre [s] at each command.

    Returns
    -------
    int
        Number of commands sent.

    Raises
    ------
    CommandError
        If nobody listens.

    """
    node = api.Node(NAME)
    executor = api.SingleThreadedExecutor()
    executor.add_node(node)
    stamped = settings.command_type == 'TwistStamped'
    kind = api.message_type(f'geometry_msgs/msg/{settings.command_type}')
    try:
        publisher = node.create_publisher(kind, settings.command_topic, 10)
        end = time.monotonic() + wait
        while publisher.get_subscription_count() == 0:
            executor.spin_once(timeout_sec=0.05)
            if time.monotonic() > end:
                raise CommandError(
                    f'nobody listens to {settings.command_topic} ({settings.command_type}) '
                    f'after {wait:g} s; is sim_node running in this domain?')
        commands = manoeuvre.commands()
        start = time.monotonic()
        message = kind()
        twist = message.twist if stamped else message
        for moment, (forward, yaw) in zip(commands.times.tolist(), commands.values.tolist(),
                                          strict=True):
            while (left := start + moment - time.monotonic()) > 0.0:
                executor.spin_once(timeout_sec=left)
            twist.linear.x, twist.angular.z = forward, yaw
            if stamped:
                set_stamp(message.header.stamp, node.get_clock().now().nanoseconds)
            publisher.publish(message)
            if progress is not None:
                progress(moment)
        return len(commands)
    finally:
        executor.shutdown()
        node.destroy_node()
