# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What is estimated depends on no unit of mass or voltage, and on no size of a Husky."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from lg_husky_sim.husky.model_file import load_model, ModelFile
from lg_husky_sim.husky.robot_size import RobotSize, speeds_of
from lg_husky_sim.identification.estimate import estimate
from lg_husky_sim.identification.paper import paper
from lg_husky_sim.identification.problem import observations
from lg_husky_sim.identification.result import Method
from lg_husky_sim.identification.start_states import settle_of
from lg_husky_sim.identification.unknowns import search_bounds, unknowns_of
from lg_husky_sim.recording import Segment
import numpy as np
import pytest

LARGE = RobotSize(mass=32.0, voltage=2.0)
NAMES = ('wheel_damping', 'yaw_damping', 'command_gain')


def enlarged() -> ModelFile:
    """Return the nominal robot in other units of mass and voltage; it moves the same."""
    model = load_model()
    return replace(model, parameters=model.parameters.with_entries(*(
        replace(entry, value=times * entry.value, lower=times * entry.lower,
                upper=times * entry.upper)
        for entry in model.parameters.entries for times in (LARGE.factor(entry.unit),))))


@pytest.mark.parametrize('method', [Method.GENETIC, Method.DIFFERENTIAL_EVOLUTION,
                                    Method.LEAST_SQUARES])
def test_estimates_are_in_proportion(circle: Segment, method: Method) -> None:
    usual, large = (estimate(model, [circle], method=method, starts=2, seed=3)
                    for model in (load_model(), enlarged()))
    for name in NAMES:
        factor = LARGE.factor(load_model().parameters.entry(name).unit)
        assert large.values[name] == pytest.approx(factor * usual.values[name], rel=1e-4)
    assert [w.partition(' = ')[0] for w in large.warnings] == [
        w.partition(' = ')[0] for w in usual.warnings]


def test_the_papers_bounds_are_those_of_the_paper_for_its_robot() -> None:
    lower, upper = search_bounds(load_model().parameters, NAMES)
    assert lower.tolist() == [paper().search[name].lower for name in NAMES]
    assert upper.tolist() == [paper().search[name].upper for name in NAMES]


def test_the_papers_bounds_are_in_proportion_to_another_robot() -> None:
    large = enlarged().parameters
    lower, upper = search_bounds(large.replacing({'command_gain': 0.5}), NAMES)
    share = 0.5 / 0.8961
    assert lower == pytest.approx([32.0, 32.0, 0.75 * share])
    assert upper == pytest.approx([3200.0, 3200.0, share])


def test_a_box_holds_the_given_value_and_keeps_to_the_models_bounds() -> None:
    parameters = load_model().parameters.replacing({'wheel_damping': 0.2})
    parameters = parameters.with_entries(replace(parameters.entry('yaw_damping'), upper=30.0))
    lower, upper = search_bounds(parameters, NAMES[:2])
    assert (lower[0], upper[0]) == (0.2, 100.0)
    assert (lower[1], upper[1]) == (1.0, 30.0)


def test_priors_of_starts_are_in_proportion_to_the_robots_speed(
        make_drive: Callable[..., Segment]) -> None:
    model = load_model()
    assert speeds_of(model.parameters, model.parameters) == (1.0, 1.0, 1.0)
    part = make_drive('circle')
    moving = replace(part, start=8.0, streams={
        name: replace(one, times=one.times[one.times >= 8.0],
                      values=one.values[one.times >= 8.0])
        for name, one in part.streams.items()})
    wanted = ['initial_state']
    data = observations([moving], settle_of(model.structure, wanted))

    def widths(**values: float) -> np.ndarray:
        own = replace(model, parameters=model.parameters.replacing(values))
        return np.array([[u.deviation, u.lower, u.upper, u.step] for u in unknowns_of(
            own, ['command_gain'], wanted, data) if u.local is not None])
    usual = widths()
    assert usual.tolist() == [[0.5, -6.0, 6.0, 0.01], [0.3, -6.0, 6.0, 0.01]]
    fast = widths(command_gain=0.8961 / 4.0, turn_ratio=2.0 * 0.541)
    assert fast == pytest.approx(usual * np.array([[4.0], [2.0]]))
