# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Earlier names are asked for again once a later one is in place."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from functools import partial

from lg_husky_sim.diagnosis.candidates import candidates, effect_entries
from lg_husky_sim.diagnosis.evidence import folds_of
from lg_husky_sim.diagnosis.fits import Fit, recalibrate
from lg_husky_sim.diagnosis.revision import most_needed_first, reconsidered
from lg_husky_sim.diagnosis.rounds import play_round, Round
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.identification.problem import Observations, observations
from lg_husky_sim.recording import Recording, segments
import pytest

Steps = Sequence[tuple[float, float, float]]
LATE = (Effect('command_latency'), {'latency': 0.06})
WRONG = (Effect('gyro_scale'), {'gyro_factor': 0.7})


@pytest.fixture(scope='module')
def data(record: Callable[..., Recording], steps: Steps) -> Observations:
    """Return two drives of a robot that acts late and whose gyro reads too little."""
    model = load_model()
    structure, parameters = model.structure, model.parameters
    for effect, values in (LATE, WRONG):
        structure = structure.with_effect(effect)
        parameters = parameters.with_entries(*effect_entries(effect, values))
    plant = compile_model(structure).at(parameters)
    return observations([s for seed, way in ((1, steps), (2, steps[::-1]))
                         for s in segments(record(f'rec{seed}', plant, way, seed))])


def adopted(data: Observations, base: Fit, number: int, only: Collection[str]) -> Round:
    """Return a round whose pool is some effects on both sides."""
    pool = [c for c in candidates() if not only or (
        c.effect.id in only and c.effect.shape in ('', 'both'))]
    return play_round(data, base, number, load_model().parameters, pool, (), folds_of(data))


def searched(data: Observations, *names: str) -> list[Round]:
    """Return rounds that could each adopt one effect only."""
    model = load_model()
    rounds: list[Round] = []
    base = recalibrate(data, model.structure, model.parameters)
    for number, name in enumerate(names):
        rounds.append(adopted(data, base, number, {name}))
        base = rounds[-1].rivals[0].fit
    return rounds


def test_a_stopgap_gives_way_to_what_it_stood_for(data: Observations) -> None:
    """An acceleration limit stood for the dead time, as long as the gyro was not corrected."""
    rounds = searched(data, 'command_slew', 'gyro_scale')
    assert all(one.adopted for one in rounds)
    fit, kept = reconsidered(data, rounds[-1].rivals[0].fit, rounds, load_model().parameters,
                             partial(adopted, data, only=()))
    assert {e.id for e in fit.structure.effects} == {'command_latency', 'gyro_scale'}
    assert {one.rivals[0].effect.id for one in kept} == {'command_latency', 'gyro_scale'}
    assert fit.parameters['latency'] == pytest.approx(0.06, abs=0.01)
    assert fit.parameters['gyro_factor'] == pytest.approx(0.7, abs=0.01)


def test_what_is_needed_most_comes_first_and_the_idle_goes(data: Observations) -> None:
    rounds = searched(data, 'command_latency', 'quadratic_drag', 'gyro_scale')
    fit, kept = most_needed_first(
        data, rounds[-1].rivals[0].fit, rounds, load_model().parameters)
    assert [one.rivals[0].effect.id for one in kept] == ['gyro_scale', 'command_latency']
    assert {e.id for e in fit.structure.effects} == {'gyro_scale', 'command_latency'}
