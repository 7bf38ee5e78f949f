# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Ask for earlier names again once a later one is in place.

The first effect of a search is chosen while the others are still missing, and may have been named
for what one of them does: a stream with late stamps looks like an acceleration limit at first.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
import math

from lg_husky_sim.diagnosis.fits import Fit, fit_structure
from lg_husky_sim.diagnosis.rivals import LEAST_GAIN
from lg_husky_sim.diagnosis.rounds import left_by, Round
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import Structure
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.identification.noise import Metric
from lg_husky_sim.identification.problem import Observations

#: Loss per value below which an earlier effect is dropped again [nats].
IDLE = 0.002
#: What an earlier effect must explain, as a multiple of the newest one, to be beyond doubt.
DOMINANT = 2.0
#: What another effect in an earlier one's place must explain more than it [nats].
BETTER = 10.0


def without(observations: Observations, fit: Fit, effect: Effect, nominal: Parameters,
            metric_: Metric, steps: int = 4) -> Fit | None:
    """
    Return a fit refitted without one of its effects.

    Parameters
    ----------
    observations : Observations
    fit : Fit
    effect : Effect
    nominal : Parameters
    metric_ : Metric
    steps : int

    Returns
    -------
    Fit or None
    """
    left = tuple(e for e in fit.structure.effects if e != effect)
    onset = fit.structure.onset if any(e.late for e in left) else None
    sizes = {**fit.parameters, **fit.solution.values}
    return fit_structure(observations, replace(fit.structure, effects=left, onset=onset),
                         nominal, metric_, fit.solution.values, sizes, steps)


def without_idle(observations: Observations, fit: Fit, nominal: Parameters, metric_: Metric,
                 first: Structure) -> Fit:
    """
    Return a fit without the effects that a later one has made needless.

    Parameters
    ----------
    observations : Observations
    fit : Fit
    nominal : Parameters
    metric_ : Metric
    first : Structure
        Of the model in doubt: its own effects stay.

    Returns
    -------
    Fit
    """
    for effect in fit.structure.effects[len(first.effects):-1]:
        again = without(observations, fit, effect, nominal, metric_)
        if again is not None and left_by(observations, again, metric_) - left_by(
                observations, fit, metric_) < idle(observations):
            return again
    return fit


def reconsidered(observations: Observations, fit: Fit, rounds: Sequence[Round],
                 nominal: Parameters, play: Callable[[Fit, int], Round]
                 ) -> tuple[Fit, list[Round]]:
    """
    Play the rounds of earlier effects again, with those adopted since in place.

    Parameters
    ----------
    observations : Observations
    fit : Fit
        With everything that was adopted.
    rounds : sequence of Round
        That adopted it, in their order.
    nominal : Parameters
    play : callable
        Plays a round on a base, after a number of adopted effects.

    Returns
    -------
    Fit
        With another effect in an earlier one's place where that explains more.
    list of Round
        That adopted what the fit has.
    """
    kept, metric_ = list(rounds), rounds[-1].metric
    newest = left_by(observations, rounds[-1].base, metric_) - left_by(
        observations, fit, metric_)
    for one in rounds[:-1]:
        effect = one.rivals[0].effect
        base = without(observations, fit, effect, nominal, metric_)
        if base is None or left_by(observations, base, metric_) - left_by(
                observations, fit, metric_) > DOMINANT * newest:
            continue
        again = play(base, len(kept) - 1)
        if not again.adopted:
            continue
        best = again.rivals[0]
        if (best.effect.id, best.effect.side) != (effect.id, effect.side) and left_by(
                observations, best.fit, again.metric) + BETTER < left_by(
                observations, fit, again.metric):
            fit, kept = best.fit, [r for r in kept if r is not one] + [again]
    return most_needed_first(observations, fit, kept, nominal)


def most_needed_first(observations: Observations, fit: Fit, rounds: Sequence[Round],
                      nominal: Parameters) -> tuple[Fit, list[Round]]:
    """
    Sort rounds by what is lost without their effect; drop those without which nothing is.

    Parameters
    ----------
    observations : Observations
    fit : Fit
        With everything that was adopted.
    rounds : sequence of Round
        That adopted it.
    nominal : Parameters

    Returns
    -------
    Fit
    list of Round
    """
    metric_ = rounds[-1].metric
    lost: list[tuple[float, Round]] = []
    for one in rounds:
        less = without(observations, fit, one.rivals[0].effect, nominal, metric_)
        lost.append((math.inf if less is None else left_by(observations, less, metric_)
                     - left_by(observations, fit, metric_), one))
        if less is not None and lost[-1][0] < idle(observations) and len(rounds) > 1:
            return most_needed_first(
                observations, less, [r for r in rounds if r is not one], nominal)
    return fit, [one for _, one in sorted(lost, key=lambda pair: -pair[0])]


def idle(observations: Observations) -> float:
    """Return the loss below which an earlier effect is dropped again [nats]."""
    return max(LEAST_GAIN[0], IDLE * len(observations.measured))
