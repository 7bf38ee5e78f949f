# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The base's wheel-speed loop: what it follows, how fast, and what it does against a loss."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation import Simulator
import numpy as np
import pytest

Maker = Callable[..., Plant]
T = 0.044488 * 78.71
VOLTS = 24.0 * 0.8961
LEFT, RIGHT, SPEED, V_LEFT = 0, 1, 2, 13


def driven(plant: Plant, *commands: tuple[float, float], seconds: float = 6.0) -> FloatArray:
    """Hold each command and return the kernel's columns at 50 Hz."""
    simulator = Simulator(plant, 0.02)
    held = np.repeat(np.array(commands), round(seconds * 50), axis=0)
    return simulator.run(simulator.initial(), held)[1]


@pytest.mark.parametrize('command', [(0.5, 0.0), (0.0, 0.4), (0.4, -0.3), (-0.5, 0.2)])
def test_wheels_come_to_the_reference(robot: Maker, command: tuple[float, float]) -> None:
    """Also where the open loop does not: turning, and against rolling resistance."""
    wanted = VOLTS / T * (command[0] + 0.541 * np.array([-1.0, 1.0]) * command[1])
    for effects in ((), ('rolling_resistance',), ('viscous_asymmetry',)):
        out = driven(robot('speed_loop', *effects), command)
        assert out[-1, :2] == pytest.approx(wanted, rel=1e-3, abs=1e-3), effects
    if command[1]:
        assert driven(robot(), command)[-1, :2] != pytest.approx(wanted, rel=1e-2, abs=1e-2)


def test_the_wheels_follow_with_the_given_lag(robot: Maker) -> None:
    """A stiff loop makes the wheels a first-order follower."""
    for lag in (0.1, 0.3):
        out = driven(robot('speed_loop', loop_lag=lag, loop_gain=4.0, loop_integral=10.0),
                     (0.5, 0.0), seconds=2.0)
        times = 0.02 * np.arange(1, 101)
        expected = VOLTS / T * 0.5 * (1.0 - np.exp(-times / lag))
        assert np.abs(out[:, LEFT] - expected).max() < 0.12 * expected[-1]


def test_more_gain_holds_the_reference_better(robot: Maker) -> None:
    def deviation(gain: float, integral: float) -> float:
        plant = robot('speed_loop', 'rolling_resistance', rolling_force=40.0, loop_gain=gain,
                      loop_integral=integral)
        return float(abs(driven(plant, (0.5, 0.0))[-1, LEFT] - VOLTS / T * 0.5))
    without = deviation(0.0, 0.0)
    assert without > 0.05
    assert 0.0 < deviation(4.0, 0.0) < 0.6 * without
    assert deviation(1.0, 4.0) < 1e-3


def test_a_stall_clips_at_the_supply_and_unwinds(robot: Maker) -> None:
    """
    Asked for more than the battery has, then for little: no long overshoot.

    The column of the voltage takes the clip from the predictor of the last sub-step, hence the
    margin; it vanishes with the step.
    """
    plant = robot('speed_loop', supply_voltage=12.0, command_gain=1.7922)
    out = driven(plant, (1.2, 0.0), (0.3, 0.0), seconds=4.0)
    assert np.abs(out[:, V_LEFT]).max() < 12.0 * 1.04
    fine = Simulator(plant, 0.0005)
    _, close = fine.run(fine.initial(), np.tile([1.2, 0.0], (1000, 1)))
    assert np.abs(close[:, V_LEFT]).max() < 12.0 * 1.002
    assert out[199, V_LEFT] == pytest.approx(12.0, abs=1e-3)
    wanted = VOLTS / T * 0.3
    assert out[-1, LEFT] == pytest.approx(wanted, rel=1e-3)
    late = out[200 + 75:, LEFT]  # 1.5 s after the change
    assert np.abs(late - wanted).max() < 0.1 * wanted


def test_what_is_fed_forward_is_a_share_of_the_back_emf(robot: Maker) -> None:
    """Without an integral the law alone says what is in balance: V = s T w_f + k (w_f - w)."""
    for share, gain in ((0.0, 2.0), (0.5, 0.5), (1.0, 1.0)):
        out = driven(robot('speed_loop', loop_lag=0.05, loop_gain=gain, loop_integral=0.0,
                           loop_forward_share=share), (0.4, 0.3))
        wanted = VOLTS / T * (0.4 + 0.541 * np.array([-1.0, 1.0]) * 0.3)
        volts = share * T * wanted + gain * (wanted - out[-1, :2])
        assert out[-1, V_LEFT:V_LEFT + 2] == pytest.approx(volts, rel=1e-3), share
    alone = driven(robot('speed_loop', loop_lag=0.01, loop_gain=1.1, loop_integral=14.0,
                         loop_forward_share=0.0), (0.4, 0.3))
    assert alone[-1, :2] == pytest.approx(wanted, rel=1e-3)
    assert alone[5, LEFT] < 0.7 * wanted[LEFT]


def test_the_loop_stands_still_at_rest(robot: Maker) -> None:
    out = driven(robot('speed_loop'), (0.0, 0.0), seconds=1.0)
    assert not np.any(out[:, :7])


def test_stable_over_the_bounds_of_its_gains(robot: Maker) -> None:
    for lag in (0.002, 0.05, 3.0):
        for gain in (0.0, 1.0, 4.0):
            for integral in (0.0, 4.0, 40.0):
                plant = robot('speed_loop', loop_lag=lag, loop_gain=gain, loop_integral=integral)
                poles = np.linalg.eigvals(plant.sets[0].a)
                assert poles.real.max() < 1e-9, (lag, gain, integral)
                out = driven(plant, (0.4, 0.2), seconds=4.0)
                assert np.abs(out[:, SPEED]).max() < 1.0, (lag, gain, integral)


def test_a_driver_that_clips_holds_its_voltage(robot: Maker) -> None:
    """The loop asks for more and more than the driver gives; the motor gets what it gives."""
    out = driven(robot('speed_loop', 'voltage_saturation', clip_voltage=12.0, loop_gain=0.5,
                       loop_integral=30.0), (1.0, 0.0))
    assert out[-1, V_LEFT] == pytest.approx(12.0, rel=1e-6)
    assert out[-1, LEFT] == pytest.approx(12.0 / T, rel=0.02)
