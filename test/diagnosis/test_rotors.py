# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Robots whose motors turn other rotors than the nominal wheel inertia has."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from lg_husky_sim.comparison.output import simulate_commands
from lg_husky_sim.diagnosis.diagnose import diagnose
from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, evidence_of, Fit
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning, Point
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.result import Verdict
from lg_husky_sim.diagnosis.selection import recalibration, rotors
from lg_husky_sim.diagnosis.selection.recalibration import (
    as_logged,
    at_ticks,
    Logged,
    Recalibrated,
)
from lg_husky_sim.diagnosis.selection.rotors import (
    other_rotors,
    rotor_notes,
    with_any_rotors,
)
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.errors import ParameterError
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.manoeuvres import Manoeuvre, Step
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import TimeSeries
from lg_husky_sim.threads import Threads
import numpy as np
import pytest

#: Numbers within the tolerances, over those of the model.
OFF = {'wheel_damping': 1.2, 'yaw_damping': 0.85, 'mass': 1.04, 'yaw_inertia': 0.95,
       'motor_resistance': 0.97}
#: Sensors that see a rotor.
NOISE = {'wheels': 0.006, 'imu': 0.0015, 'pose': 0.001}


def driven(factor: float, seed: int) -> Recording:
    """Return a drive of a robot whose wheels have a multiple of the nominal inertia."""
    model, random = load_model(), np.random.default_rng(seed)
    plant = compile_model(model.structure).at(model.parameters.replacing({
        name: share * model.parameters[name]
        for name, share in {**OFF, 'wheel_inertia': factor}.items()}))
    steps = [Step(float(random.uniform(0.4, 2.0)), float(random.uniform(-0.8, 0.8)),
                  float(random.uniform(-0.8, 0.8)), 0.2) for _ in range(16)]
    still = Step(1.0, 0.0, 0.0, 0.2)
    script = Manoeuvre('random', (still, *steps, still))
    seen = simulate_commands(plant, script.commands(), 1.0)
    noisy = {name: TimeSeries(seen[name].times, seen[name].values + deviation
                              * random.standard_normal(seen[name].values.shape), seen[name].names)
             for name, deviation in NOISE.items()}
    return Recording(f'rec{seed}', f'rec{seed}', {'command': seen['command'], **noisy}, 0,
                     frames=('odom', 'base_link'))


@pytest.fixture
def pool() -> Iterator[Threads]:
    """Return one thread."""
    with Threads(1) as threads:
        yield threads


def begun(factor: float, pool: Threads) -> tuple[Evidence, Fit]:
    """Return the nominal model of such a robot, after one step, under a first guess of noise."""
    recording, model = driven(factor, 0), load_model()
    drives = drives_of([recording])
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    evidence = evidence_of(drives, [recording.name], start, first_guess(drives), pool)
    return evidence, evidence.fit(start, rounds=1)


@pytest.mark.parametrize('factor', [2.0, 4.0])
def test_other_rotors_are_found_and_said(pool: Threads, factor: float) -> None:
    nominal = load_model().parameters['wheel_inertia']
    fit = other_rotors(*begun(factor, pool))
    assert fit is not None
    assert fit.point.values['wheel_inertia'] == pytest.approx(factor * nominal, rel=0.1)
    said, = rotor_notes(fit.point)
    assert f'not {nominal:.2g} kg' in said


def test_rotors_are_found_where_the_model_runs_away_at_the_nominal_numbers(
        pool: Threads, monkeypatch: pytest.MonkeyPatch) -> None:
    def runs_away(_: Point) -> Point:
        raise ParameterError('it runs away')
    monkeypatch.setattr(rotors, 'is_distorted', lambda _: True)
    monkeypatch.setattr(rotors, 'nominal_of', runs_away)
    assert other_rotors(*begun(4.0, pool)) is not None


@pytest.mark.parametrize('factor', [1.0, 0.4])
def test_the_nominal_inertia_stays_where_nothing_says_that_it_is_larger(
        pool: Threads, factor: float) -> None:
    evidence, rough = begun(factor, pool)
    assert other_rotors(evidence, evidence.fit(rough.point)) is None
    assert rotor_notes(rough.point) == ()
    # Nor is it said of one that was free and ended where it was, or below.
    free = with_any_rotors(rough.point)
    nominal = load_model().parameters['wheel_inertia']
    for share, said in ((1.0, 0), (0.6, 0), (1.6, 1)):
        there = free.at(np.array([u.place(share * nominal) if u.name == 'wheel_inertia' else place
                                  for u, place in zip(free.unknowns, free.places, strict=True)]))
        assert len(rotor_notes(there)) == said


def test_a_slow_robot_is_not_taken_for_slow_sensors(pool: Threads) -> None:
    """Low passes of the wheel rates and of the yaw rate were found for it, of 10 ms and 9 ms."""
    evidence, rough = begun(4.0, pool)
    logged = as_logged(evidence, rough, afresh=True)
    assert logged.fit.point.reading == Reading()
    assert logged.fit.point.values['wheel_inertia'] > 3.5 * rough.point.parameters['wheel_inertia']


def test_ticks_of_the_base_are_looked_for_with_the_rotors_that_were_found(
        pool: Threads, monkeypatch: pytest.MonkeyPatch) -> None:
    """Else the nominal inertia would be held against them."""
    evidence, rough = begun(2.0, pool)
    base = replace(rough, point=with_any_rotors(rough.point))
    begins: list[Point] = []

    def none_likelier(first: object, plain: object, starts: list[Point], rivals: object) -> None:
        begins.extend(starts)
    monkeypatch.setattr(recalibration, 'likelier_ticks', none_likelier)
    known = Recalibrated(evidence, rough, Logged(rough), evidence, base)
    assert at_ticks(known, rough.point, []) is None
    spread = {u.name: u.deviation for u in base.point.unknowns}
    assert spread['wheel_inertia'] == setting('rotor_spread')
    assert [{u.name: u.deviation for u in one.unknowns} for one in begins] == [spread]


def test_a_robot_of_twice_the_inertia_lacks_nothing() -> None:
    """It was said to carry -11 kg."""
    said = diagnose([driven(2.0, seed) for seed in (0, 1)], load_model(),
                    lambda text, share: None).diagnosis
    assert said.verdict is Verdict.NOTHING_MISSING
    inertia = next(e for e in said.recalibration if e.name == 'wheel_inertia')
    assert inertia.value == pytest.approx(0.16, rel=0.1)
    assert any('rotors count' in note for note in said.notes)
