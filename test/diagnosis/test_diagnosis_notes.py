# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What is said first of a finding that makes an error larger."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

from lg_husky_sim.diagnosis.before_after.diagnose_change import diagnose_change
from lg_husky_sim.diagnosis.diagnose import _nearest, _notes, _refused, diagnose
from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import evidence_of
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading, WheelReading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.hypotheses.hypothesis import hypotheses
from lg_husky_sim.diagnosis.log_notes import reading_notes
from lg_husky_sim.diagnosis.selection.rounds import Round
from lg_husky_sim.diagnosis.selection.search import Search
from lg_husky_sim.errors import RecordingError
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
    assert notes[0].startswith('held-out errors of rates that grow are those of the rates') == said
    assert _notes(found, {grown: 0.1}, {grown: 0.1})[0].startswith('held-out') is False
    name = found.found[0].effect.id
    assert _nearest(found) == (f'model.yaml has the nearest effects of the catalogue, {name}, '
                               'which do not explain it')
    assert _nearest(replace(found, found=())) == ''
    tried = (SimpleNamespace(hypothesis=found.found[0], gain=12.0),)
    for chance, words in ((1.0, 'as chance alone gives it'),
                          (0.25, 'which chance gives with a probability of 0.25'),
                          (1e-9, 'more than chance gives, but nothing as the log is read')):
        last = Round(evidence, fit, tried, False, chance)  # type: ignore[arg-type]
        assert f'effect, {name}, gains 12.0 nats, {words}' in _refused(last, ())
        assert f'effect, one more {name}, gains' in _refused(last, found.found)
        assert ('what was found may be off by' in _refused(last, found.found)) == (chance > 0.02)


def test_a_robot_that_is_not_driven_is_refused(drive: Callable[..., Recording]) -> None:
    recording = drive('ahead', 'nothing', 1)
    command = recording.streams['command']
    still = replace(recording, name='still', path='still', streams={
        **recording.streams, 'command': replace(command, values=0.0 * command.values)})
    with pytest.raises(RecordingError, match='all commands are zero; a robot that is not driven'):
        diagnose([still], load_model(), lambda text, share: None)
    for later, before in (([still], [recording]), ([recording], [still])):
        with pytest.raises(RecordingError, match='all commands are zero'):
            diagnose_change(later, before, load_model(), lambda text, share: None)


def test_windows_that_no_fit_has_moved_are_not_said(drive: Callable[..., Recording]) -> None:
    drives = drives_of([drive('ahead', 'nothing', 1)])
    assert reading_notes(drives, Reading()) == ()
    wide = Reading(values={'wheel_window': 0.15})
    assert reading_notes(drives, wide) == (
        'wheel rates seem to be means over 150 ms before their stamps',)
