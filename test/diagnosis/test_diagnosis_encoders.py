# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Wheel rates are read as what they are: counted for a while, or of the moment."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from lg_husky_sim.diagnosis.diagnose import diagnose
from lg_husky_sim.diagnosis.encoders import as_read, is_momentary, read_otherwise
from lg_husky_sim.diagnosis.fits import first_metric, fit_structure, recalibrate
from lg_husky_sim.diagnosis.result import Verdict
from lg_husky_sim.diagnosis.rounds import Round
from lg_husky_sim.diagnosis.search import Search
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.identification.problem import Observations, observations
from lg_husky_sim.recording import Recording, segments
from lg_husky_sim.signals import TimeSeries
from lg_husky_sim.simulation import rollout
import numpy as np
import pytest

Record = Callable[..., Recording]
Steps = Sequence[tuple[float, float, float]]
NOISE = 0.02


@pytest.fixture(scope='module')
def plant() -> Plant:
    model = load_model()
    return compile_model(model.structure).at(model.parameters.replacing({'wheel_damping': 1.3}))


@pytest.fixture(scope='module')
def counted(record: Record, steps: Steps, plant: Plant) -> Recording:
    return record('rec', plant, steps, 1)


@pytest.fixture(scope='module')
def momentary(counted: Recording, plant: Plant) -> Recording:
    """Return the same drive with the rates that the wheels have at each stamp."""
    commands, wheels = counted.streams['command'], counted.streams['wheels']
    truth = rollout(plant, commands, float(wheels.times[-1]) + 0.01, 0.002)
    rates = np.column_stack([np.interp(wheels.times, truth.times, truth.column(f'wheel_{name}'))
                             for name in wheels.names])
    rates += NOISE * np.random.default_rng(2).standard_normal(rates.shape)
    return replace(counted, streams={
        **counted.streams, 'wheels': TimeSeries(wheels.times, rates, wheels.names)})


def read(recording: Recording) -> Observations:
    model = load_model()
    return as_read(observations(segments(recording)), model.structure, model.parameters)[0]


def test_rates_are_read_as_what_they_are(counted: Recording, momentary: Recording) -> None:
    assert not is_momentary(read(counted))
    assert is_momentary(read(momentary))


def test_without_wheels_there_is_nothing_to_read(counted: Recording) -> None:
    less = replace(counted, streams={name: stream for name, stream in counted.streams.items()
                                     if not name.startswith('wheel')})
    given = observations(segments(less))
    model = load_model()
    assert as_read(given, model.structure, model.parameters)[0] is given


@pytest.mark.parametrize(('of_moment', 'wrongly'), [(True, False), (True, True), (False, True)])
def test_what_was_found_says_how_rates_are_read(
        momentary: Recording, counted: Recording, of_moment: bool, wrongly: bool) -> None:
    model, recording = load_model(), momentary if of_moment else counted
    given = observations(segments(recording)).read_as(of_moment is not wrongly)
    plain = recalibrate(given, model.structure, model.parameters)
    metric = first_metric(given, plain.solution.predicted)
    nominal = {name: model.parameters[name] for name in model.parameters}
    final = fit_structure(given, model.structure.with_effect(Effect('gyro_scale')),
                          model.parameters, metric, plain.solution.values,
                          {**nominal, 'gyro_factor': 1.0})
    assert final is not None
    adopted = Round(plain, (), (), metric, 0.0, True)
    other = read_otherwise(Search(given, plain, final, (adopted,), model.parameters))
    assert (other is not None) is wrongly
    assert other is None or is_momentary(other) is of_moment
    assert read_otherwise(Search(given, plain, plain, (adopted,), model.parameters)) is None


def test_a_right_robot_with_rates_of_the_moment_lacks_nothing(momentary: Recording) -> None:
    found = diagnose([momentary], load_model(), lambda text, share: None).diagnosis
    assert found.verdict is Verdict.NOTHING_MISSING
    assert any('read as those of the moment' in note for note in found.notes)
