# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The deviation model: what the filter takes for noise, against the same model by itself."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from lg_husky_sim.diagnosis.evidence.deviation import axle_inertias, slow_model
from lg_husky_sim.diagnosis.evidence.drives import Channel, drives_of
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, evidence_of
from lg_husky_sim.diagnosis.evidence.noise import (
    fit_noise,
    negative_log_likelihood,
    Noise,
    sensor_variance,
    Whitener,
    whitener_of,
)
from lg_husky_sim.diagnosis.evidence.point import beginning, Point
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.evidence.whitener import MODEL
from lg_husky_sim.diagnosis.hypotheses.hypothesis import entries_of
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.threads import Threads
import numpy as np
import pytest

TRUE = Noise({
    'force': 6.0, 'moment': 1.0, 'drive': 0.4, 'force_time': 0.3, 'moment_time': 0.3,
    'drive_time': 0.08, 'place_walk': 1e-4, 'heading_walk': 1e-4, 'wheel': 0.02,
    'wheel_jitter': 5e-4, 'gyro': 0.005, 'imu_jitter': 5e-4, 'place': 0.003, 'heading': 0.003,
    'pose_jitter': 5e-4, 'command_jitter': 1e-3})


@pytest.fixture(scope='module')
def setup(drive: Callable[..., Recording]) -> Iterator[tuple[Evidence, Point]]:
    """Return the evidence of one drive from rest, noise known."""
    drives, model = drives_of([drive('ahead', 'nothing', 1)]), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        yield evidence_of(drives, ['ahead'], start, TRUE, pool), start


def simulated(whitener: Whitener, noise: Noise, count: int, seed: int) -> FloatArray:
    """Return residuals of the deviation model, shape (n, count), by small steps of its own."""
    frame, m = whitener.frame, whitener.model
    rng = np.random.default_rng(seed)
    slow, by, left, right = m[:4].reshape(2, 2), m[4:12].reshape(2, 4), m[12:16], m[16:20]
    v = noise.values
    level = np.array([v['force'], v['moment'], v['drive'], v['drive']])[:, None]
    time = np.array([v['force_time'], v['moment_time'], v['drive_time'], v['drive_time']])
    d = level * rng.standard_normal((4, count))
    s = setting('start_speed') * rng.standard_normal((2, count))
    angles = setting('start_angle') * rng.standard_normal((2, count))
    heading = setting('start_heading') * rng.standard_normal(count)
    place = setting('start_place') * rng.standard_normal((2, count))
    bias = np.zeros(count)
    out = np.empty((frame.times.size, count))
    sensor = np.sqrt(sensor_variance(frame, noise))
    now = frame.times[frame.order[0]]
    for reading in frame.order:
        while frame.times[reading] - now > 1e-9:
            dt = min(frame.times[reading] - now, 0.005)
            now += dt
            rates = [w[:2] @ s + w[2] * d[2] + w[3] * d[3] for w in (left, right)]
            angles += dt * np.array(rates)
            heading += dt * s[1] + v['heading_walk'] * np.sqrt(dt) * rng.standard_normal(count)
            way = np.array([frame.cosine[reading], frame.sine[reading]])
            place += dt * way[:, None] * s[0] + v['place_walk'] * np.sqrt(
                dt) * rng.standard_normal((2, count))
            bias += setting('bias_walk') * np.sqrt(dt) * rng.standard_normal(count)
            s = s + dt * (slow @ s + by @ d)
            keep = np.exp(-dt / time)[:, None]
            d = keep * d + level * np.sqrt(1.0 - keep ** 2) * rng.standard_normal((4, count))
        channel = Channel(int(frame.drive.channels[reading]))
        rows = {Channel.YAW_RATE: s[1] + bias, Channel.HEADING: heading, Channel.X: place[0],
                Channel.Y: place[1], Channel.ANGLE_LEFT: angles[0],
                Channel.ANGLE_RIGHT: angles[1]}
        if channel in (Channel.WHEEL_LEFT, Channel.WHEEL_RIGHT):
            w = left if channel is Channel.WHEEL_LEFT else right
            rows[channel] = w[:2] @ s + w[2] * d[2] + w[3] * d[3]
        out[reading] = rows[channel] + sensor[reading] * rng.standard_normal(count)
    return out


def known(whitener: Whitener) -> Whitener:
    """Return the filter with the true noise, without commands that may be lost."""
    return whitener_of(replace(whitener.frame, kicks=np.zeros((0, 6))), whitener.model, TRUE)


def test_innovations_of_the_deviation_model_are_white_with_unit_variance(
        setup: tuple[Evidence, Point]) -> None:
    whitener = known(setup[0].whiteners[0])
    e = whitener.apply(simulated(whitener, TRUE, 24, 1))
    assert np.mean(e ** 2) == pytest.approx(1.0, abs=0.04)
    frame = whitener.frame
    for channel in np.unique(frame.drive.channels):
        own = e[frame.drive.channels[frame.order] == channel]
        assert np.mean(own ** 2) == pytest.approx(1.0, abs=0.12), Channel(int(channel)).name
        for lag in (1, 2, 5):
            assert abs(np.mean(own[lag:] * own[:-lag])) < 0.08, (Channel(int(channel)).name, lag)


def test_intensities_are_recovered_within_a_quarter(setup: tuple[Evidence, Point]) -> None:
    evidence = setup[0]
    whitener = known(evidence.whiteners[0])
    residuals = [np.ascontiguousarray(column)
                 for column in simulated(whitener, TRUE, 4, 2).T]
    start = Noise({name: 1.8 * value for name, value in TRUE.values.items()})
    found = fit_noise(start, [whitener.frame] * 4, [whitener.model] * 4, residuals,
                      evidence.pool, 12, setting('longest_time')).values
    for name in ('force', 'moment', 'drive', 'wheel', 'gyro', 'place', 'heading'):
        assert found[name] == pytest.approx(TRUE.values[name], rel=0.25), name


def test_six_sets_of_derivatives_lead_from_far_away_to_the_maximum(
        setup: tuple[Evidence, Point]) -> None:
    """A search from where it ended gains nothing more."""
    evidence = setup[0]
    whitener = known(evidence.whiteners[0])
    residuals = [np.ascontiguousarray(column)
                 for column in simulated(whitener, TRUE, 2, 4).T]
    start = Noise({name: value if name.endswith('_time') else 30.0 * value
                   for name, value in TRUE.values.items()})

    def searched(begin: Noise, rounds: int) -> tuple[Noise, float]:
        found = fit_noise(begin, [whitener.frame] * 2, [whitener.model] * 2, residuals,
                          evidence.pool, rounds, setting('longest_time'))
        own = whitener_of(whitener.frame, whitener.model, found)
        return found, sum(negative_log_likelihood(own.apply(r), own.scale) for r in residuals)
    found, cost = searched(start, 6)
    assert cost - searched(found, 20)[1] < 2.0


def test_whitening_is_linear_and_does_not_look_ahead(setup: tuple[Evidence, Point]) -> None:
    whitener = known(setup[0].whiteners[0])
    a, b = simulated(whitener, TRUE, 2, 3).T
    np.testing.assert_allclose(whitener.apply(2.0 * a - b),
                               2.0 * whitener.apply(a) - whitener.apply(b), atol=1e-8)
    cut = np.array(a)
    cut[whitener.frame.order[1000:]] = 0.0
    np.testing.assert_array_equal(whitener.apply(cut)[:1000], whitener.apply(a)[:1000])


@pytest.mark.parametrize('count', [1, 2, 4, 5, 16, 17, 31, 33])
def test_columns_that_are_whitened_together_have_the_bits_of_each_alone(
        setup: tuple[Evidence, Point], count: int) -> None:
    """Some are filled up to a width that the compiler knows."""
    evidence, _ = setup
    columns = np.random.default_rng(count).standard_normal((evidence.count, count))
    together = evidence.whiteners[0].apply(columns)
    for k in range(count):
        assert np.array_equal(together[:, k], evidence.whiteners[0].apply(columns[:, k]))


def test_a_decay_faster_than_a_step_of_the_filter_is_slowed_and_no_gain_with_it() -> None:
    model = load_model()
    usual, stiff = (slow_model(
        compile_model(model.structure).at(model.parameters.replacing({'yaw_inertia': inertia})),
        model.parameters['mass'], inertia, axle_inertias(model.structure, model.parameters))
        for inertia in (model.parameters['yaw_inertia'], 0.01))
    rate, by_moment, by_voltage = (MODEL.index(name) for name in (
        'turn_by_turn', 'turn_by_moment', 'turn_by_voltage_right'))
    assert abs(usual[rate]) < abs(stiff[rate]) <= 0.5 / setting('longest_step') + 1e-9
    for gain in (by_moment, by_voltage):
        np.testing.assert_allclose(stiff[gain] / stiff[rate], usual[gain] / usual[rate], rtol=1e-6)


def _by_torque(**sizes: float) -> float:
    # Rate of a wheel by a torque on it [rad/s/(N·m)], with a speed loop of these gains.
    model, loop = load_model(), Effect('speed_loop')
    plant = compile_model(model.structure.with_effect(loop)).at(
        model.parameters.with_entries(*entries_of(loop, {'loop_lag': 0.1, **sizes})))
    found = slow_model(plant, model.parameters['mass'], model.parameters['yaw_inertia'],
                       axle_inertias(model.structure, model.parameters))
    return float(found[MODEL.index('left_by_left')])


def test_a_loop_holds_wheels_at_once_only_where_its_integral_is_fast() -> None:
    without = _by_torque(loop_gain=1.0, loop_integral=0.0)
    assert _by_torque(loop_gain=1.0, loop_integral=0.5) == pytest.approx(without, rel=0.05)
    assert abs(_by_torque(loop_gain=1.0, loop_integral=100.0)) < 1e-9 * without


def test_a_torque_on_wheels_does_as_much_with_the_inertia_parted() -> None:
    """Between motor and wheels, or between the axles of a side, which hold each other."""
    def by_torque(*effects: str) -> float:
        structure, entries = load_model().structure, []
        for effect in map(Effect, effects):
            structure = structure.with_effect(effect)
            entries += [p.parameter() for p in effect.parameters()]
        numbers = load_model().parameters.with_entries(*entries)
        found = slow_model(compile_model(structure).at(numbers), numbers['mass'],
                           numbers['yaw_inertia'], axle_inertias(structure, numbers))
        return float(found[MODEL.index('speed_by_left')])
    assert by_torque('gear_backlash') == pytest.approx(by_torque(), rel=1e-6)
    assert by_torque('belt_compliance', 'gear_backlash') == pytest.approx(by_torque(), rel=1e-6)


def test_wheels_that_a_loop_holds_are_whitened_to_finite_numbers(
        setup: tuple[Evidence, Point]) -> None:
    """Where a command seems lost, the torque of wheels is unsure, of those that it moves."""
    evidence, _ = setup
    whitener = known(evidence.whiteners[0])
    kicks = np.array([[whitener.frame.times[whitener.frame.order[50]], 0.4, 0.4, 0.0, 0.0, 0.0]])
    frame = replace(whitener.frame, kicks=kicks)
    usual, held = np.array(whitener.model), np.array(whitener.model)
    held[[MODEL.index('left_by_left'), MODEL.index('right_by_right')]] = 0.0
    for model in (usual, held):
        assert np.all(np.isfinite(whitener_of(frame, model, TRUE).scale))
    assert np.max(whitener_of(frame, usual, TRUE).scale) > 1.5 * np.max(
        whitener_of(frame, held, TRUE).scale)
