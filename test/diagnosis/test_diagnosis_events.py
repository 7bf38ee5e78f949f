# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What happens now and then is noticed, placed in time, and given no name of the catalogue."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
import re

from lg_husky_sim.comparison.output import simulate_commands
from lg_husky_sim.diagnosis.candidates import candidates, effect_entries
from lg_husky_sim.diagnosis.diagnose import diagnose
from lg_husky_sim.diagnosis.events import (
    are_others,
    elements_of,
    energy_in_moments,
    event_words,
    Moments,
    moments,
    place_of,
    remain,
    what_happens,
)
from lg_husky_sim.diagnosis.fits import first_metric, fit_structure, recalibrate
from lg_husky_sim.diagnosis.judge import is_unnamed
from lg_husky_sim.diagnosis.result import Verdict
from lg_husky_sim.diagnosis.rounds import Round
from lg_husky_sim.diagnosis.screening import Score, Signature
from lg_husky_sim.diagnosis.search import Search
from lg_husky_sim.husky.effects import Effect, Onset, OnsetKind, Subsystem
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.identification.problem import observations
from lg_husky_sim.manoeuvres import Manoeuvre, Step
from lg_husky_sim.recording import Recording, segments
from lg_husky_sim.signals import TimeSeries
import numpy as np
import pytest

Steps = Sequence[tuple[float, float, float]]
Record = Callable[..., Recording]
#: Steps that come late, of those of the drives, and by how long [s].
STALLS, HOLD = (2, 4, 7), 0.4


@pytest.fixture(scope='module')
def plant() -> Plant:
    model = load_model()
    return compile_model(model.structure).at(model.parameters)


@pytest.fixture(scope='module')
def stalled(record: Record, steps: Steps, plant: Plant) -> Callable[..., Recording]:
    """Return a function that records a robot some of whose commands come late."""
    def made(name: str, seed: int, late: Sequence[int] = STALLS) -> Recording:
        moved = [list(step) for step in steps]
        for k in late:
            moved[k - 1][0] += HOLD
            moved[k][0] -= HOLD
        told, acted = (record(name, plant, rows, seed) for rows in (steps, moved))
        return replace(acted, streams={**acted.streams, 'command': told.streams['command']})
    return made


def looked_at(recordings: Sequence[Recording], change: Onset | None = None) -> Search:
    """Return a search that found nothing."""
    model = load_model()
    data = observations([s for r in recordings for s in segments(r)])
    plain = recalibrate(data, model.structure, model.parameters)
    return Search(data, plain, plain, (), model.parameters, change)


def test_moments_are_found_where_they_are(stalled: Callable[..., Recording], steps: Steps
                                          ) -> None:
    found = what_happens(looked_at([stalled('rec', 1)]))
    assert {'wheel_left', 'wheel_right'} <= set(found)
    begins = [sum(step[0] for step in steps[:k]) for k in STALLS]
    for name in ('wheel_left', 'wheel_right'):
        one = found[name]
        assert one.excess > 1.0
        assert {recording for recording, _ in one.begins} == {'rec'}
        for _, time in one.begins[:3]:
            assert min(abs(time - begin) for begin in begins) < HOLD + 0.3
    assert place_of(found) is Subsystem.COMMAND
    words = event_words(found)
    assert 'wheel leaves the model by up to' in words
    assert ' s of rec' in words


@pytest.mark.parametrize('late', [(), STALLS[:1]])
def test_one_late_command_is_chance(stalled: Callable[..., Recording], late: tuple[int, ...]
                                    ) -> None:
    search = looked_at([stalled('rec', 1, late)])
    assert not what_happens(search)
    largest = max(one.excess for one in moments(search.observations, search.plain).values())
    assert (largest > 0.05) == bool(late)


def test_lost_messages_are_no_physics(steps: Steps, plant: Plant) -> None:
    """The robot does for one interval what it did before, and the bag says otherwise."""
    script = Manoeuvre('sparse', tuple(Step(*step, 0.0) for step in steps), rate=10.0)
    told = script.commands()
    changed = np.flatnonzero(np.any(np.diff(told.values, axis=0), axis=1)) + 1
    heard = TimeSeries(np.delete(told.times, changed[1:6]),
                       np.delete(told.values, changed[1:6], axis=0), told.names)
    streams, rng = simulate_commands(plant, heard, 1.0), np.random.default_rng(3)
    seen = {name: TimeSeries(series.times, series.values + 0.02 * rng.standard_normal(
        series.values.shape), series.names) for name, series in streams.items()
        if name in ('wheels', 'imu', 'pose')}
    recording = Recording('rec', 'rec', {**seen, 'command': told}, 0,
                          frames=('odom', 'base_link'))
    search = looked_at([recording])
    held = moments(search.observations, search.final)
    assert all(held[name].excess > 1.0 for name in ('wheel_left', 'wheel_right'))
    assert all(len(held[name].begins) >= 3 for name in ('wheel_left', 'wheel_right'))
    assert not what_happens(search)


def test_one_wheel_alone_is_its_drivetrain(stalled: Callable[..., Recording]) -> None:
    found = what_happens(looked_at([stalled('rec', 1)]))
    assert place_of({'wheel_left': found['wheel_left']}) is Subsystem.DRIVETRAIN
    assert elements_of({'wheel_left': found['wheel_left']}) == ('J_LW',)
    assert place_of({'yaw_rate': found['wheel_left']}) is Subsystem.ROTATION


@pytest.mark.parametrize(('before', 'happens'), [((), True), (STALLS, False)])
def test_what_happened_before_is_no_change(stalled: Callable[..., Recording],
                                           before: tuple[int, ...], happens: bool) -> None:
    recordings = [stalled('base', 1, before), stalled('rec', 2)]
    search = looked_at(recordings, Onset(OnsetKind.TIME, 0.0, 'rec'))
    assert bool(what_happens(search)) is happens


@pytest.mark.parametrize(('often', 'largest', 'others'), [
    (10, 0.25, False), (23, 0.25, True), (10, 0.5, False), (4, 0.6, True)])
def test_moments_like_those_before_are_no_others(often: int, largest: float, others: bool) -> None:
    def seen(times: int, size: float) -> Moments:
        return Moments(1.0, 1.0, size, 1000, tuple(('rec', float(k)) for k in range(times)))
    assert are_others(seen(often, largest), seen(10, 0.28)) is others
    assert are_others(seen(often, largest), seen(0, 0.0))


@pytest.mark.parametrize(('gain', 'unknown'), [(0.5, False), (2.0, True)])
def test_a_lost_command_alone_is_no_change(stalled: Callable[..., Recording], gain: float,
                                           unknown: bool) -> None:
    """Screening may like some effect for one moment; nothing has changed for that."""
    search = looked_at([stalled('base', 1, ()), stalled('rec', 2, STALLS[:1])],
                       Onset(OnsetKind.TIME, 0.0, 'rec'))
    metric = first_metric(search.observations, search.plain.solution.predicted)
    one = candidates()[0]
    held = energy_in_moments(search, Round(search.plain, (), (), metric, 0.0, False))
    assert held > 1000.0
    liked = Score(Signature(one, one.starts[0], np.zeros((0, 1)), one.signed), 500.0 + gain * held,
                  (1.0,))
    found = Round(search.plain, (liked,), (), metric, 0.0, False)
    assert not what_happens(search)
    assert is_unnamed(replace(search, rounds=(found,)), None) is unknown


def test_names_that_cure_the_moments_stand(record: Record, steps: Steps) -> None:
    """A dead time leaves the model far off after each step; named, it leaves nothing."""
    model, effect, sizes = load_model(), Effect('command_latency'), {'latency': 0.3}
    late = compile_model(model.structure.with_effect(effect)).at(
        model.parameters.with_entries(*effect_entries(effect, sizes)))
    search = looked_at([record('rec', late, steps, 1)])
    nominal = {name: model.parameters[name] for name in model.parameters}
    named = fit_structure(
        search.observations, model.structure.with_effect(effect), model.parameters,
        first_metric(search.observations, search.plain.solution.predicted),
        {**search.plain.solution.values, **nominal}, {**nominal, **sizes}, 12)
    assert named is not None
    assert what_happens(search)
    assert remain(search)
    assert not remain(replace(search, final=named))


def test_stalling_commands_get_no_name(stalled: Callable[..., Recording]) -> None:
    found = diagnose([stalled('rec', 1)], load_model(), lambda text, share: None).diagnosis
    assert found.verdict is Verdict.UNKNOWN
    (finding,) = found.findings
    assert (finding.effect, finding.subsystem) == ('unknown', 'command')
    assert finding.elements == ('V_S1', 'V_S2')
    assert re.search(r'In \d+ moments the (left|right) wheel leaves the model', finding.statement)
