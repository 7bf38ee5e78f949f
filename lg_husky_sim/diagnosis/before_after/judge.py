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


def chance_of_one(gain: float, own: Sequence[float], best: Sequence[float], count: int,
                  recordings: int, numbers: Mapping[str, float]) -> float:
    """
    Return how probable the gain of one of several changes is where nothing has changed.

    By what it gains in the other partitions itself, with what the best of all gains there as the
    expected mean, if that is more; for each of those that are weighed (Bonferroni)::

        b = max(null_gain, mean of the best),  m = min(n, recordings - 2)
        P = count (1 + gain / (a b + m mean of its own))^-(a + m)

    or by the best of all, where that is less: whichever it is that gains by chance. The gains of
    one change in all partitions come from as many values as there are recordings, less the mean of
    each set: where one is large, the others are small. They are worth no more than that many.

    Parameters
    ----------
    gain : float
        Of the sets as they are [nats].
    own, best : sequence of float
        Of the other partitions: of this change, and of whichever gains most [nats].
    count : int
        Changes that are weighed.
    recordings : int
        Of both sets.
    numbers : mapping of str to float
        ``decision`` of the settings.

    Returns
    -------
    float
        At most 1.

    """
    mean = max([numbers['null_gain'], *([sum(max(one, 0.0) for one in best) / len(best)]
                                        if best else [])])
    return min(exchange_chance(gain, best, numbers), count * exchange_chance(
        gain, own, {**numbers, 'null_gain': mean}, recordings - 2))


def exchange_chance(gain: float, others: Sequence[float], numbers: Mapping[str, float],
                    most: int | None = None) -> float:
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
    most : int, optional
        What the other partitions are worth at most; if not given, one each.

    Returns
    -------
    float

    """
    weight = numbers['null_weight']
    worth = len(others) if most is None else min(len(others), most)
    total = weight * numbers['null_gain']
    if worth:
        total += worth / len(others) * sum(max(one, 0.0) for one in others)
    return float((1.0 + max(gain, 0.0) / total) ** -(weight + worth))
