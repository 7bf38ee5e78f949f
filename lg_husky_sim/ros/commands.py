# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Velocity commands to a robot: who listens, within limits, and zero at the end of it all."""

from __future__ import annotations

from collections import Counter
import math
import time
from types import TracebackType

from lg_husky_sim.errors import CommandError
from lg_husky_sim.ros import api
from lg_husky_sim.ros.conversions import set_stamp
from lg_husky_sim.ros.graph import Endpoint, listeners
from lg_husky_sim.ros.settings import Settings
from lg_husky_sim.ros.tool import Say, Tool

#: Zero commands that end everything, and the time between two of them [s].
ZEROS = 5
SPACING = 0.02
#: How long to wait for the names of the nodes that listen [s]; the middleware tells them after it
#: has told that there is a listener. Until then nobody knows whether it is a recorder.
NAMES = 3.0
#: How long nobody may listen before that is an error [s].
DEAF = 1.0


def clamped(value: float, largest: float) -> float:
    """Return a speed within ± a limit; a limit of zero is none."""
    return max(-largest, min(largest, value)) if largest > 0.0 else value


class Commands:
    """
    A publisher of commands that leaves the robot stopped, whichever way it is left.

    Use it as a context: at its end, by whatever exception, zero commands go out.

    Parameters
    ----------
    tool : Tool
    settings : Settings
        Topic, type and limits of the command.

    """

    def __init__(self, tool: Tool, settings: Settings) -> None:
        """Make the publisher; nothing is sent yet."""
        self._tool, self._settings = tool, settings
        self._stamped = settings.command_type == 'TwistStamped'
        self.kind = f'geometry_msgs/msg/{settings.command_type}'
        self.topic = tool.node.resolve_topic_name(settings.command_topic)
        self._class = api.message_type(self.kind)
        self._publisher = tool.node.create_publisher(self._class, settings.command_topic, 10)
        #: Commands that were sent, and those of them that were beyond the limits.
        self.sent = self.limited = 0
        self._last_heard = 0.0

    def __enter__(self) -> Commands:
        """Return itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        """Stop the robot."""
        self.stop()

    def robots(self) -> tuple[Endpoint, ...]:
        """Return who listens, without our own recorder and twin."""
        return tuple(end for end in listeners(self._tool.node, self._settings.command_topic)
                     if not end.is_tool)

    def heard(self) -> bool:
        """Return whether a robot is connected that takes this type."""
        return self._publisher.get_subscription_count() > 0 and any(
            end.kind == self.kind for end in self.robots())

    def check_heard(self) -> None:
        """
        Go on only while somebody listens: who comes back is not to be moved from the middle on.

        Raises
        ------
        CommandError
            If nobody has listened for :data:`DEAF`.

        """
        now = time.monotonic()
        if self.sent <= 1 or self.heard():
            self._last_heard = now
        elif now - self._last_heard > DEAF:
            raise CommandError(
                f'{self.topic}: nobody listens any more, after {self.sent} commands')

    def settle(self) -> None:
        """Wait for all the nodes that listen to be known by name, for some seconds at most."""
        while not self._tool.orderly.acquainted:
            self._tool.serve()
        end = time.monotonic() + NAMES
        while time.monotonic() < end and not all(one.is_named for one in self.robots()):
            self._tool.serve()

    def _heard_by_name(self) -> bool:
        if self.heard():
            self.settle()
        return self.heard()

    def wait(self, seconds: float, say: Say) -> None:
        """
        Wait until somebody listens, and say who.

        Raises
        ------
        CommandError
            If nobody does, or only to another type.

        """
        end = time.monotonic() + seconds
        while not self._heard_by_name():
            self._tool.serve()
            if time.monotonic() > end:
                self.settle()
                raise CommandError(self._silence(seconds))
        # Two of one name are two robots that move.
        counts = Counter(f'{one.node} ({one.kind.rpartition("/")[2]})' for one in self.robots())
        names = ', '.join(name + (f' ×{count}' if count > 1 else '')
                          for name, count in counts.items())
        limits = ', '.join(f'at most {limit:g} {unit}' for limit, unit in (
            (self._settings.max_forward, 'm/s'), (self._settings.max_yaw, 'rad/s')) if limit > 0.0)
        say(f'{self.topic} moves {names}; {limits or "no limit in this preset"}')

    def _silence(self, seconds: float) -> str:
        name = f'{self.topic} ({self._settings.command_type})'
        others = [end for end in self.robots() if end.kind != self.kind]
        if others:
            return (f'{name}: {others[0].node} listens to {others[0].kind.rpartition("/")[2]} '
                    'there; choose --type or --preset')
        return (f'no node subscribes to {name} after {seconds:g} s; is sim_node running in '
                'this domain?')

    def send(self, forward: float, yaw: float) -> None:
        """
        Send a command, within the preset's limits.

        Parameters
        ----------
        forward, yaw : float
            [m/s], [rad/s] positive to the left. What is not finite counts as zero.

        """
        wanted = tuple(value if math.isfinite(value) else 0.0 for value in (forward, yaw))
        within = (clamped(wanted[0], self._settings.max_forward),
                  clamped(wanted[1], self._settings.max_yaw))
        self.limited += within != (forward, yaw)
        self._publish(*within)
        self.sent += 1

    def _publish(self, forward: float, yaw: float) -> None:
        message = self._class()
        twist = message.twist if self._stamped else message
        twist.linear.x, twist.angular.z = forward, yaw
        if self._stamped:
            set_stamp(message.header.stamp, self._tool.node.get_clock().now().nanoseconds)
        self._publisher.publish(message)

    def stop(self) -> None:
        """Send zero commands; several, as the first may get lost."""
        if self.sent:
            for _ in range(ZEROS):
                self._publish(0.0, 0.0)
                time.sleep(SPACING)
