# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Where the number of an effect begins that fits hardly move."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import evidence_of
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.observation import observe, simulate
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.hypotheses.hypothesis import hypotheses
from lg_husky_sim.diagnosis.selection.narrowing import narrowed
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.threads import threads
import pytest


@pytest.mark.parametrize(('effect', 'name', 'value'), [
    ('gear_backlash', 'play', 0.077), ('gear_backlash', 'play', 0.21),
    ('voltage_saturation', 'clip_voltage', 6.1), ('command_latency', 'latency', 0.019)])
def test_a_number_that_fits_hardly_move_begins_where_it_is(
        drive: Callable[..., Recording], effect: str, name: str, value: float) -> None:
    """Between starts that are a factor of two or three apart."""
    own, model = drives_of([drive('ahead', 'nothing', 1)])[0], load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, [own]),
                      model.parameters, Reading())
    hypothesis = next(h for h in hypotheses(start.structure) if h.effect.id == effect)
    true = hypothesis.point(start, {**hypothesis.starts[0], name: value})
    plant = true.plant
    known = replace(own, measured=observe(simulate(plant, own, true.log), own, true.log))
    with threads(1) as pool:
        evidence = evidence_of([known], [known.recording], start, first_guess([known]), pool)
        found = narrowed(evidence, hypothesis, start)
    assert found is not None
    assert found[name] == pytest.approx(value, rel=0.07)


def test_numbers_that_fits_do_move_are_not_looked_for(drive: Callable[..., Recording]) -> None:
    own, model = drives_of([drive('ahead', 'nothing', 1)])[0], load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, [own]),
                      model.parameters, Reading())
    with threads(1) as pool:
        evidence = evidence_of([own], [own.recording], start, first_guess([own]), pool)
        for effect in ('payload', 'battery_sag', 'speed_loop'):
            one = next(h for h in hypotheses(start.structure) if h.effect.id == effect)
            assert narrowed(evidence, one, start) is None
