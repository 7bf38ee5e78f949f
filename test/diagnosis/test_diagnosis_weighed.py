# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A payload that described a robot becomes its mass, and what all robots have is not named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from lg_husky_sim.diagnosis.candidates import effect_entries, neutral
from lg_husky_sim.diagnosis.closed_base import TYRES
from lg_husky_sim.diagnosis.diagnose import Case
from lg_husky_sim.diagnosis.everyday import (
    everyday_words,
    is_everyday,
    more_than_everyday,
    named_rounds,
    open_rounds,
)
from lg_husky_sim.diagnosis.fits import Fit, recalibrate
from lg_husky_sim.diagnosis.held_out import plant_of
from lg_husky_sim.diagnosis.judge import findings, is_unnamed
from lg_husky_sim.diagnosis.unnamed import Description, Unnamed
from lg_husky_sim.diagnosis.weighed import centred, weighed
from lg_husky_sim.husky.effects import catalogue, Effect
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.identification.noise import Metric
from lg_husky_sim.identification.problem import Observations, observations
from lg_husky_sim.recording import Recording, segments
from lg_husky_sim.signals import FloatArray
import numpy as np
import pytest


def _loaded(record: Callable[..., Recording], shape: str, tyres: bool
            ) -> tuple[Fit, FloatArray, Observations]:
    # A fit of a robot that carries 20 kg, its prediction of a drive, and the drive.
    model = load_model()
    drive = record('rec', compile_model(model.structure).at(model.parameters), [
        (1.0, 0.0, 0.0), (2.0, 0.8, 0.0), (2.0, 0.4, 0.9), (2.0, 0.0, -0.8)], 3)
    data = observations(list(segments(drive)))
    structure, parameters = model.structure, model.parameters
    effects = [(TYRES, {'traction_torque': 3.0})] if tyres else []
    effects.append((Effect('payload', shape=shape), {'payload_mass': 20.0,
                                                     'payload_inertia': 1.5}))
    for effect, values in effects:
        structure = structure.with_effect(effect)
        parameters = parameters.with_entries(*effect_entries(effect, values))
    plain = recalibrate(data, model.structure, model.parameters)
    values = {**plain.solution.values, 'mass': parameters['mass'], 'payload_mass': 20.0,
              'payload_inertia': 1.5}
    fit = Fit(structure, parameters, replace(plain.solution, values=values))
    return fit, np.asarray(data.predict(plant_of(fit))), data


@pytest.mark.parametrize('shape', ['chassis', 'ground'])
@pytest.mark.parametrize('tyres', [False, True])
def test_a_payload_becomes_mass(record: Callable[..., Recording], shape: str, tyres: bool
                                ) -> None:
    fit, predicted, data = _loaded(record, shape, tyres)
    found = weighed(fit)
    assert [e.id for e in found.structure.effects] == ['traction_saturation'] * tyres
    assert found.parameters['mass'] == pytest.approx(fit.parameters['mass'] + 20.0)
    assert found.solution.values['mass'] == found.parameters['mass']
    assert not {'payload_mass', 'payload_inertia'} & {*found.parameters, *found.solution.values}
    np.testing.assert_allclose(data.predict(plant_of(found)), predicted, atol=1e-9)
    plain = recalibrate(data, load_model().structure, load_model().parameters)
    assert np.max(np.abs(plain.solution.predicted - predicted)) > 0.05
    assert weighed(found) is found
    own = centred(load_model().parameters, found)
    assert own['mass'] == found.parameters['mass']
    assert own.entry('mass').tolerance == load_model().parameters.entry('mass').tolerance
    assert own['motor_resistance'] == load_model().parameters['motor_resistance']


@pytest.mark.parametrize(('effect', 'numbers', 'expected'), [
    (Effect('coulomb_drivetrain', 'right'), {'dry_torque': 0.2}, True),
    (Effect('coulomb_drivetrain', 'right'), {'dry_torque': 1.2}, False),
    (Effect('gyro_scale'), {'gyro_factor': 1.004}, True),
    (Effect('gyro_scale'), {'gyro_factor': 0.98}, False),
    (Effect('gyro_sign'), {'gyro_factor': -1.0}, False),
    (Effect('slope'), {'slope_x': 1.0, 'slope_y': -1.0}, True),
    (Effect('slope'), {'slope_x': 1.0, 'slope_y': -6.0}, False),
    (Effect('command_limit', shape='yaw'), {'limit_yaw': 0.6}, False),
    (Effect('rolling_resistance', late=True, again=True),
     {'rolling_force': 20.0, 'rolling_force_later': 21.0}, True),
    (Effect('rolling_resistance', late=True, again=True),
     {'rolling_force': 20.0, 'rolling_force_later': 40.0}, False),
])
def test_what_every_robot_has_a_little_of(effect: Effect, numbers: dict[str, float],
                                          expected: bool) -> None:
    assert is_everyday(effect, numbers) is expected


def test_everyday_sizes_are_below_the_largest_that_estimations_begin_with() -> None:
    sizes = [(p.everyday, max(abs(start - neutral(p.name)) for start in p.starts))
             for kind in catalogue().values() for p in kind.parameters if p.everyday > 0.0]
    assert len(sizes) > 20
    assert all(everyday < start for everyday, start in sizes)


def test_an_everyday_effect_is_modelled_and_said_but_not_named(
        diagnosed: Callable[[str], Case]) -> None:
    case = diagnosed('drivetrain')
    search = case.search
    assert named_rounds(search) == tuple(r for r in search.rounds if r.adopted)
    assert open_rounds(search) == search.rounds
    assert not everyday_words(search)
    effect = named_rounds(search)[0].rivals[0].effect
    name = next(p.name for p in effect.parameters() if not p.fixed)
    entry = search.final.parameters.entry(name)
    final = replace(search.final, parameters=search.final.parameters.with_entries(
        replace(entry, value=0.1, low=None, high=None)))
    slight = replace(search, final=final)
    assert not findings(slight)
    assert open_rounds(slight) == tuple(r for r in search.rounds if not r.adopted)
    assert name.replace('_', ' ') in everyday_words(slight)
    assert '0.1' in everyday_words(slight)


def test_a_smooth_effort_counts_where_it_is_more_than_everyday() -> None:
    small, large = (Description(Effect('smooth_torque', 'both', 'wheel_rate'), 100.0, 1.0,
                                (size,) * 9, (0.0, 1.0)) for size in (0.3, -0.6))
    both = Unnamed((small, large), 2.0, 10, Metric(np.ones(1), {}))
    assert more_than_everyday(both).descriptions == (large,)


@pytest.mark.parametrize(('torque', 'expected'), [(0.2, False), (1.5, True)])
def test_something_is_missing_only_if_it_is_more_than_everyday(
        torque: float, expected: bool, diagnosed: Callable[[str], Case]) -> None:
    clean, rubbing = diagnosed('nothing').search, diagnosed('drivetrain').search
    best = named_rounds(rubbing)[0].rivals[0]
    name = next(p.name for p in best.effect.parameters() if not p.fixed)
    entry = replace(best.fit.parameters.entry(name), value=torque, low=None, high=None)
    rival = replace(best, held_out=100.0, gain=100.0, beside_jitter=100.0, fit=replace(
        best.fit, parameters=best.fit.parameters.with_entries(entry)))
    search = replace(clean, rounds=(replace(clean.rounds[0], rivals=(rival,), adopted=False),))
    assert is_unnamed(search, None) is expected
