# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A base on tyres whose grip is limited, and what only the later recordings could show."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from lg_husky_sim.diagnosis.candidates import effect_entries
from lg_husky_sim.diagnosis.fits import Fit, recalibrate
from lg_husky_sim.diagnosis.judge import rivals_of
from lg_husky_sim.diagnosis.rivals import rank, Rival
from lg_husky_sim.diagnosis.rounds import is_eased, Round
from lg_husky_sim.diagnosis.search import search
from lg_husky_sim.husky.effects import Effect, Onset, OnsetKind
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.identification.noise import Metric
from lg_husky_sim.identification.problem import Observations, observations
from lg_husky_sim.recording import Recording, segments
import numpy as np
import pytest

STEPS = ((1.0, 0.0, 0.0), (2.0, 0.9, 0.0), (2.0, 0.5, 0.6), (2.0, -0.6, -0.5), (2.0, 0.0, -0.9),
         (2.0, 0.7, -0.4), (2.0, 0.0, 0.0))
#: Tyres that share their grip between driving and scrubbing.
TYRES = Effect('traction_saturation', shape='circle')
Record = Callable[..., Recording]


def driven(record: Record, name: str, effects: Mapping[Effect, Mapping[str, float]], seed: int,
           scale: float = 1.0) -> Recording:
    """Return 13 s of an open-loop robot whose driver asks for a part of the full speed."""
    model = load_model()
    structure, parameters = model.structure, model.parameters
    for effect, values in effects.items():
        structure = structure.with_effect(effect)
        parameters = parameters.with_entries(*effect_entries(effect, values))
    return record(name, compile_model(structure).at(parameters), [
        (duration, scale * forward, scale * yaw) for duration, forward, yaw in STEPS], seed)


def seen(*recordings: Recording) -> Observations:
    return observations([part for one in recordings for part in segments(one)])


@pytest.mark.parametrize(('part', 'named'), [(0.4, []), (1.0, ['voltage_saturation'])])
def test_what_the_earlier_recordings_could_not_show_is_no_change(
        record: Record, part: float, named: list[str]) -> None:
    """
    A driver of 16 V shows at full speed only.

    Seen first in later recordings that are faster, it may have been there before; earlier ones
    as fast as the later ones say that it was not.
    """
    model, clipped = load_model(), {Effect('voltage_saturation'): {'clip_voltage': 16.0}}
    slow = part < 1.0
    whole = seen(driven(record, 'base1', clipped if slow else {}, 1, part),
                 driven(record, 'rec1', clipped, 2))
    exact = model.parameters.with_entries(*(
        replace(p, tolerance=0.0) for p in model.parameters.entries))
    start = next(p for p in whole.pieces if p.recording == 'rec1').start
    found = search(whole, model.structure, exact, change=Onset(OnsetKind.TIME, start, 'rec1'))
    adopted = [one.rivals[0].effect.id for one in found.rounds if one.adopted]
    assert adopted == named
    there = [e.id for e in found.plain.structure.effects]
    assert there == (['voltage_saturation'] if slow else [])


def test_ground_limits_and_rivals_are_what_they_are_called(record: Record) -> None:
    model = load_model()
    again = replace(TYRES, late=True, again=True)
    structure = model.structure.with_effect(TYRES).with_effect(
        again, Onset(OnsetKind.TIME, 3.0, 'rec1'))
    solution = recalibrate(seen(driven(record, 'base1', {}, 1)), model.structure,
                           model.parameters).solution
    for later, eased in ((8.0, True), (2.0, False)):
        parameters = model.parameters.with_entries(
            *effect_entries(TYRES, {'traction_torque': 4.0}),
            *effect_entries(again, {'traction_torque_later': later}))
        fit = Fit(structure, parameters, solution)
        assert is_eased(fit) is eased
    metric = Metric(np.ones(1), {})
    sides = [Rival(Effect('viscous_asymmetry', side), None, fit, 100.0, gain)
             for side, gain in (('left', 30.0), ('right', 70.0))]
    listed = rivals_of(Round(fit, (), (*sides, Rival(Effect('payload'), None, fit, 100.0, 50.0)),
                             metric, 0.5, True), Effect('payload'))
    assert [(one.effect, one.side, one.held_out_gain) for one in listed] == [
        ('viscous_asymmetry', 'right', 70.0)]
    ground, other = (Rival(Effect(name), None, fit, 100.0, gain) for name, gain in (
        ('terrain_change', 110.0), ('yaw_scrub_coulomb', 100.0)))
    assert rank(ground) < rank(other)
    assert rank(replace(ground, held_out=120.0)) > rank(other)
