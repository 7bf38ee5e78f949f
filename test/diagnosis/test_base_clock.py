# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A base that applies commands at its own ticks: found from when its wheels follow."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
import math

from lg_husky_sim.comparison.output import simulate_commands
from lg_husky_sim.diagnosis.diagnose import diagnose
from lg_husky_sim.diagnosis.evidence import clock_search
from lg_husky_sim.diagnosis.evidence.base_clock import ticked_as, ticker_of, ticking
from lg_husky_sim.diagnosis.evidence.clock_search import at_ticks, usual_period
from lg_husky_sim.diagnosis.evidence.drives import Clock, Drive, drives_of
from lg_husky_sim.diagnosis.evidence.evidence import evidence_of
from lg_husky_sim.diagnosis.evidence.noise import first_guess, Noise
from lg_husky_sim.diagnosis.evidence.point import beginning, Point
from lg_husky_sim.diagnosis.evidence.reading import Reading, WheelReading
from lg_husky_sim.diagnosis.evidence.unknowns import (
    base_unknowns,
    start_of,
    tick_unknowns,
    window_unknown,
)
from lg_husky_sim.diagnosis.hypotheses.hypothesis import hypotheses
from lg_husky_sim.diagnosis.result import Verdict
from lg_husky_sim.diagnosis.selection import recalibration, search
from lg_husky_sim.diagnosis.selection.conventions import read_like
from lg_husky_sim.diagnosis.selection.rounds import calibrated
from lg_husky_sim.diagnosis.selection.ticks import ticked, ticks_are_likelier
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.manoeuvres import Manoeuvre, Step
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import TimeSeries
from lg_husky_sim.threads import Threads
import numpy as np
import pytest

PERIOD = 0.073
Made = Callable[[str, float, int], Recording]


@pytest.fixture
def made(steps: Sequence[tuple[float, float, float]]) -> Made:
    """Return a function that records a base which ticks with a period, 0 for not at all."""
    def record(name: str, period: float, seed: int) -> Recording:
        rng = np.random.default_rng(seed)
        model = load_model()
        plant = compile_model(model.structure).at(model.parameters)
        asked = Manoeuvre(name, tuple(Step(t, v, w, 0.6) for t, v, w in steps)).commands()
        sent = TimeSeries(asked.times + rng.uniform(0.0, 0.01, asked.times.size), asked.values,
                          asked.names)
        got = at_ticks(sent, period, 0.011 * seed) if period else sent
        streams = simulate_commands(plant, got, 1.0)
        noise = {'wheels': 0.02, 'imu': 0.005, 'pose': 0.003}
        read = {key: TimeSeries(
            streams[key].times, streams[key].values + level * rng.standard_normal(
                streams[key].values.shape), streams[key].names) for key, level in noise.items()}
        return Recording(name, name, {'command': sent, **read}, 0, frames=('odom', 'base_link'))
    return record


@pytest.fixture
def pool() -> Iterator[Threads]:
    """Return one thread."""
    with Threads(1) as threads:
        yield threads


def _once(commands: TimeSeries) -> TimeSeries:
    last = np.append(np.diff(commands.times) > 0.0, True)
    return TimeSeries(commands.times[last], commands.values[last], commands.names)


def test_commands_wait_for_the_next_tick_and_the_last_one_counts() -> None:
    commands = TimeSeries(np.array([0.01, 0.03, 0.05, 0.1]), np.array([[1.0, 2.0, 3.0, 4.0]]).T,
                          ('forward',))
    held = at_ticks(commands, 0.05, 0.0)
    np.testing.assert_allclose(held.times, [0.05, 0.1])
    np.testing.assert_array_equal(held.values[:, 0], [3.0, 4.0])


def test_the_period_of_messages_is_that_of_runs_without_a_pause() -> None:
    """A minute of 20 Hz must be known to a part of a tick, whatever the pauses are long."""
    rng, runs, begin = np.random.default_rng(3), [], 0.0
    for length in (400, 90, 1, 350, 2, 260):
        runs.append(begin + 0.05 * np.arange(length) + rng.uniform(0.0, 0.012, length))
        begin = runs[-1][-1] + rng.uniform(0.3, 1.1)
    times = np.delete(np.concatenate(runs), [77, 300, 301, 612])
    assert usual_period([times, times[200:700] + 9.0]) == pytest.approx(0.05, rel=1e-4)
    assert usual_period([np.array([1.0, 3.0])]) == 2.0


def test_ticks_are_compared_with_a_log_that_is_read_alike(
        made: Made, pool: Threads, monkeypatch: pytest.MonkeyPatch) -> None:
    """Wheel rates behind a low pass were held against them: only the base was read so."""
    drives, model = drives_of([made('one', PERIOD, 1)]), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    slow = replace(start, reading=Reading(WheelReading.FILTERED, 0.0, {
        'wheel_window': 0.05, 'wheel_mean': 0.02, 'imu_window': 0.02}))
    windows = [window_unknown(name, 0.02, 0.15) for name in ('wheel_mean', 'imu_window')]
    slow = replace(slow, unknowns=(*slow.unknowns, *windows), places=np.append(
        slow.places, start_of(windows)))
    late = next(k for k, u in enumerate(slow.unknowns) if u.name == 'command_delay')
    slow.places[late] += 0.004
    effect = next(h for h in hypotheses(start.structure) if h.effect.id == 'yaw_pull')
    heavy = effect.point(start, {'pull_moment': 2.0})
    alike = read_like(heavy, slow)
    assert alike.reading == slow.reading
    assert [u.name for u in alike.unknowns[-3:]] == ['wheel_mean', 'imu_window', 'pull_moment']
    assert alike.log.get('wheel_mean') == pytest.approx(0.02)
    assert alike.log.get('command_delay') == start.log.get('command_delay')
    assert alike.values == heavy.values
    evidence = evidence_of(drives, ['one'], start, first_guess(drives), pool)
    asked: list[list[Point]] = []
    monkeypatch.setattr(recalibration, 'likelier_ticks',
                        lambda first, plain, starts, rivals: asked.append(list(starts)))
    for base in (start, slow):
        fit = evidence.fit(base, rounds=0)
        known = recalibration.Recalibrated(
            evidence, fit, recalibration.Logged(fit), evidence, fit)
        assert recalibration.at_ticks(known, start, [drives]) is None
    assert [[one.reading for one in starts] for starts in asked] == [
        [start.reading], [start.reading, slow.reading]]


def test_the_period_of_a_base_is_found_from_two_drives(
        made: Made, pool: Threads, monkeypatch: pytest.MonkeyPatch) -> None:
    recordings = [made('one', PERIOD, 1), made('two', PERIOD, 2)]
    drives, model = drives_of(recordings), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    guess = first_guess(drives)
    noise = Noise({**guess.values, 'command_jitter': 0.02})
    evidence = evidence_of(drives, ['one', 'two'], start, noise, pool)
    found = ticking(evidence, evidence.fit(start, rounds=3))[0]
    assert {drive.clock.period for drive in found if drive.clock} == {
        found[0].clock.period if found[0].clock else None}
    for number, (drive, recording) in enumerate(zip(found, recordings, strict=True), 1):
        assert drive.clock is not None
        assert drive.clock.period == pytest.approx(PERIOD, rel=2e-4)
        true = at_ticks(recording.streams['command'], PERIOD, 0.011 * number)
        apart = np.abs(drive.commands.times[:, None] - true.times).min(axis=1)
        assert np.quantile(apart, 0.9) < 0.004
    own = tick_unknowns(found)
    ticked = calibrated(evidence_of(found, ['one', 'two'], start, noise, pool), replace(
        start, unknowns=(*start.unknowns, *own), places=np.append(start.places, start_of(own))), 1)
    plain = calibrated(evidence, start, 1)
    assert ticks_are_likelier(plain, ticked, found)
    assert not ticks_are_likelier(ticked, plain, found)
    # Not beside a robot that is as none can be: something else is missing then.
    places = np.array(ticked[1].point.places)
    mass = next(k for k, u in enumerate(start.unknowns) if u.name == 'mass')
    places[mass] += 8.0 * start.unknowns[mass].deviation
    distorted = ticked[0].fit(ticked[1].point.at(places), rounds=0)
    known = recalibration.Recalibrated(
        evidence, plain[1], recalibration.Logged(plain[1]), *plain)
    for base, accepted in ((ticked[1], True), (distorted, False)):
        other = replace(known, evidence=ticked[0], base=base)
        monkeypatch.setattr(recalibration, 'recalibrated', lambda *_, other=other: other)
        assert (recalibration.at_ticks(known, start, [found]) is other) is accepted
    quiet = evidence_of(drives, ['one', 'two'], start, replace(guess, values={
        **guess.values, 'command_jitter': 1e-4}), pool)
    assert ticking(quiet, quiet.fit(start, rounds=1)) == []


def test_ticks_in_step_with_the_commands_are_found(
        made: Made, pool: Threads, monkeypatch: pytest.MonkeyPatch) -> None:
    """At 20 Hz behind commands at 20 Hz, half of which just miss a tick; without a spectrum."""
    monkeypatch.setattr(clock_search, '_promising', lambda steps: [])
    recordings = [made('one', 0.05, 5), made('two', 0.05, 15)]
    drives, model = drives_of(recordings), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    guess = first_guess(drives)

    def clocks(jitter: float, lag: float) -> list[list[Drive]]:
        evidence = evidence_of(drives, ['one', 'two'], start, Noise({
            **guess.values, 'command_jitter': jitter}), pool)
        fit = evidence.fit(start, rounds=1)
        places = [lag if u.name == 'lag two' else float(place) for u, place in zip(
            fit.point.unknowns, fit.point.places, strict=True)]
        return ticking(evidence, replace(fit, point=fit.point.at(np.array(places))))
    for drive in clocks(0.02, 0.0)[0]:
        assert drive.clock is not None
        assert drive.clock.period == pytest.approx(0.05, rel=2e-4)
    # Recordings that are late by different times tell it, too.
    assert clocks(1e-4, 0.0) == []
    assert clocks(1e-4, 0.01) != []


def test_ticks_are_tried_again_with_what_was_found(
        made: Made, pool: Threads, monkeypatch: pytest.MonkeyPatch) -> None:
    """Here a gyro's factor; with it, but not before, they are accepted."""
    whole = made('one', PERIOD, 1)
    imu = whole.streams['imu']
    factor = np.where(np.array(imu.names) == 'yaw_rate', 1.08, 1.0)
    scaled = TimeSeries(imu.times, factor * imu.values, imu.names)
    drives = drives_of([replace(whole, streams={**whole.streams, 'imu': scaled})])
    model = load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    first = evidence_of(drives, ['one'], start, first_guess(drives), pool)
    ticks = [ticked_as(drive, [replace(drive, clock=Clock(PERIOD, 0.011, 0.0))])
             for drive in drives]
    wrong = next(h for h in hypotheses(start.structure) if h.effect.id == 'gyro_scale')
    monkeypatch.setattr(search, 'ticking', lambda *_: [ticks])
    for module in (search, recalibration):
        monkeypatch.setattr(module, 'hypotheses', lambda structure: [wrong] if not (
            structure.effects) else [])
    tried = []

    def at(known: recalibration.Recalibrated, point: Point, rivals: Sequence[Sequence[Drive]]
           ) -> recalibration.Recalibrated | None:
        tried.append(len(point.structure.effects))
        if not point.structure.effects:
            return None
        evidence, fit = calibrated(*ticked(known.first, point, rivals[0]), 1)
        return recalibration.Recalibrated(
            evidence, fit, recalibration.Logged(fit), evidence, fit)
    monkeypatch.setattr(search, 'at_ticks', at)
    found = search.search(first, start, lambda *_: None)
    assert tried == [0, 1]
    assert [d.clock.period for d in found.evidence.drives if d.clock] == [PERIOD] * len(drives)
    assert [one.effect.id for one in found.found] == ['gyro_scale']
    assert found.final.point.values['gyro_factor'] == pytest.approx(1.08, abs=0.01)
    assert found.plain.point.unknowns[-1].name == 'tick_delay one'


def test_a_dead_time_from_an_onset_on_is_compared_with_ticks(
        made: Made, pool: Threads, monkeypatch: pytest.MonkeyPatch) -> None:
    """Commands that come in step with slow ticks act at once or a tick later then, too."""
    whole = made('one', 0.0, 1)
    asked, begin = whole.streams['command'], 0.5 * whole.streams['command'].times[-1]
    # What was sent so much earlier acts now.
    late = replace(whole, streams={**whole.streams, 'command': replace(asked, times=np.where(
        asked.times < begin, asked.times, np.maximum(asked.times - 0.1, begin)))})
    late = replace(late, streams={**late.streams, 'command': _once(late.streams['command'])})
    model = load_model()
    for recording, gains in ((late, True), (whole, False)):
        drives = drives_of([recording])
        start = beginning(model.structure, base_unknowns(model.parameters, drives),
                          model.parameters, Reading())
        evidence, base = calibrated(
            evidence_of(drives, ['one'], start, first_guess(drives), pool), start, 1)
        found = recalibration.late_from_an_onset(evidence, base)
        assert (found is not None and found < evidence.surprise(base) - 100.0) is gains
    fit = evidence.fit(start, rounds=0)
    known = recalibration.Recalibrated(evidence, fit, recalibration.Logged(fit), evidence, fit)
    monkeypatch.setattr(recalibration, 'likelier_ticks', lambda *_: drives)
    monkeypatch.setattr(recalibration, 'recalibrated', lambda *_: known)
    for surprise, taken in ((None, True), (math.inf, True), (-math.inf, False)):
        monkeypatch.setattr(recalibration, 'late_from_an_onset', lambda *_, s=surprise: s)
        assert (recalibration.at_ticks(known, start, [drives]) is known) is taken


def test_delays_of_single_steps_are_those_to_the_next_tick(made: Made) -> None:
    """As far as they are linear; their phase is that of the base."""
    drive = drives_of([made('one', PERIOD, 1)])[0]
    model = load_model()
    plant = compile_model(model.structure).at(model.parameters)
    ticker = ticker_of(plant, drive, Reading(values={'command_delay': 0.5 * PERIOD}), 0.02)
    assert ticker is not None
    known = ticker.steps
    assert np.corrcoef(np.mod(0.011 - known.stamps, PERIOD), known.delays)[0, 1] > 0.8
    cost = known.clock_costs(np.array([PERIOD]), 0.011, 40).cost[0]
    assert int(np.argmin(cost)) in {37, 38, 39, 0, 1, 2, 3}


def test_steps_that_no_rate_shows_tell_nothing(made: Made) -> None:
    """A gyro alone sees nothing of a robot that drives straight ahead."""
    recording = made('one', 0.0, 1)
    straight = recording.streams['command']
    values = straight.values * np.array([1.0 if name == 'forward' else 0.0
                                         for name in straight.names])
    alone = replace(recording, streams={
        'command': replace(straight, values=values), 'imu': recording.streams['imu'],
        'pose': recording.streams['pose']})
    model = load_model()
    plant = compile_model(model.structure).at(model.parameters)
    assert ticker_of(plant, drives_of([alone])[0], Reading(), 0.02) is None
    assert ticker_of(plant, drives_of([recording])[0], Reading(), 0.02) is not None


def test_a_clean_base_that_ticks_lacks_nothing(made: Made) -> None:
    said = diagnose([made('one', PERIOD, 1), made('two', PERIOD, 2)], load_model(),
                    lambda text, share: None).diagnosis
    assert said.verdict is Verdict.NOTHING_MISSING
    assert any('ticks, every 73 ms' in note for note in said.notes)
