# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Free play of the gears: what turns without load, and what an encoder sees of it."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import Pose, TimeSeries
from lg_husky_sim.simulation import rollout
import numpy as np
import pytest
from scipy.linalg import expm

Maker = Callable[..., Plant]


def driven(plant: Plant, *commands: tuple[float, float], each: float = 1.0) -> TimeSeries:
    """Hold each command for ``each`` seconds, from rest."""
    series = TimeSeries(each * np.arange(len(commands), dtype=np.float64), np.array(commands),
                        ('forward', 'yaw'))
    return rollout(plant, series, each * len(commands), 0.02, pose=Pose(0.0, 0.0, 0.2))


def test_encoders_run_ahead_of_the_wheels_within_the_play(robot: Maker) -> None:
    """They sit on the motors: half the play ahead when driving, half behind when reversing."""
    radius = load_model().parameters['wheel_radius']
    commands = ((0.6, 0.0),) * 4 + ((-0.6, 0.0),) * 4
    play = 0.4
    both = [driven(robot('gear_backlash', play=play), *commands), driven(robot(), *commands)]
    ahead, free = ([run.column('angle_left')[at] - run.column('distance')[at] / radius
                    for at in (190, 390)] for run in both)
    assert ahead[0] - free[0] == pytest.approx(0.5 * play, rel=0.05)
    assert ahead[1] - free[1] == pytest.approx(-0.5 * play, rel=0.05)
    # A motor that nothing holds back turns at the speed whose back-EMF is its voltage.
    p = load_model().parameters
    unloaded = both[0].column('voltage_left')[10] / (p['torque_constant'] * p['gear_ratio'])
    assert max(both[0].column('wheel_left')[:10]) == pytest.approx(unloaded, rel=0.01)
    assert max(both[0].column('wheel_left')[:10]) < 1.0001 * unloaded
    assert max(both[1].column('wheel_left')[:10]) < 0.96 * unloaded


@pytest.mark.parametrize('share', [0.2, 0.8])
def test_a_motor_in_play_turns_its_own_inertia_only(robot: Maker, share: float) -> None:
    """A step of the voltage: winding and rotor by hand; the robot stands until teeth meet."""
    p = load_model().parameters
    constant = p['torque_constant'] * p['gear_ratio']
    plants = [robot(Effect('gear_backlash', shape=shape), play=2.0, rotor_share=share)
              for shape in ('motor', 'wheel')]
    on_motor, on_wheel = (driven(plant, (0.6, 0.0), each=0.2) for plant in plants)
    volts = on_motor.column('voltage_left')[5]
    a = np.array([[-p['motor_resistance'], -constant, volts], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    a[0] /= p['motor_inductance']
    a[1, 0] = constant / (share * p['wheel_inertia'])
    by_hand = [(expm(a * t) @ [0.0, 0.0, 1.0])[1] for t in on_motor.times]
    assert by_hand[-1] > 1.0
    assert on_motor.column('angle_left')[-1] < 1.0
    np.testing.assert_allclose(on_motor.column('wheel_left'), by_hand, rtol=0, atol=2e-4)
    np.testing.assert_allclose(on_motor.column('forward'), 0.0, rtol=0, atol=1e-4)
    # What the teeth's spring says and the play takes cancels but for the errors of the steps.
    np.testing.assert_allclose(on_wheel.column('wheel_left'), 0.0, rtol=0, atol=1e-3)


@pytest.mark.parametrize('shape', ['motor', 'wheel'])
def test_a_limit_holds_the_current_of_a_motor_in_play(robot: Maker, shape: str) -> None:
    """Its back-EMF is that of the rotor: what the wheels do does not count until teeth meet."""
    plant = robot(Effect('gear_backlash', shape=shape), 'current_limit', play=0.3,
                  current_limit=4.0)
    commands = TimeSeries(np.array([0.0, 1.5]), np.array([[0.8, 0.0], [-0.8, 0.0]]),
                          ('forward', 'yaw'))
    run = rollout(plant, commands, 1.6, 0.005)
    crossing = (run.times > 1.504) & (run.times < 1.521)
    assert np.sum(crossing) == 4
    np.testing.assert_allclose(run.column('current_left')[crossing], -4.0, atol=0.01)
