# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Poles, gains, currents and the wheel-to-yaw multiplier of the paper's parameters."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import BodyTwist, FloatArray
from lg_husky_sim.simulation import Simulator, SimulatorState
import numpy as np
import pytest

Maker = Callable[..., Plant]

# Tables I and II, and Clearpath's wheel radius and half track.
R, L, T = 0.46, 0.22e-3, 0.044488 * 78.71
J, M, J_H = 0.08, 48.39, 3.0556
B, B_H, GAIN = 1.3016, 12.865, 0.8961
RADIUS, HALF = 0.1651, 0.5708 / 2.0


def half(lever: float, inertia: float, loss: float) -> FloatArray:
    """Return A of one of the two 3-state systems (wheel, body, current) of a symmetric robot."""
    slip = 2.0 * B * np.array([1.0, -lever])
    return np.array([
        [-slip[0] / J, -slip[1] / J, T / J],
        [2.0 * lever * slip[0] / inertia, (2.0 * lever * slip[1] - loss) / inertia, 0.0],
        [-T / L, 0.0, -R / L]])


STRAIGHT = half(1.0 / RADIUS, M, 0.0)
TURN = half(HALF / RADIUS, J_H, B_H)


def settled(plant: Plant, forward: float, yaw: float) -> SimulatorState:
    simulator = Simulator(plant, 0.02)
    state, _ = simulator.run(simulator.initial(), np.tile([forward, yaw], (800, 1)))
    return state


def test_poles(robot: Maker) -> None:
    poles = np.sort(np.linalg.eigvals(robot().sets[0].a))
    assert np.all(poles.imag == 0.0)
    typed = np.sort(np.concatenate([np.linalg.eigvals(STRAIGHT), np.linalg.eigvals(TURN)]).real)
    np.testing.assert_allclose(poles.real, typed, rtol=1e-9)
    printed = [-1663.81, -1663.80, -460.11, -459.99, -8.8395, -3.5931]
    assert [round(p, d) for p, d in zip(poles.real, (2, 2, 2, 2, 4, 4), strict=True)] == printed


def test_straight_gain(robot: Maker) -> None:
    state = settled(robot(), 1.0, 0.0)
    assert state.twist.forward == pytest.approx(24.0 * GAIN * RADIUS / T, rel=1e-10)
    assert round(state.twist.forward, 5) == 1.01401
    assert state.twist.yaw == pytest.approx(0.0, abs=1e-12)
    assert state.currents == pytest.approx((0.0, 0.0), abs=1e-9)
    assert state.wheel_rates == pytest.approx((state.twist.forward / RADIUS,) * 2, rel=1e-10)


def test_turning_gain_and_currents(robot: Maker) -> None:
    state = settled(robot(), 0.0, 1.0)
    rate, turn, current = np.linalg.solve(
        -TURN, np.array([0.0, 0.0, 24.0 * GAIN * 0.541 / L]))
    assert state.twist.yaw == pytest.approx(turn, rel=1e-10)
    assert round(state.twist.yaw, 5) == 1.00759
    assert state.currents == pytest.approx((-current, current), rel=1e-9)
    assert round(state.currents[1], 4) == 1.0707
    assert state.wheel_rates == pytest.approx((-rate, rate), rel=1e-10)
    assert state.twist.forward == pytest.approx(0.0, abs=1e-12)


def test_wheel_to_yaw_multiplier(robot: Maker) -> None:
    """At any speed: 1 + B_H r² / (4 B c²), Clearpath's controller uses 1.875."""
    for half_track, printed in ((HALF, None), (0.555 / 2.0, 1.8747)):
        expected = 1.0 + B_H * RADIUS ** 2 / (4.0 * B * half_track ** 2)
        for command in ((0.0, 1.0), (0.4, -0.3)):
            state = settled(robot(track=2.0 * half_track), *command)
            left, right = state.wheel_rates
            rolled = RADIUS * (right - left) / (2.0 * half_track)
            assert rolled / state.twist.yaw == pytest.approx(expected, rel=1e-9)
        if printed is not None:
            assert round(expected, 4) == printed


def test_step_response_is_the_closed_form(robot: Maker) -> None:
    """Sums of three exponentials of the typed 3-state systems, from rest."""
    simulator = Simulator(robot(), 0.02)
    _, out = simulator.run(simulator.initial(), np.tile([0.5, 0.2], (50, 1)))
    times = 0.02 * np.arange(1, 51)
    for matrix, column, volts in ((STRAIGHT, 2, 24.0 * GAIN * 0.5),
                                  (TURN, 3, 24.0 * GAIN * 0.541 * 0.2)):
        rates, modes = np.linalg.eig(matrix)
        steady = np.linalg.solve(-matrix, np.array([0.0, 0.0, volts / L]))
        shares = np.linalg.solve(modes, -steady)
        expected = steady[1] + (modes[1] * shares) @ np.exp(np.outer(rates, times))
        np.testing.assert_allclose(out[:, column], expected.real, atol=1e-11)


def test_a_zero_command_at_rest_stays_exactly_at_rest(robot: Maker) -> None:
    simulator = Simulator(robot(), 0.02)
    state = simulator.step(simulator.initial(), BodyTwist(0.0, 0.0))
    assert not np.any(state.row)
