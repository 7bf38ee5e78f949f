# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
When a gain is beyond chance.

Twice the gain of a hypothesis with k numbers is nearly chi-square distributed with k degrees of
freedom on a robot that lacks nothing; with n hypotheses tried, the largest of them exceeds a gain
with a probability of at most n times that of one.

Innovations that are not quite white make a gain larger by chance, by their dispersion.

No model is exact, and what a robot differs from it by grows with the number of readings as real
effects do: much of what is beyond chance is too little to be an effect. With the share
``v = 2 gain / n`` of the variance of the n innovations that an effect explains, how likely it is
real is ``p = 1 / (1 + exp(-(c0 + c1 log10 v + d)))``, by what became of the names of exams. Here d
is of the part of the robot that the effect belongs to: errors of sensors have exact forms, while
what a log or a model is off by looks like a command that comes late or a wheel of another size.
An effect is adopted where it is beyond chance and more likely real than not (Bayes' rule where
either error costs as much), or where a robot that its tolerances do not allow is one that they do
with it (:func:`~lg_husky_sim.diagnosis.decision.strain.relieves`).

The log evidence of an effort without a name is the logarithm of a Bayes factor B. Where nothing is
missing, its mean is one, so that ``P(B >= b) <= 1 / b`` (Markov), and with n of them that are
looked at, the largest exceeds ``n / rate`` with a probability of at most that rate.
"""

from __future__ import annotations

import math

from lg_husky_sim.diagnosis.evidence.evidence import Evidence
from lg_husky_sim.diagnosis.hypotheses.hypothesis import Hypothesis
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.effects import Effect
from scipy.special import chdtrc, expit


def chance_of(gain: float, hypothesis: Hypothesis, tried: int, evidence: Evidence,
              inflation: float) -> float:
    """
    Return how likely the largest gain is on a robot that lacks nothing.

    Parameters
    ----------
    gain : float
        [nats]
    hypothesis : Hypothesis
        That gained it; one with an onset was tried at every onset.
    tried : int
        Number of hypotheses and starts.
    evidence : Evidence
        Its length says how many onsets were tried.
    inflation : float
        Of twice the gain, see :func:`lg_husky_sim.diagnosis.evidence.dispersion.dispersion`.

    Returns
    -------
    float
        At most 1.

    """
    count = float(tried)
    if hypothesis.onset is not None:
        seconds = sum(d.end - d.start for d in evidence.drives)
        count *= max(1.0, seconds / setting('onset_resolution'))
    tail = float(chdtrc(hypothesis.size, 2.0 * max(gain, 0.0) / inflation))
    return min(1.0, count * tail)


def is_beyond_chance(chance: float) -> bool:
    """Return whether a gain is beyond the stated false-alarm rate."""
    return chance < setting('false_alarm_rate')


def likely_real(gain: float, count: int, effect: Effect) -> float:
    """
    Return how likely an effect of the catalogue is real if its gain is beyond chance.

    Parameters
    ----------
    gain : float
        [nats]
    count : int
        Number of readings.
    effect : Effect
        Whose part of the robot says how often such a gain is real.

    Returns
    -------
    float
        Between 0 and 1, by the names of exams.

    """
    told = 2.0 * max(gain, setting('least_told_gain')) / count
    return float(expit(setting('real_constant') + setting('real_told') * math.log10(told)
                       + setting(f'real_{effect.kind.subsystem.value}')))


def is_rather_real(gain: float, count: int, effect: Effect) -> bool:
    """Return whether an effect is real more likely than not, see :func:`likely_real`."""
    return likely_real(gain, count, effect) > 0.5


def evidence_beyond_chance(looks: int) -> float:
    """
    Return the log evidence that the best of some efforts without a name needs.

    Parameters
    ----------
    looks : int
        Number of them that were looked at.

    Returns
    -------
    float
        [nats]

    """
    return math.log(looks / setting('false_alarm_rate'))
