# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What was adopted goes again where it is not needed as the log is read in the end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import evidence_of
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading, WheelReading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.hypotheses.hypothesis import hypotheses, Hypothesis
from lg_husky_sim.diagnosis.selection.elimination import eliminated
from lg_husky_sim.diagnosis.selection.rounds import calibrated, Round
from lg_husky_sim.diagnosis.selection.search import _without_the_dropped
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.threads import Threads
import numpy as np
import pytest


@pytest.mark.parametrize(('hidden', 'kept'), [
    ('nothing', []), ('electrical', ['battery_sag']), ('command', ['command_latency'])])
def test_one_effect_is_kept_only_if_it_is_needed(
        drive: Callable[..., Recording], hidden: str, kept: list[str]) -> None:
    """A sag and a delay on robots that have both, one, or none of them."""
    recording, model = drive('ahead', hidden, 1), load_model()
    drives = drives_of([recording])
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    found = []
    point = start
    for name in ('battery_sag', 'command_latency'):
        one = next(h for h in hypotheses(point.structure) if h.effect.id == name)
        point = one.point(point, one.starts[0])
        found.append(one)
    with Threads(1) as pool:
        evidence = evidence_of(drives, [recording.name], start, first_guess(drives), pool)
        evidence, final = calibrated(evidence, point, 1)
        fit, needed = eliminated(evidence, start, final, found)
    assert [one.effect.id for one in needed] == kept
    assert [effect.id for effect in fit.point.structure.effects] == kept


def test_stamps_at_the_begin_of_a_window_are_not_early(drive: Callable[..., Recording]) -> None:
    """A delay of the wheels that was adopted goes where the stamps may stand elsewhere."""
    recording, model = drive('ahead', 'nothing', 1), load_model()
    wheels = recording.streams['wheels']
    rates = [k for k, name in enumerate(wheels.names) if 'rate' in name or 'speed' in name]
    values = wheels.values.copy()
    span = 5
    for k in rates or range(values.shape[1]):
        # What encoders counted until a stamp, over those of the next ones.
        values[:-span, k] = np.convolve(values[:, k], np.full(span, 1.0 / span))[
            span:][:len(values) - span]
    period = float(np.median(np.diff(wheels.times)))
    averaged = replace(recording, streams={**recording.streams, 'wheels': replace(
        wheels, values=values).slice(wheels.times[0], wheels.times[-span - 1])})
    drives = drives_of([averaged])
    window = span * period
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading(values={'wheel_window': window}))
    late = next(h for h in hypotheses(start.structure)
                if (h.effect.id, h.effect.shape) == ('sensor_time_offset', 'wheels'))
    with Threads(1) as pool:
        evidence = evidence_of(drives, [recording.name], start, first_guess(drives), pool)
        final = evidence.fit(late.point(start, {'stamp_delay': -window}))
        fit, kept = eliminated(evidence, start, final, [late])
    assert -window - period < final.point.values['stamp_delay'] < -window + period
    assert not kept
    assert fit.point.reading.wheels is WheelReading.WINDOW_START


def test_a_round_is_left_where_all_that_was_found_is_dropped(
        drive: Callable[..., Recording]) -> None:
    """Else nothing would say how far the best that was looked at is beyond chance."""
    drives = drives_of([drive('ahead', 'nothing', 1)])
    model = load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['ahead'], start, first_guess(drives), pool)
        fit = evidence.fit(start, rounds=0)
    first, second, last = (Round(evidence, fit, (), adopted, chance) for adopted, chance in (
        (True, 1e-9), (True, 1e-3), (False, 0.5)))
    one, other = hypotheses(model.structure)[:2]

    def left(rounds: list[Round], kept: list[Hypothesis]) -> list[tuple[bool, float]]:
        return [(r.adopted, r.chance) for r in _without_the_dropped(rounds, [one, other], kept)]
    assert left([first, second, last], [other]) == [(True, 1e-3), (False, 0.5)]
    assert left([first, second, last], []) == [(False, 0.5)]
    assert left([first, second], []) == [(False, 1e-3)]
