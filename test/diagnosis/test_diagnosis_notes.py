# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What is said first of a finding that makes an error larger."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from lg_husky_sim.diagnosis.diagnose import _notes
from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import evidence_of
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading, WheelReading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.hypotheses.hypothesis import hypotheses
from lg_husky_sim.diagnosis.selection.search import Search
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.threads import Threads
import pytest


@pytest.mark.parametrize(('grown', 'said'), [
    ('wheel_speed_rmse', True), ('position_rmse_m', False), ('yaw_rate_rmse', False)])
def test_errors_of_rates_that_grow_behind_a_low_pass_are_explained(
        drive: Callable[..., Recording], grown: str, said: bool) -> None:
    """Heavier wheels stand for a low pass of the log; right ones are further from what it says."""
    recording, model = drive('ahead', 'nothing', 1), load_model()
    drives = drives_of([recording])
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    point = replace(start, reading=Reading(WheelReading.FILTERED))
    with Threads(1) as pool:
        evidence = evidence_of(drives, [recording.name], start, first_guess(drives), pool)
        fit = evidence.fit(point, rounds=0)
    found = Search(fit, fit, evidence, (), (hypotheses(model.structure)[0],))
    notes = _notes(found, {grown: 0.1}, {grown: 0.2})
    assert notes[0].startswith('held-out errors that grow with the finding: ')
    assert notes[1].startswith('these are errors of the rates themselves') == said
    assert _notes(found, {grown: 0.1}, {grown: 0.1})[0].startswith('held-out') is False
