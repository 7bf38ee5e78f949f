# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Fit a structure to observations, and the metric that fits are compared under."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math

from lg_husky_sim.diagnosis.candidates import (
    effect_entries,
    effect_unknowns,
    is_exact,
    nuisance,
    RECALIBRATED,
)
from lg_husky_sim.diagnosis.screening import Signature
from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.parameters import Parameter, Parameters
from lg_husky_sim.identification.least_squares import Problem, Solution, solve, Unknown
from lg_husky_sim.identification.noise import Metric, metric, robust, scales
from lg_husky_sim.identification.problem import Observations
from lg_husky_sim.identification.relations import rows_of_recordings
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Part by which a recalibration is far from a nominal number, or so many of its deviations.
FAR_OFF, STRAINED = 0.3, 2.0
#: Robust deviations from which an event that nothing explains loses weight.
EVENT = 5.0
#: Ridge on columns of unit length, against those that are alike.
RIDGE = 1e-6


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
    problem = _problem(observations, structure, nominal, metric_, start, effects)
    if problem is None:
        return None
    known = None if near is None else _columns(near, problem.unknowns)
    solution = solve(problem, {**effects, **start}, steps=steps, known=known, polish=polish)
    if solution is None:
        return None
    inner = {u.name: solution.values[u.name] for u in problem.unknowns if not u.extra}
    return Fit(structure, problem.parameters.replacing(inner), solution)


def _problem(observations: Observations, structure: Structure, nominal: Parameters,
             metric_: Metric, start: Mapping[str, float], effects: Mapping[str, float]
             ) -> Problem | None:
    unknowns: list[Unknown] = list(nuisance(nominal, structure, observations.channels))
    entries: list[Parameter] = []
    for effect in structure.effects:
        unknowns.extend(u for u in effect_unknowns(effect, effects)
                        if not is_exact(nominal, u.name))
        entries.extend(effect_entries(effect, {**effects, **start}))
    try:
        model = compile_model(structure)
    except LgHuskyError:
        return None
    return Problem(observations, model, nominal.with_entries(*entries), metric_, unknowns)


def cost_at(observations: Observations, structure: Structure, nominal: Parameters,
            metric_: Metric, start: Mapping[str, float], effects: Mapping[str, float]) -> float:
    """
    Return what a fit would begin with.

    Parameters
    ----------
    observations, structure, nominal, metric_, start, effects
        As in :func:`fit_structure`.

    Returns
    -------
    float
        Half the sum of squares, priors included [nats]; infinite where the model cannot be
        evaluated.
    """
    problem = _problem(observations, structure, nominal, metric_, start, effects)
    if problem is None:
        return math.inf
    varied = problem.start({**effects, **start})
    varied = np.array([u.varied(u.value(float(v))) for u, v in zip(
        problem.unknowns, varied, strict=True)])
    predicted = problem.predict(varied)
    return math.inf if predicted is None else problem.cost(predicted, varied)[0]


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
    for _ in range(2):
        fit = _recalibrated(observations, structure, nominal, predicted, start, sizes)
        predicted, start = fit.solution.predicted, fit.solution.values
    return _recalibrated(observations, structure, nominal, predicted, start, sizes)


def _recalibrated(observations: Observations, structure: Structure, nominal: Parameters,
                  predicted: FloatArray, start: Mapping[str, float], sizes: Mapping[str, float]
                  ) -> Fit:
    fit = fit_structure(observations, structure, nominal,
                        first_metric(observations, predicted), start, sizes)
    if fit is None:
        raise LgHuskyError('the nominal model cannot be evaluated')
    return fit


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
           < (min(FAR_OFF, STRAINED * u.deviation) if u.logarithmic else 1.5 * u.deviation)
           for u in solution.unknowns):
        return None
    order = {name: np.ones(1) for name in observations.channels}
    metric_ = Metric(np.ones(observations.measured.size), order)
    return fit_structure(observations, base.structure, nominal, metric_, start,
                         base.parameters, steps=0)


def shared_metric(observations: Observations, fit: Fit, signatures: Sequence[Signature]
                  ) -> Metric:
    """
    Estimate the correlation on what neither a fit nor any signature explains.

    A signature may be on in each recording as much as it likes: an effect that is there in some of
    them only would otherwise pass for noise.

    Parameters
    ----------
    observations : Observations
    fit : Fit
    signatures : sequence of Signature

    Returns
    -------
    Metric
    """
    return metric_beside(observations, fit, [s.columns for s in signatures])


def metric_beside(observations: Observations, fit: Fit, columns: Sequence[FloatArray]) -> Metric:
    """
    Estimate the correlation on what neither a fit nor any of some columns explains.

    Parameters
    ----------
    observations : Observations
    fit : Fit
    columns : sequence of numpy.ndarray, each of shape (n_values, k)
        Each with a coefficient of its own in each recording.

    Returns
    -------
    Metric
    """
    predicted = fit.solution.predicted
    residual = observations.measured - predicted
    scale = scales(observations, residual, predicted)
    common = () if observations.common is None else (observations.common,)
    everywhere = _normed(np.column_stack([fit.solution.jacobian, *common]), scale)
    own = _normed(np.column_stack([np.zeros((residual.size, 0)), *columns]), scale)
    left = residual
    weighted = scale
    for _ in range(3):
        left = _unexplained(observations, residual, weighted, everywhere, own)
        weighted = robust(observations, left, scale, EVENT)
    return metric(observations, left, weighted, related=True)


def _normed(columns: FloatArray, scale: FloatArray) -> FloatArray:
    scaled = columns * scale[:, None]
    norms = np.sqrt(np.einsum('ij,ij->j', scaled, scaled))
    normed: FloatArray = columns[:, norms > 1e-9] / norms[norms > 1e-9]
    return normed


def _unexplained(observations: Observations, residual: FloatArray, weights: FloatArray,
                 everywhere: FloatArray, own: FloatArray) -> FloatArray:
    # What is left of a residual: the columns of `everywhere` have one coefficient each, those
    # of `own` another in each recording; the latter are eliminated first.
    stacked = np.column_stack([everywhere, residual])
    eliminated, back = np.empty_like(stacked), []
    for rows in rows_of_recordings(observations):
        part, inside = stacked[rows] * weights[rows, None], own[rows] * weights[rows, None]
        gram = inside.T @ inside + RIDGE * np.eye(inside.shape[1])
        onto = np.linalg.solve(gram, inside.T @ part)
        eliminated[rows] = part - inside @ onto
        back.append((rows, onto))
    columns = eliminated[:, :-1]
    gram = columns.T @ columns + RIDGE * np.eye(columns.shape[1])
    sizes = np.linalg.solve(gram, columns.T @ eliminated[:, -1])
    left = residual - everywhere @ sizes
    for rows, onto in back:
        left[rows] -= own[rows] @ (onto[:, -1] - onto[:, :-1] @ sizes)
    return left
