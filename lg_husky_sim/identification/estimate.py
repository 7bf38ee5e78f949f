# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Estimate parameters from recorded segments, by any method behind one signature."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
import time

from lg_husky_sim.comparison.metrics import channel_errors, pooled
from lg_husky_sim.comparison.metrics import UNITS as DRIVEN_UNITS
from lg_husky_sim.comparison.replay import replay
from lg_husky_sim.errors import FitError
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import ModelFile
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.identification.confidence import Confidence, confidence, undetermined
from lg_husky_sim.identification.least_squares import Problem, Solution, Unknown
from lg_husky_sim.identification.multistart import (
    best_solution,
    Ends,
    is_autocorrelated,
    judged,
    refine,
)
from lg_husky_sim.identification.paper_objective import PaperObjective
from lg_husky_sim.identification.problem import Observations, observations, UNITS
from lg_husky_sim.identification.profile import Profile, profile
from lg_husky_sim.identification.result import (
    ChannelFit,
    Estimated,
    FitResult,
    Method,
    Start,
)
from lg_husky_sim.identification.search import (
    differential_evolution,
    genetic,
    Objective,
    SearchResult,
)
from lg_husky_sim.identification.settings import setting
from lg_husky_sim.identification.start_states import (
    settle_of,
    start_states,
    start_warnings,
)
from lg_husky_sim.identification.unknowns import (
    check_profiles,
    free_names,
    NUISANCES,
    search_bounds,
    unknowns_of,
)
from lg_husky_sim.recording import Segment
from lg_husky_sim.reporting.words import quantity
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Starts of the multi-start least squares, the given model's values being the first.
STARTS = 6


def estimate(model: ModelFile, segments: Sequence[Segment], *,
             method: Method = Method.LEAST_SQUARES, free: Sequence[str] = (),
             nuisance: Sequence[str] = (), profiles: Sequence[str] = (), seed: int = 0,
             starts: int = STARTS, jobs: int = 1, scheduler: str | None = None,
             baseline: ModelFile | None = None, data: Observations | None = None,
             progress: Callable[[str], None] | None = None) -> FitResult:
    """
    Estimate parameters.

    Parameters
    ----------
    model : ModelFile
        Structure and the values to start from.
    segments : sequence of Segment
        Of one or more recordings; every channel is used at its own stamps.
    method : Method
        The paper's genetic algorithm or differential evolution on eq. (23), or multi-start
        least squares on all outputs.
    free : sequence of str
        Parameters to estimate; those marked free in the model and all of its effects' if empty.
    nuisance : sequence of str
        Unknowns of the recordings, for least squares: latency, delay_wheels, delay_imu,
        delay_pose [s], gyro_bias [rad/s]; and initial_state, the state at the start of every
        segment that begins in motion, whose first values are then used as well.
    profiles : sequence of str
        Estimated parameters that get a likelihood profile.
    seed : int
        The same seed gives the same estimates to the last bit.
    starts : int
        Starts of the least squares.
    jobs : int
        Processes for the starts.
    scheduler : str, optional
        Address of a Dask scheduler for the starts.
    baseline : ModelFile, optional
        Model of the column "before"; ``model`` if not given.
    data : Observations, optional
        What to fit in place of all that the segments hold; for least squares.
    progress : callable, optional
        Called with a word after each unit of work.

    Returns
    -------
    FitResult
        A poor end is no exception: see ``converged`` and ``warnings``.

    Raises
    ------
    FitError
        If nothing is free, a profile is asked of what is not estimated, or eq. (23) is asked
        for without a pose.
    RecordingError
        If no segment can be used.

    """
    names = free_names(model, free)
    check_profiles(model, free, nuisance, profiles)
    began = time.perf_counter()
    used = data or observations(segments, settle_of(model.structure, nuisance))
    tell = progress or (lambda word: None)
    if method is Method.LEAST_SQUARES:
        unknowns = unknowns_of(model, names, nuisance, used)
        ends = best_solution(used, model, unknowns, seed, starts, jobs, scheduler, tell)
        problem, solution, evaluations = refine(used, model, unknowns, ends.values, tell)
        return _result(model, baseline or model, segments, method, seed, problem, solution,
                       ends.evaluations + evaluations, began, profiles, tell, ends=ends)
    if nuisance:
        raise FitError(f'nuisance {nuisance[0]!r} can only be estimated by least-squares')
    objective = PaperObjective(compile_model(model.structure), model.parameters, names,
                               segments)
    found = _search(method, objective, *search_bounds(model.parameters, names), seed, tell)
    fitted = replace(model, parameters=model.parameters.replacing(
        dict(zip(names, map(float, found.values), strict=True))))
    unknowns = unknowns_of(fitted, names, ())
    problem, solution, evaluations = refine(used, fitted, unknowns, {}, tell, steps=0)
    return _result(model, baseline or model, segments, method, seed, problem, solution,
                   found.evaluations + evaluations, began, profiles, tell, search=found)


def _search(method: Method, objective: Objective, lower: FloatArray, upper: FloatArray,
            seed: int, tell: Callable[[str], None]) -> SearchResult:
    def each(generation: int, best: float) -> None:
        tell(f'generation {generation}, {best:.4g} m')
    run = genetic if method is Method.GENETIC else differential_evolution
    return run(objective, lower, upper, seed, each)


def _result(model: ModelFile, baseline: ModelFile, segments: Sequence[Segment], method: Method,
            seed: int, problem: Problem, solution: Solution, evaluations: int, began: float,
            profiles: Sequence[str], tell: Callable[[str], None],
            ends: Ends | None = None, search: SearchResult | None = None) -> FitResult:
    sure = confidence(problem, solution)
    drawn = tuple(_profile(problem, solution, sure, name, tell) for name in profiles)
    estimates = tuple(
        _estimated(u, solution.values[u.name], float(low), float(high), model.parameters)
        for u, low, high in zip(sure.unknowns, sure.low, sure.high, strict=True))
    states = start_states(problem.observations, sure.local,
                          [solution.values[u.name] for u in sure.local], sure.local_deviations)
    of_model = [one for one in estimates if not one.nuisance]
    fitted = ModelFile(model.structure, model.parameters.with_entries(*(
        replace(model.parameters.entry(one.name), value=one.value, low=one.low, high=one.high,
                source=f'estimated from {", ".join(_recordings(segments))}')
        for one in of_model)), f'{model.about}; estimated by {method.value}'.lstrip('; '))
    values = np.array([one.value for one in estimates])
    warnings = (*_warnings(solution, estimates, search, model),
                *_disagreement(problem, solution, ends),
                *start_warnings(states), *_left_over(problem, solution))
    cost = solution.cost if search is None else search.cost
    converged = (solution.converged if search is None else search.converged)
    starts = () if ends is None else tuple(
        Start({u.name: end.values[u.name] for u in sure.unknowns}, end.cost, end.converged)
        for end in ends.all)
    history = np.zeros((0, 2)) if search is None else np.column_stack([search.best, search.mean])
    return FitResult(
        method, seed, fitted, _recordings(segments), estimates, sure.correlation,
        sure.covariance, sure.condition, cost, evaluations, time.perf_counter() - began,
        channel_fits(problem.observations, segments, baseline, fitted, solution),
        starts, history, undetermined(sure, values), warnings, converged, drawn, states,
        driven_fits(segments, baseline, fitted))


def _profile(problem: Problem, solution: Solution, sure: Confidence, name: str,
             tell: Callable[[str], None]) -> Profile:
    place = [u.name for u in sure.unknowns].index(name)
    return profile(problem, solution, name, float(sure.deviations[place]),
                   float(sure.inflation[place]), lambda: tell(f'profile of {name}'))


def _recordings(segments: Sequence[Segment]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(s.recording for s in segments))


def _estimated(unknown: Unknown, value: float, low: float, high: float,
               parameters: Parameters) -> Estimated:
    if unknown.extra:
        return Estimated(unknown.name, NUISANCES[unknown.name][0], value, low, high, 0.0, True)
    entry = parameters.entry(unknown.name)
    return Estimated(unknown.name, entry.unit, value, low, high, entry.value)


def channel_fits(data: Observations, segments: Sequence[Segment], before: ModelFile,
                 after: ModelFile, solution: Solution | None = None) -> tuple[ChannelFit, ...]:
    """
    Compare two models with the data, channel by channel.

    Parameters
    ----------
    data : Observations
        Measured channels to compare with.
    segments : sequence of Segment
        For the position, which is simulated from each segment's start without resets.
    before, after : ModelFile
        Models as given and as fitted.
    solution : Solution, optional
        Holds the prediction of ``after`` with the recordings' own unknowns.

    Returns
    -------
    tuple of ChannelFit
        Position last, where a pose was recorded: root mean square distance [m].

    """
    plants = [compile_model(m.structure).at(m.parameters) for m in (before, after)]
    errors = [data.measured - data.predict(plants[0]), data.measured - (
        data.predict(plants[1]) if solution is None else solution.predicted)]
    rows = []
    for name in data.channels:
        mask = data.channel_mask(name)
        rms = [float(np.sqrt(np.mean(error[mask] ** 2))) for error in errors]
        rows.append(ChannelFit(name, UNITS[name], int(mask.sum()), rms[0], rms[1]))
    if any('pose' in s.streams for s in segments):
        tracks = PaperObjective(compile_model(after.structure), after.parameters, (),
                                segments).tracks
        squares = [[np.sum((t.simulate(plant) - t.targets) ** 2, axis=1) for t in tracks]
                   for plant in plants]
        rms = [float(np.sqrt(np.mean(np.concatenate(square)))) for square in squares]
        rows.append(ChannelFit('position', 'm', sum(len(s) for s in squares[0]), rms[0], rms[1]))
    return tuple(rows)


def driven_fits(segments: Sequence[Segment], before: ModelFile, after: ModelFile
                ) -> tuple[ChannelFit, ...]:
    """Compare two models driven by the commands alone from the start of each segment."""
    plants = [compile_model(m.structure).at(m.parameters) for m in (before, after)]
    old, new = (pooled(channel_errors(segment, replay(plant, segment)) for segment in segments)
                for plant in plants)
    return tuple(ChannelFit(name, DRIVEN_UNITS[name], one.count, one.rmse, new[name].rmse)
                 for name, one in old.items() if name in new)


def _warnings(solution: Solution, estimates: Sequence[Estimated],
              search: SearchResult | None, model: ModelFile) -> tuple[str, ...]:
    said = []
    bounds = {u.name: (u.lower, u.upper) for u in solution.unknowns}
    if search is not None:
        names = [one.name for one in estimates]
        lower, upper = search_bounds(model.parameters, tuple(names))
        bounds.update(zip(names, zip(map(float, lower), map(float, upper), strict=True),
                          strict=True))
    for one in estimates:
        low, high = bounds[one.name]
        near = 1e-3 * (high - low) if search is not None else 1e-9 * max(abs(low), abs(high))
        for side, bound in (('lower', low), ('upper', high)):
            if abs(one.value - bound) <= near:
                said.append(f'{one.name} = {one.value:.5g} {one.unit} ended on its {side} bound '
                            f'{bound:g}')
    if search is not None:
        if not search.converged:
            said.append(f'not converged: {search.message}')
        return tuple(said)
    if not solution.converged:
        said.append('not converged: the last step still lowered the cost')
    return tuple(said)


def _left_over(problem: Problem, solution: Solution) -> list[str]:
    data = problem.observations
    scaled = (data.measured - solution.predicted) * problem.metric.scale
    names = [name for name in data.channels if is_autocorrelated(data, scaled, name)]
    return [f'autocorrelated residuals ({", ".join(map(quantity, names))}): physics is missing '
            'from the model, and the intervals hold only for this model; lg_husky diagnose finds '
            'out what is missing'] if names else []


def _disagreement(problem: Problem, solution: Solution, ends: Ends | None) -> list[str]:
    # What the search itself saw, as far as noise that is believed can tell it, too.
    if ends is None or len(ends.all) < 2:
        return []
    said = []
    judge, costs = judged(problem, ends)
    sure = confidence(judge, solution)
    searched = np.array([end.cost for end in ends.all])
    apart_by = setting('equal_fit')
    told = (searched > searched.min() + apart_by) & (costs > costs.min() + apart_by)
    worse = [end for end, one in zip(ends.all, told, strict=True) if one]
    equal = [end for end, one in zip(ends.all, told, strict=True) if not one]
    apart: set[str] = set()
    for unknown, deviation in zip(sure.unknowns, sure.deviations, strict=True):
        varied = [unknown.varied(end.values[unknown.name]) for end in equal]
        if max(varied) - min(varied) > setting('starts_apart') * deviation:
            apart.add(unknown.name)
    if apart:
        said.append(f'starting points disagree: {len(equal)} optima fit equally well but differ '
                    'in '
                    f'{", ".join(sorted(apart))}')
    if len(worse) * 2 > len(ends.all):
        said.append(f'{len(worse)} of {len(ends.all)} starts ended in a worse local minimum, so '
                    'the best one found may not be the global one')
    return said
