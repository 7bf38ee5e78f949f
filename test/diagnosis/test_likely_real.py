# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What is beyond chance, and too little to be an effect more likely than not."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from lg_husky_sim.comparison.output import simulate_commands
from lg_husky_sim.diagnosis.decision.adoption import is_rather_real, likely_real
from lg_husky_sim.diagnosis.decision.strain import relieves
from lg_husky_sim.diagnosis.diagnose import diagnose
from lg_husky_sim.diagnosis.evidence.drives import drives_of
from lg_husky_sim.diagnosis.evidence.evidence import evidence_of, Fit
from lg_husky_sim.diagnosis.evidence.noise import first_guess
from lg_husky_sim.diagnosis.evidence.point import beginning
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.evidence.unknowns import base_unknowns
from lg_husky_sim.diagnosis.result import Verdict
from lg_husky_sim.diagnosis.selection import elimination, rounds
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.effects import Effect, effect_kind, Subsystem
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.manoeuvres import Manoeuvre, Step
from lg_husky_sim.proof import calibration
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import TimeSeries
from lg_husky_sim.threads import Threads
import numpy as np
import pytest

NOISE = {'wheels': 0.0218, 'imu': 0.0055, 'pose': 0.0036}


def effect(name: str) -> Effect:
    """Return an effect of the catalogue on its first side."""
    return Effect(name, effect_kind(name).sides[0])


def uneven(robot: Callable[..., Plant], change: float) -> Recording:
    """Return a drive of half a minute with left wheels that are larger by a share."""
    random = np.random.default_rng(0)
    plant = robot(Effect('wheel_radius_mismatch', 'left'), radius_change=change)
    steps = [Step(float(random.uniform(0.4, 2.0)), float(random.uniform(-0.8, 0.8)),
                  float(random.uniform(-0.8, 0.8)), 0.2) for _ in range(16)]
    still = Step(1.0, 0.0, 0.0, 0.2)
    seen = simulate_commands(plant, Manoeuvre('random', (still, *steps, still)).commands(), 1.0)
    noisy = {name: TimeSeries(seen[name].times, seen[name].values + deviation
                              * random.standard_normal(seen[name].values.shape), seen[name].names)
             for name, deviation in NOISE.items()}
    return Recording('rec', 'rec', {'command': seen['command'], **noisy}, 0,
                     frames=('odom', 'base_link'))


def test_the_share_of_the_variance_counts() -> None:
    """What a model is off by gains the more the longer a recording is, as effects do."""
    slope = effect('slope')
    assert likely_real(50.0, 10000, slope) == pytest.approx(likely_real(500.0, 100000, slope))
    assert likely_real(50.0, 10000, slope) < likely_real(60.0, 10000, slope)
    assert not is_rather_real(30.0, 31000, slope)
    assert is_rather_real(400.0, 31000, slope)
    assert 0.0 < likely_real(0.0, 31000, slope) < 0.05


def test_of_as_much_a_sensor_s_error_is_likelier_real_than_a_late_command() -> None:
    """Its form is exact; what a model is off by looks like commands that come late."""
    told = [likely_real(150.0, 31000, effect(name)) for name in (
        'gyro_scale', 'slope', 'command_latency')]
    assert told == sorted(told, reverse=True)
    assert told[0] > 0.5 > told[2]


def test_what_is_fitted_to_names_is_what_decides() -> None:
    """The trial shares no code with the diagnosis: the formula stands in both."""
    line = {'kind': 'none', 'true': [], 'features': {'readings': 20000},
            'said': [{'effect': 'payload', 'gain': 90.0}]}
    (row, real), = calibration._names(line)
    real_so = likely_real(90.0, 20000, effect('payload'))
    odds = np.log(real_so / (1.0 - real_so))
    known = calibration.COEFFICIENTS['real']
    assert known[2:] == tuple(sorted(f'real_{part.value}' for part in Subsystem))
    assert not real
    assert odds == pytest.approx(float(np.dot(row, [setting(name) for name in known])))


@pytest.mark.parametrize(('change', 'named'), [(0.004, False), (0.02, True)])
def test_an_effect_that_is_too_little_is_said_but_not_named(
        robot: Callable[..., Plant], change: float, named: bool) -> None:
    """Nor is it unknown: it has a name."""
    case = diagnose([uneven(robot, change)], load_model(), lambda text, share: None)
    said, last = case.diagnosis, case.search.rounds[-1]
    assert last.small is not named
    if named:
        assert [f.effect for f in said.findings] == ['wheel_radius_mismatch']
        assert case.search.beside is None
        return
    assert said.verdict is Verdict.NOTHING_MISSING
    assert last.chance < setting('false_alarm_rate')
    assert said.features['left'] <= said.features['needed'] > 0.0
    assert 'wheel_radius_mismatch, gains' in said.remaining
    assert '% of the variance of the innovations: beyond chance, but so little' in said.remaining
    assert case.search.beside is not None
    assert case.left.final.point.structure.effects
    assert not case.search.final.point.structure.effects


def test_what_brings_a_robot_back_into_its_tolerances_is_a_relief(
        robot: Callable[..., Plant]) -> None:
    """A load that recalibrated numbers bear explains little, but they are as none can be."""
    drives, model = drives_of([uneven(robot, 0.0)]), load_model()
    start = beginning(model.structure, base_unknowns(model.parameters, drives),
                      model.parameters, Reading())
    mass = [u.name for u in start.unknowns].index('mass')
    with Threads(1) as pool:
        evidence = evidence_of(drives, ['rec'], start, first_guess(drives), pool)

        def heavy(deviations: float) -> Fit:
            places = np.array(start.places)
            places[mass] += deviations * start.unknowns[mass].deviation
            return evidence.fit(start.at(places), rounds=0)
        fine, heavier, worse = map(heavy, (1.0, 5.0, 7.0))
    assert relieves(heavier, fine)
    assert not relieves(worse, heavier)
    assert not relieves(fine, fine)


@pytest.mark.parametrize('relief', [True, False])
def test_a_relief_is_named_however_little_it_explains(
        relief: bool, robot: Callable[..., Plant], monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (rounds, elimination):
        monkeypatch.setattr(module, 'relieves', lambda without, within: relief)
    said = diagnose([uneven(robot, 0.004)], load_model(), lambda text, share: None).diagnosis
    assert [f.effect for f in said.findings] == relief * ['wheel_radius_mismatch']


def test_an_effect_that_the_robot_s_numbers_took_the_place_of_is_named(
        robot: Callable[..., Plant], record: Callable[..., Recording],
        steps: Sequence[tuple[float, float, float]]) -> None:
    """Roughly fitted it gains less than 10 nats, which is likely by chance; in the end 84."""
    rolling = record('rec', robot('rolling_resistance', rolling_force=1.0), steps, 0)
    said = diagnose([rolling], load_model(), lambda text, share: None).diagnosis
    assert [f.effect for f in said.findings] == ['rolling_resistance']
