# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Starts that end apart: said where noise could tell them apart, and not of rounding."""

from __future__ import annotations

from collections.abc import Mapping

import lg_husky_sim as lg
from lg_husky_sim.husky.model_file import ModelFile
from lg_husky_sim.identification.estimate import _disagreement
from lg_husky_sim.identification.least_squares import Problem, Solution
from lg_husky_sim.identification.multistart import End, Ends, refine
from lg_husky_sim.identification.noise import believable
from lg_husky_sim.identification.problem import observations
from lg_husky_sim.identification.unknowns import free_names, unknowns_of
from lg_husky_sim.recording import Segment
import numpy as np
import pytest


@pytest.mark.parametrize('robot', [{}, {'wheel_damping': 1.6}, {'mass': 60.0}])
def test_a_perfect_fit_has_no_warnings(robot: dict[str, float]) -> None:
    drive = lg.Husky(None, **robot).simulate('s_bend')
    free = [] if not robot else [*robot]
    fit = lg.Husky().identify(drive, free, progress=False)
    assert fit.warnings == ()
    for name, value in robot.items():
        assert fit.values[name] == pytest.approx(value, rel=1e-5)


def test_all_that_is_free_by_default_has_none_either() -> None:
    fit = lg.Husky().identify(lg.Husky(wheel_damping=1.6).simulate('s_bend'), progress=False)
    assert fit.warnings == ()


@pytest.fixture(scope='module')
def fitted(husky: ModelFile, circle: Segment) -> tuple[Problem, Solution]:
    data = observations([circle])
    unknowns = unknowns_of(husky, free_names(husky, ()), (), data)
    problem, solution, _ = refine(data, husky, unknowns, {}, lambda word: None)
    return problem, solution


def end(values: Mapping[str, float], cost: float, **changed: float) -> End:
    return End({**values, **changed}, cost, True, 1)


def test_ends_that_noise_tells_apart_are_still_said(fitted: tuple[Problem, Solution]) -> None:
    problem, solution = fitted
    best = end(solution.values, 100.0)
    far = end(solution.values, 150.0, yaw_damping=1.5 * solution.values['yaw_damping'])
    same = end(solution.values, 100.0, yaw_damping=1.5 * solution.values['yaw_damping'])
    worse, = _disagreement(problem, solution, Ends((best, far, far)))
    assert worse.startswith('2 of 3 starts ended in a worse local minimum')
    apart, = _disagreement(problem, solution, Ends((best, same)))
    assert apart.endswith('2 optima fit equally well but differ in yaw_damping')
    assert _disagreement(problem, solution, Ends((best, best))) == []
    assert _disagreement(problem, solution, Ends((best,))) == []


def test_noise_that_sensors_have_is_believed_as_it_is(fitted: tuple[Problem, Solution]) -> None:
    problem, _ = fitted
    data = problem.observations
    believed = believable(data, problem.metric)
    for name in data.channels:
        np.testing.assert_array_equal(believed.filters[name], problem.metric.filters[name])
