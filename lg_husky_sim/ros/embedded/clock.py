# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Time, Duration and Clock with rclpy's names."""

from __future__ import annotations

from dataclasses import dataclass
import time as system
from typing import Any

from lg_husky_sim.ros.embedded.messages import message_class

_SECOND = 1_000_000_000


@dataclass(frozen=True, order=True, init=False)
class Duration:
    """
    A span of time.

    Parameters
    ----------
    seconds, nanoseconds : float, int
        Added up.

    """

    nanoseconds: int

    def __init__(self, *, seconds: float = 0, nanoseconds: int = 0) -> None:
        """Add both up in nanoseconds."""
        object.__setattr__(self, 'nanoseconds', round(seconds * _SECOND) + int(nanoseconds))

    def to_msg(self) -> Any:
        """Return a builtin_interfaces/msg/Duration."""
        whole, rest = divmod(self.nanoseconds, _SECOND)
        return message_class('builtin_interfaces/msg/Duration')(sec=whole, nanosec=rest)


@dataclass(frozen=True, order=True, init=False)
class Time:
    """
    A moment.

    Parameters
    ----------
    seconds, nanoseconds : float, int
        Since the epoch of the clock, added up.

    """

    nanoseconds: int

    def __init__(self, *, seconds: float = 0, nanoseconds: int = 0) -> None:
        """Add both up in nanoseconds."""
        object.__setattr__(self, 'nanoseconds', round(seconds * _SECOND) + int(nanoseconds))

    @classmethod
    def from_msg(cls, msg: Any) -> Time:
        """Read a builtin_interfaces/msg/Time."""
        return cls(nanoseconds=msg.sec * _SECOND + msg.nanosec)

    def to_msg(self) -> Any:
        """Return a builtin_interfaces/msg/Time."""
        whole, rest = divmod(self.nanoseconds, _SECOND)
        return message_class('builtin_interfaces/msg/Time')(sec=whole, nanosec=rest)

    def seconds_nanoseconds(self) -> tuple[int, int]:
        """Return whole seconds and the remaining nanoseconds."""
        return divmod(self.nanoseconds, _SECOND)

    def __add__(self, other: Duration) -> Time:
        """Return the moment after a span."""
        return Time(nanoseconds=self.nanoseconds + other.nanoseconds)

    def __sub__(self, other: Time) -> Duration:
        """Return the span since another moment."""
        return Duration(nanoseconds=self.nanoseconds - other.nanoseconds)


class Clock:
    """ROS time: the system's, or that of /clock while ``use_sim_time`` is set."""

    def __init__(self) -> None:
        """Start on system time."""
        self.simulated: int | None = None

    def now(self) -> Time:
        """Return the present moment."""
        if self.simulated is not None:
            return Time(nanoseconds=self.simulated)
        return Time(nanoseconds=system.time_ns())
