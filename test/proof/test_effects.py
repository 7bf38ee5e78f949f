# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Each hidden effect shows in the channel that it should show in, and nowhere by magic."""

from __future__ import annotations

from dataclasses import replace

from lg_husky_sim.proof import cases, catalogue, effects, manoeuvres, motion, robots, sensors
from lg_husky_sim.proof.hidden import Change
from lg_husky_sim.proof.integrate import COLUMNS
from lg_husky_sim.proof.manoeuvres import Manoeuvre
import numpy as np
from numpy.typing import NDArray
import pytest

Vector = NDArray[np.float64]

SENSOR_ONLY = {'gyro_bias', 'gyro_scale', 'gyro_sign', 'encoder_scale', 'sensor_time_offset',
               'gyro_clipping'}
CHANNELS = {'wheel_left': 0.05, 'wheel_right': 0.05, 'yaw_rate': 0.01, 'forward': 0.02}
# Where a strong effect must show, beyond the noise of that channel.
SHOWS_IN = {
    'torque_ripple': 'wheel', 'coulomb_drivetrain': 'wheel', 'viscous_asymmetry': 'wheel',
    'voltage_saturation': 'wheel', 'driver_deadband': 'wheel', 'battery_droop': 'wheel',
    'command_latency': 'wheel', 'command_slew': 'wheel', 'command_limit': 'wheel',
    'speed_loop': 'wheel', 'motor_cogging': 'wheel', 'reverse_gain': 'wheel',
    'command_stutter': 'wheel', 'periodic_cutback': 'wheel', 'current_limit': 'wheel',
    'rolling_resistance': 'forward', 'quadratic_drag': 'forward', 'slope': 'forward',
    'wavy_floor': 'forward', 'payload': 'yaw_rate', 'yaw_pull': 'yaw_rate',
    'yaw_scrub_coulomb': 'yaw_rate', 'yaw_scrub_speed': 'yaw_rate',
    'terrain_change': 'yaw_rate', 'traction_saturation': 'yaw_rate',
    'wheel_radius_mismatch': 'yaw_rate', 'wheel_eccentricity': 'yaw_rate',
    'offset_mass': 'yaw_rate', 'belt_compliance': 'yaw_rate', 'gear_backlash': 'wheel',
}


def drive() -> Manoeuvre:
    rate = 20.0
    times = np.arange(260) / rate
    commands = np.zeros((260, 2))
    for start, end, pair in ((1, 3.3, (0.9, 0.0)), (3.3, 6, (0.6, 0.8)), (6, 8, (-0.7, 0.0)),
                             (8, 10, (0.0, -0.9)), (10, 12, (0.9, 0.3))):
        commands[int(start * rate):int(end * rate)] = pair
    return Manoeuvre('short', times, commands)


def hide(effect: str, severity: str = 'strong', onset: str = 'none') -> motion.Hidden:
    kind = 'single' if effect in catalogue.SUBSYSTEM else 'outside'
    spec = cases.Spec(5, kind, effects=(effect,), severity=severity, onset=onset)
    rng = np.random.default_rng(5)
    hidden, told, _ = cases.conceal(spec, robots.open_loop_robot(rng), (drive(),), rng)
    assert told[0]['effect'] == effect
    assert told[0]['parameters']
    return hidden


def moved(hidden: motion.Hidden) -> dict[str, float]:
    return motion.visibility(hidden, (drive(),), [(0.0, 0.0, 0.0)])


def test_every_effect_of_the_catalogue_and_more_can_be_hidden() -> None:
    assert set(effects.BUILDERS) == set(catalogue.SUBSYSTEM) | set(catalogue.OUTSIDE)
    assert len(catalogue.SUBSYSTEM) == 30
    assert len(catalogue.OUTSIDE) >= 6
    assert not set(catalogue.SUBSYSTEM) & set(catalogue.OUTSIDE)


@pytest.mark.parametrize('effect', sorted(SHOWS_IN))
def test_a_strong_effect_shows_where_it_should(effect: str) -> None:
    found = moved(hide(effect))
    where = SHOWS_IN[effect]
    value = max(value for name, value in found.items() if name.startswith(where))
    assert value > 0.8


@pytest.mark.parametrize('effect', ['coulomb_drivetrain', 'payload', 'command_latency',
                                    'yaw_scrub_coulomb', 'battery_sag', 'motor_heating'])
def test_a_stronger_effect_shows_more(effect: str) -> None:
    sizes = [sum(moved(hide(effect, severity)).values())
             for severity in ('weak', 'medium', 'strong')]
    assert sizes[0] < sizes[1] < sizes[2]


@pytest.mark.parametrize('effect', sorted(SENSOR_ONLY))
def test_a_sensor_fault_leaves_the_motion_alone_and_shows_in_its_stream(effect: str) -> None:
    hidden = hide(effect)
    assert moved(hidden) == dict.fromkeys(CHANNELS, 0.0)
    table = motion.run(hidden, drive(), (0.0, 0.0, 0.0), 0, None)
    faulty = sensors.ideal(table, drive(), hidden.senses)
    healthy = sensors.ideal(table, drive(), hidden.robot.senses)
    changed = {name for name in ('joints', 'imu', 'poses')
               if np.abs(getattr(faulty, name) - getattr(healthy, name)).max() > 0.004}
    if effect.startswith('gyro'):
        assert changed == {'imu'}
    elif effect == 'encoder_scale':
        assert changed == {'joints'}
    else:
        stream = {'wheels': 'joints', 'imu': 'imu', 'pose': 'poses'}[hidden.senses.late]
        assert changed == {stream}
        late = getattr(faulty, stream)[:, 0] - getattr(healthy, stream)[:, 0]
        assert late == pytest.approx(hidden.senses.late_by)


def test_wind_pushes_only_where_chance_is_allowed() -> None:
    hidden = hide('wind_gusts')
    rng = np.random.default_rng(1)
    blown = motion.run(hidden, drive(), (0.0, 0.0, 0.0), 0, rng)
    calm = motion.run(replace(hidden, gusts=0.0), drive(), (0.0, 0.0, 0.0), 0,
                      np.random.default_rng(1))
    k = COLUMNS.index('forward')
    assert np.sqrt(np.mean((blown[:, k] - calm[:, k]) ** 2)) > 0.02


@pytest.mark.parametrize('effect', ['rolling_resistance', 'command_latency', 'gyro_bias'])
def test_an_effect_with_an_onset_in_time_is_absent_before(effect: str) -> None:
    hidden = hide(effect, onset='time')
    assert hidden.onset == 'time'
    pose = (0.0, 0.0, 0.0)
    senses = replace(hidden.senses, since=hidden.onset_time)
    with_it = sensors.publish(motion.run(hidden, drive(), pose, 0, None), drive(), senses,
                              np.random.default_rng(3))
    without = sensors.publish(motion.run(hidden, drive(), pose, 0, None, with_effect=False),
                              drive(), hidden.robot.senses, np.random.default_rng(3))
    early = with_it.imu[:, 0] < hidden.onset_time - 0.1
    assert np.abs(with_it.imu - without.imu)[early, 1].max() < 1e-9
    assert np.abs(with_it.imu - without.imu)[~early, 1:3].max() > 0.01


def test_an_effect_at_a_place_holds_beyond_it() -> None:
    hidden = replace(hide('rolling_resistance'), onset='place', onset_x=1.0)
    pose = (0.0, 0.0, 0.0)
    table = motion.run(hidden, drive(), pose, None, None)
    plain = motion.run(hidden, drive(), pose, None, None, with_effect=False)
    x, v = COLUMNS.index('x'), COLUMNS.index('forward')
    before = np.arange(table.shape[0]) < np.argmax(table[:, x] > 0.8)
    assert np.abs(table[before, v] - plain[before, v]).max() < 1e-12
    assert np.abs(table[~before, v] - plain[~before, v]).max() > 0.05


@pytest.mark.parametrize('name', manoeuvres.SETS)
def test_drives_start_and_end_at_rest_within_what_a_husky_is_asked(name: str) -> None:
    for one in manoeuvres.drive(name, np.random.default_rng(8)):
        assert 15.0 < one.duration < 100.0
        assert not one.commands[0].any()
        assert not one.commands[-1].any()
        assert np.abs(one.commands[:, 0]).max() <= 1.1
        assert np.abs(one.commands[:, 1]).max() <= 1.2
        assert np.abs(one.commands).max() > 0.3


def ahead() -> Manoeuvre:
    times = np.arange(100) / 20.0
    return Manoeuvre('ahead', times, np.column_stack([np.where(times < 3.0, 0.8, 0.0),
                                                      np.zeros(100)]))


def build(effect: str) -> tuple[motion.Hidden, list[Change]]:
    rng = np.random.default_rng(5)
    kind = 'single' if effect in catalogue.SUBSYSTEM else 'outside'
    spec = cases.Spec(5, kind, effects=(effect,), severity='strong')
    hidden, _, changes = cases.conceal(spec, robots.open_loop_robot(rng), (ahead(),), rng)
    return hidden, changes


def test_an_effect_that_its_drives_cannot_show_is_refused() -> None:
    hidden, changes = build('reverse_gain')
    with pytest.raises(cases.NoTraceError, match='no trace'):
        cases.check_traces(hidden, changes, (ahead(),), [(0.0, 0.0, 0.0)])
    cases.check_traces(hidden, changes, (ahead(), drive()), [(0.0, 0.0, 0.0)] * 2)


@pytest.mark.parametrize('effect', ['coulomb_drivetrain', 'command_slew', 'gyro_bias',
                                    'wind_gusts'])
def test_an_effect_that_shows_in_its_channel_is_not_refused(effect: str) -> None:
    hidden, changes = build(effect)
    cases.check_traces(hidden, changes, (ahead(),), [(0.0, 0.0, 0.0)])


def test_each_effect_of_a_pair_is_looked_at_alone() -> None:
    rng = np.random.default_rng(6)
    spec = cases.Spec(6, 'pair', effects=('payload', 'command_slew'), severity='strong')
    robot = robots.open_loop_robot(rng)
    hidden, _, changes = cases.conceal(spec, robot, (drive(),), rng)
    heavy, slow = (cases.alone(hidden, change) for change in changes)
    assert heavy.fields['mass'] == hidden.fields['mass'] != robot.fields['mass']
    assert heavy.command.slew_forward == robot.command.slew_forward
    assert slow.command.slew_forward == hidden.command.slew_forward != (
        robot.command.slew_forward)
    assert slow.fields == robot.fields
