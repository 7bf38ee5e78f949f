# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The hidden robots obey physics: the paper's numbers, an independent solver, energy."""

from __future__ import annotations

from lg_husky_sim.proof import plain, world
from lg_husky_sim.proof.dynamics import brush, derivative, N_STATES
from lg_husky_sim.proof.integrate import COLUMNS, Gate, integrate, STEP
import numpy as np
from numpy.typing import NDArray
import pytest

Vector = NDArray[np.float64]
CALM = np.zeros((2, 5))


def voltages(forward: float, yaw: float, seconds: float) -> Vector:
    volts = world.NOMINAL_SUPPLY * world.COMMAND_GAIN
    pair = [volts * (forward - world.TURN_RATIO * yaw), volts * (forward + world.TURN_RATIO * yaw)]
    return np.tile(pair, (round(seconds / STEP), 1))


def motion(demand: Vector, **changes: float) -> dict[str, Vector]:
    vector = world.vector({**world.nominal(), **changes})
    table = integrate(vector, vector, Gate(), demand, CALM)
    return {name: table[:, k] for k, name in enumerate(COLUMNS)}


def test_the_paper_s_speeds_and_currents_come_out() -> None:
    ahead = motion(voltages(1.0, 0.0, 6.0))
    assert ahead['forward'][-1] == pytest.approx(1.01401, abs=1e-5)
    assert ahead['current_left'][-1] == pytest.approx(0.0, abs=1e-6)
    turning = motion(voltages(0.0, 1.0, 6.0))
    assert turning['yaw_rate'][-1] == pytest.approx(1.00759, abs=1e-5)
    assert turning['current_right'][-1] == pytest.approx(1.0707, abs=1e-4)
    assert turning['current_left'][-1] == pytest.approx(-1.0707, abs=1e-4)


def test_the_linear_rival_has_the_paper_s_poles() -> None:
    a, _ = plain.matrices(1.3016, 12.8650)
    poles = np.sort(np.linalg.eigvals(a).real)
    assert poles == pytest.approx(
        [-1663.81, -1663.80, -460.11, -459.99, -8.8395, -3.5931], rel=2e-5)


def test_with_everything_extra_off_it_is_the_linear_model() -> None:
    from scipy.linalg import expm
    demand = voltages(0.0, 0.8, 1.0)
    a, b = plain.matrices(1.3016, 12.8650)
    exact = expm(np.block([[a, b], [np.zeros((2, 8))]]))
    expected = exact[:6, 6:] @ demand[0]
    found = motion(np.vstack([demand, demand[:4]]))
    rows = [found[name][500] for name in ('wheel_left', 'wheel_right', 'forward', 'yaw_rate',
                                          'current_left', 'current_right')]
    assert found['time'][500] == pytest.approx(1.0)
    assert rows == pytest.approx(expected, abs=2e-6)


@pytest.mark.parametrize('changes', [
    {}, {'belt_stiffness': 12.0}, {'drag': 60.0, 'force_limit': 20.0},
    {'tyre': 1.0, 'creep': 700.0}, {'battery_resistance': 0.3, 'heating': 1e-3},
])
def test_runge_kutta_agrees_with_an_implicit_solver(changes: dict[str, float]) -> None:
    from scipy.integrate import solve_ivp
    vector = world.vector({**world.nominal(), 'lateral': 4000.0, **changes})
    demand = voltages(0.5, 0.6, 0.5)

    def right(time: float, state: Vector) -> Vector:
        slope, extra = np.zeros(N_STATES), np.zeros(5)
        derivative(time, np.ascontiguousarray(state), vector, demand[0, 0], demand[0, 1],
                   np.zeros(5), slope, extra)
        return slope

    reference = solve_ivp(right, (0.0, 0.4), np.zeros(N_STATES), method='Radau', rtol=1e-8,
                          atol=1e-10)
    table = integrate(vector, vector, Gate(), demand, CALM)
    row = table[200]
    assert row[0] == pytest.approx(0.4)
    assert row[1:4] == pytest.approx(reference.y[0:3, -1], abs=2e-4)
    assert row[4:7] == pytest.approx(reference.y[3:6, -1], abs=1e-4)
    assert row[7:9] == pytest.approx(reference.y[6:8, -1], abs=2e-3)


@pytest.mark.parametrize('changes', [
    {}, {'friction_left': 5.0}, {'scrub': 4.0, 'rolling': 40.0}, {'drag': 80.0},
    {'viscous_right': 2.0}, {'force_limit': 12.0}, {'tyre': 1.0, 'creep': 700.0},
    {'scrub_speed': 20.0}, {'centre_forward': 0.12},
])
def test_without_voltage_kinetic_energy_only_falls(changes: dict[str, float]) -> None:
    demand = voltages(0.8, 0.7, 2.0)
    demand[demand.shape[0] // 2:] = 0.0
    found = motion(demand, **changes)
    f = {**world.nominal(), **changes}
    inertia = f['inertia_motor'] + f['inertia_rear'] + f['inertia_front']
    lateral = found['lateral'] + f['centre_forward'] * found['yaw_rate']
    energy = 0.5 * (f['mass'] * (found['forward'] ** 2 + lateral ** 2)
                    + f['yaw_inertia'] * found['yaw_rate'] ** 2
                    + inertia * (found['wheel_left'] ** 2 + found['wheel_right'] ** 2)
                    + f['inductance'] * (found['current_left'] ** 2
                                         + found['current_right'] ** 2))
    coasting = energy[found['time'] > 1.01]
    assert coasting[0] > 1.0
    # What is left is the energy that bristles of the friction give back when they relax.
    assert np.diff(coasting).max() < 5e-4 * coasting[0]
    assert coasting[-1] < 0.2 * coasting[0]


def test_dry_friction_sticks_below_its_level_and_slides_above() -> None:
    stuck = motion(np.full((4000, 2), 0.5), friction_left=6.0, friction_right=6.0)
    assert abs(stuck['angle_left'][-1]) < 0.02
    sliding = motion(np.full((10000, 2), 6.0), friction_left=6.0, friction_right=6.0)
    lost = 6.0 - world.nominal()['torque_constant'] * sliding['wheel_left'][-1]
    volts = 6.0 * world.nominal()['resistance'] / world.nominal()['torque_constant']
    assert lost == pytest.approx(volts, rel=0.01)


def test_a_brush_tyre_is_linear_at_first_and_never_exceeds_adhesion() -> None:
    assert brush(0.01, 50.0) == pytest.approx(0.01, rel=1e-3)
    forces = [brush(float(force), 50.0) for force in np.linspace(0.0, 500.0, 200)]
    assert np.all(np.diff(forces) >= 0.0)
    assert max(forces) == pytest.approx(50.0)
    assert brush(-500.0, 50.0) == -50.0


def test_an_unknown_field_is_refused() -> None:
    with pytest.raises(KeyError, match='colour'):
        world.vector({**world.nominal(), 'colour': 1.0})
    assert len(world.FIELDS) == world.LOOP_PERIOD + 1


def test_a_robot_that_explodes_is_an_error() -> None:
    with pytest.raises(FloatingPointError, match='left its bounds'):
        motion(voltages(1.0, 0.0, 1.0), creep=1e7)
