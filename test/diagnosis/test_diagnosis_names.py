# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The diagnosis names what is hidden, gets its size right, and names nothing where nothing is."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from lg_husky_sim.diagnosis.diagnose import Case, diagnose
from lg_husky_sim.diagnosis.doubts import is_guise
from lg_husky_sim.diagnosis.locate import fingerprints, locate, subsystem_strengths
from lg_husky_sim.diagnosis.result import Verdict
from lg_husky_sim.diagnosis.unnamed import look_for_unnamed
from lg_husky_sim.errors import RecordingError
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
import numpy as np
import pytest

PARTS = ('command', 'electrical', 'drivetrain', 'translation', 'rotation', 'sensor')


def test_nothing_is_missing_where_nothing_is(diagnosed: Callable[[str], Case]) -> None:
    found = diagnosed('nothing').diagnosis
    assert found.verdict is Verdict.NOTHING_MISSING
    assert found.findings == ()
    assert found.confidence > 0.5
    assert found.model.structure.effects == ()


def test_recalibration_finds_what_differs_from_the_nominal_model(
        diagnosed: Callable[[str], Case]) -> None:
    by_name = {e.name: e for e in diagnosed('nothing').diagnosis.recalibration}
    ratio = by_name['yaw_damping'].value / by_name['wheel_damping'].value
    assert ratio == pytest.approx(14.0 / 1.3, rel=0.15)


@pytest.mark.parametrize('part', PARTS)
def test_hidden_effect_is_named_with_its_size(
    part: str, diagnosed: Callable[[str], Case],
    hidden: Mapping[str, tuple[Effect | None, dict[str, float]]],
) -> None:
    effect, sizes = hidden[part]
    assert effect is not None
    found = diagnosed(part).diagnosis
    assert found.verdict is Verdict.KNOWN
    assert [f.effect for f in found.findings] == [effect.id]
    (finding,) = found.findings
    assert finding.side == effect.side
    assert finding.subsystem == part
    assert finding.p_value < 1e-3
    numbers = {p.name: p for p in finding.parameters}
    for name, size in sizes.items():
        assert numbers[name].value == pytest.approx(size, rel=0.12, abs=0.5 * (name == 'slope_y'))
        assert numbers[name].low < size < numbers[name].high


def test_what_explains_all_is_no_guise_of_something_else(diagnosed: Callable[[str], Case]) -> None:
    search = diagnosed('rotation').search
    assert not is_guise(search, look_for_unnamed(search.observations, search.final))


@pytest.mark.parametrize('part', PARTS)
def test_what_was_found_predicts_held_out_data_better(
        part: str, diagnosed: Callable[[str], Case]) -> None:
    found = diagnosed(part).diagnosis
    ratios = [found.held_out_augmented[name] / before
              for name, before in found.held_out_plain.items() if name.endswith(('_m', 'rmse'))]
    assert min(ratios) < 0.9
    assert max(ratios) < 1.25


@pytest.mark.parametrize('part', ['drivetrain', 'translation', 'rotation'])
def test_smoother_puts_an_effort_where_it_is(part: str, diagnosed: Callable[[str], Case]
                                             ) -> None:
    search = diagnosed(part).search
    strengths = subsystem_strengths(search.observations, search.plain)
    assert next(iter(strengths)) == part
    assert max(strengths.values()) == 1.0
    assert all(0.0 <= value <= 1.0 for value in strengths.values())


def test_smoother_sees_nothing_in_a_clean_drive(diagnosed: Callable[[str], Case]) -> None:
    search = diagnosed('nothing').search
    assert not locate(search.observations, search.plain).certain


def test_missing_force_has_its_size_in_newtons(diagnosed: Callable[[str], Case]) -> None:
    search = diagnosed('translation').search
    located = locate(search.observations, search.plain)
    best = located.best('translation')
    assert located.explanations[best].inputs[0].unit == 'N'
    straight = [np.max(np.abs(e.values)) for e in located.explanations[best].estimates]
    assert 8.0 < max(straight) < 45.0  # a slope of 20.6 N
    assert max(mark.share for mark in fingerprints(located)) > 0.3


def test_a_recording_given_twice_is_refused(drive: Callable[..., Recording]) -> None:
    one = drive('same', 'nothing', 1)
    with pytest.raises(RecordingError, match='same is given twice'):
        diagnose([one, one], load_model(), lambda text, share: None)


def test_recording_without_commands_is_refused(drive: Callable[..., Recording]) -> None:
    one = drive('mute', 'nothing', 1)
    streams = {name: series for name, series in one.streams.items() if name != 'command'}
    with pytest.raises(RecordingError, match='command'):
        diagnose([Recording('mute', 'mute', streams, 0)], load_model(), lambda text, share: None)
