# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The steps against other steps, and against an integrator of scipy on the same equations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.laws import evaluate, Law, MEMORY
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import FloatArray, Pose, TimeSeries
from lg_husky_sim.simulation import rollout, Simulator
import numpy as np
import pytest
from scipy.integrate import solve_ivp

Maker = Callable[..., Plant]

HOLD = 0.5
"""How long each of DRIVE is held [s]."""
DRIVE = np.array([[0.6, 0.0], [0.6, 0.5], [0.0, -0.7], [-0.4, -0.3], [0.8, 0.1]])


def columns(plant: Plant, period: float) -> FloatArray:
    """Return the kernel's columns at the ends of the holds, without the voltages."""
    simulator, steps = Simulator(plant, period), round(HOLD / period)
    start = simulator.initial(Pose(1.0, -2.0, 0.7))
    _, out = simulator.run(start, np.repeat(DRIVE, steps, axis=0))
    return out[steps - 1::steps, :13]


@dataclass(frozen=True)
class Equations:
    """A plant's continuous equations, with pose and motor heat as further states."""

    plant: Plant

    def efforts(self, time: float, s: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        one = self.plant.sets[0]
        n = one.a.shape[0]
        f, z = np.zeros(one.laws.size), one.h @ s[:n] + one.k @ u
        if f.size:
            memory = np.zeros(MEMORY)
            memory[:2] = s[n + 6:]
            context = np.array([time, s[n + 3], s[n + 4], s[n + 5], s[n], s[n + 1], 0.0])
            evaluate(0, one.laws[None], one.coefficients[None],
                     one.offsets[None], z, context, memory, f)
        return f, z

    def outputs(self, time: float, s: FloatArray, u: FloatArray) -> FloatArray:
        one = self.plant.sets[0]
        y: FloatArray = one.rows @ s[:one.a.shape[0]] + one.rows_u @ u
        return y + one.rows_f @ self.efforts(time, s, u)[0]

    def rates(self, time: float, s: FloatArray, u: FloatArray) -> FloatArray:
        one = self.plant.sets[0]
        n = one.a.shape[0]
        f, z = self.efforts(time, s, u)
        y = one.rows @ s[:n] + one.rows_u @ u + one.rows_f @ f
        heat = np.zeros(2)
        for j in np.flatnonzero(one.laws == Law.HEATING):
            side, cooling = int(one.coefficients[j, 2]), one.coefficients[j, 1]
            heat[side] = z[one.offsets[j]] ** 2 - s[n + 6 + side] / cooling
        return np.concatenate([
            one.a @ s[:n] + one.b @ u + one.g @ f, y[:4],
            [y[2] * np.cos(s[n + 3]), y[2] * np.sin(s[n + 3])], heat])

    def solve(self, rtol: float, atol: float) -> FloatArray:
        one = self.plant.sets[0]
        n, stage = one.a.shape[0], one.command
        s = np.zeros(n + 8)
        s[n + 3:n + 6] = 0.7, 1.0, -2.0
        rows = []
        for index, (forward, yaw) in enumerate(DRIVE):
            rate = stage.volts_per_rate * yaw
            u = stage.volts_per_speed * forward + np.array([-rate, rate])
            end = (index + 1) * HOLD
            s = solve_ivp(self.rates, (end - HOLD, end), s, 'DOP853', args=(u,), rtol=rtol,
                          atol=atol).y[:, -1]
            rows.append(np.concatenate([self.outputs(end, s, u)[:7], s[n:n + 6]]))
        return np.array(rows)


@pytest.mark.parametrize('effects', [(), ('belt_compliance',), ('payload',)])
def test_any_period_gives_the_same_at_common_samples(
        robot: Maker, effects: tuple[str, ...]) -> None:
    """Commands change every 0.1 s; all 15 columns, x and y too."""
    plant = robot(*effects)
    generator = np.random.default_rng(3)
    times = np.linspace(0.0, 7.9, 80)
    commands = TimeSeries(times, generator.uniform(-0.8, 0.8, (80, 2)), ('forward', 'yaw'))
    runs = {period: rollout(plant, commands, 8.0, period, pose=Pose(1.0, 2.0, 0.5))
            for period in (0.001, 0.005, 0.01, 0.02, 0.05)}
    fine = runs[0.001].values[::100]
    assert fine.shape == (81, 15)
    assert np.ptp(fine[:, 11]) > 0.2  # it went somewhere
    for period, run in runs.items():
        np.testing.assert_allclose(run.values[::round(0.1 / period)], fine, rtol=0, atol=1e-9,
                                   err_msg=str(period))


def test_clamped_voltages_do_not_depend_on_the_period(robot: Maker) -> None:
    plant = robot()
    commands = TimeSeries(np.array([0.0, 1.0]), np.array([[2.0, 1.0], [-2.0, 3.0]]),
                          ('forward', 'yaw'))
    coarse, fine = (rollout(plant, commands, 2.0, period) for period in (0.05, 0.005))
    assert np.abs(coarse.column('voltage_left')).max() == 24.0
    np.testing.assert_allclose(coarse.values, fine.values[::10], rtol=0, atol=1e-9)


@pytest.mark.parametrize('effects', [(), ('speed_loop',), ('belt_compliance',)])
def test_linear_plants_agree_with_scipy(robot: Maker, effects: tuple[str, ...]) -> None:
    """All columns and the pose; a speed loop is linear while it does not clip."""
    plant = robot(*effects)
    expected = Equations(plant).solve(1e-10, 1e-12)
    np.testing.assert_allclose(columns(plant, 0.02), expected, rtol=0, atol=2e-9)


@pytest.mark.parametrize('effect', [
    'rolling_resistance', 'quadratic_drag', 'yaw_scrub_coulomb', 'yaw_scrub_speed', 'slope',
    'torque_ripple', 'coulomb_drivetrain', 'battery_sag', 'traction_saturation'])
def test_efforts_agree_with_scipy(robot: Maker, effect: str) -> None:
    """At any period: speeds and rates to 2e-6 [m/s, rad/s], the pose to 3e-6 [m, rad]."""
    plant = robot(effect)
    expected = Equations(plant).solve(1e-8, 1e-10)
    for period in (0.02, 0.0025):
        error = np.abs(columns(plant, period) - expected).max(axis=0)
        assert error[:4].max() < 2e-6
        assert error[9:].max() < 3e-6
    # The effect itself is far larger than the error it is computed with.
    linear = columns(robot(), 0.02)
    assert np.abs(linear - expected)[:, :4].max() > 1e-3


@pytest.mark.parametrize(('effect', 'values'), [
    ('battery_droop', {'droop_rate': 0.02}),
    ('voltage_saturation', {'clip_voltage': 8.0}),
    (Effect('voltage_saturation', shape='soft'), {'clip_voltage': 8.0}),
    (Effect('driver_deadband', shape='zone'), {'dead_voltage': 2.0}),
    (Effect('driver_deadband', shape='band'), {'dead_voltage': 6.0}),
    (Effect('driver_deadband', shape='soft'), {'dead_voltage': 3.0}),
])
def test_efforts_of_the_voltage_alone_are_as_exact_as_the_linear_plant(
        robot: Maker, effect: str | Effect, values: dict[str, float]) -> None:
    plant = robot(effect, **values)
    assert np.abs(columns(plant, 0.02) - columns(robot(), 0.02))[:, :4].max() > 0.01
    np.testing.assert_allclose(columns(plant, 0.02), Equations(plant).solve(1e-9, 1e-11),
                               rtol=0, atol=2e-8)


@pytest.mark.parametrize(('effect', 'value'), [('current_limit', 2.0), ('motor_heating', 0.005)])
def test_efforts_in_the_fast_modes_are_followed_at_any_period(
        robot: Maker, effect: str, value: float) -> None:
    """
    Both live on the milliseconds after a jump of the voltage, far shorter than a period.

    A current limit undoes the back-EMF (some 0.1 m/s for a moment); heat counts the inrush.
    """
    name = {'current_limit': 'current_limit', 'motor_heating': 'heating_rate'}[effect]
    plant = robot(effect, **{name: value})
    expected = Equations(plant).solve(1e-8, 1e-10)
    for period in (0.02, 0.01, 0.0025, 0.000625):
        assert np.abs(columns(plant, period) - expected)[:, 2:4].max() < 5e-6
