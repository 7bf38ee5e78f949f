# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A payload that described a robot becomes its mass, and what all robots have is not named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from lg_husky_sim.diagnosis.candidates import neutral
from lg_husky_sim.diagnosis.diagnose import Case
from lg_husky_sim.diagnosis.everyday import (
    everyday_words,
    is_everyday,
    more_than_everyday,
    named_rounds,
    open_rounds,
)
from lg_husky_sim.diagnosis.judge import findings, is_unnamed
from lg_husky_sim.diagnosis.unnamed import Description, Unnamed
from lg_husky_sim.husky.effects import catalogue, Effect
from lg_husky_sim.identification.noise import Metric
import numpy as np
import pytest


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
