# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Commands that reach a base early, late or not at all are noise, not physics."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.comparison.output import simulate_commands
from lg_husky_sim.diagnosis.evidence.drives import Drive, drive_of, drives_of
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, evidence_of, Fit
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.repaired_commands import repaired
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.log_notes import log_notes
from lg_husky_sim.diagnosis.selection.rounds import calibrated
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording, segments
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.threads import Threads
import numpy as np
import pytest

NOISE = {'wheels': 0.01, 'imu': 0.003, 'pose': 0.003}


def driven(name: str, seed: int, heard: Callable[[TimeSeries], TimeSeries],
           written: Callable[[TimeSeries], TimeSeries] = lambda sent: sent) -> Recording:
    """Return a drive of the nominal robot, whose base hears and whose log holds other commands."""
    rng = np.random.default_rng(seed)
    times = np.arange(0.0, 30.0, 0.1)
    steps = np.repeat(rng.uniform(-1.0, 1.0, (60, 2)) * [0.8, 0.9], 5, axis=0)
    steps[:10] = 0.0
    sent = TimeSeries(times, steps, ('forward', 'yaw'))
    model = load_model()
    streams = simulate_commands(compile_model(model.structure).at(model.parameters),
                                heard(sent), 1.0)
    made = {'command': written(sent)}
    for stream, deviation in NOISE.items():
        series = streams[stream]
        made[stream] = TimeSeries(
            series.times, series.values + deviation * rng.standard_normal(series.values.shape),
            series.names)
    return Recording(name, name, made, 0, frames=('odom', 'base_link'))


def fitted(recording: Recording) -> tuple[Evidence, Fit]:
    """Return the recalibrated nominal model and its noise."""
    drives, model = drives_of([recording]), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        return calibrated(evidence_of(drives, [recording.name], start, first_guess(drives),
                                      pool), start)


@pytest.mark.parametrize('period', [0.01, 0.03])
def test_jitter_of_a_base_that_looks_at_its_own_rate_is_recovered(period: float) -> None:
    rng = np.random.default_rng(3)

    def heard(sent: TimeSeries) -> TimeSeries:
        return TimeSeries(sent.times + rng.uniform(0.0, period, len(sent)), sent.values,
                          sent.names)
    evidence, fit = fitted(driven('ticked', 4, heard))
    assert evidence.noise.values['command_jitter'] == pytest.approx(period / 12 ** 0.5, rel=0.3)
    assert fit.point.log.get('command_delay') == pytest.approx(0.5 * period, abs=0.003)


def test_a_command_that_the_base_missed_is_taken_out() -> None:
    def heard(sent: TimeSeries) -> TimeSeries:
        keep = np.arange(len(sent)) != 150
        return TimeSeries(sent.times[keep], sent.values[keep], sent.names)
    evidence, _ = fitted(driven('missed', 5, heard))
    gone = set(evidence.drives[0].logged.times) - set(evidence.drives[0].commands.times)
    assert gone == {15.0}


def test_a_command_that_the_log_lost_is_put_back() -> None:
    def written(sent: TimeSeries) -> TimeSeries:
        keep = np.arange(len(sent)) != 150
        return TimeSeries(sent.times[keep], sent.values[keep], sent.names)
    evidence, _ = fitted(driven('lost', 5, lambda sent: sent, written))
    commands = evidence.drives[0].commands
    assert len(commands) == len(evidence.drives[0].logged) + 1
    place = int(np.argmin(np.abs(commands.times - 15.0)))
    assert commands.times[place] == pytest.approx(15.0, abs=1e-9)
    truth = driven('kept', 5, lambda sent: sent).streams['command'].values[150]
    np.testing.assert_allclose(commands.values[place], truth, atol=0.1)


@pytest.mark.parametrize('late', [0.06, 0.13, 0.27])
def test_a_command_that_came_late_acts_then_with_all_behind_it(late: float) -> None:
    def heard(sent: TimeSeries) -> TimeSeries:
        times = np.array(sent.times)
        times[150:] = np.maximum(times[150:], times[150] + late)
        return TimeSeries(times, sent.values, sent.names)
    evidence, _ = fitted(driven('late', 5, heard))
    commands = evidence.drives[0].commands
    # The next one after a gap is the last that waited.
    first = commands.times[np.searchsorted(commands.times, 14.95)]
    assert first == pytest.approx(15.0 + late, abs=0.02)
    waited = 150 + int(np.floor(late / 0.1))
    truth = driven('kept', 5, lambda sent: sent).streams['command'].values[waited]
    np.testing.assert_array_equal(commands.values[np.searchsorted(commands.times, 14.95)], truth)
    (note,) = log_notes(evidence.drives)
    assert note.startswith(f'{waited - 149} of {len(evidence.drives[0].logged)} commands seem to '
                           'have reached the base late')


def test_a_robot_that_hears_everything_keeps_all_its_commands() -> None:
    evidence, _ = fitted(driven('all', 6, lambda sent: sent))
    assert evidence.drives[0].commands is evidence.drives[0].logged
    assert log_notes(evidence.drives) == ()
    assert evidence.noise.values['command_jitter'] < 0.001


@pytest.mark.parametrize(('missed', 'late', 'taken'), [
    (12.0, 7.0, 'late'), (8.0, 7.0, 'missed'), (0.0, 7.0, 'missed'), (40.0, 7.0, 'late')])
def test_a_command_has_its_likeliest_explanation_and_not_the_first(
        missed: float, late: float, taken: str) -> None:
    """What has a number must be likelier by more than such a number gains by chance."""
    times = np.linspace(0.0, 3.9, 40)
    logged = TimeSeries(times, np.column_stack([np.sin(times), np.cos(times)]),
                        ('forward', 'yaw'))
    far = np.zeros(400)
    far[200:203] = 40.0

    def score(commands: TimeSeries) -> FloatArray:
        # One of them later, or one less.
        e = np.array(far)
        e[200:203] = missed if np.all(np.isin(commands.times, times)) else late
        return e
    found = repaired(logged, far, np.ones(400, dtype=bool), np.linspace(0.0, 4.0, 400), score)
    assert found is not logged
    assert np.all(np.isin(found.times, times)) == (taken == 'missed')


@pytest.mark.parametrize(('every', 'most'), [(1, 8), (10, 3), (240, 0)])
def test_of_few_changes_of_the_command_few_are_late_by_chance(every: int, most: int) -> None:
    """What repeats the command before it shows in nothing; a dead time would be repaired away."""
    times = np.linspace(0.0, 47.8, 240)
    values = np.repeat(np.random.default_rng(1).uniform(-1.0, 1.0, 240 // every), every)
    logged = TimeSeries(times, np.column_stack([values, values]), ('forward', 'yaw'))
    changed = np.flatnonzero(np.diff(values, prepend=values[0]))

    def score(commands: TimeSeries) -> FloatArray:
        # Every change is far off where the base gets it; none is later.
        e = np.full(240, 0.0 if np.all(np.isin(commands.times, times)) else 50.0)
        e[[place for place in changed if times[place] in commands.times]] += 40.0
        return e
    found = repaired(logged, score(logged), np.ones(240, dtype=bool), times, score)
    assert 240 - np.count_nonzero(np.isin(times, found.times)) == most


def rounding_of(values: FloatArray) -> FloatArray:
    """Return the variances by which the wheel rates of a drive are rounded."""
    recording = driven('rounded', 7, lambda sent: sent)
    wheels = recording.streams['wheels']
    streams = dict(recording.streams)
    streams['wheels'] = TimeSeries(wheels.times[:values.size], np.repeat(
        values[:, None], wheels.values.shape[1], axis=1), wheels.names)
    drive = drive_of(segments(Recording('r', 'r', streams, 0, frames=('odom', 'base_link')))[0])
    assert isinstance(drive, Drive)
    return np.asarray(drive.rounding[drive.channels == 0])


def test_readings_that_are_rounded_tell_once_what_they_repeat() -> None:
    ramp = np.round(np.linspace(0.0, 6.0, 600) / 0.06) * 0.06
    found = rounding_of(ramp)
    # Runs of six equal readings: together as sure as one that is rounded to 0.06.
    assert np.median(found) == pytest.approx(6 * 0.06 ** 2 / 12.0, rel=0.2)
    smooth = rounding_of(np.sin(np.linspace(0.0, 6.0, 600)))
    assert np.median(smooth) < 1e-5
