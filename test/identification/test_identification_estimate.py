# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Known parameters come back from synthetic drives, with honest intervals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
import json

from lg_husky_sim.errors import FitError, ParameterError, RecordingError
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import Structure
from lg_husky_sim.husky.model_file import ModelFile
from lg_husky_sim.identification.confidence import Confidence, undetermined
from lg_husky_sim.identification.estimate import estimate
from lg_husky_sim.identification.least_squares import Unknown
from lg_husky_sim.identification.options import effect_in, names_in, with_effects
from lg_husky_sim.identification.result import FitResult, Method
from lg_husky_sim.recording import Segment
from lg_husky_sim.signals import TimeSeries
import numpy as np
import pytest

Drive = Callable[..., Segment]
Truth = dict[str, float]


@pytest.fixture(scope='session')
def fit(husky: ModelFile, circle: Segment) -> FitResult:
    return estimate(husky, [circle], profiles=['command_gain'], starts=4)


def test_least_squares_finds_the_truth(fit: FitResult, truth: Truth) -> None:
    assert fit.converged
    for one in fit.estimates:
        assert one.value == pytest.approx(truth[one.name], rel=0.05)
        assert one.low < one.value < one.high
        entry = fit.model.parameters.entry(one.name)
        assert (entry.value, entry.low, entry.high) == (one.value, one.low, one.high)
        assert 'drive' in entry.source


def test_intervals_hold_the_truth_as_often_as_they_say(husky: ModelFile, make_drive: Drive,
                                                       truth: Truth) -> None:
    # Counted over 200 recordings by benchmarks/interval_coverage.py; here over ten.
    fits = [estimate(husky, [make_drive(seed=seed)], starts=1) for seed in range(20, 30)]
    inside = [one.low < truth[one.name] < one.high for fit in fits for one in fit.estimates]
    assert len(inside) == 30
    assert sum(inside) >= 25
    assert not all(one.high / one.low > 1.2 for fit in fits for one in fit.estimates)


def test_channels_end_at_the_noise(fit: FitResult) -> None:
    after = {c.name: c.after for c in fit.channels}
    assert after['wheel_left'] == pytest.approx(0.05, rel=0.1)
    assert after['yaw_rate'] == pytest.approx(0.01, rel=0.1)
    assert after['position'] < 0.05
    for channel in fit.channels:
        assert channel.before > channel.after


def test_only_the_ratio_of_the_dampings_is_said_to_be_known(fit: FitResult) -> None:
    (sentence,) = fit.undetermined
    assert sentence.startswith('only yaw_damping/wheel_damping = ')
    assert 'weighing the robot or a motor current sensor would separate them' in sentence
    ratio = float(sentence.split(' = ')[1].split()[0])
    assert ratio == pytest.approx(20.0 / 3.0, rel=0.02)
    names = [one.name for one in fit.estimates]
    i, j = names.index('wheel_damping'), names.index('yaw_damping')
    assert fit.correlation[i, j] > 0.95


def known_to(deviation: float) -> Confidence:
    names = ('wheel_damping', 'yaw_damping')
    unknowns = tuple(Unknown(n, True, 0.0, np.inf, 1e-3, 1e3, 1e-6) for n in names)
    correlation = np.array([[1.0, 0.999], [0.999, 1.0]])
    return Confidence(unknowns, deviation ** 2 * correlation, correlation, 1e3, 30, np.ones(2),
                      np.ones(2), np.ones(2), (), np.empty(0))


def test_what_is_known_well_alone_is_not_said_to_be_known_only_together() -> None:
    values = np.array([30.0, 200.0])
    (sentence,) = undetermined(known_to(0.1), values)
    assert sentence.startswith('only yaw_damping/wheel_damping = 6.667 is well determined')
    assert undetermined(known_to(0.001), values) == ()


def test_profile_agrees_with_the_interval_where_the_cost_is_a_parabola(fit: FitResult) -> None:
    (profile,) = fit.profiles
    one = next(e for e in fit.estimates if e.name == 'command_gain')
    assert profile.low == pytest.approx(one.low, abs=0.4 * (one.high - one.low))
    assert profile.high == pytest.approx(one.high, abs=0.4 * (one.high - one.low))
    assert np.min(profile.rise) == 0.0


def test_report_holds_every_number(fit: FitResult, truth: Truth) -> None:
    text, data = str(fit), json.loads(json.dumps(fit.data(), allow_nan=False))
    for one in fit.estimates:
        assert one.name in text
        assert one.unit in text
    assert data['schema'] == 'lg_husky_sim/fit/1'
    assert len(data['starts']) == 4
    assert {p['name'] for p in data['parameters']} == set(truth)


def test_an_interval_is_printed_with_digits_that_tell_its_ends_apart(fit: FitResult) -> None:
    narrow = replace(fit, estimates=(replace(
        fit.estimates[0], value=1.6, low=1.599998, high=1.600002),))
    line = next(one for one in str(narrow).splitlines() if one.startswith('wheel_damping'))
    assert line.split()[1:5] == ['1.6', '1.599998', 'to', '1.600002']


def test_the_same_seed_gives_the_same_bits_whatever_the_jobs(husky: ModelFile, circle: Segment
                                                             ) -> None:
    alone = estimate(husky, [circle], seed=5, starts=2)
    spread = estimate(husky, [circle], seed=5, starts=2, jobs=2)
    assert alone.values == spread.values
    np.testing.assert_array_equal(alone.covariance, spread.covariance)


@pytest.mark.parametrize('method', [Method.GENETIC, Method.DIFFERENTIAL_EVOLUTION])
def test_the_position_alone_is_fitted_by_populations(husky: ModelFile, circle: Segment,
                                                     method: Method) -> None:
    result = estimate(husky, [circle], method=method, seed=2)
    position = next(c for c in result.channels if c.name == 'position')
    assert position.after < 0.2 * position.before
    assert len(result.history) > 10
    assert result.cost == result.history[-1, 0]
    if method is Method.DIFFERENTIAL_EVOLUTION:
        assert result.values['command_gain'] == pytest.approx(0.85, rel=0.02)


def test_recordings_with_gaps_and_slow_encoders_are_fitted_together(
        husky: ModelFile, make_drive: Drive, truth: Truth) -> None:
    whole = [make_drive('spin', seed=2, recording='spin'),
             make_drive('s_bend', seed=3, recording='bend')]
    slow = []
    for segment in whole:
        wheels = segment.streams['wheels']
        picked = slice(3, None, 7)
        streams = {**segment.streams, 'wheels': TimeSeries(
            wheels.times[picked], wheels.values[picked], wheels.names)}
        cut = {k: v.slice(6.0, segment.end) for k, v in streams.items()}
        early = {k: v.slice(segment.start, 5.0) for k, v in streams.items()}
        slow += [replace(segment, end=5.0, streams=early),
                 replace(segment, index=1, start=6.0, streams=cut)]
    result = estimate(husky, slow, starts=2)
    assert result.recordings == ('spin', 'bend')
    for name, value in truth.items():
        assert result.values[name] == pytest.approx(value, rel=0.1)


def test_an_effect_and_a_nuisance_are_estimated_with_the_rest(
        husky: ModelFile, make_drive: Drive, truth: Truth) -> None:
    effect = Effect('yaw_scrub_coulomb')
    segment = make_drive('spin', {**truth, 'yaw_coulomb_moment': 3.0}, structure=Structure(
        effects=(effect,)))
    imu = segment.streams['imu']
    biased = replace(segment, streams={**segment.streams, 'imu': TimeSeries(
        imu.times, imu.values + np.array([0.03, 0.0, 0.0]), imu.names)})
    result = estimate(with_effects(husky, ['yaw_scrub_coulomb']), [biased],
                      nuisance=['gyro_bias'], starts=2)
    assert result.values['yaw_coulomb_moment'] == pytest.approx(3.0, rel=0.1)
    assert result.values['gyro_bias'] == pytest.approx(0.03, abs=0.003)
    assert 'gyro_bias' not in result.model.parameters


def test_what_nothing_measures_is_open_up_to_its_bounds(husky: ModelFile, circle: Segment,
                                                        truth: Truth) -> None:
    """Without a gyro, its bias and delay are not zero with certainty."""
    mute = replace(circle, streams={
        name: series for name, series in circle.streams.items() if name != 'imu'})
    result = estimate(husky, [mute], nuisance=['gyro_bias', 'delay_imu'], starts=1)
    known = {one.name: one for one in result.estimates}
    for name in ('gyro_bias', 'delay_imu'):
        assert known[name].low < -0.04 < 0.04 < known[name].high
        assert f'{name} is hardly determined' in ' '.join(result.undetermined)
    for name, value in truth.items():
        assert known[name].low < value < known[name].high
        assert known[name].high < 1.2 * known[name].low


def test_a_bound_that_was_hit_is_warned_of(husky: ModelFile, circle: Segment) -> None:
    entry = husky.parameters.entry('command_gain')
    narrow = ModelFile(husky.structure, husky.parameters.with_entries(
        replace(entry, value=0.9, lower=0.88, upper=0.95)))
    result = estimate(narrow, [circle], starts=1)
    assert any(w.startswith('command_gain = 0.88 s/m ended on its lower bound')
               for w in result.warnings)


def test_physics_that_is_left_out_is_warned_of(husky: ModelFile, make_drive: Drive,
                                               truth: Truth, fit: FitResult) -> None:
    segment = make_drive('spin', {**truth, 'yaw_coulomb_moment': 6.0}, structure=Structure(
        effects=(Effect('yaw_scrub_coulomb'),)))
    poor = estimate(husky, [segment], starts=1)
    assert any('autocorrelated' in w and 'yaw rate' in w for w in poor.warnings)
    assert not any('autocorrelated' in w for w in fit.warnings)


def test_what_cannot_be_estimated_is_refused(husky: ModelFile, circle: Segment) -> None:
    fixed = ModelFile(husky.structure, husky.parameters.with_entries(*(
        replace(p, free=False) for p in husky.parameters.entries)))
    with pytest.raises(FitError, match='no parameter is free'):
        estimate(fixed, [circle])
    with pytest.raises(FitError, match="unknown nuisance 'bias'"):
        estimate(husky, [circle], nuisance=['bias'])
    with pytest.raises(FitError, match='only be estimated by least-squares'):
        estimate(husky, [circle], nuisance=['latency'], method=Method.GENETIC)
    with pytest.raises(ParameterError, match='did you mean wheel_damping'):
        estimate(husky, [circle], free=['wheel_dampin'])
    with pytest.raises(FitError, match="no profile of 'mass'"):
        estimate(husky, [circle], profiles=['mass'], starts=1)
    with pytest.raises(RecordingError, match='no usable segment'):
        estimate(husky, [replace(circle, streams={'command': circle.streams['command']})])


def test_options_are_read() -> None:
    assert names_in(['a,b', ' b , c']) == ('a', 'b', 'c')
    assert effect_in('command_limit:yaw').shape == 'yaw'
    assert effect_in('coulomb_drivetrain:left').side == 'left'
    assert effect_in('viscous_asymmetry:right:bearing').shape == 'bearing'
    with pytest.raises(ParameterError, match='not one of'):
        effect_in('command_limit:sideways')
