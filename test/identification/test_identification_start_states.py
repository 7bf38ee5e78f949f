# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The state at the start of each segment, estimated with the parameters."""

from __future__ import annotations

from dataclasses import replace
import json

from lg_husky_sim.errors import FitError
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.model_file import load_model, ModelFile
from lg_husky_sim.identification.estimate import estimate
from lg_husky_sim.identification.least_squares import Problem
from lg_husky_sim.identification.multistart import first_metric
from lg_husky_sim.identification.problem import observations
from lg_husky_sim.identification.result import FitResult, Method
from lg_husky_sim.identification.start_states import settle_of, start_unknowns
from lg_husky_sim.identification.unknowns import free_names, unknowns_of
from lg_husky_sim.recording import Segment
from lg_husky_sim.recording.recording import cut
from lg_husky_sim.signals import TimeSeries
from lg_husky_sim.simulation import rollout
import numpy as np
import pytest

#: A robot that takes a third of a second to settle, unlike the nominal one.
SLOW = {'wheel_damping': 1.0, 'yaw_damping': 9.0, 'command_gain': 0.85}
WANTED = ['initial_state']
COUNT = 20


def _commands(end: float) -> TimeSeries:
    draws = np.random.default_rng(3)
    times = np.arange(0.0, end, 0.05)
    levels = np.column_stack([draws.uniform(0.0, 1.0, times.size),
                              draws.uniform(-1.0, 1.0, times.size)])
    return TimeSeries(times, levels[np.arange(times.size) // 26], ('forward', 'yaw'))


@pytest.fixture(scope='module')
def moving() -> tuple[list[Segment], list[float]]:
    """Return segments without a pose that begin in motion, and their true first speeds."""
    model, length = load_model(), 1.6
    plant = compile_model(model.structure).at(model.parameters.replacing(SLOW))
    commands = _commands(1.0 + COUNT * length)
    truth = rollout(plant, commands, float(commands.times[-1]), 0.02)
    seen, draws = plant.observe(truth), np.random.default_rng(4)

    def noisy(names: tuple[str, ...], deviation: float) -> np.ndarray:
        values = np.column_stack([seen.column(n) for n in names])
        return values + draws.normal(0.0, deviation, values.shape)
    gyro = np.column_stack([noisy(('yaw_rate',), 0.02), np.zeros((len(seen), 2))])
    streams = {
        'command': commands,
        'wheels': TimeSeries(seen.times, noisy(('wheel_left', 'wheel_right'), 0.1),
                             ('left', 'right')),
        'imu': TimeSeries(seen.times, gyro, ('yaw_rate', 'accel_x', 'accel_y'))}
    starts = [1.0 + number * length for number in range(COUNT)]
    return ([Segment('drive', number, start, start + length, cut(streams, start, start + length))
             for number, start in enumerate(starts)],
            [float(np.interp(t, truth.times, truth.column('forward'))) for t in starts])


@pytest.fixture(scope='module')
def fit(moving: tuple[list[Segment], list[float]]) -> FitResult:
    return estimate(load_model(), moving[0], nuisance=WANTED, starts=2)


def test_intervals_hold_the_truth_only_where_the_start_is_estimated(
        moving: tuple[list[Segment], list[float]], fit: FitResult) -> None:
    # Without a pose the first speed is not measured, and is forgotten after the 0.6 s.
    blind = {one.name: one for one in estimate(load_model(), moving[0], starts=2).estimates}
    assert not blind['command_gain'].low < SLOW['command_gain'] < blind['command_gain'].high
    for one in fit.estimates:
        assert one.low < SLOW[one.name] < one.high
        assert abs(one.value / SLOW[one.name] - 1.0) < 0.02
        assert one.high - one.low < 1.2 * (blind[one.name].high - blind[one.name].low)


def test_the_first_speeds_come_back(moving: tuple[list[Segment], list[float]],
                                    fit: FitResult) -> None:
    forward = [one for one in fit.start_states if one.quantity == 'initial_forward']
    assert [one.segment for one in forward] == [f'drive/{k}' for k in range(COUNT)]
    assert all(one.measured == 0.0 and one.determined for one in forward)
    errors = np.array([one.value for one in forward]) - moving[1]
    assert np.sqrt(np.mean(errors ** 2)) < 0.12
    inside = sum(one.low < true < one.high for one, true in zip(forward, moving[1], strict=True))
    assert inside >= COUNT - 3
    assert {one.quantity for one in fit.start_states} == {'initial_forward', 'initial_yaw'}


def test_the_report_is_as_long_for_many_segments_as_for_few(fit: FitResult) -> None:
    text = str(fit)
    assert text.count('initial_forward') == text.count('initial_yaw') == 1
    assert set(fit.values) == set(SLOW)
    assert fit.correlation.shape == (3, 3)
    data = json.loads(json.dumps(fit.data(), allow_nan=False))
    assert len(data['start_states']) == 2 * COUNT
    assert data['start_states'][0]['name'] == 'initial_forward@drive/0'
    assert set(data['starts'][0]['values']) == set(SLOW)


def test_processes_give_the_same_bits(moving: tuple[list[Segment], list[float]]) -> None:
    some = moving[0][:4]
    alone = estimate(load_model(), some, nuisance=WANTED, starts=2)
    spread = estimate(load_model(), some, nuisance=WANTED, starts=2, jobs=2)
    assert alone.values == spread.values
    assert alone.start_states == spread.start_states


def _problem(model: ModelFile, parts: list[Segment]) -> Problem:
    data = observations(parts, settle_of(model.structure, WANTED))
    unknowns = unknowns_of(model, free_names(model, ()), [*WANTED, 'gyro_bias'], data)
    return Problem(data, compile_model(model.structure), model.parameters,
                   first_metric(data, model), unknowns)


def test_packed_derivatives_are_those_of_each_unknown(
        husky: ModelFile, moving: tuple[list[Segment], list[float]]) -> None:
    problem = _problem(husky, moving[0][:3])
    varied = problem.start({})
    predicted = problem.predict(varied)
    assert predicted is not None
    packed = problem.jacobian(varied, predicted)
    assert packed.shape[1] == 3 + 1 + 2
    dense = np.column_stack([problem._column(i, varied, predicted)
                             for i in range(len(problem.unknowns))])
    np.testing.assert_allclose(problem.layout.gram(packed), dense.T @ dense,
                               rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(problem.layout.project(packed, predicted), dense.T @ predicted,
                               rtol=1e-9, atol=1e-9)
    assert np.linalg.norm(dense[:, problem.layout.own[0]]) > 1.0


def test_solving_segment_by_segment_is_solving_at_once(
        husky: ModelFile, moving: tuple[list[Segment], list[float]]) -> None:
    problem = _problem(husky, moving[0][:3])
    layout, draws = problem.layout, np.random.default_rng(1)
    slope = draws.normal(size=(problem.observations.measured.size, layout.columns))
    matrix, right = layout.gram(slope) + np.eye(layout.size), draws.normal(size=layout.size)
    free = np.ones(layout.size, dtype=bool)
    free[[1, layout.own[1, 0]]] = False
    expected = np.zeros(layout.size)
    expected[free] = np.linalg.solve(matrix[np.ix_(free, free)], right[free])
    np.testing.assert_allclose(layout.solve(matrix, right, free), expected, rtol=1e-8)
    curvature, along, follow, alone = layout.eliminate(matrix, slope)
    covariance = np.linalg.inv(matrix)
    shared = np.ix_(layout.shared, layout.shared)
    np.testing.assert_allclose(np.linalg.inv(curvature), covariance[shared], rtol=1e-8)
    own = alone + np.einsum('pij,jk,pik->pi', follow, covariance[shared], follow)
    np.testing.assert_allclose(own, np.diag(covariance)[layout.own], rtol=1e-8)
    assert along.shape == (slope.shape[0], layout.shared.size)


def test_only_pieces_whose_start_moves_are_simulated_again(
        husky: ModelFile, moving: tuple[list[Segment], list[float]]) -> None:
    data = observations(moving[0][:3])
    plant = compile_model(husky.structure).at(husky.parameters)
    still = np.zeros((3, 4))
    grids = data.simulate(plant, 0.0, still)
    np.testing.assert_array_equal(grids[1], data.simulate(plant)[1])
    moved = data.corrections({'initial_forward@drive/1': 0.1, 'gyro_bias': 0.0})
    assert moved is not None
    again = data.simulate(plant, 0.0, moved, (still, grids))
    assert [a is b for a, b in zip(grids, again, strict=True)] == [True, False, True]
    assert again[1][0, 2] == pytest.approx(grids[1][0, 2] + 0.1)
    assert data.corrections({'gyro_bias': 0.1}) is None


def test_a_start_at_rest_and_a_forgotten_part_get_no_unknown(
        husky: ModelFile, circle: Segment, moving: tuple[list[Segment], list[float]]) -> None:
    looped = Structure(effects=(Effect('speed_loop'),))
    parameters = husky.parameters.with_entries(*(
        p.parameter() for e in looped.effects for p in e.parameters()))
    data = observations([replace(circle, recording='rest'), *moving[0][:2]])

    def kept(structure: Structure, settle: float) -> list[str]:
        plant = compile_model(structure).at(parameters)
        return [u.name for u in start_unknowns(data, plant, settle)]
    assert kept(husky.structure, 0.15) == [
        f'{what}@drive/{k}' for k in (0, 1) for what in ('initial_forward', 'initial_yaw')]
    assert kept(husky.structure, 3.0) == []
    assert any('initial_left' in name for name in kept(looped, 0.05))


def test_early_values_count_only_where_nothing_reaches_back_before_them() -> None:
    plain, late = Structure(), Structure(effects=(Effect('command_latency'),))
    assert settle_of(plain, []) == settle_of(late, WANTED) == 0.6
    assert settle_of(plain, [*WANTED, 'delay_imu']) == 0.6
    assert settle_of(plain, [*WANTED, 'gyro_bias']) == 0.15


def test_what_makes_no_sense_is_refused(
        husky: ModelFile, circle: Segment, moving: tuple[list[Segment], list[float]]) -> None:
    with pytest.raises(FitError, match="'initial_state' can only be estimated by least-squares"):
        estimate(husky, [circle], nuisance=WANTED, method=Method.GENETIC)
    twins = [moving[0][0], replace(moving[0][1], index=0)]
    with pytest.raises(FitError, match='two are named drive/0'):
        estimate(husky, twins, nuisance=WANTED, starts=1)
    with pytest.raises(FitError, match=r'known: latency, .*gyro_bias, initial_state'):
        estimate(husky, [circle], nuisance=['start'])
    with pytest.raises(FitError, match="no profile of 'initial_yaw@drive/0'"):
        estimate(husky, moving[0][:2], nuisance=WANTED, starts=1,
                 profiles=['initial_yaw@drive/0'])
