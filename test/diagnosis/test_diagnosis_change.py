# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What changed between recordings before and after, on a base that closes a speed loop."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from lg_husky_sim.comparison.output import simulate_commands
from lg_husky_sim.diagnosis import change
from lg_husky_sim.diagnosis.alike import with_common_errors
from lg_husky_sim.diagnosis.candidates import effect_entries
from lg_husky_sim.diagnosis.closed_base import closed_base
from lg_husky_sim.diagnosis.diagnose import Case, diagnose
from lg_husky_sim.diagnosis.fits import Fit, recalibrate
from lg_husky_sim.diagnosis.result import Verdict
from lg_husky_sim.errors import RecordingError
from lg_husky_sim.husky.effects import Effect, OnsetKind
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.identification.noise import metric, scales
from lg_husky_sim.identification.problem import Observations, observations
from lg_husky_sim.manoeuvres import Manoeuvre, Step
from lg_husky_sim.recording import Recording, segments
from lg_husky_sim.signals import TimeSeries
import numpy as np
import pytest

STEPS = ((1.0, 0.0, 0.0), (2.0, 0.4, 0.0), (2.0, 0.9, 0.0), (2.0, 0.5, 0.6), (2.0, 0.0, 0.6),
         (2.0, -0.5, 0.0), (2.0, -0.6, -0.5), (2.0, 0.0, -0.9), (2.0, 0.7, -0.4),
         (2.0, 0.0, 0.0))
BASE: Mapping[str, Mapping[str, float]] = {
    'command_latency': {'latency': 0.08}, 'command_slew': {'slew_forward': 2.0, 'slew_yaw': 4.0},
    'speed_loop': {'loop_lag': 0.15, 'loop_gain': 1.0, 'loop_integral': 15.0},
    # Two things that the catalogue has, but that the base is not given by itself.
    'rolling_resistance': {'rolling_force': 12.0}, 'yaw_scrub_coulomb': {
        'yaw_coulomb_moment': 3.0}}
NOISE = {'wheels': 0.02, 'imu': 0.005, 'pose': 0.003, 'wheel_angles': 0.0}
Sizes = Mapping[str, Mapping[str, float]]
#: What the base closes, by what was measured.
CLOSED: dict[bytes, Fit | None] = {}


def driven(name: str, effects: Sizes, seed: int, backwards: bool = False,
           since: float | None = None, before: Sizes = BASE) -> Recording:
    """Return 19 s of a robot; where ``since`` is given, it is another one until then [s]."""
    model = load_model()
    steps = tuple(Step(duration, forward, yaw, 0.2)
                  for duration, forward, yaw in (STEPS[::-1] if backwards else STEPS))
    made = []
    for sizes in (before, effects):
        structure, parameters = model.structure, model.parameters
        for effect, values in sizes.items():
            structure = structure.with_effect(Effect(effect))
            parameters = parameters.with_entries(*effect_entries(Effect(effect), values))
        made.append(simulate_commands(compile_model(structure).at(parameters),
                                      Manoeuvre(name, steps).commands(), 1.0))
    rng = np.random.default_rng(seed)
    streams = {'command': made[1]['command']}
    for stream, deviation in NOISE.items():
        early, late = (each[stream] for each in made)
        read = late.values if since is None else np.where(
            late.times[:, None] < since, early.values, late.values)
        streams[stream] = TimeSeries(
            late.times, read + deviation * rng.standard_normal(read.shape), late.names)
    return Recording(name, name, streams, 0, frames=('odom', 'base_link'))


def changed(effects: Sizes, since: float | None = None, each: int = 1) -> Case:
    """Return the diagnosis of one or two recordings against as many of the base."""
    before = [driven('base1', BASE, 1), driven('base2', BASE, 2, backwards=True)]
    after = [driven('rec2', effects, 4, backwards=True, since=since), driven('rec1', effects, 3)]
    return diagnose(after[:each], load_model(), lambda text, share: None, before[:each])


@pytest.fixture
def base_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Look once at what the base closes: the recordings before the change are always the same."""
    def once(before: Observations, *rest: Any) -> Fit | None:
        key = before.measured.tobytes()
        if key not in CLOSED:
            CLOSED[key] = closed_base(before, *rest)
        return CLOSED[key]
    monkeypatch.setattr(change, 'closed_base', once)


@pytest.mark.usefixtures('base_once')
def test_nothing_has_changed() -> None:
    found = changed(BASE)
    assert found.diagnosis.verdict is Verdict.NOTHING_MISSING
    assert {e.id for e in found.diagnosis.model.structure.effects} >= {
        'command_latency', 'command_slew', 'speed_loop'}
    for name, value in (('latency', 0.08), ('slew_forward', 2.0), ('loop_lag', 0.15)):
        assert found.diagnosis.model.parameters[name] == pytest.approx(value, rel=0.35), name


@pytest.mark.usefixtures('base_once')
def test_a_new_effect_is_named() -> None:
    found = changed({**BASE, 'gyro_scale': {'gyro_factor': 0.93}}).diagnosis
    assert [f.effect for f in found.findings] == ['gyro_scale']
    assert found.findings[0].onset is None
    assert found.findings[0].parameters[0].value == pytest.approx(0.93, abs=0.01)


@pytest.mark.usefixtures('base_once')
def test_what_was_there_before_may_change() -> None:
    """The dead time grows: the finding is the dead time, with its new value."""
    found = changed({**BASE, 'command_latency': {'latency': 0.2}}, each=2).diagnosis
    (finding,) = found.findings
    assert finding.effect == 'command_latency'
    (number,) = finding.parameters
    assert number.name == 'latency'
    late = found.model.parameters['latency_later'] - found.model.parameters['latency']
    assert late == pytest.approx(0.12, abs=0.02)
    assert 'changed' in finding.statement


@pytest.mark.usefixtures('base_once')
def test_it_may_change_within_a_recording() -> None:
    found = changed({**BASE, 'gyro_bias': {'gyro_bias': 0.04}}, since=9.0).diagnosis
    assert [f.effect for f in found.findings] == ['gyro_bias']
    onset = found.findings[0].onset
    assert onset is not None
    assert (onset.recording, onset.kind) == ('rec2', OnsetKind.TIME)
    assert onset.value == pytest.approx(9.0, abs=0.7)


@pytest.mark.parametrize('short', ['base', 'rec', 'rec2'])
def test_a_recording_that_cannot_be_used_is_refused(short: str) -> None:
    """However many others can be."""
    given = {name: driven(name, {}, 1) for name in ('base', 'rec', 'rec2')}
    given[short] = Recording(short, short, {
        name: series.slice(0.0, 0.5) for name, series in given[short].streams.items()}, 0)
    with pytest.raises(RecordingError, match=f'no usable segment in {short}: '):
        diagnose([given['rec'], given['rec2']], load_model(), lambda text, share: None,
                 [given['base']])


def test_an_open_loop_is_no_closed_base() -> None:
    one = driven('open', {}, 1)
    data = observations(segments(one))
    model = load_model()
    assert closed_base(data, model.structure, model.parameters) is None


def test_common_errors_weigh_as_a_random_effect() -> None:
    """Whitening gives the same sum of squares as the covariance written out."""
    model = load_model()
    data = observations(segments(driven('rec1', BASE, 1)))
    fit = recalibrate(data, model.structure, model.parameters)
    with_common = with_common_errors(data, fit)
    assert with_common.common is not None
    residual = data.measured - fit.solution.predicted
    used = metric(data, residual, scales(data, residual, fit.solution.predicted))
    plain = used.filtered(data, residual)
    columns = used.filtered(data, with_common.common)
    covariance = np.eye(plain.size) + columns @ columns.T
    expected = float(plain @ np.linalg.solve(covariance, plain))
    white = used.whiten(with_common, residual)
    assert float(white @ white) == pytest.approx(expected, rel=1e-6)
    assert float(white @ white) < float(plain @ plain)
