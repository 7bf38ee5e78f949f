# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Numbers of a finding: a number that the recordings do not determine is no number."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import cast

from lg_husky_sim.diagnosis.conclusion import estimates, undetermined, without_undetermined
from lg_husky_sim.diagnosis.diagnose import model_of
from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, evidence_of, Fit
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning, Point
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.hypotheses.hypothesis import entries_of, Hypothesis
from lg_husky_sim.diagnosis.wording import sentence
from lg_husky_sim.errors import FitError
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.threads import Threads
import numpy as np
import pytest

LIMITS = Effect('command_limit', shape='both')
NAMES = ('limit_forward', 'limit_yaw')
#: The drive commands up to 0.8 m/s and 0.9 rad/s.
YAW, BEYOND = 0.5, 0.9


@pytest.fixture(scope='module')
def limited(record: Callable[..., Recording], steps: Sequence[tuple[float, float, float]]
            ) -> Iterator[tuple[Evidence, Fit]]:
    """Return the fit of two limits to a robot that has only the one on its yaw rate."""
    model = load_model()
    plant = compile_model(model.structure.with_effect(LIMITS)).at(model.parameters.with_entries(
        *entries_of(LIMITS, {'limit_forward': 20.0, 'limit_yaw': YAW})))
    drives = drives_of([record('ahead', plant, [(0.5 * d, f, y) for d, f, y in steps], 4)])
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    numbers = {'limit_forward': BEYOND, 'limit_yaw': YAW}
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['ahead'], start, first_guess(drives), pool)
        yield evidence, evidence.fit(Hypothesis(LIMITS, (numbers,)).point(start, numbers))


def test_a_number_whose_interval_is_its_search_is_not_reported(limited: tuple[Evidence, Fit]
                                                               ) -> None:
    """Where an estimation began says nothing of the robot: 0.9 m/s was one of its starts."""
    _, fit = limited
    assert fit.point.values['limit_forward'] == pytest.approx(BEYOND)
    (yaw,) = estimates(fit, NAMES, fit.point.numbers)
    assert yaw.name == 'limit_yaw'
    assert yaw.low < YAW < yaw.high
    assert undetermined(fit, NAMES) == ('limit_forward',)
    said = sentence(LIMITS, None, (yaw,), 'while turning',
                    undetermined=undetermined(fit, NAMES))
    assert said.endswith('These recordings do not determine forward speed.')
    assert '0.9' not in said


def test_it_is_written_into_a_model_where_it_does_nothing(limited: tuple[Evidence, Fit]) -> None:
    evidence, fit = limited
    written = model_of(fit, evidence, load_model(), 'a test')
    forward, yaw = (written.parameters.entry(name) for name in NAMES)
    assert forward.value == pytest.approx(forward.upper)
    assert (forward.low, forward.high) == (None, None)
    assert forward.source == 'not determined by these recordings'
    assert yaw.value == fit.point.values['limit_yaw']
    assert yaw.low is not None
    there = evidence.predict(without_undetermined(evidence, fit))
    for before, after in zip(fit.predicted, there, strict=True):
        np.testing.assert_allclose(after, before, atol=1e-9)


def test_a_number_that_cannot_be_without_its_value_keeps_it(limited: tuple[Evidence, Fit]
                                                            ) -> None:
    """Two numbers may be known together where none is by itself."""
    evidence, fit = limited
    blind = replace(fit, jacobian=np.zeros_like(fit.jacobian))
    assert set(undetermined(blind, NAMES)) == set(NAMES)
    point = without_undetermined(evidence, blind)
    assert point.values['limit_yaw'] == fit.point.values['limit_yaw']
    assert point.values['limit_forward'] > BEYOND


def test_a_number_without_which_there_is_no_model_stays_as_it_was_fitted(
        limited: tuple[Evidence, Fit]) -> None:
    """Its neutral value may be one at which nothing can be simulated."""
    evidence, fit = limited
    tried = []

    class Refusing:
        def __getattr__(self, name: str) -> object:
            return getattr(evidence, name)

        def predict(self, point: Point) -> object:
            tried.append(point.values['limit_forward'])
            raise FitError('no such model')
    point = without_undetermined(cast('Evidence', Refusing()), fit)
    value, = tried
    assert value > BEYOND
    assert point.values['limit_forward'] == fit.point.values['limit_forward']
    assert point is fit.point


def test_other_errors_than_ours_are_not_hidden(limited: tuple[Evidence, Fit]) -> None:
    evidence, fit = limited

    class Broken:
        def __getattr__(self, name: str) -> object:
            return getattr(evidence, name)

        def predict(self, point: Point) -> object:
            raise ZeroDivisionError
    with pytest.raises(ZeroDivisionError):
        without_undetermined(cast('Evidence', Broken()), fit)


def test_a_finding_without_a_number_is_a_sentence() -> None:
    assert sentence(LIMITS, None, (), 'everywhere', undetermined=NAMES) == (
        'The base limits the commanded speed or yaw rate. It shows everywhere. '
        'These recordings do not determine forward speed and yaw rate.')
