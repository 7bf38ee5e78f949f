# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A team's own code, for the tests beside it: follow a circle by what odometry says."""

from __future__ import annotations

import math

from lg_husky_sim.signals import BodyTwist, Pose


class CircleFollower:
    """
    Drive around a centre at constant speed.

    Parameters
    ----------
    x, y : float
        Centre [m].
    radius : float
        [m]
    speed : float
        [m/s], positive for counter-clockwise.

    """

    def __init__(self, x: float, y: float, radius: float, speed: float) -> None:
        """Keep the circle."""
        self.x, self.y, self.radius, self.speed = x, y, radius, speed

    def command(self, pose: Pose) -> BodyTwist:
        """Return the command at a pose: feed-forward, and gains on distance and heading."""
        dx, dy = pose.x - self.x, pose.y - self.y
        outside = math.hypot(dx, dy) - self.radius
        wanted = math.atan2(dy, dx) + math.pi / 2.0
        off = math.remainder(wanted - pose.heading, 2.0 * math.pi)
        yaw = self.speed / self.radius + 2.0 * off + 2.0 * outside
        return BodyTwist(self.speed, max(-1.5, min(1.5, yaw)))
