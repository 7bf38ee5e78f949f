# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a search begins if recalibration has taken the place of an effect."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from lg_husky_sim.diagnosis.conclusion import explained_by
from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, evidence_of, Fit
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning, Point
from lg_husky_sim.diagnosis.evidence.reading import Reading, WheelReading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.hypotheses.hypothesis import entries_of, hypotheses
from lg_husky_sim.diagnosis.selection import search as searching
from lg_husky_sim.diagnosis.selection.conventions import best_reading, wheel_reading
from lg_husky_sim.diagnosis.selection.recalibration import Logged
from lg_husky_sim.diagnosis.selection.rounds import calibrated, fitted
from lg_husky_sim.diagnosis.selection.screening import look
from lg_husky_sim.diagnosis.selection.search import read_anew, Search, search, seeds_of
from lg_husky_sim.diagnosis.selection.tried import Tried
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.recording import Recording
from lg_husky_sim.threads import Threads
import pytest

Recorded = Callable[..., Recording]
Steps = Sequence[tuple[float, float, float]]


def _begun(recording: Recording, pool: Threads) -> tuple[Evidence, Point]:
    drives, model = drives_of([recording]), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    return evidence_of(drives, [recording.name], start, first_guess(drives), pool), start


@pytest.fixture
def threads() -> Iterator[Threads]:
    """Return one thread."""
    with Threads(1) as pool:
        yield pool


def _seeded(recording: Recording, pool: Threads
            ) -> tuple[Fit, list[Tried]]:
    first, start = _begun(recording, pool)
    _, base = calibrated(first, start, 1)
    return base, seeds_of(first, first.fit(start, rounds=1), base, Logged(base))


def _with_loop(sizes: dict[str, float]) -> Plant:
    model, loop = load_model(), Effect('speed_loop')
    return compile_model(model.structure.with_effect(loop)).at(
        model.parameters.with_entries(*entries_of(loop, sizes)))


@pytest.mark.parametrize('sizes', [
    {'loop_lag': 0.3, 'loop_gain': 1.0, 'loop_integral': 10.0, 'loop_forward_share': 1.0},
    {'loop_lag': 0.01, 'loop_gain': 1.1, 'loop_integral': 14.0, 'loop_forward_share': 0.0}])
def test_a_speed_loop_is_a_seed_where_the_numbers_of_the_robot_took_its_place(
        record: Recorded, steps: Steps, threads: Threads, sizes: dict[str, float]) -> None:
    """With the back-EMF fed forward or by its PI law alone."""
    plant = _with_loop(sizes)
    base, seeds = _seeded(record('loop', plant, steps, 1), threads)
    assert max(abs(base.point.prior_residuals)) > 5.0
    assert [one.hypothesis.effect.id for one in seeds] == ['speed_loop']
    assert seeds[0].gain > 100.0
    assert max(abs(seeds[0].fit.point.prior_residuals)) < max(abs(base.point.prior_residuals))


def test_smoothed_commands_are_named_and_not_a_loop_without_gains(
        record: Recorded, steps: Steps, short: float, threads: Threads) -> None:
    """A heavy wheel follows like them: the search begins far from that."""
    model, lag = load_model(), Effect('command_slew', shape='lag')
    plant = compile_model(model.structure.with_effect(lag)).at(
        model.parameters.with_entries(*entries_of(lag, {'command_lag': 0.3})))
    brief = [(short * duration, forward, yaw) for duration, forward, yaw in steps]
    evidence, start = _begun(record('lag', plant, brief, 1), threads)
    found = search(evidence, start, lambda text, share: None)
    assert [one.effect for one in found.found] == [lag]
    assert found.final.point.values['command_lag'] == pytest.approx(0.3, rel=0.1)
    # What is said of the model without it is said under the last noise.
    plain, last = found.plain, found.evidence
    assert plain.cost == pytest.approx(last.cost(last.residuals(plain.predicted), plain.point))


def test_a_robot_within_its_tolerances_has_no_seeds(
        record: Recorded, steps: Steps, threads: Threads) -> None:
    model = load_model()
    plant = compile_model(model.structure).at(model.parameters)
    assert _seeded(record('clean', plant, steps, 1), threads)[1] == []


def test_each_early_effect_is_read_anew(
        record: Recorded, steps: Steps, threads: Threads, monkeypatch: pytest.MonkeyPatch) -> None:
    made: dict[int, Fit] = {}

    def once(evidence: Evidence, fit: Fit) -> Fit:
        made[id(fit)] = made.get(id(fit)) or wheel_reading(evidence, fit)
        return made[id(fit)]
    monkeypatch.setattr(searching, 'wheel_reading', once)
    plant = _with_loop({'loop_lag': 0.45, 'loop_gain': 2.0, 'loop_integral': 10.0})
    first, start = _begun(record('loop', plant, steps, 1), threads)
    rough = first.fit(start, rounds=1)
    pool_of = [h for h in hypotheses(start.structure)
               if h.label in ('speed_loop', 'payload:ground')]
    early = [tried for one in look(first, rough, pool_of)
             for tried in fitted(first, rough, [one], [rough.point], whole=False,
                                 leading_on=True)]
    assert len(early) == 2
    found = read_anew(first, rough, early[::-1])
    assert found is not None
    assert read_anew(first, rough, ()) is None
    _, hypothesis, point = found
    cost = first.cost(first.residuals(first.predict(point)), point)
    assert len(made) == 2
    read = {t.hypothesis.label: once(first, t.fit) for t in early}
    assert len(made) == 2
    assert hypothesis.label == 'speed_loop'
    # Of the same kind here, with a window of its own.
    assert point.reading == read['speed_loop'].point.reading
    windows = [one.log.get('wheel_window') for one in (
        point, read['speed_loop'].point, rough.point)]
    assert windows[0] == pytest.approx(windows[1])
    assert windows[0] < 0.7 * windows[2]
    assert [u.name for u in point.unknowns[-4:]] == [p.name for p in hypothesis.free]
    assert cost == pytest.approx(min(one.cost for one in read.values()))
    # What it explains is counted against a robot as it may be, with the likeliest reading.
    plain, loop = best_reading(first, rough), read['speed_loop']
    whole = Search(plain, loop, first, (), (hypothesis,))
    assert explained_by(whole) > 1.1 * (plain.cost - loop.cost)


def test_a_reading_that_came_with_a_seed_goes_with_it(
        record: Recorded, steps: Steps, monkeypatch: pytest.MonkeyPatch) -> None:
    model = load_model()
    plant = compile_model(model.structure).at(model.parameters)

    def misled(first: Evidence, rough: Fit, base: Fit, logged: Logged) -> list[Tried]:
        latency = next(h for h in hypotheses(base.point.structure)
                       if h.effect.id == 'command_latency')
        slow = replace(base.point, reading=Reading(wheels=WheelReading.FILTERED).replacing(
            {'wheel_window': 0.1}))
        fit = first.fit(latency.point(slow, {'latency': 0.01}), rounds=1)
        return [Tried(latency, fit, 100.0, first.count)]

    monkeypatch.setattr(searching, 'seeds_of', misled)
    with Threads(1) as pool:
        first, start = _begun(record('clean', plant, steps[:6], 1), pool)
        found = search(first, start, lambda *_: None)
    assert found.found == ()
    assert found.final.point.reading == Reading()
