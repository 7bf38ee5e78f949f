# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Commands that come some milliseconds late, each by itself, are no effect."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from lg_husky_sim.comparison.output import simulate_commands
from lg_husky_sim.diagnosis.diagnose import diagnose
from lg_husky_sim.diagnosis.fits import first_metric, recalibrate
from lg_husky_sim.diagnosis.jitter import (
    gains_beside_jitter,
    JITTER,
    later,
    MOST,
    steps_of,
    with_jitter,
)
from lg_husky_sim.diagnosis.result import Verdict
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.identification.problem import Observations, observations
from lg_husky_sim.recording import Recording, segments
from lg_husky_sim.signals import TimeSeries
import numpy as np
import pytest

Steps = Sequence[tuple[float, float, float]]
Record = Callable[..., Recording]
NOISE = {'wheels': 0.02, 'imu': 0.005, 'pose': 0.003}


@pytest.fixture(scope='module')
def plant() -> Plant:
    model = load_model()
    return compile_model(model.structure).at(model.parameters)


@pytest.fixture(scope='module')
def data(record: Record, steps: Steps, plant: Plant) -> Observations:
    return observations(segments(record('rec', plant, steps, 1)))


def test_every_change_of_the_command_is_one_step(data: Observations, steps: Steps) -> None:
    """The drives ramp within 0.2 s: a ramp is one step."""
    found = steps_of(data)
    begins = np.cumsum([duration for duration, _, _ in steps])[:-1]
    (piece,) = data.pieces
    times = [piece.commands.times[one.first] for one in found]
    assert len(found) == len(begins)
    np.testing.assert_allclose(times, begins, atol=0.06)
    first = found[0]
    assert first.size == pytest.approx(0.4 / 0.05)
    assert 0.1 < piece.commands.times[first.last] - times[0] < 0.25


def test_largest_steps_of_many_count(record: Record, plant: Plant) -> None:
    many = [(0.5, 0.1 + 0.001 * k * (-1) ** k, 0.0) for k in range(2 * MOST)]
    data = observations(segments(record('rec', plant, many, 1)))
    found = steps_of(data)
    assert len(found) == MOST
    assert [one.first for one in found] == sorted(one.first for one in found)
    assert min(one.size for one in found) > 1.0


def test_a_step_never_overtakes_the_next_command(data: Observations) -> None:
    for step in steps_of(data):
        moved, late = later(data.pieces[step.piece], step)
        assert 0.0 < late <= 0.01
        assert np.all(np.diff(moved.commands.times) > 0.0)


def test_columns_are_what_a_late_step_changes(data: Observations, plant: Plant) -> None:
    model = load_model()
    fit = recalibrate(data, model.structure, model.parameters)
    common = with_jitter(data, fit).common
    assert common is not None
    steps = steps_of(data)
    assert common.shape == (data.measured.size, len(steps))
    (piece,) = data.pieces
    times = np.array(piece.commands.times)
    times[steps[3].first:steps[3].last + 1] += JITTER
    moved = replace(piece, commands=TimeSeries(
        times, piece.commands.values, piece.commands.names))
    own = compile_model(fit.structure).at(fit.parameters)
    change = Observations((moved,)).predict(own, {}) - data.predict(own, {})
    assert float(np.max(np.abs(change))) > 0.01
    assert float(np.linalg.norm(common[:, 3] - change)) < 0.1 * float(np.linalg.norm(change))


def test_commands_of_one_stamp_are_no_step_of_jitter(data: Observations) -> None:
    """Neither can come later than the other; a drive with one command has no step at all."""
    model, (piece,) = load_model(), data.pieces
    sent, step = piece.commands, steps_of(data)[2]
    times = np.array(sent.times)
    times[step.last + 1] = times[step.last]
    for commands, count in ((TimeSeries(times, sent.values, sent.names), len(steps_of(data))),
                            (TimeSeries(times[:1], sent.values[:1], sent.names), 0)):
        odd = Observations((replace(piece, commands=commands),))
        fit = recalibrate(odd, model.structure, model.parameters)
        metric = first_metric(odd, fit.solution.predicted)
        assert len(steps_of(odd)) == count
        assert gains_beside_jitter(odd, fit, [fit], metric) == [0.0]


def test_a_late_step_gains_nothing_beside_jitter_and_a_slope_does(data: Observations) -> None:
    model = load_model()
    base = recalibrate(data, model.structure, model.parameters)
    common = with_jitter(data, base).common
    assert common is not None
    error = 3.0 * common[:, 4]
    drift = 0.05 * np.sin(0.5 * data.times) * data.channel_mask('yaw_rate')
    metric = first_metric(data, base.solution.predicted)

    def gain(change: np.ndarray) -> tuple[float, float]:
        # Of a fit that follows a change of the data, against one that does not.
        worse = replace(base, solution=replace(
            base.solution, predicted=base.solution.predicted - change))
        plain = [0.5 * float(np.sum(metric.whiten(
            data, data.measured - fit.solution.predicted) ** 2)) for fit in (worse, base)]
        return plain[0] - plain[1], gains_beside_jitter(data, worse, [base], metric)[0]
    alone, beside = gain(error)
    assert alone > 100.0
    assert abs(beside) < 0.1 * alone
    alone, beside = gain(drift)
    assert alone > 100.0
    assert beside > 0.8 * alone


def jittered(told: Recording, plant: Plant, most: float, rng: np.random.Generator) -> Recording:
    """Return a recording whose every command acts up to so many seconds late."""
    sent = told.streams['command']
    late = np.maximum.accumulate(sent.times + rng.uniform(0.0, most, len(sent)))
    acted = simulate_commands(plant, TimeSeries(late, sent.values, sent.names), 1.0)
    noisy = {name: TimeSeries(series.times, series.values + NOISE[name] * rng.standard_normal(
        series.values.shape), series.names) for name, series in acted.items() if name in NOISE}
    return replace(told, streams={'command': sent, **noisy})


def test_commands_that_jitter_are_nothing_missing(record: Record, steps: Steps, plant: Plant
                                                  ) -> None:
    """Every command comes up to 20 ms late, as with a base that asks for them at 50 Hz."""
    rng = np.random.default_rng(4)
    recordings = [jittered(record(f'rec{k}', plant, steps, k), plant, 0.02, rng)
                  for k in range(2)]
    found = diagnose(recordings, load_model(), lambda text, share: None).diagnosis
    assert found.verdict is Verdict.NOTHING_MISSING, found.findings
    assert found.confidence > 0.5
