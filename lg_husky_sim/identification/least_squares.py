# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Bounded Gauss-Newton (Levenberg-Marquardt) on whitened residuals, with priors."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
import math

from lg_husky_sim.errors import ParameterError
from lg_husky_sim.husky.effects import EffectParameter
from lg_husky_sim.husky.model import HuskyModel
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.identification.layout import Layout
from lg_husky_sim.identification.noise import Metric
from lg_husky_sim.identification.problem import Observations
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Unknown:
    """
    One number that an estimation varies.

    Parameters
    ----------
    name : str
        Of a parameter of the model, or of an ``extra`` of
        :meth:`~lg_husky_sim.identification.problem.Observations.predict`.
    logarithmic : bool
        Whether it is varied by its logarithm.
    centre, deviation : float
        Prior: mean and standard deviation in the varied quantity; infinite for none.
    lower, upper : float
        Bounds of the number itself.
    step : float
        For the differences of the Jacobian, in the varied quantity.
    extra : bool
        Whether it belongs to the observation instead of the model.
    local : tuple of int, optional
        For a correction of the start of one segment: the segment's number, and which correction.

    """

    name: str
    logarithmic: bool
    centre: float
    deviation: float
    lower: float
    upper: float
    step: float
    extra: bool = False
    local: tuple[int, int] | None = None

    def varied(self, value: float) -> float:
        """Return the varied quantity of a value."""
        return math.log(max(value, self.lower)) if self.logarithmic else value

    def value(self, varied: float) -> float:
        """Return the number for a varied quantity, inside the bounds."""
        raw = math.exp(min(varied, 700.0)) if self.logarithmic else varied
        return min(max(raw, self.lower), self.upper)


def effect_unknown(parameter: EffectParameter, start: float) -> Unknown:
    """Return a number of an effect as an unknown without a prior."""
    size = max(abs(start), 1e-6)
    positive = parameter.lower > 0.0
    if positive:
        return Unknown(parameter.name, True, math.log(size), math.inf, parameter.lower,
                       parameter.upper, 0.02)
    return Unknown(parameter.name, False, 0.0, math.inf, parameter.lower, parameter.upper,
                   0.05 * size)


@dataclass(frozen=True, eq=False)
class Solution:
    """
    Where a least-squares search ended.

    Parameters
    ----------
    unknowns : tuple of Unknown
    values : mapping of str to float
        Estimates by name.
    predicted : numpy.ndarray, shape (n_values,)
    jacobian : numpy.ndarray, shape (n_values, n_columns)
        Derivatives of the prediction by the varied quantities, not whitened; a column for each
        unknown, those of single segments packed as :class:`Layout` says.
    cost : float
        Half the sum of squares, priors included [nats].
    data_cost : float
        The same without the priors.
    steps : int
    converged : bool
    at_bound : tuple of str
        Unknowns that ended on a bound.

    """

    unknowns: tuple[Unknown, ...]
    values: Mapping[str, float]
    predicted: FloatArray
    jacobian: FloatArray
    cost: float
    data_cost: float
    steps: int
    converged: bool
    at_bound: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Simulated:
    # What was simulated last: of which parameters and latency, and from which starts.
    key: tuple[float, ...]
    plant: Plant
    starts: FloatArray | None
    grids: tuple[FloatArray, ...]


class Problem:
    """
    A model, its observations and a metric: what a search and its derivatives need.

    Parameters
    ----------
    observations : Observations
    model : HuskyModel
    parameters : Parameters
        Values of everything that is not varied.
    metric : Metric
    unknowns : sequence of Unknown

    """

    def __init__(self, observations: Observations, model: HuskyModel, parameters: Parameters,
                 metric: Metric, unknowns: Sequence[Unknown]) -> None:
        self.observations = observations
        self.model = model
        self.parameters = parameters
        self.metric = metric
        self.unknowns = tuple(unknowns)
        self.layout = Layout(observations, self.unknowns)
        self._simulated: _Simulated | None = None

    def predict(self, varied: FloatArray) -> FloatArray | None:
        """Return the prediction, or None where the model cannot be evaluated there."""
        values = {u.name: u.value(float(v)) for u, v in zip(self.unknowns, varied, strict=True)}
        extra = {u.name: values[u.name] for u in self.unknowns if u.extra}
        inner = {u.name: values[u.name] for u in self.unknowns if not u.extra}
        latency = extra.get('latency', 0.0)
        key = (*inner.values(), latency)
        starts = self.observations.corrections(extra)
        kept = self._simulated if self._simulated and self._simulated.key == key else None
        try:
            if kept is None:
                plant = self.model.at(self.parameters.replacing(inner))
                self._simulated = _Simulated(
                    key, plant, starts, self.observations.simulate(plant, latency, starts))
            elif starts is not None and kept.starts is not None:
                self._simulated = replace(kept, starts=starts, grids=self.observations.simulate(
                    kept.plant, latency, starts, (kept.starts, kept.grids)))
        except (ParameterError, ArithmeticError, np.linalg.LinAlgError):
            return None
        assert self._simulated is not None
        predicted = self.observations.observe(
            self._simulated.plant, self._simulated.grids, extra)
        return predicted if np.all(np.isfinite(predicted)) and (
            np.max(np.abs(predicted), initial=0.0) < 1e6) else None

    def start(self, values: Mapping[str, float]) -> FloatArray:
        """Return the varied quantities at given values; the prior's mean where none is given."""
        return np.array([u.varied(values[u.name]) if u.name in values else u.centre
                         for u in self.unknowns])

    def prior(self, varied: FloatArray) -> FloatArray:
        """Return the priors' standardised deviations, shape (n_unknowns,)."""
        return np.array([0.0 if math.isinf(u.deviation) else (v - u.centre) / u.deviation
                         for u, v in zip(self.unknowns, varied, strict=True)])

    def cost(self, predicted: FloatArray, varied: FloatArray) -> tuple[float, float]:
        """Return half the sum of squares with and without the priors [nats]."""
        white = self.metric.whiten(self.observations, self.observations.measured - predicted)
        data = 0.5 * float(white @ white)
        prior = self.prior(varied)
        return data + 0.5 * float(prior @ prior), data

    def jacobian(self, varied: FloatArray, predicted: FloatArray,
                 known: FloatArray | None = None) -> FloatArray:
        """
        Return forward differences (backward at an upper bound).

        Parameters
        ----------
        varied : numpy.ndarray, shape (n_unknowns,)
            Where: unknowns as they are varied, some by their logarithms.
        predicted : numpy.ndarray, shape (n_values,)
            What the model says there.
        known : numpy.ndarray, shape (n_values, n_known), optional
            Columns of the first unknowns, taken over from a point nearby.

        Returns
        -------
        numpy.ndarray, shape (n_values, n_columns)
            Those of the unknowns that all segments share, then the packed ones.

        """
        layout = self.layout
        columns = [] if known is None else [*known.T]
        # Extras of the observation first: they need no new simulation.
        shared = [int(i) for i in layout.shared[len(columns):]]
        order = sorted(shared, key=lambda i: not self.unknowns[i].extra)
        found: dict[int, FloatArray] = {}
        if any(self.unknowns[i].extra for i in order) or layout.own.size:
            self.predict(varied)
        # Starts next: they need no new plant, and only segments that begin in motion.
        packed = [self._packed(column, varied, predicted) for column in layout.own.T]
        for i in order:
            found[i] = self._column(i, varied, predicted)
        columns.extend(found[i] for i in sorted(found))
        columns.extend(packed)
        return np.column_stack(columns) if columns else np.zeros((predicted.size, 0))

    def _packed(self, places: NDArray[np.int64], varied: FloatArray, predicted: FloatArray
                ) -> FloatArray:
        # One own unknown of every segment, all moved at once: none shows in another's values.
        for sign in (1.0, -1.0):
            moved = np.array(varied)
            for i in places:
                unknown = self.unknowns[i]
                step = sign * unknown.step
                inside = unknown.lower <= varied[i] + step <= unknown.upper
                moved[i] += step if inside else -step
            there = self.predict(moved)
            if there is not None:
                column = np.zeros(predicted.size)
                for i, rows in zip(places, self.layout.rows, strict=True):
                    column[rows] = (there[rows] - predicted[rows]) / (moved[i] - varied[i])
                return column
        return np.zeros(predicted.size)

    def _column(self, i: int, varied: FloatArray, predicted: FloatArray) -> FloatArray:
        unknown = self.unknowns[i]
        for step in (unknown.step, -unknown.step):
            moved = np.array(varied)
            moved[i] += step
            inside = unknown.value(float(moved[i]))
            if abs(unknown.varied(inside) - moved[i]) > 1e-3 * abs(step):
                continue
            there = self.predict(moved)
            if there is not None:
                column: FloatArray = (there - predicted) / step
                return column
        return np.zeros(predicted.size)


def _inside(problem: Problem, varied: FloatArray, curvature: FloatArray,
            gradient: FloatArray) -> FloatArray:
    # A step whose unknowns stay inside their bounds: those that would leave are put on the
    # bound, and the others are solved for again.
    unknowns = problem.unknowns
    move = np.zeros(varied.size)
    free = np.ones(varied.size, dtype=bool)
    tried = np.array(varied)
    for _ in range(3):
        held = gradient - curvature @ np.where(free, 0.0, move)
        move = np.where(free, problem.layout.solve(curvature, held, free), move)
        wanted = np.array([v + (max(-1.5, min(1.5, m)) if u.logarithmic else m)
                           for u, v, m in zip(unknowns, varied, move, strict=True)])
        tried = np.array([u.varied(u.value(float(w)))
                          for u, w in zip(unknowns, wanted, strict=True)])
        out = free & (np.abs(tried - wanted) > 1e-12)
        if not np.any(out) or np.all(out | ~free):
            break
        move[out] = tried[out] - varied[out]
        free &= ~out
    return tried


def solve(problem: Problem, start: Mapping[str, float], steps: int = 12,
          tolerance: float = 0.02, progress: Callable[[], None] | None = None,
          known: FloatArray | None = None, polish: bool = True) -> Solution | None:
    """
    Minimise the whitened residuals.

    Parameters
    ----------
    problem : Problem
        Data, model and metric, and the unknowns to vary.
    start : mapping of str to float
        Values to start from.
    steps : int
        Most Jacobians.
    tolerance : float
        Gain of a step below which the search has converged [nats].
    progress : callable, optional
        Called once a step.
    known : numpy.ndarray, shape (n_values, n_known), optional
        Derivatives by the first unknowns at a point nearby; they are kept.
    polish : bool
        Whether to take all derivatives anew at the end.

    Returns
    -------
    Solution or None
        None if the model cannot be evaluated at the start.

    """
    observations, metric = problem.observations, problem.metric
    varied = problem.start(start)
    varied = np.array([u.varied(u.value(float(v))) for u, v in zip(
        problem.unknowns, varied, strict=True)])
    predicted = problem.predict(varied)
    if predicted is None:
        return None
    cost, data = problem.cost(predicted, varied)
    damping, done, taken = 1e-3, False, 0
    jacobian = problem.jacobian(varied, predicted, known)
    while taken < steps and not done and problem.unknowns:
        taken += 1
        if progress is not None:
            progress()
        white = metric.whiten(observations, observations.measured - predicted)
        slope = metric.whiten(observations, jacobian)
        deviations = np.array([0.0 if math.isinf(u.deviation) else 1.0 / u.deviation
                               for u in problem.unknowns])
        gradient = problem.layout.project(slope, white) - deviations * problem.prior(varied)
        curvature = problem.layout.gram(slope) + np.diag(deviations ** 2)
        better = False
        for _ in range(7):
            lifted = curvature + np.diag(damping * np.diag(curvature) + 1e-12)
            tried = _inside(problem, varied, lifted, gradient)
            there = problem.predict(tried)
            if there is not None:
                new_cost, new_data = problem.cost(there, tried)
                if new_cost < cost:
                    done = cost - new_cost < tolerance
                    varied, predicted, cost, data = tried, there, new_cost, new_data
                    damping = max(damping * 0.2, 1e-6)
                    better = True
                    break
            damping = damping * 6.0 + 1e-4
        if not better:
            done = True
            break
        if not done:
            jacobian = problem.jacobian(varied, predicted, known)
    if polish:
        jacobian = problem.jacobian(varied, predicted)
    values = {u.name: u.value(float(v)) for u, v in zip(problem.unknowns, varied, strict=True)}
    bound = tuple(u.name for u in problem.unknowns if values[u.name] <= u.lower * (
        1.0 + 1e-9 * math.copysign(1.0, u.lower)) or values[u.name] >= u.upper * (1.0 - 1e-9))
    return Solution(problem.unknowns, values, predicted, jacobian, cost, data, taken, done, bound)
