# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What a named effect leaves at its place and over its quantity is its form, no other physics."""

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
from lg_husky_sim.diagnosis.hypotheses.hypothesis import entries_of, hypotheses
from lg_husky_sim.diagnosis.localisation import missing_efforts
from lg_husky_sim.diagnosis.nameless import left_over
from lg_husky_sim.diagnosis.result import Verdict
from lg_husky_sim.diagnosis.selection.rounds import calibrated, forward_step
from lg_husky_sim.diagnosis.selection.search import Search
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.threads import Threads
import pytest

KNOTS = 9
Steps = Sequence[tuple[float, float, float]]


def _turned(first: float, fourth: float) -> dict[str, float]:
    # A torque over the angle of the wheel [N·m] with a first and a fourth harmonic.
    angles = [2.0 * math.pi * k / (KNOTS - 1) for k in range(KNOTS)]
    return {'range_low': 0.0, 'range_high': 2.0 * math.pi, **{
        f'knot_{k + 1}': first * math.cos(a) + fourth * math.cos(4.0 * a)
        for k, a in enumerate(angles)}}


def _headed(moment: float) -> dict[str, float]:
    # A yaw moment that changes its sign from one heading to the next [N·m].
    return {'range_low': 0.0, 'range_high': 2.0 * math.pi, **{
        f'knot_{k + 1}': moment * (-1.0) ** k for k in range(KNOTS)}}


@pytest.mark.parametrize(('law', 'sizes', 'verdict'), [
    (Effect('smooth_torque', 'right', 'angle'), _turned(1.2, 0.6), Verdict.KNOWN),
    (Effect('smooth_torque', 'right', 'angle'), _turned(0.7, 1.8), Verdict.UNKNOWN),
    (Effect('smooth_moment', shape='heading'), _headed(8.0), Verdict.UNKNOWN)])
def test_another_harmonic_is_a_ripple_and_what_is_mainly_another_law_is_unknown(
        law: Effect, sizes: dict[str, float], verdict: Verdict,
        record: Callable[..., Recording], steps: Steps) -> None:
    model = load_model()
    structure, parameters = model.structure.with_effect(law), model.parameters.with_entries(
        *entries_of(law, sizes))
    if law.id == 'smooth_moment':
        ripple = Effect('torque_ripple', 'right', 'once')
        structure = structure.with_effect(ripple)
        parameters = parameters.with_entries(*entries_of(ripple, {
            'ripple_cos': 0.4, 'ripple_sin': 0.15}))
    drives = drives_of([record('ahead', compile_model(structure).at(parameters), steps, 6)])
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    with Threads(1) as pool:
        evidence, fit = calibrated(
            evidence_of(drives, ['ahead'], start, first_guess(drives), pool), start, 2)
        named = [h for h in hypotheses(fit.point.structure) if (
            h.effect.id, h.effect.side) == ('torque_ripple', 'right')]
        one = forward_step(evidence, fit, named, None)
        assert one.adopted
        search = Search(one.base, one.evidence.fit(one.tried[0].fit.point), one.evidence, (one,),
                        (one.tried[0].hypothesis,))
        said = answer(search, left_over(search.evidence, search.final),
                      missing_efforts(search.evidence, search.final))
        assert said.features.share > setting('unknown_share')
        assert said.verdict is verdict
