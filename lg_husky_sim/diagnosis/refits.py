# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Put scored candidates into a fitted model and refit everything, one task each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
import math

from lg_husky_sim.diagnosis.candidates import Candidate, neutral
from lg_husky_sim.diagnosis.fits import cost_at, extras_of, Fit, fit_structure
from lg_husky_sim.diagnosis.screening import Score, Signature, signatures_of
from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.identification.noise import Metric
from lg_husky_sim.identification.problem import Observations
import numpy as np

#: Parts of a scored size that a refit may begin from.
GENTLER = (1.0, 0.4, 0.1)
#: Part of what screening promised that a value of the catalogue must keep; else it is looked for
#: between the catalogue's values, in so many steps.
KEPT, STEPS_BETWEEN = 0.25, 9
#: Ratio of the golden section.
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


@dataclass(frozen=True, eq=False)
class Looked:
    """A candidate to be looked at on top of a fit: arguments of :func:`look`."""

    candidate: Candidate
    base: Fit
    observations: Observations


def look(task: Looked) -> list[Signature]:
    """Return the signatures of a candidate on top of a fit."""
    base = task.base
    return signatures_of(task.candidate, base.structure, base.parameters, extras_of(base),
                         task.observations, base.solution.predicted)


@dataclass(frozen=True, eq=False)
class Refit:
    """A candidate to be refitted: arguments of :func:`refit`."""

    observations: Observations
    base: Fit
    nominal: Parameters
    score: Score
    metric: Metric
    steps: int = 2
    start: Fit | None = None


def run_refit(task: Refit) -> Fit | None:
    """Return what :func:`refit` does with a task."""
    return refit(task.observations, task.base, task.nominal, task.score, task.metric,
                 task.steps, task.start)


def _sizes(score: Score) -> list[dict[str, float]]:
    # Values of an effect's parameters to begin from: as scored, smaller, and the catalogue's.
    candidate = score.signature.candidate
    start = dict(score.signature.start)
    if not candidate.signed:
        return [start, *(dict(other) for other in candidate.starts if dict(other) != start)]
    return [{name: neutral(name) + part * float(np.clip(size, -8.0, 8.0)) * (
        value - neutral(name)) for (name, value), size in zip(
            start.items(), score.size, strict=True)} for part in GENTLER]


def _others(candidate: Candidate, chosen: Mapping[str, float]) -> list[dict[str, float]]:
    # The catalogue's other values of each number of an effect that has several of them.
    if candidate.signed or len(chosen) < 2:
        return []
    return [{name: value} for name in chosen
            for value in dict.fromkeys(start[name] for start in candidate.starts)
            if value != chosen[name]]


def between(cost: Callable[[Mapping[str, float]], float], harmful: Mapping[str, float],
            idle: Mapping[str, float]) -> tuple[float, dict[str, float]]:
    """
    Look for the best size between one that does too much and one that does nothing.

    Parameters
    ----------
    cost : callable
        Of the values of an effect's parameters [nats].
    harmful, idle : mapping of str to float
        Values of the same parameters; a limit between them may begin to act anywhere.

    Returns
    -------
    float
        Lowest cost that was met.
    dict of str to float
        Its values, on the straight line of the logarithms where both are positive.
    """
    def at(part: float) -> dict[str, float]:
        return {name: value * (idle[name] / value) ** part if value * idle[name] > 0.0
                else value + part * (idle[name] - value) for name, value in harmful.items()}

    def seen(part: float) -> tuple[float, float]:
        return cost(at(part)), part
    low, high = 0.0, 1.0
    inner, outer = seen(high - GOLDEN), seen(low + GOLDEN)
    best = min(inner, outer)
    for _ in range(STEPS_BETWEEN - 2):
        # Where both cost the same the effect does nothing yet: it begins nearer to the harmful.
        if inner[0] <= outer[0]:
            high, outer = outer[1], inner
            inner = seen(high - GOLDEN * (high - low))
        else:
            low, inner = inner[1], outer
            outer = seen(low + GOLDEN * (high - low))
        best = min(best, inner, outer)
    return best[0], at(best[1])


def refit(observations: Observations, base: Fit, nominal: Parameters, score: Score,
          metric_: Metric, steps: int = 2, start: Fit | None = None) -> Fit | None:
    """
    Put a scored candidate into the base and refit everything.

    Parameters
    ----------
    observations : Observations
    base : Fit
    nominal : Parameters
    score : Score
    metric_ : Metric
    steps : int
    start : Fit, optional
        Where an earlier, shorter refit of the same candidate ended; it is then polished.

    Returns
    -------
    Fit or None
    """
    effect = replace(score.signature.candidate.effect, late=score.onset is not None)
    try:
        structure = base.structure.with_effect(effect, score.onset)
    except LgHuskyError:
        return None
    own = {name: base.parameters[name] for e in base.structure.effects
           for name in (p.name for p in e.parameters())}
    if start is not None:
        sizes = {**own, **_sizes(score)[0]}
        return fit_structure(observations, structure, nominal, metric_,
                             dict(start.solution.values), sizes, steps)

    def cost(sized: Mapping[str, float]) -> float:
        return cost_at(observations, structure, nominal, metric_,
                       {**base.solution.values, **sized}, {**own, **sized})
    # The signature is a straight line through a bent world: begin where it is really best.
    tried = [(cost(sized), sized) for sized in _sizes(score)]
    least, sized = min(tried, key=lambda one: one[0])
    if not score.signature.candidate.signed and tried[0][1] is not sized:
        idle = cost_at(observations, base.structure, nominal, metric_, base.solution.values, own)
        if idle - least < KEPT * score.gain:
            # A limit between two of its values: the one does too much, the other nothing.
            least, sized = min((least, sized), between(cost, tried[0][1], sized),
                               key=lambda one: one[0])
    for other in _others(score.signature.candidate, sized):
        # One number after the other: a limit above all commands has no slope to follow.
        again = cost(mixed := {**sized, **other})
        if again < least:
            least, sized = again, mixed
    return fit_structure(observations, structure, nominal, metric_,
                         {**base.solution.values, **sized}, {**own, **sized}, steps, base,
                         polish=False)
