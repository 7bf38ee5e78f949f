# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Find the effects that a recalibrated model lacks.

The nominal model is recalibrated first, within the tolerances of its parameters. Then, round by
round: every candidate is screened by its signature; the serious ones are refitted together with
the recalibration; all are compared under one metric, whose correlation is estimated on what the
best of them leaves; the winner is adopted if its gain on held-out blocks is beyond chance and a
material share of what was unexplained.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from lg_husky_sim.diagnosis.candidates import (
    Candidate, candidates, effect_entries, effect_unknowns, nuisance)
from lg_husky_sim.diagnosis.screening import (
    Onsets, Projector, Score, Signature, place_onsets, scan, signatures_of, time_onsets)
from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.husky.effects import Effect, Onset
from lg_husky_sim.husky.model import Structure, compile_model
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.identification.least_squares import Problem, Solution, Unknown, solve
from lg_husky_sim.identification.noise import Metric, metric, scales
from lg_husky_sim.identification.problem import Observations
from lg_husky_sim.signals import FloatArray

#: Candidates that are refitted in a round.
SERIOUS = 7
#: Folds and block length of the held-out gain [s].
FOLDS = 4
BLOCK = 5.0
#: Least held-out gain of an adopted effect [nats].
LEAST_GAIN = 12.0
#: Least share of the unexplained energy that the first and a further effect must explain.
LEAST_SHARE = (0.03, 0.1)
#: Most effects that are named.
MOST = 3


@dataclass(frozen=True, eq=False)
class Fit:
    """
    A structure fitted to all observations.

    Parameters
    ----------
    structure : Structure
    parameters : Parameters
        Estimates of the model's parameters.
    solution : Solution
    """

    structure: Structure
    parameters: Parameters
    solution: Solution

    @property
    def residual_of(self) -> FloatArray:
        """Prediction of the fit, shape (n_values,)."""
        return self.solution.predicted


@dataclass(frozen=True, eq=False)
class Rival:
    """
    A candidate as it was refitted in one round.

    Parameters
    ----------
    effect : Effect
    onset : Onset or None
    fit : Fit
    gain : float
        Drop of the half sum of squares against the round's base, all data [nats].
    held_out : float
        The same on blocks that were not fitted [nats].
    """

    effect: Effect
    onset: Onset | None
    fit: Fit
    gain: float
    held_out: float


@dataclass(frozen=True, eq=False)
class Round:
    """
    One round of the search.

    Parameters
    ----------
    base : Fit
        What it began with.
    scores : tuple of Score
        The screening, best first.
    rivals : tuple of Rival
        The refitted candidates, best held-out gain first.
    metric : Metric
        Under which they were compared.
    share : float
        Share of the base's unexplained energy that the best one explains.
    adopted : bool
    """

    base: Fit
    scores: tuple[Score, ...]
    rivals: tuple[Rival, ...]
    metric: Metric
    share: float
    adopted: bool


@dataclass(frozen=True, eq=False)
class Search:
    """
    The whole search.

    Parameters
    ----------
    observations : Observations
    plain : Fit
        Recalibrated, nothing added.
    final : Fit
        With the adopted effects.
    rounds : tuple of Round
    """

    observations: Observations
    plain: Fit
    final: Fit
    rounds: tuple[Round, ...] = field(default=())


Progress = Callable[[str, float], None]


def _silent(text: str, share: float) -> None:
    del text, share


def fit_structure(observations: Observations, structure: Structure, nominal: Parameters,
                  metric_: Metric, start: Mapping[str, float],
                  effects: Mapping[str, float], steps: int = 8) -> Fit | None:
    """
    Refit a structure: the recalibration together with the parameters of its effects.

    Parameters
    ----------
    observations : Observations
    structure : Structure
    nominal : Parameters
        Centres of the recalibration's priors.
    metric_ : Metric
    start : mapping of str to float
        Values to start from.
    effects : mapping of str to float
        Sizes of the effects' parameters, to scale their steps.
    steps : int

    Returns
    -------
    Fit or None
        None where it cannot be evaluated.
    """
    unknowns: list[Unknown] = list(nuisance(nominal, structure, observations.channels))
    entries = []
    for effect in structure.effects:
        unknowns.extend(effect_unknowns(effect, effects))
        entries.extend(effect_entries(effect, {**effects, **start}))
    try:
        model = compile_model(structure)
    except LgHuskyError:
        return None
    parameters = nominal.with_entries(*entries)
    problem = Problem(observations, model, parameters, metric_, unknowns)
    solution = solve(problem, {**effects, **start}, steps=steps)
    if solution is None:
        return None
    inner = {u.name: solution.values[u.name] for u in unknowns if not u.extra}
    return Fit(structure, parameters.replacing(inner), solution)


def extras_of(fit: Fit) -> dict[str, float]:
    """Return the observation's extras of a fit."""
    return {u.name: fit.solution.values[u.name] for u in fit.solution.unknowns if u.extra}


def first_metric(observations: Observations, predicted: FloatArray) -> Metric:
    """Return a metric without correlation, from a first prediction."""
    scale = scales(observations, observations.measured - predicted, predicted)
    return metric(observations, observations.measured - predicted, scale, order=0)


def recalibrate(observations: Observations, structure: Structure, nominal: Parameters) -> Fit:
    """
    Fit the nominal model within the tolerances of its parameters.

    Parameters
    ----------
    observations : Observations
    structure : Structure
    nominal : Parameters

    Returns
    -------
    Fit
    """
    predicted = observations.predict(compile_model(structure).at(nominal))
    start: Mapping[str, float] = {p: nominal[p] for p in nominal}
    fit: Fit | None = None
    for _ in range(2):
        fit = fit_structure(observations, structure, nominal,
                            first_metric(observations, predicted), start, start)
        if fit is None:
            raise LgHuskyError('the nominal model cannot be evaluated')
        predicted, start = fit.solution.predicted, fit.solution.values
    assert fit is not None
    return fit


def shared_metric(observations: Observations, fit: Fit, signatures: Sequence[Signature]
                  ) -> Metric:
    """
    Estimate the correlation on what neither a fit nor any signature explains.

    Parameters
    ----------
    observations : Observations
    fit : Fit
    signatures : sequence of Signature

    Returns
    -------
    Metric
    """
    predicted = fit.solution.predicted
    residual = observations.measured - predicted
    scale = scales(observations, residual, predicted)
    columns = np.column_stack([fit.solution.jacobian, *(s.columns for s in signatures)]) * (
        scale[:, None])
    norms = np.sqrt(np.sum(columns ** 2, axis=0))
    columns = columns[:, norms > 1e-9] / norms[norms > 1e-9]
    scaled = residual * scale
    gram = columns.T @ columns + 1e-6 * np.eye(columns.shape[1])
    left = scaled - columns @ np.linalg.solve(gram, columns.T @ scaled)
    safe = np.where(scale > 0.0, scale, 1.0)
    return metric(observations, np.where(scale > 0.0, left / safe, 0.0), scale)


def folds_of(observations: Observations) -> FloatArray:
    """Return the fold of each value: blocks in time, dealt in turn, shape (n_values,)."""
    fold = np.zeros(observations.times.size)
    for one in observations.slices:
        part = slice(one.first, one.last)
        shift = observations.recordings.index(observations.pieces[one.piece].recording)
        fold[part] = (np.floor(observations.times[part] / BLOCK) + shift) % FOLDS
    return fold


def held_out_cost(observations: Observations, fit: Fit, metric_: Metric, folds: FloatArray
                  ) -> FloatArray:
    """
    Return half the squared whitened residual of each value when its fold is not fitted.

    One linear step from the full estimate stands for the refit without a fold.

    Parameters
    ----------
    observations : Observations
    fit : Fit
    metric_ : Metric
    folds : numpy.ndarray, shape (n_values,)

    Returns
    -------
    numpy.ndarray, shape (n_values,)
    """
    solution = fit.solution
    white = metric_.whiten(observations, observations.measured - solution.predicted)
    slope = metric_.whiten(observations, solution.jacobian)
    deviations = np.array([u.deviation for u in solution.unknowns])
    varied = np.array([u.varied(solution.values[u.name]) for u in solution.unknowns])
    centres = np.array([u.centre for u in solution.unknowns])
    weights = 1.0 / deviations ** 2
    pull = np.where(np.isfinite(deviations), (varied - centres) * weights, 0.0)
    cost = np.zeros(white.size)
    for fold in range(FOLDS):
        out = folds == fold
        inside = slope[~out]
        curvature = inside.T @ inside + np.diag(weights)
        curvature += 1e-9 * np.diag(np.diag(curvature)) + 1e-12 * np.eye(len(varied))
        move = np.linalg.solve(curvature, inside.T @ white[~out] - pull)
        left = white[out] - slope[out] @ move
        cost[out] = 0.5 * left ** 2
    return cost


def energy(observations: Observations, fit: Fit, metric_: Metric) -> float:
    """Return the sum of squares of the scaled residual, correlation left in."""
    scaled = (observations.measured - fit.solution.predicted) * metric_.scale
    return float(np.sum(np.minimum(scaled ** 2, 1e6)))


def _sized(score: Score) -> dict[str, float]:
    # Values of an effect's parameters from a score's multiples.
    candidate = score.signature.candidate
    start = dict(score.signature.start)
    if candidate.signed:
        from lg_husky_sim.diagnosis.candidates import neutral
        return {name: neutral(name) + float(np.clip(size, -8.0, 8.0)) * (value - neutral(name))
                for (name, value), size in zip(start.items(), score.size, strict=True)}
    return start


def refit(observations: Observations, base: Fit, nominal: Parameters, score: Score,
          metric_: Metric, steps: int = 5) -> Fit | None:
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

    Returns
    -------
    Fit or None
    """
    effect = replace(score.signature.candidate.effect, late=score.onset is not None)
    try:
        structure = base.structure.with_effect(effect, score.onset)
    except LgHuskyError:
        return None
    sized = _sized(score)
    sizes = {**{name: base.parameters[name] for e in base.structure.effects
                for name in (p.name for p in e.parameters())}, **sized}
    start = {**base.solution.values, **sized}
    return fit_structure(observations, structure, nominal, metric_, start, sizes, steps)


def search(observations: Observations, structure: Structure, nominal: Parameters,
           progress: Progress = _silent, most: int = MOST) -> Search:
    """
    Search the catalogue.

    Parameters
    ----------
    observations : Observations
    structure : Structure
        Of the model that is in doubt.
    nominal : Parameters
    progress : callable
        Told what is being done and how far it is.
    most : int
        Most effects to adopt.

    Returns
    -------
    Search
    """
    plain = recalibrate(observations, structure, nominal)
    base, rounds = plain, []
    folds = folds_of(observations)
    masks = (time_onsets(observations), place_onsets(observations))
    pool = candidates()
    for number in range(most + 1):
        progress(f'round {number + 1}: signatures', number / (most + 1))
        one = play_round(observations, base, nominal, pool, masks, folds, number)
        rounds.append(one)
        if not one.adopted or number == most:
            break
        base = one.rivals[0].fit
    return Search(observations, plain, base, tuple(rounds))


def play_round(observations: Observations, base: Fit, nominal: Parameters,
               pool: Sequence[Candidate], masks: Sequence[Onsets], folds: FloatArray,
               number: int) -> Round:
    """
    Play one round of the search.

    Parameters
    ----------
    observations : Observations
    base : Fit
    nominal : Parameters
    pool : sequence of Candidate
    masks : sequence of Onsets
        Onsets to try.
    folds : numpy.ndarray
    number : int
        Effects that were adopted before.

    Returns
    -------
    Round
    """
    taken = {(e.id, e.side) for e in base.structure.effects}
    signatures = [s for c in pool if (c.effect.id, c.effect.side) not in taken
                  for s in signatures_of(c, base.structure, base.parameters, extras_of(base),
                                         observations, base.solution.predicted)]
    common = shared_metric(observations, base, signatures)
    residual = observations.measured - base.solution.predicted
    unknowns = base.solution.unknowns
    deviations = np.array([u.deviation for u in unknowns])
    pull = np.array([(u.centre - u.varied(base.solution.values[u.name])) / u.deviation
                     for u in unknowns])
    projector = Projector(observations, common, residual, base.solution.jacobian, deviations,
                          pull)
    late = base.structure.onset is None
    scores = scan(projector, signatures, masks if late else ())
    serious = _serious(scores)
    fits = [(score, refit(observations, base, nominal, score, common)) for score in serious]
    usable = [(score, fit) for score, fit in fits if fit is not None]
    rebased = fit_structure(observations, base.structure, nominal, common,
                            base.solution.values, base.parameters) or base
    if not usable:
        return Round(rebased, tuple(scores), (), common, 0.0, False)
    best = min(usable, key=lambda pair: pair[1].solution.cost)[1]
    final = shared_metric(observations, best, [])
    cost_base = held_out_cost(observations, rebased, final, folds)
    rivals = []
    for score, fit in usable:
        cost = held_out_cost(observations, fit, final, folds)
        white = [0.5 * float(np.sum(final.whiten(
            observations, observations.measured - f.solution.predicted) ** 2))
            for f in (rebased, fit)]
        rivals.append(Rival(fit.structure.effects[-1], score.onset, fit,
                            white[0] - white[1], float(np.sum(cost_base - cost))))
    rivals.sort(key=lambda r: -r.held_out)
    before = energy(observations, rebased, final)
    after = energy(observations, rivals[0].fit, final)
    floor = float(np.count_nonzero(final.scale))
    share = (before - after) / max(before - 0.5 * floor, 1e-9)
    adopted = (rivals[0].held_out > LEAST_GAIN
               and share > LEAST_SHARE[0 if number == 0 else 1])
    return Round(rebased, tuple(scores), tuple(rivals), final, share, adopted)


def _serious(scores: Sequence[Score]) -> list[Score]:
    # The best few, at most two variants of one effect; an onset only where it clearly helps.
    plain = {s.signature.candidate.label: s.gain for s in scores if s.onset is None}
    chosen: list[Score] = []
    counts: dict[str, int] = {}
    for score in scores:
        name = score.signature.candidate.effect.id
        without = plain.get(score.signature.candidate.label, 0.0)
        if score.onset is not None and score.gain < 1.1 * without + 15.0:
            continue
        if counts.get(name, 0) >= 2:
            continue
        counts[name] = counts.get(name, 0) + 1
        chosen.append(score)
        if len(chosen) >= SERIOUS:
            break
    return chosen
