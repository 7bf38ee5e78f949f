# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Messages to rows of numbers, one message at a time.

A row collector takes the messages of one topic and keeps, for each, the log time, the header
stamp and the values; nothing here sorts, repairs or judges.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from lg_husky_sim.recording.clock import Stamps
from lg_husky_sim.recording.frames import quaternion_heading, whole_frame
from lg_husky_sim.recording.wheels import (
    chosen_sides,
    named_wheels,
    passed_over,
    side_means,
    Sides,
    unwrapped_means,
    wheel_sides,
    WRAP,
)
from lg_husky_sim.signals import FloatArray
import numpy as np

WHEEL_COLUMNS = 6
"""Rates, angles and efforts, each left and right."""
LISTED = 4
"""Joints that a note lists; a pair of arms has many."""


@dataclass
class Rows:
    """Stamps and values of one topic, or one transform, in the order of the bag."""

    width: int
    logged: list[int] = field(default_factory=list)
    header: list[int] = field(default_factory=list)
    values: list[tuple[float, ...]] = field(default_factory=list)

    def add(self, logged: int, header: int, values: tuple[float, ...]) -> None:
        """Append one message."""
        self.logged.append(logged)
        self.header.append(header)
        self.values.append(values)

    def stamps(self) -> Stamps:
        """Return both kinds of stamps as arrays."""
        return Stamps(np.array(self.logged, dtype=np.int64), np.array(self.header, dtype=np.int64))

    def array(self) -> FloatArray:
        """Return the values, shape (n, width)."""
        return np.array(self.values, dtype=np.float64).reshape(-1, self.width)


@dataclass
class Collected:
    """
    What the messages of one topic gave: rows by name, and why others gave none.

    `turned` has the angles of each joint for each row of wheels, None if they do not wrap;
    `joints` are those of the left and of the right side if they were chosen by hand.
    """

    rows: dict[str, Rows] = field(default_factory=dict)
    seen: set[str] = field(default_factory=set)
    notes: list[str] = field(default_factory=list)
    named: bool = False
    turned: list[tuple[dict[str, float], dict[str, float]]] | None = field(default_factory=list)
    joints: tuple[tuple[str, ...], tuple[str, ...]] | None = None

    def into(self, name: str, width: int) -> Rows:
        """Return the rows of a name, new ones at first."""
        if name not in self.rows:
            self.rows[name] = Rows(width)
        return self.rows[name]

    def settle(self) -> None:
        """Mend and note what only shows in all messages of the wheels."""
        left_out = passed_over(self.seen) if self.named else []
        if left_out:
            more = f' and {len(left_out) - LISTED} more' if len(left_out) > LISTED else ''
            self.notes.append('wheels: joints that are not called wheels, or have no side, were '
                              'ignored: '
                              + ', '.join(left_out[:LISTED]) + more)
        turned, self.turned = self.turned, None
        means = unwrapped_means(turned) if turned else None
        if means is None:
            return
        rows = self.rows['wheels']
        rows.values = [(*row[:2], float(left), float(right), *row[4:])
                       for row, (left, right) in zip(rows.values, means, strict=True)]
        self.notes.append('wheels: front and rear positions wrap at different moments; each '
                          'joint was unwrapped before the mean')


def edge_name(parent: str, child: str) -> str:
    """Return the name under which a transform's rows are kept."""
    return f'{parent}>{child}'


def header_ns(message: Any) -> int:
    """Return the header stamp [ns]; 0 without one or when it is negative."""
    header = getattr(message, 'header', None)
    if header is None:
        return 0
    stamp = header.stamp
    total: int = stamp.sec * 1_000_000_000 + stamp.nanosec
    return max(0, total)


def _command(into: Collected, logged: int, message: Any) -> None:
    twist = getattr(message, 'twist', message)
    into.into('command', 2).add(
        logged, header_ns(message), (float(twist.linear.x), float(twist.angular.z)))


def _wheels(into: Collected, logged: int, message: Any) -> None:
    names = message.name
    count = max(len(message.velocity), len(message.position))
    into.seen.update(names)
    sides = wheel_sides(names, count) if into.joints is None else chosen_sides(
        names, into.joints)
    if sides is None:
        return
    if not names:
        into.seen.add(f'{count} values without names')
    named = into.joints is None and named_wheels(tuple(names))
    if into.named and not named:
        return
    if named and not into.named:  # what came before was no wheels, but a gripper's joints
        into.named = True
        into.rows.pop('wheels', None)
        into.turned = []
    row = _wheel_row(message, sides)
    into.into('wheels', WHEEL_COLUMNS).add(logged, header_ns(message), row)
    if abs(row[2]) > WRAP or abs(row[3]) > WRAP:
        into.turned = None
    if into.turned is not None:
        left, right = (_angles(message, places) for places in sides)
        into.turned.append((left, right))


def _angles(message: Any, places: tuple[int, ...]) -> dict[str, float]:
    return {message.name[place] if len(message.name) else str(place):
            float(message.position[place])
            for place in places if place < len(message.position)}


def _wheel_row(message: Any, sides: Sides) -> tuple[float, ...]:
    return (*side_means(message.velocity, sides), *side_means(message.position, sides),
            *side_means(message.effort, sides))


def _imu(into: Collected, logged: int, message: Any) -> None:
    turn, pull = message.angular_velocity, message.linear_acceleration
    into.into('imu', 3).add(
        logged, header_ns(message), (float(turn.z), float(pull.x), float(pull.y)))


def _pose(into: Collected, logged: int, stamp: int, edge: tuple[str, str],
          where: Any, turned: Any) -> None:
    parent, child = whole_frame(edge[0]), whole_frame(edge[1])
    into.seen.add(f'{parent} -> {child}')
    heading = quaternion_heading(turned.x, turned.y, turned.z, turned.w)
    into.into(edge_name(parent, child), 3).add(
        logged, stamp, (float(where.x), float(where.y), heading))


def _transforms(into: Collected, logged: int, message: Any) -> None:
    for entry in message.transforms:
        _pose(into, logged, header_ns(entry), (entry.header.frame_id, entry.child_frame_id),
              entry.transform.translation, entry.transform.rotation)


def _odometry(into: Collected, logged: int, message: Any) -> None:
    _pose(into, logged, header_ns(message),
          (message.header.frame_id or 'odom', message.child_frame_id or 'base_link'),
          message.pose.pose.position, message.pose.pose.orientation)


def _posed(into: Collected, logged: int, message: Any) -> None:
    pose = getattr(message.pose, 'pose', message.pose)  # with its covariance, or without
    _pose(into, logged, header_ns(message), (message.header.frame_id or 'map', 'base_link'),
          pose.position, pose.orientation)


def _number(name: str) -> Callable[[Collected, int, Any], None]:
    def collect(into: Collected, logged: int, message: Any) -> None:
        into.into(name, 1).add(logged, header_ns(message), (float(message.data),))
    return collect


def _battery(into: Collected, logged: int, message: Any) -> None:
    into.into('voltage', 1).add(logged, header_ns(message), (float(message.voltage),))


def _status(into: Collected, logged: int, message: Any) -> None:
    stamp = header_ns(message)
    into.into('current_left', 1).add(logged, stamp, (float(message.left_driver_current),))
    into.into('current_right', 1).add(logged, stamp, (float(message.right_driver_current),))
    into.into('voltage', 1).add(logged, stamp, (float(message.battery_voltage),))


Collector = Callable[[Collected, int, Any], None]

COLLECTORS: Mapping[tuple[str, str], Collector] = {
    ('command', 'geometry_msgs/msg/Twist'): _command,
    ('command', 'geometry_msgs/msg/TwistStamped'): _command,
    ('wheels', 'sensor_msgs/msg/JointState'): _wheels,
    ('imu', 'sensor_msgs/msg/Imu'): _imu,
    ('pose', 'tf2_msgs/msg/TFMessage'): _transforms,
    ('pose', 'tf/msg/tfMessage'): _transforms,
    ('pose', 'nav_msgs/msg/Odometry'): _odometry,
    ('pose', 'geometry_msgs/msg/PoseStamped'): _posed,
    ('pose', 'geometry_msgs/msg/PoseWithCovarianceStamped'): _posed,
    ('current_left', 'std_msgs/msg/Float32'): _number('current_left'),
    ('current_left', 'std_msgs/msg/Float64'): _number('current_left'),
    ('current_right', 'std_msgs/msg/Float32'): _number('current_right'),
    ('current_right', 'std_msgs/msg/Float64'): _number('current_right'),
    ('voltage', 'sensor_msgs/msg/BatteryState'): _battery,
    ('voltage', 'std_msgs/msg/Float32'): _number('voltage'),
    ('voltage', 'std_msgs/msg/Float64'): _number('voltage'),
    ('status', 'husky_msgs/msg/HuskyStatus'): _status,
}
"""How the messages of a type are read for a role."""
