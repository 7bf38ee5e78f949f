# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
How sure an answer is, by logistic functions of what informs about it.

Posterior odds carry no information: the form of no law is exact, so that they are near 1 for right
and wrong names alike. What informs is the margin to the next name that is not negligible,
``1 - score_2 / score_1`` (score: gain less what its numbers cost), what a smooth effort still
explains as a share of what the name explains, and how far a gain is beyond chance.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

from lg_husky_sim.diagnosis.settings import setting


@dataclass(frozen=True)
class Features:
    """
    What a confidence is made of.

    Parameters
    ----------
    gain : float
        Of the first name [nats].
    margin : float
        1 - score of the next name / score of the first, 0 to 1; less where the first is not the
        one of the largest score.
    share : float
        Evidence of a smooth effort beside the name over the gain of the name.
    chance : float
        Probability of such a gain on a robot that lacks nothing.
    """

    gain: float
    margin: float
    share: float
    chance: float


def _logistic(value: float) -> float:
    return 1.0 / (1.0 + math.exp(-min(max(value, -30.0), 30.0)))


def of_name(features: Features) -> float:
    """Return how likely the first name is right."""
    return _logistic(setting('name_constant')
                     + setting('name_margin') * math.log(max(features.margin, 1e-3))
                     + setting('name_share') * math.log1p(min(max(features.share, 0.0), 10.0)))


def of_nothing(features: Features) -> float:
    """Return how likely it is that nothing is missing."""
    return _logistic(setting('nothing_constant')
                     + setting('nothing_chance') * math.log10(max(features.chance, 1e-12)))


def of_unknown(features: Features) -> float:
    """Return how likely it is that what is missing has no name."""
    return _logistic(setting('unknown_constant')
                     + setting('unknown_share_slope') * math.log(max(features.share, 1e-3)))
