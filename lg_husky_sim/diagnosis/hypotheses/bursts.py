# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Efforts that come in bursts: gusts, kicks, a load that swings.

A noise whose intensity is estimated takes them in as if they were everywhere. They show in the
scores ``z = c' e / |c|`` of short efforts one after the other: of one scale if the effort is the
same noise all the time, of two where it bursts. The evidence is the ratio of the likelihoods of
both, less what the two further numbers cost::

    log p(z; (1 - q) N(0, a^2) + q N(0, b^2)) - log p(z; N(0, s^2)) - log n

A rough floor acts the more the faster the robot is, and not at rest: scores are compared with
others at like speeds.
"""

from __future__ import annotations

from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.signals import FloatArray
import numpy as np


def levelled(scores: FloatArray, speeds: FloatArray) -> FloatArray:
    """
    Return scores over what is usual at their speeds.

    Parameters
    ----------
    scores : numpy.ndarray, shape (n,)
        In any unit; their mean square may depend on the speed. Those of nothing tell nothing.
    speeds : numpy.ndarray, shape (n,)
        Of the robot, in any unit.

    Returns
    -------
    numpy.ndarray, shape (n,)
        Of a mean square of one in each of some groups of like speed.

    """
    found = np.where(_tells(scores), scores, 0.0)
    count = max(1, min(int(setting('burst_speeds')), scores.size // int(setting('burst_least'))))
    for group in np.array_split(np.argsort(speeds, kind='stable'), count):
        own = found[group]
        if np.any(own):
            found[group] = own / np.sqrt(np.mean(own[own != 0.0] ** 2))
    return found


def _tells(scores: FloatArray) -> np.typing.NDArray[np.bool_]:
    # Where there is a score: an effort that no sensor sees has none, or one of zero.
    return np.asarray(np.isfinite(scores) & (scores != 0.0), dtype=np.bool_)


def burst_evidence(scores: FloatArray) -> float:
    """
    Return the evidence that scores have two scales.

    Parameters
    ----------
    scores : numpy.ndarray, shape (n,)
        In the order of time. The strongest one and its neighbours are left out: what happens
        once is an accident of a log more often than physics. Those of nothing tell nothing.

    Returns
    -------
    float
        [nats]

    """
    scores = scores[_tells(scores)]
    strongest = int(np.argmax(np.abs(scores))) if scores.size else 0
    reach = int(setting('burst_reach'))
    squares = np.delete(scores, np.arange(
        max(0, strongest - reach), min(scores.size, strongest + reach + 1))) ** 2
    if squares.size < int(setting('burst_least')) or not np.any(squares > 0.0):
        return 0.0
    usual = float(np.mean(squares))
    single = -0.5 * float(np.sum(squares / usual + np.log(usual)))
    share = setting('burst_share')
    large = float(np.mean(np.sort(squares)[-max(1, int(share * squares.size)):]))
    least = 1e-6 * usual
    small = max(float(np.median(squares)), least)
    before = -np.inf
    while True:
        quiet = np.log1p(-share) - 0.5 * (squares / small + np.log(small))
        burst = np.log(share) - 0.5 * (squares / large + np.log(large))
        both = np.logaddexp(quiet, burst)
        found = float(np.sum(both))
        if not found >= before + setting('fit_converged'):
            return (found if found > before else before) - single - float(np.log(squares.size))
        before, part = found, np.exp(burst - both)
        share = float(np.clip(np.mean(part), 1.0 / squares.size, 0.5))
        small = max(float(np.sum((1.0 - part) * squares) / np.sum(1.0 - part)), least)
        large = max(float(np.sum(part * squares) / np.sum(part)), least)
