# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Which differences are beyond chance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from lg_husky_sim.diagnosis.before_after.evidence import Solution
import numpy as np
from scipy.special import fdtrc


class Weighed(Protocol):
    """What has a gain [nats] and a chance."""

    @property
    def gain(self) -> float: ...
    @property
    def chance(self) -> float: ...


def is_beyond_chance(one: Weighed, numbers: Mapping[str, float]) -> bool:
    """Return whether something gains, by more than chance gives at the false-alarm rate."""
    return one.gain > 0.0 and one.chance < numbers['false_alarm_rate']


def exchange_chance(gain: float, others: Sequence[float], least: float) -> float:
    """
    Return how probable a gain is where recordings may change places between the sets.

    The largest gain of each of the n other partitions and that of the sets as they are then come
    from one distribution. Its tail is taken as exponential, with a scale that the others show::

        P = (1 + gain / sum of the others)^-n

    Parameters
    ----------
    gain : float
        Of the sets as they are [nats].
    others : sequence of float
        Of the other partitions [nats].
    least : float
        What each of these counts as at least [nats].

    Returns
    -------
    float
    """
    total = sum(max(one, least) for one in others)
    return float((1.0 + max(gain, 0.0) / total) ** -len(others))


def chance_of(solved: Solution, freedom: float) -> float:
    """
    Return how probable so large a shift is where nothing has changed.

    The deviations from recording to recording are themselves estimated, so that the shift d of k
    parameters with covariance C is judged by Fisher's distribution::

        P(F(k, freedom) > d' C^-1 d / k)

    Parameters
    ----------
    solved : Solution
    freedom : float
        Degrees of freedom of the deviations.

    Returns
    -------
    float
    """
    size = solved.shift.size
    square = float(solved.shift @ np.linalg.solve(solved.covariance, solved.shift))
    return float(fdtrc(size, freedom, square / size))
