# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Achieved rate, late steps and real-time factor on diagnostics."""

from __future__ import annotations

from typing import Any

from lg_husky_sim.ros.api import message_type, Node
from lg_husky_sim.ros.conversions import set_stamp

_KIND = 'diagnostic_msgs/msg/DiagnosticArray'
_OK, _WARN = b'\x00', b'\x01'
_SECOND = 1e9


class Diagnostics:
    """
    Counts steps and reports once a second.

    Parameters
    ----------
    node : Node

    """

    def __init__(self, node: Node) -> None:
        """Make the publisher; without diagnostic_msgs a warning names it and nothing is sent."""
        self._publisher: Any = None
        self.total = self.late = self._steps = self._late_now = 0
        self._simulated = 0.0
        self._worst = 0
        self._since = 0
        self._name = f'{node.get_fully_qualified_name().lstrip("/")}: simulation'
        if message_type(_KIND) is None:
            node.get_logger().warning(
                'diagnostics is not published: message package diagnostic_msgs is missing')
            return
        self._publisher = node.create_publisher(message_type(_KIND), 'diagnostics', 10)

    def count(self, lateness_ns: int, period_ns: float, simulated: float) -> None:
        """
        Count one step.

        Parameters
        ----------
        lateness_ns : int
            How long after its moment the step was made [ns].
        period_ns : float
            Time between steps [ns]; a step later than this is a late one.
        simulated : float
            Simulated time that it advanced [s].

        """
        self.total += 1
        self._steps += 1
        self._simulated += simulated
        self._worst = max(self._worst, lateness_ns)
        if lateness_ns > period_ns:
            self.late += 1
            self._late_now += 1

    def report(self, now_ns: int, stamp_ns: int, wanted_rate: float, *, paused: bool) -> None:
        """
        Publish what was counted since the last report, once a second.

        Parameters
        ----------
        now_ns : int
            Steady clock [ns].
        stamp_ns : int
            Stamp of the message [ns].
        wanted_rate : float
            Steps wanted in a second; 0 if as many as possible.
        paused : bool
            Whether the simulation stands.

        """
        if self._since == 0:
            self._since = now_ns
        passed = (now_ns - self._since) / _SECOND
        if passed < 1.0:
            return
        achieved, factor = self._steps / passed, self._simulated / passed
        slow = not paused and wanted_rate > 0.0 and achieved < 0.9 * wanted_rate
        if self._publisher is not None:
            value = message_type('diagnostic_msgs/msg/KeyValue')
            status = message_type('diagnostic_msgs/msg/DiagnosticStatus')(
                level=self._level(slow), name=self._name, hardware_id='lg_husky_sim',
                message='paused' if paused else 'too slow' if slow else 'running',
                values=[value(key=key, value=text) for key, text in (
                    ('steps per second', f'{achieved:.3f}'),
                    ('wanted steps per second', f'{wanted_rate:.3f}'),
                    ('real-time factor', f'{factor:.4f}'),
                    ('late steps, last second', str(self._late_now)),
                    ('late steps, all', str(self.late)),
                    ('steps, all', str(self.total)),
                    ('largest lateness [ms]', f'{self._worst / 1e6:.3f}'))])
            message = message_type(_KIND)(status=[status])
            set_stamp(message.header.stamp, stamp_ns)
            self._publisher.publish(message)
        self._since, self._steps, self._late_now, self._worst = now_ns, 0, 0, 0
        self._simulated = 0.0

    @staticmethod
    def _level(slow: bool) -> Any:
        # A byte: rclpy wants bytes of length one, the embedded subset a number.
        level = _WARN if slow else _OK
        kind = type(message_type('diagnostic_msgs/msg/DiagnosticStatus')().level)
        return level if kind is bytes else level[0]
