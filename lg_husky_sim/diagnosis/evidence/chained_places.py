# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a simulated robot is that drives along the measured heading."""

from __future__ import annotations

from lg_husky_sim.diagnosis.evidence.drives import Drive
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.signals import FloatArray
import numpy as np


def chained(drive: Drive, distance: FloatArray, reading: Reading
            ) -> tuple[FloatArray, FloatArray]:
    """
    Return x and y of a drive from the distances at the stamps of its pose.

    The way between two stamps is the chord of an arc from one measured heading to the next.

    Parameters
    ----------
    drive : Drive
        With a pose.
    distance : numpy.ndarray, shape (n,)
        Driven since the start [m].
    reading : Reading
        How the frame of the pose lies on the robot.

    Returns
    -------
    tuple of numpy.ndarray, shapes (n,)
        [m]

    """
    turn, lever = reading.get('pose_turn'), reading.get('pose_lever')
    first, shorter, ways, levers = drive.memory.remembered(
        'ways', turn, lambda: _ways(drive, turn))
    chord = np.diff(distance) * shorter
    x, y = (start + distance[0] * ahead + np.concatenate([[0.0], np.cumsum(chord * way)])
            for start, ahead, way in zip((drive.pose.x, drive.pose.y), first, ways, strict=True))
    x += lever * levers[0]
    y += lever * levers[1]
    return x, y


def _ways(drive: Drive, turn: float) -> tuple[
        tuple[float, float], FloatArray, FloatArray, FloatArray]:
    # Cosine and sine of the first direction; chord over arc, cosine and sine of its direction,
    # from each stamp to the next; how far the direction of a lever has moved.
    heading = drive.heading - turn
    half = 0.5 * np.diff(heading)
    middle = heading[:-1] + half
    own = drive.heading
    return ((float(np.cos(heading[0])), float(np.sin(heading[0]))), np.sinc(half / np.pi),
            np.stack([np.cos(middle), np.sin(middle)]),
            np.stack([np.cos(own) - np.cos(own[0]), np.sin(own) - np.sin(own[0])]))
