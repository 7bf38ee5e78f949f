# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The hidden robots obey physics: the paper's numbers, an independent solver, energy."""

from __future__ import annotations

from lg_husky_sim.proof import plain, world
from lg_husky_sim.proof.commands import CommandPath, demanded
from lg_husky_sim.proof.dynamics import derivative, N_STATES
from lg_husky_sim.proof.integrate import (
    COARSE,
    COLUMNS,
    Floor,
    Gate,
    integrate,
    smooth_floor,
    STEP,
)
from lg_husky_sim.proof.laws import adhesion, dry, shaft_loss
import numpy as np
from numpy.typing import NDArray
import pytest

Vector = NDArray[np.float64]


def motion(commands: list[tuple[float, float, float]], seconds: float, step: float = STEP,
           floor: Floor | None = None,
           changes: dict[str, float] | None = None) -> dict[str, Vector]:
    """Drive commands (time, forward, yaw) with a robot that differs by `changes`."""
    fields = {**world.nominal(), **(changes or {})}
    rows = np.array(commands)
    vector = world.vector(fields)
    table = integrate(vector, vector, Gate(), rows[:, 0],
                      demanded(rows[:, 1:], CommandPath(), fields), floor or smooth_floor(),
                      seconds, step=step)
    return {name: table[:, k] for k, name in enumerate(COLUMNS)}


def test_the_paper_s_speeds_and_currents_come_out() -> None:
    ahead = motion([(0.0, 1.0, 0.0)], 6.0)
    assert ahead['forward'][-1] == pytest.approx(1.01401, abs=1e-5)
    assert ahead['current_left'][-1] == pytest.approx(0.0, abs=1e-6)
    turning = motion([(0.0, 0.0, 1.0)], 6.0)
    assert turning['yaw_rate'][-1] == pytest.approx(1.00759, abs=1e-5)
    assert turning['current_right'][-1] == pytest.approx(1.0707, abs=1e-4)
    assert turning['current_left'][-1] == pytest.approx(-1.0707, abs=1e-4)


def test_the_linear_rival_has_the_paper_s_poles() -> None:
    a, _ = plain.matrices(1.3016, 12.8650)
    poles = np.sort(np.linalg.eigvals(a).real)
    assert poles == pytest.approx(
        [-1663.81, -1663.80, -460.11, -459.99, -8.8395, -3.5931], rel=2e-5)


@pytest.mark.parametrize('start', [0.0, 0.01234567, 0.0999])
def test_commands_take_effect_at_their_very_time(start: float) -> None:
    """A step that begins anywhere gives what the linear model gives after the same time."""
    from scipy.linalg import expm
    a, b = plain.matrices(1.3016, 12.8650)
    found = motion([(0.0, 0.0, 0.0), (start, 0.0, 0.8)], 1.2)
    gone = 1.0 - start
    exact = expm(np.block([[a, b], [np.zeros((2, 8))]]) * gone)
    volts = 24.0 * 0.8961 * 0.541 * 0.8
    expected = exact[:6, 6:] @ np.array([-volts, volts])
    assert found['time'][1000] == pytest.approx(1.0)
    assert [found[name][1000] for name in (
        'wheel_left', 'wheel_right', 'forward', 'yaw_rate', 'current_left', 'current_right')] \
        == pytest.approx(expected, abs=2e-6)


@pytest.mark.parametrize('changes', [
    {}, {'belt_stiffness': 12.0}, {'drag': 60.0, 'force_limit': 20.0, 'form_force': 3.0},
    {'tyre': 1.0}, {'battery_resistance': 0.3, 'heating': 1e-3, 'magnet_loss': 0.05},
    {'current_limit': 9.0, 'form_current': 1.0, 'droop_depth': 0.2, 'droop_time': 0.3},
])
def test_runge_kutta_agrees_with_an_implicit_solver(changes: dict[str, float]) -> None:
    from scipy.integrate import solve_ivp
    fields = {**world.nominal(), 'lateral': 4000.0, **changes}
    vector = world.vector(fields)
    volts = demanded(np.array([[0.5, 0.6]]), CommandPath(), fields)[0]

    def right(time: float, state: Vector) -> Vector:
        slope, extra = np.zeros(N_STATES), np.zeros(5)
        derivative(time, np.ascontiguousarray(state), vector, volts[0], volts[1],
                   np.zeros(5), np.zeros(3), slope, extra)
        return slope

    reference = solve_ivp(right, (0.0, 0.4), np.zeros(N_STATES), method='Radau', rtol=1e-8,
                          atol=1e-10)
    found = motion([(0.0, 0.5, 0.6)], 0.5, changes={**changes, 'lateral': 4000.0})
    rows = np.array([found[name][400] for name in COLUMNS])
    assert rows[0] == pytest.approx(0.4)
    assert rows[1:4] == pytest.approx(reference.y[0:3, -1], abs=2e-5)
    assert rows[4:7] == pytest.approx(reference.y[3:6, -1], abs=2e-5)
    assert rows[7:9] == pytest.approx(reference.y[10:12, -1], abs=2e-4)


def test_a_coarser_step_changes_nothing_that_a_sensor_sees() -> None:
    drives = [(0.0, 0.9, 0.0), (1.0, 0.3, 0.8), (2.0, -0.5, -0.4)]
    fine, coarse = motion(drives, 3.0), motion(drives, 3.0, step=COARSE)
    for name, size in (('wheel_left', 1e-3), ('yaw_rate', 1e-5), ('x', 1e-6)):
        assert np.abs(fine[name] - coarse[name]).max() < size


@pytest.mark.parametrize('changes', [
    {}, {'friction_left': 5.0}, {'scrub': 4.0, 'rolling': 40.0}, {'drag': 80.0},
    {'friction_right': 3.0, 'form_friction': 2.0, 'stribeck_ratio': 1.5},
    {'scrub': 4.0, 'rolling': 30.0, 'form_dry': 3.0}, {'rolling_left': 20.0},
    {'viscous_right': 2.0}, {'force_limit': 12.0}, {'tyre': 1.0}, {'lateral': 8e4},
    {'scrub_speed': 20.0}, {'centre_forward': 0.12},
])
def test_without_voltage_kinetic_energy_only_falls(changes: dict[str, float]) -> None:
    found = motion([(0.0, 0.7, 0.5), (1.0, 0.0, 0.0)], 2.0, changes=changes)
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
    # The remaining residual is the energy that bristles of the friction give back when they relax.
    assert np.diff(coasting).max() < 5e-4 * coasting[0]
    assert coasting[-1] < 0.2 * coasting[0]


@pytest.mark.parametrize('form', range(5))
def test_a_tyre_is_linear_at_first_and_never_exceeds_adhesion(form: int) -> None:
    assert adhesion(0.01, 50.0, form) == pytest.approx(0.01, rel=2e-3)
    forces = np.array([adhesion(float(force), 50.0, form) for force in np.linspace(0., 3e3, 999)])
    assert forces.max() <= 50.0 + 1e-9
    assert forces.max() > 45.0
    assert adhesion(-70.0, 50.0, form) == -adhesion(70.0, 50.0, form)
    if form == 3:
        assert forces[-1] < 0.95 * forces.max(), 'this one peaks and falls'
    else:
        assert np.all(np.diff(forces) >= 0.0)
    assert adhesion(70.0, 1e9, form) == 70.0


@pytest.mark.parametrize('form', range(4))
def test_dry_friction_reaches_its_level_in_every_form(form: int) -> None:
    fields = {**world.nominal(), 'form_friction': float(form), 'friction_width': 0.03}
    assert shaft_loss(4.0, 1.0, 5.0, 0.0, world.vector(fields)) == pytest.approx(5.0, rel=0.02)
    assert shaft_loss(0.0, 0.0, 5.0, 0.0, world.vector(fields)) == 0.0
    assert dry(1.0, 1.0, form) == pytest.approx(1.0, rel=0.01)
    assert dry(-1.0, -1.0, form) == -dry(1.0, 1.0, form)


def test_dry_friction_sticks_below_its_level_and_slides_above() -> None:
    push = 0.5 / (24.0 * 0.8961)
    dry_shafts = {'friction_left': 6.0, 'friction_right': 6.0}
    stuck = motion([(0.0, push, 0.0)], 2.0, changes=dry_shafts)
    assert abs(stuck['angle_left'][-1]) < 0.02
    sliding = motion([(0.0, 12.0 * push, 0.0)], 5.0, changes=dry_shafts)
    f = world.nominal()
    lost = 6.0 - f['torque_constant'] * sliding['wheel_left'][-1]
    assert lost == pytest.approx(6.0 * f['resistance'] / f['torque_constant'], rel=0.01)


def test_a_rough_floor_is_felt_while_driving_and_not_at_rest() -> None:
    rough = np.zeros((600, 5))
    rough[:, 2] = 30.0
    felt = motion([(0.0, 0.0, 0.0), (1.0, 0.8, 0.0)], 3.0, floor=Floor(rough, np.zeros((0, 7))))
    calm = motion([(0.0, 0.0, 0.0), (1.0, 0.8, 0.0)], 3.0)
    gap = np.abs(felt['forward'] - calm['forward'])
    assert gap[:990].max() == 0.0
    assert gap[1500:].max() > 0.01
    waves = np.array([[3.0, 0.0, 0.4, 20.0, 0.0, 0.0, 0.0]])
    wavy = motion([(0.0, 0.8, 0.0)], 3.0, floor=Floor(np.zeros((1, 5)), waves))
    again = motion([(0.5, 0.8, 0.0)], 3.5, floor=Floor(np.zeros((1, 5)), waves))
    assert again['forward'][500:] == pytest.approx(wavy['forward'], abs=1e-9), 'bound to places'


def test_an_unknown_field_is_refused() -> None:
    with pytest.raises(KeyError, match='colour'):
        world.vector({**world.nominal(), 'colour': 1.0})
    assert len(world.fields()) == world.ROUGH_SPEED + 1
    for k, name in enumerate(world.fields()):
        assert getattr(world, name.upper()) == k


def test_a_robot_that_explodes_is_an_error() -> None:
    with pytest.raises(FloatingPointError, match='left its bounds'):
        motion([(0.0, 1.0, 0.0)], 1.0, changes={'creep': 1e8})
