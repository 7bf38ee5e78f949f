# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
How sure an answer is, by a logistic function of what informs about it.

For each verdict ``p = 1 / (1 + exp(-(c0 + c1 x1 + ...)))``. Posterior odds carry no information:
the form of no law is exact, so that they are near 1 for right and wrong names alike. The margin to
the next name is not used: where it is small, the names are declared not to be told apart. What
informs of the names is what a smooth effort still explains as a share of what they explain,
``x1 = log(share)``, and how much the one that gains least does, ``x2 = log10(gain)``; of
``unknown``, that share; of ``nothing``, whether the largest gain is beyond chance all the same
(``x1`` is 1 then, else 0), since what is too little to be called real is real often enough, and
what a smooth effort explains, ``x2 = log10(evidence)``.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

from lg_husky_sim.diagnosis.decision.adoption import is_beyond_chance
from lg_husky_sim.diagnosis.result import Verdict
from lg_husky_sim.diagnosis.settings import setting

#: Verdict to the settings that are its coefficients, c0, c1, ...
COEFFICIENTS = {
    Verdict.KNOWN: ('name_constant', 'name_share', 'name_gain'),
    Verdict.NOTHING_MISSING: ('nothing_constant', 'nothing_beyond', 'nothing_left'),
    Verdict.UNKNOWN: ('unknown_constant', 'unknown_share_slope'),
}


@dataclass(frozen=True)
class Features:
    """
    What a confidence is made of.

    Parameters
    ----------
    gain : float
        Of the name that gains least, or of the best one where none is adopted [nats].
    share : float
        Evidence of a smooth effort beside the names over what these gain.
    chance : float
        Probability of such a gain on a robot that lacks nothing.
    left : float
        Largest log evidence of an effort without a name that is not negligible [nats], 0 if none.
    needed : float
        What of it is beyond chance [nats].

    """

    gain: float
    share: float
    chance: float
    left: float = 0.0
    needed: float = 0.0


def informs(verdict: Verdict, features: Features) -> tuple[float, ...]:
    """
    Return what informs about a verdict, x1, ...

    Parameters
    ----------
    verdict : Verdict
        What is to be informed about: each has features of its own.
    features : Features
        Gain, share and chance at the end of a search.

    Returns
    -------
    tuple of float
        Bounded: what is below the least share or gain, or above the largest share, is told apart
        by nobody.

    """
    if verdict is Verdict.NOTHING_MISSING:
        left = features.share * max(features.gain, setting('least_told_gain'))
        return (float(is_beyond_chance(features.chance)),
                math.log10(max(left, setting('least_told_gain'))))
    share = math.log(min(max(features.share, setting('least_told_share')),
                         setting('most_told_share')))
    if verdict is Verdict.UNKNOWN:
        return (share,)
    return share, math.log10(max(features.gain, setting('least_told_gain')))


def confidence(verdict: Verdict, features: Features) -> float:
    """Return how likely a verdict, with its first name, is right."""
    constant, *slopes = (setting(name) for name in COEFFICIENTS[verdict])
    return 1.0 / (1.0 + math.exp(-constant - sum(
        slope * x for slope, x in zip(slopes, informs(verdict, features), strict=True))))
