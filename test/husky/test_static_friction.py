# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A robot that is held at rest, against equations that are written here once more."""

from __future__ import annotations

from collections.abc import Callable
import math

from lg_husky_sim.husky.effects import catalogue
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import TimeSeries
from lg_husky_sim.simulation.events import trajectory
import numpy as np
import pytest

Maker = Callable[..., Plant]
P = dict(load_model().parameters.items())
OWN = {p.name: p.starts[0] for p in catalogue()['static_friction'].parameters}
HELD = 5.0
"""Break-away torque of a side [N·m]."""
WEIGHT = 2.0 * HELD / P['wheel_radius']
"""Force on the base at which both sides let go [N]."""
SPEED = HELD * P['motor_resistance'] / (
    P['torque_constant'] * P['gear_ratio'] * P['supply_voltage'] * P['command_gain'])
"""Commanded speed whose voltage makes a motor at rest give the break-away torque [m/s]."""
CREEP = 5e-6
"""Way that a robot which is held may creep in a minute [m]: what the accuracy of a step leaves."""


def drive(plant: Plant, speed: float, end: float, step: float = 0.05) -> TimeSeries:
    """Command one speed from rest."""
    commands = TimeSeries(np.zeros(1), np.array([[speed, 0.0]]), ('forward', 'yaw'))
    return trajectory(plant, commands, np.arange(0.0, end + 0.5 * step, step))


def test_it_stands_in_the_catalogue() -> None:
    kind = catalogue()['static_friction']
    assert (kind.subsystem.value, kind.sides, kind.needs_onset) == (
        'drivetrain', ('none',), False)


def test_a_robot_at_rest_without_a_command_does_not_move_at_all(robot: Maker) -> None:
    run = drive(robot('static_friction', break_away_torque=HELD), 0.0, 60.0)
    assert not np.any(run.values)


@pytest.mark.parametrize('others', [(), ('rolling_resistance',), ('coulomb_drivetrain',)])
@pytest.mark.parametrize('share', [0.3, 0.66, 0.99])
def test_it_holds_a_robot_on_a_slope(robot: Maker, share: float, others: tuple[str, ...]) -> None:
    """Up to the break-away force it gives way once, by less than the presliding, and stays."""
    plant = robot('slope', 'static_friction', *others, slope_x=share * WEIGHT, slope_y=0.0,
                  break_away_torque=HELD)
    x = drive(plant, 0.0, 61.0).column('x')
    assert 0.0 < x[20] < 2.0 * (1.0 + OWN['tyre_share']) * OWN['presliding'] * P['wheel_radius']
    assert np.abs(x[20:] - x[20]).max() < CREEP


def test_what_creeps_without_it_rests_with_it(robot: Maker) -> None:
    """60 N of slope against 100 N of rolling resistance, whose smooth sign is never at rest."""
    values = {'slope_x': 60.0, 'slope_y': 0.0, 'rolling_force': 100.0}
    creeping = drive(robot('slope', 'rolling_resistance', **values), 0.0, 60.0).column('x')
    assert creeping[-1] > 0.5
    held = robot('slope', 'rolling_resistance', 'static_friction', break_away_torque=HELD,
                 **values)
    x = drive(held, 0.0, 61.0).column('x')
    assert np.abs(x[20:] - x[20]).max() < CREEP


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_a_steeper_slope_breaks_it_away(robot: Maker, sign: float) -> None:
    plant = robot('slope', 'static_friction', slope_x=sign * 1.03 * WEIGHT, slope_y=0.0,
                  break_away_torque=HELD)
    assert sign * drive(plant, 0.0, 60.0).column('x')[-1] > 0.01


@pytest.mark.parametrize('sign', [1.0, -1.0])
def test_a_voltage_moves_it_from_the_break_away_torque_on(robot: Maker, sign: float) -> None:
    plant = robot('static_friction', break_away_torque=HELD)
    below = drive(plant, sign * 0.98 * SPEED, 61.0)
    assert np.ptp(below.column('angle_left')[20:]) < CREEP / P['wheel_radius']
    assert np.ptp(below.column('x')[20:]) < CREEP
    above = drive(plant, sign * 1.1 * SPEED, 61.0)
    assert sign * above.column('x')[-1] > 0.1


def test_what_drives_is_not_held(robot: Maker) -> None:
    """Beyond the release rate nothing is left of it."""
    held = drive(robot('static_friction', break_away_torque=HELD), 0.6, 8.0)
    free = drive(robot(), 0.6, 8.0)
    for channel in ('forward', 'wheel_left', 'current_left'):
        assert held.column(channel)[-1] == pytest.approx(free.column(channel)[-1], rel=1e-9)


def reference(speed: float, off: float, end: float) -> np.typing.NDArray[np.float64]:
    """
    Return wheel rate and speed every 10 ms by the classic Runge-Kutta method in steps of 20 us.

    Straight ahead both sides are alike. What has given way is limited where it is used, and after
    each step.
    """
    motor, radius = P['torque_constant'] * P['gear_ratio'], P['wheel_radius']
    stiffness, settling = HELD / OWN['presliding'], OWN['settling_time']
    most = (OWN['presliding'], OWN['tyre_share'] * OWN['presliding'])

    def hold(given: float, limit: float, rate: float, letting: float) -> float:
        given = max(-limit * letting, min(limit * letting, given))
        free = max(letting * letting - (given / limit) ** 2, 0.0)
        return stiffness * (given + settling * free * rate)

    def letting_go(wheel: float) -> float:
        return math.exp(-(wheel / OWN['release_rate']) ** 2)

    def slope(s: tuple[float, ...], volts: float) -> tuple[float, ...]:
        wheel, base, current, axle, tyre = s
        slip, letting = wheel - base / radius, letting_go(wheel)
        contact = 2.0 * P['wheel_damping'] * slip + hold(tyre, most[1], slip, letting)
        return ((motor * current - contact - hold(axle, most[0], wheel, letting))
                / P['wheel_inertia'], 2.0 * contact / radius / P['mass'],
                (volts - P['motor_resistance'] * current - motor * wheel)
                / P['motor_inductance'], wheel, slip)

    step, seen = 2e-5, []
    s: tuple[float, ...] = (0.0,) * 5
    for k in range(round(end / step)):
        volts = P['supply_voltage'] * P['command_gain'] * speed * (k * step < off - 0.5 * step)
        one = slope(s, volts)
        two = slope(tuple(a + 0.5 * step * b for a, b in zip(s, one, strict=True)), volts)
        three = slope(tuple(a + 0.5 * step * b for a, b in zip(s, two, strict=True)), volts)
        four = slope(tuple(a + step * b for a, b in zip(s, three, strict=True)), volts)
        s = tuple(a + step / 6.0 * (b + 2.0 * c + 2.0 * d + e) for a, b, c, d, e in zip(
            s, one, two, three, four, strict=True))
        letting = letting_go(s[0])
        s = (*s[:3], *(max(-limit * letting, min(limit * letting, given))
                       for limit, given in zip(most, s[3:], strict=True)))
        if (k + 1) % 500 == 0:
            seen.append(s[:2])
    return np.array(seen)


@pytest.mark.parametrize(('speed', 'error'), [(0.09, 1e-4), (0.15, 1e-4), (0.37, 1e-3)])
def test_it_breaks_away_and_stops_as_its_equations_say(robot: Maker, speed: float, error: float
                                                       ) -> None:
    off, end = 0.5, 1.2
    expected = reference(speed, off, end)
    commands = TimeSeries(np.array([0.0, off]), np.array([[speed, 0.0], [0.0, 0.0]]),
                          ('forward', 'yaw'))
    seen = trajectory(robot('static_friction', break_away_torque=HELD), commands,
                      0.01 * np.arange(1, len(expected) + 1))
    assert expected[:, 0].max() > 4.0 * speed
    np.testing.assert_allclose(seen.column('wheel_left'), expected[:, 0], atol=error)
    np.testing.assert_allclose(seen.column('forward'), expected[:, 1], atol=0.1 * error)
    assert abs(expected[-1, 0]) < 1e-3
