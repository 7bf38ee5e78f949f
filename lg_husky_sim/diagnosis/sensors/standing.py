# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Wheels that stand still in a log whose pose moves.

They have no relation to anything: nothing can be in proportion to what is always zero. A side
stands where its angle stays within what counts as motion, times one window, in every stretch.
"""

from __future__ import annotations

from collections.abc import Sequence

from lg_husky_sim.diagnosis.sensors.ways import advance, heading, turned_left, turned_right
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.recording import Segment
import numpy as np


def standing(parts: Sequence[Segment]) -> tuple[tuple[str, ...], float]:
    """
    Return which sides stand still, and for how long the pose moves meanwhile.

    Parameters
    ----------
    parts : sequence of Segment
        Stretches of all recordings; those without wheels or pose tell nothing.

    Returns
    -------
    tuple of str
        ``left``, ``right``; empty where the pose moves for less than ``least_moved``.
    float
        Time in windows in which the pose drives or turns [s].

    """
    seconds, still = 0.0, {'left': True, 'right': True}
    most = setting('least_wheel_motion') * setting('relation_window')
    for part in parts:
        left, right = turned_left(part), turned_right(part)
        if heading(part) is None or left is None or right is None:
            continue
        for side, (_, angle) in (('left', left), ('right', right)):
            still[side] &= float(np.ptp(angle)) < most
        seconds += _moved(part)
    enough = seconds >= setting('least_moved')
    return tuple(side for side, stands in still.items() if stands and enough), seconds


def _moved(part: Segment) -> float:
    # Time in which the pose drives or turns faster than what counts as motion.
    span, moves = setting('relation_window'), np.zeros(0, dtype=np.bool_)
    for way, least in ((advance(part), 'least_speed'), (heading(part), 'least_yaw_rate')):
        if way is None:
            continue
        times, values = way
        edges = np.arange(times[0], times[-1], span)
        faster = np.abs(np.diff(np.interp(edges, times, values))) > setting(least) * span
        moves = faster if not moves.size else moves | faster
    return span * int(np.count_nonzero(moves))
