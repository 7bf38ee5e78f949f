# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What a search leaves is judged under disturbances that may last, and no effect is lost by it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import math

from lg_husky_sim.diagnosis.conclusion import answer
from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import evidence_of
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.hypotheses.hypothesis import entries_of
from lg_husky_sim.diagnosis.hypotheses.smooth_efforts import efforts
from lg_husky_sim.diagnosis.localisation import missing_efforts
from lg_husky_sim.diagnosis.nameless import remaining
from lg_husky_sim.diagnosis.result import Verdict
from lg_husky_sim.diagnosis.selection.rounds import calibrated, Round
from lg_husky_sim.diagnosis.selection.search import Search
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.threads import Threads
import numpy as np
import pytest

KNOTS = 9
#: Standard deviation [N] and time constant [s] of a force that a floor might exert.
PUSH, MEMORY = 15.0, 12.0

Steps = Sequence[tuple[float, float, float]]


def _lasting(length: float) -> list[float]:
    # A first-order Gauss-Markov process at the knots.
    rng = np.random.default_rng(0)
    keep = math.exp(-length / (KNOTS - 1) / MEMORY)
    force = [rng.standard_normal()]
    for _ in range(KNOTS - 1):
        force.append(keep * force[-1] + math.sqrt(1.0 - keep ** 2) * rng.standard_normal())
    return [PUSH * one for one in force]


def _said(search: Search) -> Verdict:
    return answer(search, efforts(search.evidence, search.final),
                  missing_efforts(search.evidence, search.final)).verdict


def _slowest(search: Search) -> float:
    return max(value for name, value in search.evidence.noise.values.items()
               if name.endswith('_time'))


@pytest.mark.parametrize('lasts', [True, False])
def test_a_disturbance_that_lasts_is_no_unknown_effort_and_a_law_is_one(
        lasts: bool, record: Callable[..., Recording], steps: Steps) -> None:
    """A force that changes slowly in time, and a moment that is the same at each heading."""
    steps = [(2.0 * duration, forward, yaw) for duration, forward, yaw in steps] if lasts else (
        steps)
    length = sum(duration for duration, _, _ in steps)
    effect = Effect('smooth_force', shape='time') if lasts else Effect(
        'smooth_moment', shape='heading')
    values = _lasting(length) if lasts else [4.0, -4.0] * (KNOTS // 2) + [4.0]
    sizes = {'range_low': 0.0, 'range_high': length if lasts else 2.0 * math.pi,
             **{f'knot_{k + 1}': value for k, value in enumerate(values)}}
    model = load_model()
    plant = compile_model(model.structure.with_effect(effect)).at(
        model.parameters.with_entries(*entries_of(effect, sizes)))
    drives = drives_of([record('ahead', plant, steps, 6)])
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        evidence, fit = calibrated(
            evidence_of(drives, ['ahead'], start, first_guess(drives), pool), start, 2)
        search = Search(fit, fit, evidence, (Round(evidence, fit, (), False, 1.0),), ())
        assert _slowest(search) == pytest.approx(setting('longest_time'))
        assert _said(search) is Verdict.UNKNOWN
        left = remaining(search)
        assert _slowest(left) > setting('longest_time')
        assert _slowest(left) <= setting('longest_memory') * (1.0 + 1e-9)
        assert _said(left) is (Verdict.NOTHING_MISSING if lasts else Verdict.UNKNOWN)


def test_a_search_without_slow_disturbances_stays_as_it_is(
        drive: Callable[..., Recording]) -> None:
    drives, model = drives_of([drive('ahead', 'nothing', 1, share=0.5)]), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['ahead'], start, first_guess(drives), pool)
        fit = evidence.fit(start, rounds=1)
        search = Search(fit, fit, evidence, (), ())
        assert _slowest(search) < setting('longest_time')
        assert remaining(search) is search
