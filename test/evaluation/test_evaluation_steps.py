# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Half of the steps is fitted, the other half judged, beside simple models."""

from __future__ import annotations

from dataclasses import replace

from lg_husky_sim.comparison.replay import replay
from lg_husky_sim.errors import FitError
from lg_husky_sim.evaluation.baselines import (
    driven,
    fit_kinematics,
    fit_lags,
    kinematic_predictor,
    lag_predictor,
)
from lg_husky_sim.evaluation.real import evaluate_steps, LABELS, steps_data, steps_table
from lg_husky_sim.evaluation.steps import alternate_steps, steps_of, within
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.identification.options import with_effects
from lg_husky_sim.identification.problem import Observations, observations
from lg_husky_sim.recording import Recording, segments
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.simulation import rollout
import numpy as np
import pytest

START_NS = 1_700_000_000_000_000_000


def recording(effects: tuple[str, ...] = (), steps: int = 10, turning: float = 0.9,
              **values: float) -> Recording:
    """Return a robot driven by random constant steps of 4 s, encoders at 7 Hz."""
    model = with_effects(load_model(), effects)
    plant = compile_model(model.structure).at(model.parameters.replacing(values))
    draws = np.random.default_rng(4)
    targets = np.column_stack([draws.uniform(-0.6, 0.6, steps),
                               draws.uniform(-turning, turning, steps)])
    times = 0.05 * np.arange(80 * steps + 1, dtype=np.float64)
    commands = TimeSeries(times, targets[np.minimum((times / 4.0).astype(int), steps - 1)],
                          ('forward', 'yaw'))
    seen = plant.observe(rollout(plant, commands, float(times[-1]), 0.01))

    def stream(names: tuple[str, ...], every: int, noise: float) -> FloatArray:
        chosen: FloatArray = np.column_stack([seen.column(n) for n in names])[::every]
        return chosen + draws.normal(0.0, noise, chosen.shape)
    return Recording('steps', 'steps', {
        'command': commands,
        'wheels': TimeSeries(seen.times[::14], stream(('wheel_left', 'wheel_right'), 14, 0.03),
                             ('left', 'right')),
        'pose': TimeSeries(seen.times[::10], stream(('x', 'y', 'heading'), 10, 0.003),
                           ('x', 'y', 'heading'))}, START_NS)


@pytest.fixture(scope='module')
def data() -> Observations:
    return observations(segments(recording()))


def test_steps_are_those_that_were_commanded(data: Observations) -> None:
    steps = steps_of(data)
    assert len(steps) == 10
    assert [round(step.start) for step in steps] == [4 * k for k in range(10)]


def test_every_value_is_fitted_or_held_out(data: Observations) -> None:
    fitted, held = alternate_steps(data)
    assert fitted.measured.size + held.measured.size == data.measured.size
    assert set(fitted.times) | set(held.times) == set(data.times)
    # Simulated throughout, so a held-out value is predicted as in the whole recording.
    model = load_model()
    plant = compile_model(model.structure).at(model.parameters)
    whole = dict(zip(zip(data.times, data.measured, strict=True), data.predict(plant),
                     strict=True))
    for key, value in zip(zip(held.times, held.measured, strict=True), held.predict(plant),
                          strict=True):
        assert whole[key] == value
    inside = (held.times % 8.0 > 4.0) | (held.times % 8.0 == 0.0)
    assert np.all(inside)


def test_a_lag_is_found_again(data: Observations) -> None:
    # The channel's values are replaced by those of a known lag.
    segments = []
    for segment in data.segments:
        channels = tuple(
            type(c)(c.name, c.times, driven(segment, c, 0.25, 0.12) @ np.array(
                [5.0, -1.5] if c.name == 'wheel_left' else [5.0, 1.5]
                if c.name == 'wheel_right' else [0.9]), c.begins) for c in segment.channels)
        segments.append(replace(segment, channels=channels))
    made = Observations(tuple(segments))
    lags = fit_lags(made)
    for name, lag in lags.items():
        assert lag.time_constant == pytest.approx(0.25, abs=0.02), name
        assert lag.delay == pytest.approx(0.12, abs=0.02), name
    assert lags['wheel_left'].gains == pytest.approx((5.0, -1.5), abs=0.05)
    # A delay found to the millisecond still errs on the jumps of the command.
    error = lag_predictor(lags)(made) - made.measured
    assert np.sqrt(np.mean(error ** 2)) < 0.02


def test_the_kinematic_model_finds_the_effective_track(data: Observations) -> None:
    model = fit_kinematics(data, load_model().parameters)
    # Table II's numbers give 1/r_W within 1.5 % and a multiplier of 1.87 on the track.
    assert model.radius == pytest.approx(0.1651, rel=0.03)
    assert model.track / 0.5708 == pytest.approx(1.87, rel=0.05)
    predicted = kinematic_predictor(model)(data)
    mask = data.channel_mask('turn')
    rest = np.sqrt(np.mean((data.measured - predicted)[mask] ** 2))
    assert rest < 0.5 * np.sqrt(np.mean(data.measured[mask] ** 2))


def test_a_drive_without_turns_keeps_the_nominal_track() -> None:
    nominal = load_model().parameters
    straight = observations(segments(recording(steps=4, turning=0.0)))
    model = fit_kinematics(straight, nominal)
    assert model.arm == 0.5 * nominal['track']
    assert model.track > 0.0
    assert np.all(np.isfinite(kinematic_predictor(model)(straight)))


def test_a_handful_of_values_is_no_channel(data: Observations) -> None:
    """Of the encoders, that send seven times a second, a short step holds too few."""
    (segment,) = within(data, [replace(steps_of(data)[1], end=4.4)]).segments
    assert {channel.name for channel in segment.channels} == set()
    (segment,) = within(data, [replace(steps_of(data)[1], end=4.8)]).segments
    assert 'wheel_left' in {channel.name for channel in segment.channels}


def test_what_the_base_does_is_found_on_held_out_steps() -> None:
    made = recording(('command_latency', 'command_limit:yaw'), latency=0.15, limit_yaw=0.5,
                     wheel_damping=4.0, yaw_damping=35.0)
    result = evaluate_steps(made, load_model(), starts=1,
                            effects=('command_latency', 'command_limit:yaw'))
    rows = dict(zip(result.channels, zip(*(result.errors[label] for label in LABELS),
                                         strict=True), strict=True))
    for name in ('wheel_left', 'wheel_right', 'turn'):
        nominal, kinematic, lag, refit, base = rows[name]
        assert base < 0.5 * min(nominal, kinematic, lag, refit), name
    assert result.extended.values['latency'] == pytest.approx(0.15, abs=0.02)
    assert result.extended.values['limit_yaw'] == pytest.approx(0.5, rel=0.05)
    assert rows['wheel_left'][-1] < 0.1
    table = steps_table(result)
    assert [row[0] for row in table.rows][:2] == [
        'left wheel rate [rad/s]', 'right wheel rate [rad/s]']
    assert steps_data(result)['steps'] == 10
    # With latency and limit in the model, nothing of either is left to change.
    assert {error.kind for error in result.what_to_change.errors}.isdisjoint(
        {'late', 'yaw_limit', 'turn_gain', 'slip'})


def test_a_follower_without_controller_starts_in_motion() -> None:
    model = with_effects(load_model(), ['speed_loop'])
    plant = compile_model(model.structure).at(model.parameters.replacing(
        {'loop_gain': 0.0, 'loop_integral': 0.0}))
    part = segments(recording())[0]
    moving = {name: series.slice(6.0, part.end) for name, series in part.streams.items()}
    seen = replay(plant, replace(part, start=6.0, streams=moving))
    start = moving['wheels'].values[0]
    np.testing.assert_allclose([seen.column('wheel_left')[0], seen.column('wheel_right')[0]],
                               start, atol=0.1)


def test_too_few_steps_are_refused() -> None:
    with pytest.raises(FitError, match='has 3 commanded steps'):
        evaluate_steps(recording(steps=3), load_model())
