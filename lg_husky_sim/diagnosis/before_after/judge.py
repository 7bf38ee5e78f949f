# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Which differences are beyond chance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol


class Weighed(Protocol):
    """What has a gain [nats] and a chance."""

    @property
    def gain(self) -> float: ...
    @property
    def chance(self) -> float: ...


def is_beyond_chance(one: Weighed, numbers: Mapping[str, float]) -> bool:
    """Return whether something gains, by more than chance gives at the false-alarm rate."""
    return one.gain > 0.0 and one.chance < numbers['false_alarm_rate']


def exchange_chance(gain: float, others: Sequence[float], numbers: Mapping[str, float]) -> float:
    """
    Return how probable a gain is where recordings may change places between the sets.

    The largest gain of each of the n other partitions and that of the sets as they are then come
    from one distribution, an exponential one. Its scale differs from robot to robot, by an inverse
    gamma distribution that other robots have shown, of weight a and mean b; what is expected here
    is that of Lomax::

        P = (1 + gain / (a b + sum of the others))^-(a + n)

    Parameters
    ----------
    gain : float
        Of the sets as they are [nats].
    others : sequence of float
        Of the other partitions [nats].
    numbers : mapping of str to float
        ``decision`` of the settings: a is ``null_weight``, b ``null_gain``.

    Returns
    -------
    float
    """
    weight = numbers['null_weight']
    total = weight * numbers['null_gain'] + sum(max(one, 0.0) for one in others)
    return float((1.0 + max(gain, 0.0) / total) ** -(weight + len(others)))
