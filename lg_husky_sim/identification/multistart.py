# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Least squares from several starts, then with noise that the data themselves tell."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from lg_husky_sim.errors import FitError
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import ModelFile
from lg_husky_sim.identification.least_squares import Problem, Solution, solve, Unknown
from lg_husky_sim.identification.noise import believable, Metric, metric, scales
from lg_husky_sim.identification.problem import Observations
from lg_husky_sim.identification.settings import setting
from lg_husky_sim.identification.unknowns import starts_of
from lg_husky_sim.parallel import run_tasks
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Most Jacobians of one search.
STEPS = 40
#: Gain below which a search has converged [nats].
TOLERANCE = 1e-3
#: Passes over the noise: scales and correlation from the fit before.
PASSES = 2


class CountedProblem(Problem):
    """A problem that knows how often it was simulated."""

    evaluations = 0

    def predict(self, varied: FloatArray) -> FloatArray | None:
        """Return the prediction, or None where the model cannot be evaluated there."""
        self.evaluations += 1
        return super().predict(varied)


@dataclass(frozen=True)
class End:
    """
    Where one start ended.

    Parameters
    ----------
    values : mapping of str to float
    cost : float
        [nats]; infinite where the model could not be evaluated.
    converged : bool
    evaluations : int

    """

    values: Mapping[str, float]
    cost: float
    converged: bool
    evaluations: int


@dataclass(frozen=True)
class Ends:
    """Where all starts ended, in the order of the starts."""

    all: tuple[End, ...]  # noqa: A003

    @property
    def values(self) -> Mapping[str, float]:
        """Values of the best one; the first of equals."""
        return min(self.all, key=lambda end: end.cost).values

    @property
    def evaluations(self) -> int:
        """Return the number of simulations of all starts."""
        return sum(end.evaluations for end in self.all)


@dataclass(frozen=True, eq=False)
class _Task:
    observations: Observations
    model: ModelFile
    unknowns: tuple[Unknown, ...]
    metric: Metric
    start: Mapping[str, float]


def _from_start(task: _Task) -> End:
    problem = CountedProblem(task.observations, compile_model(task.model.structure),
                             task.model.parameters, task.metric, task.unknowns)
    solution = solve(problem, task.start, STEPS, TOLERANCE)
    if solution is None:
        return End(task.start, float('inf'), False, problem.evaluations)
    return End(solution.values, solution.cost, solution.converged, problem.evaluations)


def first_metric(data: Observations, model: ModelFile) -> Metric:
    """
    Return the metric that all starts share: each channel by the spread of the given model's error.

    Parameters
    ----------
    data : Observations
        Measured channels, which are predicted.
    model : ModelFile
        As given, before any fit.

    Returns
    -------
    Metric
        Without correlation.

    """
    predicted = data.predict(compile_model(model.structure).at(model.parameters))
    residual = data.measured - predicted
    return metric(data, residual, scales(data, residual, predicted), order=0)


def best_solution(data: Observations, model: ModelFile, unknowns: Sequence[Unknown], seed: int,
                  starts: int, jobs: int, scheduler: str | None,
                  tell: Callable[[str], None]) -> Ends:
    """
    Search from several starts.

    Parameters
    ----------
    data : Observations
        Measured channels, which are fitted.
    model : ModelFile
        As given; the first start is at its values.
    unknowns : sequence of Unknown
        What is varied.
    seed, starts, jobs : int
        Seed of the starts, how many there are, and processes to use.
    scheduler : str or None
        Address of a Dask scheduler, in place of processes.
    tell : callable
        Called with the word ``start`` after each start.

    Returns
    -------
    Ends

    Raises
    ------
    FitError
        If the model cannot be evaluated at any start.

    """
    shared = first_metric(data, model)
    tasks = [_Task(data, model, tuple(unknowns), shared, start)
             for start in starts_of(model, unknowns, starts, seed)]
    ends = Ends(tuple(run_tasks(_from_start, tasks, jobs, scheduler,
                                lambda: tell('start'))))
    if not any(np.isfinite(end.cost) for end in ends.all):
        raise FitError('the model cannot be simulated from any start')
    return ends


def judged(problem: Problem, ends: Ends) -> tuple[Problem, FloatArray]:
    """
    Return the problem with noise that is believed, and what each end costs by it.

    Parameters
    ----------
    problem : Problem
        With the noise that a fit's residual shows.
    ends : Ends
        Where the searches ended, from each start.

    Returns
    -------
    problem : Problem
    costs : numpy.ndarray, shape (n_ends,)
        [nats]; infinite where the model cannot be evaluated.

    """
    data = problem.observations
    judge = Problem(data, problem.model, problem.parameters, believable(data, problem.metric),
                    problem.unknowns)
    costs = []
    for end in ends.all:
        varied = judge.start(end.values)
        predicted = judge.predict(varied)
        costs.append(np.inf if predicted is None else judge.cost(predicted, varied)[0])
    return judge, np.array(costs)


def noise_metric(data: Observations, residual: FloatArray, predicted: FloatArray) -> Metric:
    """
    Return scale and correlation of the noise, from a fit's residual.

    Parameters
    ----------
    data : Observations
        Channels and times of the values.
    residual, predicted : numpy.ndarray, shape (n_values,)
        Measured less predicted, and predicted, in the unit of each channel.

    Returns
    -------
    Metric
        A channel is whitened only where its residual is not autocorrelated: one that is shows an
        error of the model, and whitening would turn the fit away from it. Outliers lose weight.

    """
    scale = scales(data, residual, predicted)
    plain = metric(data, residual, scale, order=0)
    standard = np.abs(plain.whiten(data, residual))
    most = setting('outlier')
    weight = np.where(standard > most, most / np.maximum(standard, most), 1.0)
    scale = scale * np.sqrt(weight)
    plain = metric(data, residual, scale, order=0)
    white = metric(data, residual, scale)
    filters = {name: plain.filters[name] if is_autocorrelated(data, residual * scale, name)
               else white.filters[name] for name in data.channels}
    return Metric(scale, filters)


def is_autocorrelated(data: Observations, scaled: FloatArray, name: str) -> bool:
    """
    Return whether a channel's residual stays on one side longer than noise does.

    Parameters
    ----------
    data : Observations
        Says which values are the channel's.
    scaled : numpy.ndarray, shape (n_values,)
        Residual times the metric's scale.
    name : str
        Channel.

    """
    above, below, count = 0.0, 0.0, 0
    for one in data.slices:
        if one.channel == name:
            part = scaled[one.first:one.last]
            above += float(part[1:] @ part[:-1])
            below += float(part @ part)
            count += part.size
    # What is far below the least noise that is believed is rounding, whatever its shape.
    return above > setting('model_error') * below and below > setting('nothing_left') * count


def refine(data: Observations, model: ModelFile, unknowns: Sequence[Unknown],
           start: Mapping[str, float], tell: Callable[[str], None], steps: int = STEPS
           ) -> tuple[Problem, Solution, int]:
    """
    Search on with the noise that the residual shows.

    Parameters
    ----------
    data : Observations
        Measured channels, which are fitted.
    model : ModelFile
        With all parameters that are not varied.
    unknowns : sequence of Unknown
        What is varied.
    start : mapping of str to float
        Values; the model's own where one is missing.
    tell : callable
        Called with the word ``noise`` after each pass.
    steps : int
        Most Jacobians of a pass; 0 to stay and only find the noise and the derivatives.

    Returns
    -------
    problem : Problem
        With the noise of the last pass.
    solution : Solution
    evaluations : int

    Raises
    ------
    FitError
        If the model cannot be simulated at the start.

    """
    used = first_metric(data, model)
    compiled = compile_model(model.structure)
    values = {u.name: start.get(u.name, 0.0 if u.extra else model.parameters[u.name])
              for u in unknowns}
    evaluations = 0
    passes = 0
    while True:
        problem = CountedProblem(data, compiled, model.parameters, used, unknowns)
        solution = solve(problem, values, steps if passes else 0, TOLERANCE)
        evaluations += problem.evaluations
        if solution is None:
            raise FitError('the model cannot be simulated at the values '
                           + ', '.join(f'{n} = {v:g}' for n, v in values.items()))
        tell('noise')
        if passes == PASSES:
            return problem, solution, evaluations
        passes += 1
        values = dict(solution.values)
        used = noise_metric(data, data.measured - solution.predicted, solution.predicted)
