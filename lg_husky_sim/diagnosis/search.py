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
    RECALIBRATED, Candidate, candidates, effect_entries, effect_unknowns, nuisance)
from lg_husky_sim.diagnosis.screening import (
    Onsets, Projector, Score, Signature, one_onset, place_onsets, scan, signatures_of, time_onsets)
from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.husky.effects import Effect, Onset
from lg_husky_sim.husky.model import Structure, compile_model
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.identification.least_squares import Problem, Solution, Unknown, solve
from lg_husky_sim.identification.noise import Metric, metric, robust, scales
from lg_husky_sim.identification.problem import Observations
from lg_husky_sim.signals import FloatArray

#: Candidates that are refitted in a round.
SERIOUS = 6
#: Of these, those that are refitted to the end.
POLISHED = 4
#: Robust deviations from which an event that nothing explains loses weight.
EVENT = 5.0
#: Folds and block length of the held-out gain [s].
FOLDS = 4
BLOCK = 5.0
#: Least held-out gain of an adopted effect [nats].
LEAST_GAIN = 18.0
#: Least share of the unexplained energy that the first and a further effect must explain.
LEAST_SHARE = (0.01, 0.2)
#: Held-out gain from which a smaller share will do: a narrow effect can be certain [nats].
STRONG_GAIN = (50.0, 400.0)
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
                  effects: Mapping[str, float], steps: int = 8, near: Fit | None = None,
                  polish: bool = True) -> Fit | None:
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
    near : Fit, optional
        A fit without the last effect, whose derivatives serve meanwhile.
    polish : bool
        Whether to end with derivatives at the estimate.

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
    known = None if near is None else _columns(near, unknowns)
    solution = solve(problem, {**effects, **start}, steps=steps, known=known, polish=polish)
    if solution is None:
        return None
    inner = {u.name: solution.values[u.name] for u in unknowns if not u.extra}
    return Fit(structure, parameters.replacing(inner), solution)


def _columns(near: Fit, unknowns: Sequence[Unknown]) -> FloatArray:
    # Derivatives of a nearby fit by those of the unknowns that it has: always the first ones.
    have = {u.name: i for i, u in enumerate(near.solution.unknowns)}
    chosen = []
    for unknown in unknowns:
        if unknown.name not in have:
            break
        chosen.append(have[unknown.name])
    return near.solution.jacobian[:, chosen]


def extras_of(fit: Fit) -> dict[str, float]:
    """Return the observation's extras of a fit."""
    return {u.name: fit.solution.values[u.name] for u in fit.solution.unknowns if u.extra}


def first_metric(observations: Observations, predicted: FloatArray) -> Metric:
    """Return a metric without correlation, from a first prediction."""
    residual = observations.measured - predicted
    scale = robust(observations, residual, scales(observations, residual, predicted), EVENT)
    return metric(observations, residual, scale, order=0)


def recalibrate(observations: Observations, structure: Structure, nominal: Parameters,
                begin: Fit | None = None) -> Fit:
    """
    Fit the nominal model within the tolerances of its parameters.

    Parameters
    ----------
    observations : Observations
    structure : Structure
    nominal : Parameters
    begin : Fit, optional
        A fit of the same structure to begin from.

    Returns
    -------
    Fit
    """
    at = nominal if begin is None else begin.parameters
    sizes: Mapping[str, float] = {p: at[p] for p in at}
    start = sizes if begin is None else {**sizes, **begin.solution.values}
    predicted = observations.predict(compile_model(structure).at(at))
    fit: Fit | None = None
    for _ in range(3):
        fit = fit_structure(observations, structure, nominal,
                            first_metric(observations, predicted), start, sizes)
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
    columns = np.column_stack([fit.solution.jacobian, *(s.columns for s in signatures)])
    norms = np.sqrt(np.sum((columns * scale[:, None]) ** 2, axis=0))
    columns = columns[:, norms > 1e-9] / norms[norms > 1e-9]
    left = residual
    weighted = scale
    for _ in range(3):
        inside = columns * weighted[:, None]
        gram = inside.T @ inside + 1e-6 * np.eye(columns.shape[1])
        left = residual - columns @ np.linalg.solve(gram, inside.T @ (residual * weighted))
        weighted = robust(observations, left, scale, EVENT)
    return metric(observations, left, weighted)


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

    One linear step from the full estimate, where the gradient vanishes, stands for the refit
    without a fold.

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
    weights = 1.0 / deviations ** 2
    cost = np.zeros(white.size)
    for fold in range(FOLDS):
        out = folds == fold
        inside, own = slope[~out], slope[out]
        curvature = inside.T @ inside + np.diag(weights)
        curvature += 1e-6 * np.diag(np.diag(curvature)) + 1e-12 * np.eye(curvature.shape[0])
        left = white[out] + own @ np.linalg.solve(curvature, own.T @ white[out])
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
    sized = _sized(score)
    sizes = {**{name: base.parameters[name] for e in base.structure.effects
                for name in (p.name for p in e.parameters())}, **sized}
    begin = {**base.solution.values, **sized} if start is None else dict(start.solution.values)
    near = base if start is None else None
    return fit_structure(observations, structure, nominal, metric_, begin, sizes, steps,
                         near, polish=start is not None)


def search(observations: Observations, structure: Structure, nominal: Parameters,
           progress: Progress = _silent, most: int = MOST, onsets: bool = True,
           change: Onset | None = None, start: Fit | None = None) -> Search:
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
    onsets : bool
        Whether an effect may begin late.
    change : Onset, optional
        Where every effect begins; nothing else is tried then.
    start : Fit, optional
        A fit of the structure to some of the data, to begin from.

    Returns
    -------
    Search
    """
    plain = recalibrate(observations, structure, nominal, start)
    base, rounds = plain, []
    folds = folds_of(observations)
    masks: tuple[Onsets, ...] = ()
    if change is not None:
        masks = (one_onset(observations, change),)
    elif onsets:
        masks = (time_onsets(observations), place_onsets(observations))
    pool = candidates()
    for number in range(most + 1):
        progress(f'round {number + 1}: signatures and refits', number / (most + 1))
        one = play_round(observations, base, nominal, pool, masks, folds, number,
                         only_late=change is not None)
        rounds.append(one)
        if not one.adopted or number == most:
            break
        base = one.rivals[0].fit
    return Search(observations, plain, base, tuple(rounds))


def play_round(observations: Observations, base: Fit, nominal: Parameters,
               pool: Sequence[Candidate], masks: Sequence[Onsets], folds: FloatArray,
               number: int, only_late: bool = False) -> Round:
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
    only_late : bool
        Whether only effects with an onset are asked for.

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
    late = base.structure.onset is None or only_late
    scores = screen(observations, base, common, signatures, masks if late else ())
    plain_metric = Metric(common.scale, {name: np.ones(1) for name in common.filters})
    broad = screen(observations, base, plain_metric, signatures, masks if late else ())
    if only_late:
        scores = [s for s in scores if s.onset is not None]
        broad = [s for s in broad if s.onset is not None]
    serious = _serious(scores, SERIOUS)
    chosen = {(s.signature.candidate.label, s.onset is None) for s in serious}
    serious += [s for s in _serious(broad, SERIOUS // 2)
                if (s.signature.candidate.label, s.onset is None) not in chosen]
    nominal_fit = at_nominal(observations, base, nominal)
    quick = []
    for score in serious:
        tries = [refit(observations, near, nominal, score, common)
                 for near in (base, nominal_fit) if near is not None]
        best_try = min((t for t in tries if t is not None),
                       key=lambda t: t.solution.cost, default=None)
        if best_try is not None:
            quick.append((score, best_try))
    near = sorted(quick, key=lambda pair: pair[1].solution.cost)[:POLISHED]
    fits = [(score, refit(observations, base, nominal, score, common, 4, fit))
            for score, fit in near]
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
    further = min(number, 1)
    strong = share > LEAST_SHARE[further] or rivals[0].held_out > STRONG_GAIN[further]
    adopted = rivals[0].held_out > LEAST_GAIN and strong
    return Round(rebased, tuple(scores), tuple(rivals), final, share, adopted)


def screen(observations: Observations, base: Fit, metric_: Metric,
           signatures: Sequence[Signature], masks: Sequence[Onsets]) -> list[Score]:
    """
    Score all signatures under one metric.

    Parameters
    ----------
    observations : Observations
    base : Fit
    metric_ : Metric
    signatures : sequence of Signature
    masks : sequence of Onsets

    Returns
    -------
    list of Score
        Best first.
    """
    unknowns = base.solution.unknowns
    deviations = np.array([u.deviation for u in unknowns])
    pull = np.array([(u.centre - u.varied(base.solution.values[u.name])) / u.deviation
                     for u in unknowns])
    projector = Projector(observations, metric_, observations.measured - base.solution.predicted,
                          base.solution.jacobian, deviations, pull)
    return scan(projector, signatures, masks)


def at_nominal(observations: Observations, base: Fit, nominal: Parameters) -> Fit | None:
    """
    Return the base's structure with the nominal parameters, where it is far from them.

    A large missing effect drives a recalibration into places from which the right refit cannot
    be reached; the nominal parameters are then the better start.

    Parameters
    ----------
    observations : Observations
    base : Fit
    nominal : Parameters

    Returns
    -------
    Fit or None
        None where the recalibration has hardly moved.
    """
    solution = base.solution
    start = {u.name: u.value(u.centre) if u.extra or u.name in RECALIBRATED
             else solution.values[u.name] for u in solution.unknowns}
    if all(abs(u.varied(solution.values[u.name]) - u.varied(start[u.name]))
           < (0.3 if u.logarithmic else 1.5 * u.deviation) for u in solution.unknowns):
        return None
    order = {name: np.ones(1) for name in observations.channels}
    metric_ = Metric(np.ones(observations.measured.size), order)
    return fit_structure(observations, base.structure, nominal, metric_, start,
                         base.parameters, steps=0)


def _serious(scores: Sequence[Score], most: int) -> list[Score]:
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
        if len(chosen) >= most:
            break
    return chosen
