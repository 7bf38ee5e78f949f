# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Where this package departs from the printed paper, one test for each row of README's table."""

from __future__ import annotations

import math

from lg_husky_sim.husky.effects import catalogue, Effect
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.network import simplified
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.identification.paper import paper
from lg_husky_sim.signals import BodyTwist, Pose, TimeSeries
from lg_husky_sim.simulation import rollout, Simulator, SimulatorState
import numpy as np
import pytest


def husky(*effects: str, **changed: float) -> Plant:
    model = load_model()
    structure = Structure(effects=tuple(Effect(name) for name in effects))
    added = [parameter.parameter() for effect in structure.effects
             for parameter in effect.parameters()]
    parameters = model.parameters.with_entries(*added).replacing(changed)
    return compile_model(structure).at(parameters)


def settled(plant: Plant, forward: float, yaw: float) -> SimulatorState:
    """Hold a command until everything is steady."""
    simulator = Simulator(plant, 0.02)
    state = simulator.initial()
    for _ in range(1000):
        state = simulator.step(state, BodyTwist(forward, yaw))
    return state


def test_positive_yaw_turns_left() -> None:
    """Eqs. (24), (25) print the signs the other way."""
    state = settled(husky(), 0.0, 0.5)
    left, right = state.voltages
    assert left == pytest.approx(-right)
    assert left < 0.0 < right
    assert state.twist.yaw > 0.0
    assert state.pose.heading > 0.0


def test_bounds_of_the_search_are_in_order() -> None:
    """Table II exchanges its labels Upper and Lower."""
    for name, entry in paper().search.items():
        assert entry.lower < entry.result < entry.upper, name


def test_dampings_are_torque_per_rate() -> None:
    """The paper prints rad/(N·m·s)."""
    parameters = load_model().parameters
    for name in ('wheel_damping', 'yaw_damping'):
        assert parameters.entry(name).unit == 'N·m·s/rad'
        assert paper().search[name].unit == 'N·m·s/rad'


def test_dimensions_that_the_paper_omits_give_unit_gains() -> None:
    """Clearpath's wheel radius and track make the paper's own fit follow its command."""
    straight, turning = settled(husky(), 1.0, 0.0), settled(husky(), 0.0, 1.0)
    assert straight.twist.forward == pytest.approx(1.01401, abs=5e-6)
    assert turning.twist.yaw == pytest.approx(1.00759, abs=5e-6)
    assert turning.currents == pytest.approx((-1.0707, 1.0707), abs=5e-5)
    wheels = settled(husky(track=0.555), 0.0, 1.0)
    kinematic = 0.1651 * (wheels.wheel_rates[1] - wheels.wheel_rates[0]) / 0.555
    assert kinematic / wheels.twist.yaw == pytest.approx(1.8747, abs=5e-5)


def test_voltages_stop_at_the_battery() -> None:
    """Command (1, 1) asks one side for 33.1 V."""
    parameters = load_model().parameters
    asked = parameters['supply_voltage'] * parameters['command_gain'] * (
        1.0 + parameters['turn_ratio'])
    assert asked == pytest.approx(33.1, abs=0.05)
    assert settled(husky(), 1.0, 1.0).voltages[1] == 24.0


def test_straight_driving_costs_nothing_until_a_loss_is_added() -> None:
    """The printed graph has no loss to ground; rolling resistance is the first missing one."""
    assert max(map(abs, settled(husky(), 0.8, 0.0).currents)) < 1e-9
    lossy = settled(husky('rolling_resistance', rolling_force=20.0), 0.8, 0.0)
    assert min(lossy.currents) > 0.1


def test_only_the_ratio_of_the_dampings_shows_in_a_steady_turn() -> None:
    """Five printed digits of B and B_H each are not information."""
    def multiplier(**changed: float) -> float:
        """Return the yaw rate of wheels that do not slip over the true one."""
        state = settled(husky(**changed), 0.3, 0.4)
        left, right = state.wheel_rates
        return 0.1651 * (right - left) / 0.5708 / state.twist.yaw

    expected = 1.0 + 12.865 * 0.1651 ** 2 / (4.0 * 1.3016 * (0.5708 / 2.0) ** 2)
    assert multiplier() == pytest.approx(expected, rel=1e-9)
    both = multiplier(wheel_damping=2.0 * 1.3016, yaw_damping=2.0 * 12.865)
    assert both == pytest.approx(expected, rel=1e-9)
    assert multiplier(yaw_damping=2.0 * 12.865) > 1.4 * expected


def test_printed_inertias_are_kept_and_their_sources_say_what_differs() -> None:
    parameters = load_model().parameters
    assert parameters['wheel_inertia'] == 0.08 < 2 * 0.0441
    assert (parameters['mass'], parameters['yaw_inertia']) == (48.39, 3.0556)
    for name, other in (('wheel_inertia', '0.0882'), ('mass', '56.58'), ('yaw_inertia', '3.6')):
        assert other in parameters.entry(name).source, name


def test_a_base_that_closes_a_speed_loop_is_in_the_catalogue() -> None:
    """Measured Huskys show dead time and a lag where the paper drives with open-loop voltage."""
    assert {'speed_loop', 'command_latency', 'command_slew', 'command_limit'} <= set(catalogue())
    commands = TimeSeries(np.array([0.0, 4.0]), np.array([[0.5, 0.0], [0.5, 0.0]]),
                          ('forward', 'yaw'))
    delayed = husky('command_latency', latency=0.2)
    plain, late = (rollout(plant, commands, 4.0).column('forward')
                   for plant in (husky(), delayed))
    np.testing.assert_allclose(late[10:], plain[:-10], atol=1e-9)


def test_pose_is_the_exact_integral_of_the_twist() -> None:
    """The paper leaves the rule open; any step gives the same circle."""
    ends = []
    for period in (0.005, 0.05):
        simulator = Simulator(husky(), period)
        state = simulator.initial(Pose(1.0, 2.0, 0.3), BodyTwist(0.5, 0.4))
        for _ in range(round(6.0 / period)):
            state = simulator.step(state, BodyTwist(0.5, 0.4))
        ends.append((state.pose.x, state.pose.y, state.pose.heading))
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-9)
    state = settled(husky(), 0.5, 0.4)
    simulator = Simulator(husky(), 0.02)
    after = simulator.step(state, BodyTwist(0.5, 0.4))
    speed, rate, heading = state.twist.forward, state.twist.yaw, state.pose.heading
    turned = heading + rate * 0.02
    assert after.pose.x - state.pose.x == pytest.approx(
        speed / rate * (math.sin(turned) - math.sin(heading)), abs=1e-12)
    assert after.pose.y - state.pose.y == pytest.approx(
        speed / rate * (math.cos(heading) - math.cos(turned)), abs=1e-12)


def test_each_element_has_one_name() -> None:
    """The paper mixes J_L with J_LW, B_LW with B_FL, and two meanings of J_RL."""
    names = [branch.name for branch in simplified().branches]
    assert len(names) == len(set(names))
    assert {'J_LW', 'J_RW', 'B_FL', 'B_RL', 'B_FR', 'B_RR', 'M_H', 'J_H', 'B_H'} <= set(names)


def test_turn_ratio_is_a_parameter_with_the_papers_value() -> None:
    """0.5351 would follow from Clearpath's ROS 1 configuration (1.875 x 0.5708 / 2)."""
    entry = load_model().parameters.entry('turn_ratio')
    assert entry.value == 0.541
    assert entry.lower < 1.875 * 0.5708 / 2 < entry.upper
    assert '0.535' in entry.source
