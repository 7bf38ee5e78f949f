# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""In which kind of driving a difference shows."""

from __future__ import annotations

from collections.abc import Mapping

from lg_husky_sim.identification.problem import Observations, Piece
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray

#: Speeds and rates below these count as none [m/s, rad/s]; the low speed; accelerations [m/s²].
STILL = 0.03
TURNING = 0.08
SLOW = 0.25
ACCELERATING = 0.25
#: Words of the regimes.
WORDS: Mapping[str, str] = {
    'rest': 'at rest', 'straight': 'driving straight', 'accelerating': 'while the speed changes',
    'steady_turn': 'in steady turns', 'spin': 'turning on the spot', 'reversing': 'in reverse',
    'slow': 'at low speed',
}


def _motion(piece: Piece, times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    # Commanded speed and yaw rate, and how fast the command changed in the last 0.4 s.
    series = piece.commands
    at = np.maximum(np.searchsorted(series.times, times, side='right') - 1, 0)
    before = np.maximum(np.searchsorted(series.times, times - 0.4, side='right') - 1, 0)
    forward, yaw = series.column('forward'), series.column('yaw')
    change = np.abs(forward[at] - forward[before]) + 0.3 * np.abs(yaw[at] - yaw[before])
    return forward[at], yaw[at], change / 0.4


def regimes(observations: Observations) -> dict[str, NDArray[np.bool_]]:
    """
    Return in which regime each value was measured.

    Parameters
    ----------
    observations : Observations

    Returns
    -------
    dict of str to numpy.ndarray of bool, shape (n_values,)
        By the commands; a value can be in several regimes (in reverse and in a steady turn).
    """
    size = observations.times.size
    found = {name: np.zeros(size, dtype=bool) for name in WORDS}
    for one in observations.slices:
        part = slice(one.first, one.last)
        forward, yaw, change = _motion(observations.pieces[one.piece],
                                       observations.times[part])
        moving = (np.abs(forward) > STILL) | (np.abs(yaw) > STILL)
        changing = change > ACCELERATING
        turning = np.abs(yaw) > TURNING
        found['rest'][part] = ~moving & ~changing
        found['accelerating'][part] = changing
        found['straight'][part] = moving & ~turning & ~changing
        found['spin'][part] = turning & (np.abs(forward) <= STILL) & ~changing
        found['steady_turn'][part] = turning & (np.abs(forward) > STILL) & ~changing
        found['reversing'][part] = forward < -STILL
        found['slow'][part] = moving & (np.abs(forward) < SLOW) & ~changing & ~turning
    return found


def where_it_shows(observations: Observations, gain: FloatArray) -> str:
    """
    Say in words where a gain comes from.

    Parameters
    ----------
    observations : Observations
    gain : numpy.ndarray, shape (n_values,)
        Gain of each value [nats].

    Returns
    -------
    str
        The regimes with the densest gain, densest first.
    """
    total = float(np.sum(gain))
    if total <= 0.0:
        return 'everywhere alike'
    mean = total / gain.size
    rows = []
    for name, mask in regimes(observations).items():
        count = int(np.count_nonzero(mask))
        if count < 20:
            continue
        part = float(np.sum(gain[mask]))
        if part > 0.15 * total and part / count > 1.3 * mean:
            rows.append((part / count, WORDS[name]))
    rows.sort(reverse=True)
    return ', '.join(word for _, word in rows[:2]) or 'everywhere alike'
