# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Signatures of laws that saturate are tried at sizes far apart."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from lg_husky_sim.diagnosis.candidates import candidates, effect_entries, still_open
from lg_husky_sim.diagnosis.confidence import estimates
from lg_husky_sim.diagnosis.fits import fit_structure, recalibrate, shared_metric
from lg_husky_sim.diagnosis.refits import look, Looked
from lg_husky_sim.diagnosis.rounds import screen
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.identification.problem import observations
from lg_husky_sim.recording import Recording, segments
import pytest


@pytest.mark.parametrize(('effect', 'values'), [
    ('current_limit', {'current_limit': 1.0}), ('voltage_saturation', {'clip_voltage': 6.0})])
def test_a_limit_is_screened_first_however_low_it_is(
        effect: str, values: dict[str, float], record: Callable[..., Recording],
        steps: Sequence[tuple[float, float, float]]) -> None:
    """A limit of a few per cent of the largest current has its own signature."""
    model = load_model()
    plant = compile_model(model.structure.with_effect(Effect(effect))).at(
        model.parameters.with_entries(*effect_entries(Effect(effect), values)))
    data = observations(segments(record('rec', plant, steps, 1)))
    base = recalibrate(data, model.structure, model.parameters)
    signatures = [s for c in candidates() for s in look(Looked(c, base, data))]
    used = shared_metric(data, base, signatures)
    assert screen(data, base, used, signatures, ())[0].signature.candidate.effect.id == effect


def test_no_candidate_shares_a_number_with_what_is_in() -> None:
    """Friction of the right side beside that of the left one would be the same number twice."""
    structure = load_model().structure.with_effect(
        Effect('coulomb_drivetrain', 'left')).with_effect(Effect('gyro_scale'))
    left = still_open(candidates(), structure)
    assert {c.effect.id for c in candidates()} - {c.effect.id for c in left} == {
        'coulomb_drivetrain', 'gyro_scale', 'gyro_sign'}


def test_a_limit_that_nothing_reaches_is_open_and_not_exact(
        record: Callable[..., Recording], steps: Sequence[tuple[float, float, float]]) -> None:
    model, limit = load_model(), Effect('command_limit', shape='yaw')
    data = observations(segments(record('rec', compile_model(model.structure).at(
        model.parameters), steps, 1)))
    base = recalibrate(data, model.structure, model.parameters)
    used = shared_metric(data, base, [])
    fit = fit_structure(data, model.structure.with_effect(limit), model.parameters, used,
                        base.solution.values, {'limit_yaw': 5.0}, 0)
    assert fit is not None
    reach, damping = estimates(data, fit, used, ['limit_yaw', 'yaw_damping'])
    (bounds,) = limit.parameters()
    assert (reach.low, reach.high) == (bounds.lower, bounds.upper)
    assert damping.low < damping.value < damping.high < 1.2 * damping.low
