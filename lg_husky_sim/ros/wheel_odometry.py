# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Odometry from wheel angles alone, as the robot's own controller computes it."""

from __future__ import annotations

from collections import deque
import math

from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.husky.by_hand import other_robot
from lg_husky_sim.husky.model_file import load_model, packaged
from lg_husky_sim.signals import BodyTwist, Pose


def assumed_for(model: object) -> dict[str, float]:
    """
    Return what the base of another robot takes for its wheels; a preset's are a Husky's.

    Parameters
    ----------
    model : object
        Path of a model file, as a setting holds it.

    Returns
    -------
    dict of str to float
        Settings by name; none for a Husky, or for a file that cannot be read, of which the node
        says so when it loads it.

    """
    if not isinstance(model, str) or not model:
        return {}
    try:
        numbers = load_model(model).parameters
    except (LgHuskyError, OSError):
        return {}
    if not other_robot(packaged().parameters, numbers):
        return {}
    return {'wheel_radius': numbers['wheel_radius'], 'wheel_separation': numbers['track'],
            'wheel_separation_multiplier': 2.0 * numbers['turn_ratio'] / numbers['track']}


class WheelOdometry:
    """
    Dead reckoning of a differential drive.

    The mean way of the wheels moves the base, their difference over the effective track turns
    it; the arc between two readings is exact for constant wheel rates. On a skid-steer robot
    the effective track is the real one times a multiplier: what it fails to catch is slip.

    Parameters
    ----------
    radius : float
        Wheel radius assumed [m].
    track : float
        Track times multiplier [m].
    window : int
        Velocities averaged in the twist.
    pose : Pose
        Where to begin.

    """

    def __init__(self, radius: float, track: float, window: int, pose: Pose) -> None:
        """Start at a pose."""
        self._radius = radius
        self._track = track
        self._twists: deque[BodyTwist] = deque(maxlen=window)
        self.pose = pose

    @property
    def twist(self) -> BodyTwist:
        """Mean velocity over the window."""
        count = len(self._twists)
        if count == 0:
            return BodyTwist()
        return BodyTwist(math.fsum(t.forward for t in self._twists) / count,
                         math.fsum(t.yaw for t in self._twists) / count)

    def update(self, left: float, right: float, period: float) -> None:
        """
        Take the turns of the wheels since the last reading.

        Parameters
        ----------
        left, right : float
            Angles turned [rad].
        period : float
            Time between the readings [s].

        """
        way = 0.5 * self._radius * (left + right)
        turn = self._radius * (right - left) / self._track
        self._twists.append(BodyTwist(way / period, turn / period))
        pose = self.pose
        half = 0.5 * turn
        chord = way if abs(half) < 1e-9 else way * math.sin(half) / half
        self.pose = Pose(pose.x + chord * math.cos(pose.heading + half),
                         pose.y + chord * math.sin(pose.heading + half), pose.heading + turn)
