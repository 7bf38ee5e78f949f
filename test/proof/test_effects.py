# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Each hidden effect shows in the channel that it should show in, and nowhere by magic."""

from __future__ import annotations

from dataclasses import replace

from lg_husky_sim.proof import (
    cases,
    catalogue,
    conventions,
    effects,
    manoeuvres,
    motion,
    oracle,
    robots,
    sensors,
)
from lg_husky_sim.proof.commands import send
from lg_husky_sim.proof.integrate import COLUMNS
from lg_husky_sim.proof.manoeuvres import Manoeuvre
from lg_husky_sim.proof.settings import settings
import numpy as np
from numpy.typing import NDArray
import pytest

Vector = NDArray[np.float64]

SENSOR_ONLY = {'gyro_bias', 'gyro_scale', 'gyro_sign', 'encoder_scale', 'sensor_time_offset',
               'gyro_clipping'}
# Where a strong effect must show, and how much [rad/s, m/s].
SHOWS_IN = {
    'torque_ripple': 'wheel', 'coulomb_drivetrain': 'wheel', 'viscous_asymmetry': 'wheel',
    'voltage_saturation': 'wheel', 'driver_deadband': 'wheel', 'battery_droop': 'wheel',
    'command_latency': 'wheel', 'command_slew': 'wheel', 'command_limit': 'wheel',
    'speed_loop': 'wheel', 'motor_cogging': 'wheel', 'reverse_gain': 'wheel',
    'command_stutter': 'wheel', 'periodic_cutback': 'wheel', 'current_limit': 'wheel',
    'battery_sag': 'wheel', 'motor_heating': 'wheel', 'gear_backlash': 'wheel',
    'rolling_resistance': 'forward', 'quadratic_drag': 'forward', 'slope': 'forward',
    'wavy_floor': 'forward', 'payload': 'yaw_rate', 'yaw_pull': 'yaw_rate',
    'yaw_scrub_coulomb': 'yaw_rate', 'yaw_scrub_speed': 'yaw_rate',
    'terrain_change': 'yaw_rate', 'traction_saturation': 'yaw_rate',
    'wheel_radius_mismatch': 'yaw_rate', 'wheel_eccentricity': 'yaw_rate',
    'com_shift': 'yaw_rate', 'belt_compliance': 'yaw_rate'}
LEAST = {'wheel': 0.04, 'forward': 0.01, 'yaw_rate': 0.008}


def drive() -> Manoeuvre:
    rate = 20.0
    times = np.arange(260) / rate
    commands = np.zeros((260, 2))
    for start, end, pair in ((1, 3.3, (0.9, 0.0)), (3.3, 6, (0.5, 0.7)), (6, 8, (-0.7, 0.0)),
                             (8, 10, (0.0, -0.9)), (10, 12, (0.9, 0.1))):
        commands[int(start * rate):int(end * rate)] = pair
    return Manoeuvre('short', times, commands)


def plain_conventions() -> conventions.Conventions:
    how = conventions.draw(np.random.default_rng(3), tuning=True, floor='none',
                           wheels='difference', needed=frozenset(conventions.STREAMS))
    return replace(how, jitter=0.0, missing=(), link=replace(
        how.link, base_rate=0.0, delay=0.0, lost_robot=0.0, late=0.0))


def a_case(*drives: Manoeuvre) -> oracle.Drives:
    how = plain_conventions()
    drives = drives or (drive(),)
    return oracle.Drives(drives, [send(one, how.link, 0.0, None) for one in drives],
                         [(0.0, 0.0, 0.0)] * len(drives), how)


def hide(effect: str, severity: str = 'strong', onset: str = 'none', seed: int = 5,
         case: oracle.Drives | None = None) -> motion.Hidden:
    kind = 'single' if effect in catalogue.SUBSYSTEM else 'outside'
    spec = cases.Spec(seed, kind, effects=(effect,), severity=severity, onset=onset)
    rng = np.random.default_rng(seed)
    hidden, told, _ = cases.conceal(spec, robots.open_loop_robot(rng), case or a_case(),
                                    (effect,), (severity,), rng)
    assert told[0]['effect'] == effect
    assert told[0]['parameters']
    return hidden


def go(hidden: motion.Hidden, index: int | None = 0,
       rng: np.random.Generator | None = None) -> Vector:
    case = a_case()
    return motion.run(hidden, drive(), case.sent[0], case.how, (0.0, 0.0, 0.0), index, rng=rng,
                      step=oracle.step_of(hidden))


def moved(hidden: motion.Hidden) -> dict[str, float]:
    gap = go(hidden) - go(motion.alone(hidden))
    return {name: float(np.sqrt(np.mean(gap[:, COLUMNS.index(name)] ** 2)))
            for name in ('wheel_left', 'wheel_right', 'motor_left', 'motor_right', 'yaw_rate',
                         'forward')}


def test_every_effect_of_the_catalogue_and_more_can_be_hidden() -> None:
    known = set(catalogue.SUBSYSTEM) | set(catalogue.OUTSIDE)
    assert set(effects.BUILDERS) == set(settings()['effects']) == known
    assert len(catalogue.SUBSYSTEM) == 30
    assert len(catalogue.OUTSIDE) >= 6
    for name, row in settings()['effects'].items():
        assert set(row['related']) <= (set(catalogue.SUBSYSTEM) | {'com_shift'}) - {name}
        for (low, high), (next_low, next_high) in zip(row['sizes'], row['sizes'][1:],
                                                      strict=False):
            assert low <= high
            rises = {next_low > high, next_high < low} if name != 'gyro_sign' else {True}
            assert True in rises, f'{name}: severities overlap'


@pytest.mark.parametrize('effect', sorted(SHOWS_IN))
def test_a_strong_effect_shows_where_it_should(effect: str) -> None:
    found = moved(hide(effect))
    where = SHOWS_IN[effect]
    assert max(value for name, value in found.items() if name.startswith(where)) > LEAST[where]


def test_a_battery_loses_by_its_charge_what_the_answer_says() -> None:
    """Not by a current that such drives are thought to draw."""
    for seed in range(20):
        rng = np.random.default_rng(seed)
        spec = cases.Spec(seed, 'single', effects=('battery_droop',), severity='strong',
                          onset='none', tuning=False)
        hidden, told, _ = cases.conceal(spec, robots.open_loop_robot(rng), a_case(),
                                        ('battery_droop',), ('strong',), rng)
        if told[0]['form'] == 'charge':
            break
    assert told[0]['form'] == 'charge'
    table = go(hidden)
    lost = 1.0 - table[-1, COLUMNS.index('bus')] / hidden.fields['supply']
    assert lost == pytest.approx(told[0]['parameters']['final_loss_fraction'], rel=0.2)


@pytest.mark.parametrize('effect', ['coulomb_drivetrain', 'payload', 'command_latency',
                                    'yaw_scrub_coulomb', 'gyro_bias'])
def test_a_stronger_effect_is_worth_more_to_the_oracle(effect: str) -> None:
    case = a_case()
    sizes = [oracle.nats(hide(effect, severity, case=case), case, np.random.default_rng(1))
             for severity in ('weak', 'medium', 'strong')]
    assert 0.0 < sizes[0] < sizes[1] < sizes[2]
    assert oracle.level(sizes[2]) == 'clear'


def test_a_robot_without_effect_is_worth_nothing_to_the_oracle() -> None:
    case = a_case()
    clean = motion.alone(hide('slope', case=case))
    worth = oracle.nats(clean, case, np.random.default_rng(1))
    assert worth == pytest.approx(0.0, abs=1e-6)
    assert oracle.level(worth) == 'undetectable'


def test_what_a_recalibration_takes_over_is_worth_nothing_to_the_oracle() -> None:
    case = a_case()
    hidden = motion.alone(hide('slope', case=case))
    damped = {**hidden.fields, 'yaw_damping': 1.01 * hidden.fields['yaw_damping']}
    heavier = {**hidden.fields, 'mass': 1.4 * hidden.fields['mass']}
    free, bound = (oracle.nats(replace(hidden, fields=fields), case, np.random.default_rng(1))
                   for fields in (damped, heavier))
    assert free < 1.0
    assert bound > 5.0, 'the tolerance of a mass is no 40 per cent'


@pytest.mark.parametrize('effect', sorted(SENSOR_ONLY))
def test_a_sensor_fault_leaves_the_motion_alone_and_shows_in_its_stream(effect: str) -> None:
    hidden = hide(effect)
    assert set(moved(hidden).values()) == {0.0}
    table, case = go(hidden), a_case()
    faulty = sensors.ideal(table, case.sent[0], case.how, hidden.faults)
    healthy = sensors.ideal(table, case.sent[0], case.how, sensors.Faults())
    changed = {name for name in ('joints', 'imu', 'poses')
               if np.abs(getattr(faulty, name) - getattr(healthy, name)).max() > 0.004}
    if effect.startswith('gyro'):
        assert changed == {'imu'}
    elif effect == 'encoder_scale':
        assert changed == {'joints'}
    else:
        stream = {'wheels': 'joints', 'imu': 'imu', 'pose': 'poses'}[hidden.faults.late]
        assert changed == {stream}
        late = getattr(faulty, stream)[:, 0] - getattr(healthy, stream)[:, 0]
        assert late == pytest.approx(hidden.faults.late_by)


def test_wind_pushes_only_where_chance_is_allowed() -> None:
    hidden = hide('wind_gusts')
    blown = go(hidden, rng=np.random.default_rng(1))
    gap = (blown - go(hidden))[:, COLUMNS.index('forward')]
    assert np.sqrt(np.mean(gap ** 2)) > 0.02


@pytest.mark.parametrize('effect', ['rolling_resistance', 'command_latency', 'gyro_bias'])
def test_an_effect_with_an_onset_in_time_is_absent_before(effect: str) -> None:
    hidden = hide(effect, onset='time')
    assert hidden.onset == 'time'
    case = a_case()
    bags = [sensors.publish(go(robot), case.sent[0], case.how,
                            replace(robot.faults, since=hidden.onset_time), 0.0, 0.165,
                            np.random.default_rng(3))
            for robot in (hidden, motion.alone(hidden))]
    early = bags[0].imu[:, 0] < hidden.onset_time - 0.3
    gap = np.abs(bags[0].imu - bags[1].imu)
    assert gap[early, 1].max() < 1e-6
    assert gap[~early, 1:3].max() > 0.01


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_an_effect_at_a_place_holds_on_one_side_of_it(sign: float) -> None:
    hidden = replace(hide('rolling_resistance'), onset='place', onset_x=1.0, onset_sign=sign,
                     onset_width=0.1)
    table, clean = go(hidden), go(motion.alone(hidden))
    x, v = COLUMNS.index('x'), COLUMNS.index('forward')
    reached = np.argmax(clean[:, x] > 0.8)
    gap = np.abs(table[:reached, v] - clean[:reached, v]).max()
    assert gap < 1e-12 if sign > 0.0 else gap > 0.02
    assert np.abs(table[:, v] - clean[:, v]).max() > 0.02


@pytest.mark.parametrize('kind', manoeuvres.SETS)
def test_drives_end_at_rest_and_ask_for_no_more_than_the_supply_has(kind: str) -> None:
    rng = np.random.default_rng(8)
    who = manoeuvres.driver(rng, 25.0, (40.0, 60.0), 0.5)
    for one in manoeuvres.drive(kind, who, rng, frozenset()):
        assert 39.0 < one.duration - one.moving_start < 61.0
        assert not one.commands[0].any()
        asked = np.abs(one.commands[:, 0]) + 0.541 * np.abs(one.commands[:, 1])
        assert asked.max() <= 0.94
        assert np.abs(one.commands).max() > 0.2


def test_a_drive_that_is_left_out_is_never_drawn() -> None:
    rng = np.random.default_rng(8)
    who = manoeuvres.driver(rng, 25.0, (20.0, 30.0), 0.0)
    names = {one.name for _ in range(30)
             for one in manoeuvres.drive('full', who, rng, frozenset({'staircase'}))}
    assert 'staircase' not in names
    assert {'spin', 'chirp', 'circle'} <= names


def test_each_effect_of_a_pair_is_looked_at_alone() -> None:
    rng = np.random.default_rng(6)
    spec = cases.Spec(6, 'pair', effects=('payload', 'command_latency'), severity='strong')
    robot = robots.open_loop_robot(rng)
    hidden, _, changes = cases.conceal(spec, robot, a_case(), spec.effects, ('strong',) * 2, rng)
    heavy, late = (cases.with_change(motion.alone(hidden), change) for change in changes)
    assert heavy.fields['mass'] == hidden.fields['mass'] != robot.fields['mass']
    assert heavy.command.latency == 0.0
    assert late.command.latency == hidden.command.latency > 0.0
    assert late.fields['mass'] == robot.fields['mass']


def test_tuning_never_has_a_form_that_is_left_out() -> None:
    left_out = conventions.left_out('forms', tuning=True)
    assert len(left_out) > 4
    case = a_case()
    for effect in ('traction_saturation', 'coulomb_drivetrain', 'driver_deadband'):
        forms = set()
        for seed in range(12):
            spec = cases.Spec(seed, effects=(effect,), severity='strong', onset='none')
            rng = np.random.default_rng(seed)
            _, (told,), _ = cases.conceal(spec, robots.open_loop_robot(rng), case, (effect,),
                                          ('strong',), rng)
            forms.add(f'{effect} {told["form"]}')
        assert not forms & left_out
