# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Angles that an encoder counts while its factor changes: what was counted stays."""

from __future__ import annotations

from collections.abc import Sequence

from lg_husky_sim.husky.effects import Onset, OnsetKind
from lg_husky_sim.signals import FloatArray
import numpy as np


def counted(angles: FloatArray, begin: float, factors: Sequence[float], late: FloatArray
            ) -> FloatArray:
    """
    Return what an encoder has counted.

    Parameters
    ----------
    angles : numpy.ndarray, shape (n,)
        Of its wheel, at the readings in the order of time [rad].
    begin : float
        Angle of both at the start [rad].
    factors : sequence of float
        Of the encoder, before an onset and after it.
    late : numpy.ndarray, shape (n,)
        Of :func:`shares`.

    Returns
    -------
    numpy.ndarray, shape (n,)
        [rad]

    """
    first, last = factors[0], factors[-1]
    if first == last:
        return begin + first * (angles - begin)
    turned = np.diff(angles, prepend=begin)
    return np.asarray(begin + np.cumsum((first + (last - first) * late) * turned))


def shares(onset: Onset, times: FloatArray, x: FloatArray) -> FloatArray:
    """
    Return for how much of the time up to each reading effects with an onset act.

    Parameters
    ----------
    onset : Onset
        A time in the recording, or a place.
    times, x : numpy.ndarray, shape (n,)
        In order [s], and where the robot is then [m].

    Returns
    -------
    numpy.ndarray, shape (n,)
        From 0 to 1, of the time since the reading before; of the first one whether they act there.

    """
    match onset.kind:
        case OnsetKind.TIME:
            ahead = times - onset.value
        case OnsetKind.PLACE_ABOVE:
            ahead = x - onset.value
        case OnsetKind.PLACE_BELOW:
            ahead = onset.value - x
    beyond, away = np.maximum(ahead, 0.0), np.abs(ahead)
    whole = away[1:] + away[:-1]
    part = np.where(whole > 0.0, beyond[1:] + beyond[:-1], 1.0) / np.where(whole > 0.0, whole, 1.0)
    return np.asarray(np.append((ahead[:1] >= 0.0).astype(np.float64), part))
