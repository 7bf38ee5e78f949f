# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a search begins if recalibration has taken the place of an effect."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import beginning, evidence_of, Fit
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.observation import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.hypotheses.hypothesis import entries_of
from lg_husky_sim.diagnosis.selection.rounds import calibrated, Tried
from lg_husky_sim.diagnosis.selection.search import seeds_of
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording

Recorded = Callable[..., Recording]
Steps = Sequence[tuple[float, float, float]]


def _seeded(recording: Recording) -> tuple[Fit, list[Tried]]:
    drives, model = drives_of([recording]), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with ThreadPoolExecutor(1) as pool:
        first = evidence_of(drives, [recording.name], start, first_guess(drives), pool)
        _, base = calibrated(first, start, 1)
        return base, seeds_of(first, first.fit(start, rounds=1), base, ())


def test_a_speed_loop_is_a_seed_where_the_numbers_of_the_robot_took_its_place(
        record: Recorded, steps: Steps) -> None:
    model, loop = load_model(), Effect('speed_loop')
    sizes = {'loop_lag': 0.3, 'loop_gain': 1.0, 'loop_integral': 10.0}
    plant = compile_model(model.structure.with_effect(loop)).at(
        model.parameters.with_entries(*entries_of(loop, sizes)))
    base, seeds = _seeded(record('loop', plant, steps, 1))
    assert max(abs(base.point.prior_residuals)) > 5.0
    assert [one.hypothesis.effect.id for one in seeds] == ['speed_loop']
    assert seeds[0].gain > 100.0
    assert max(abs(seeds[0].fit.point.prior_residuals)) < max(abs(base.point.prior_residuals))


def test_a_robot_within_its_tolerances_has_no_seeds(record: Recorded, steps: Steps) -> None:
    model = load_model()
    plant = compile_model(model.structure).at(model.parameters)
    assert _seeded(record('clean', plant, steps, 1))[1] == []
