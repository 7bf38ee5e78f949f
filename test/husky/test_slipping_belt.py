# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Belts that slip beyond a torque, against equations that are written here once more."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.husky.effects import catalogue, Effect
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.simulation.events import trajectory
import numpy as np
import pytest
from scipy.integrate import solve_ivp

Maker = Callable[..., Plant]
P = dict(load_model().parameters.items())
SLIPPING = Effect('belt_compliance', shape='slipping')
BELT = {'belt_stiffness': 20.0, 'belt_damping': 0.3}
DAMPING = {p.name: p.starts[0] for p in catalogue()['belt_compliance'].parameters}[
    'belt_slip_damping']
STEPS = ((0.0, 0.8), (1.0, -0.8), (2.0, 0.0))
"""When a forward speed is commanded [s, m/s]: a start, a reversal and a stop."""
END = 3.0


def rates(time: float, s: FloatArray, command: float, hold: float) -> FloatArray:
    """
    Return the rates of one side, straight ahead with half of the base.

    State: rear and front axle [rad/s], base [m/s], current [A], stretch of the belt [rad].
    """
    rear, front, speed, current, stretch = s
    motor = P['torque_constant'] * P['gear_ratio']
    spring = BELT['belt_stiffness'] * stretch
    slip = np.sign(spring) * max(abs(spring) - hold, 0.0) / DAMPING
    belt = spring + BELT['belt_damping'] * (rear - front - slip)
    treads = [P['wheel_damping'] * (rate - speed / P['wheel_radius']) for rate in (rear, front)]
    volts = P['supply_voltage'] * P['command_gain'] * command
    return np.array([
        (motor * current - belt - treads[0]) / (0.5 * P['wheel_inertia']),
        (belt - treads[1]) / (0.5 * P['wheel_inertia']),
        sum(treads) / P['wheel_radius'] / (0.5 * P['mass']),
        (volts - P['motor_resistance'] * current - motor * rear) / P['motor_inductance'],
        rear - front - slip])


def reference(times: FloatArray, hold: float) -> FloatArray:
    """Return rear wheel rate and speed by Radau, which stops where the command changes."""
    seen, state = [], np.zeros(5)
    for (begin, command), (end, _) in zip(STEPS, (*STEPS[1:], (END, 0.0)), strict=True):
        inside = times[(times > begin) & (times <= end)]
        found = solve_ivp(rates, (begin, end), state, 'Radau', [*inside, end],
                          args=(command, hold), rtol=1e-9, atol=1e-11)
        seen.append(found.y[[0, 2], :inside.size])
        state = found.y[:, -1]
    return np.hstack(seen).T


def driven(plant: Plant, times: FloatArray) -> FloatArray:
    commands = TimeSeries(np.array([t for t, _ in STEPS]), np.array([[v, 0.0] for _, v in STEPS]),
                          ('forward', 'yaw'))
    run = trajectory(plant, commands, times)
    return np.column_stack([run.column('wheel_left'), run.column('forward')])


@pytest.mark.parametrize('hold', [0.3, 1.0, 2.0])
def test_it_moves_as_its_equations_say(robot: Maker, hold: float) -> None:
    """To 0.2 mrad/s and 20 um/s, where the belt slips at every change of the command."""
    times = np.linspace(0.013, END - 0.01, 200)
    found = driven(robot(SLIPPING, **BELT, belt_hold=hold), times)
    expected = reference(times, hold)
    np.testing.assert_allclose(found[:, 0], expected[:, 0], atol=2e-4)
    np.testing.assert_allclose(found[:, 1], expected[:, 1], atol=2e-5)
    assert np.abs(expected - reference(times, 1e6)).max() > 0.03


def test_one_that_holds_all_is_elastic(robot: Maker) -> None:
    times = np.linspace(0.013, END - 0.01, 50)
    holding = driven(robot(SLIPPING, **BELT, belt_hold=1e4), times)
    np.testing.assert_allclose(holding, driven(robot('belt_compliance', **BELT), times),
                               atol=2e-5)
