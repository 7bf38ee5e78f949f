# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""An effect that begins in the second of two recordings, in a form that another stands for."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from lg_husky_sim.diagnosis.diagnose import Case, diagnose
from lg_husky_sim.diagnosis.held_out import errors
from lg_husky_sim.diagnosis.hypotheses.hypothesis import entries_of
from lg_husky_sim.husky.effects import Effect, Onset, OnsetKind
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.recording import Recording, segments
import pytest

ONSET = Onset(OnsetKind.TIME, 7.0, 'second')
NAMES = ('first', 'second')


@pytest.fixture(scope='module')
def plant() -> Plant:
    """Return a robot whose left wheels become larger in the second recording."""
    model = load_model()
    effect = Effect('wheel_radius_mismatch', 'left', 'firm_contact', late=True)
    return compile_model(model.structure.with_effect(effect, ONSET)).at(
        model.parameters.with_entries(*entries_of(effect, {'radius_change': 0.03})))


@pytest.fixture(scope='module')
def made(plant: Plant, record: Callable[..., Recording],
         steps: Sequence[tuple[float, float, float]]) -> tuple[Recording, ...]:
    """Return its two recordings."""
    return tuple(record(name, plant.in_recording(name, NAMES[:1]), steps, k)
                 for k, name in enumerate(NAMES))


@pytest.fixture(scope='module')
def case(made: Sequence[Recording]) -> Case:
    """Return what the diagnosis says of them."""
    return diagnose(made, load_model(), lambda text, share: None)


def test_a_form_that_another_stands_for_is_found_with_its_onset(case: Case) -> None:
    finding, = case.diagnosis.findings
    assert (finding.effect, finding.side) == ('wheel_radius_mismatch', 'left')
    assert case.search.found[0].effect.shape == 'firm_contact'
    assert finding.onset is not None
    assert finding.onset.recording == 'second'
    assert finding.onset.value == pytest.approx(7.0, abs=0.3)
    assert finding.parameters[0].value == pytest.approx(0.03, abs=0.004)


def test_it_lowers_the_errors_on_all_data(case: Case) -> None:
    plain, with_finding = case.diagnosis.plain, case.diagnosis.augmented
    for key in ('position_rmse_m', 'yaw_rate_rmse'):
        assert with_finding[key] < plain[key]


def test_errors_before_the_recording_of_an_onset_are_those_without_the_effect(
        plant: Plant, made: Sequence[Recording]) -> None:
    first, second = (segments(recording) for recording in made)
    assert errors(plant, first, NAMES) == errors(plant.in_recording('first', NAMES[:1]), first)
    assert errors(plant, first, NAMES) != errors(plant, first)
    assert errors(plant, second, NAMES) == errors(plant, second)
