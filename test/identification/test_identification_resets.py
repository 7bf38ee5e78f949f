# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What depends on a wheel's angle acts where the wheel really was, and encoders do not jump."""

from __future__ import annotations

from dataclasses import replace

from lg_husky_sim.diagnosis.candidates import effect_entries
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.identification.piece_simulation import ANGLES, RESET, simulate_piece
from lg_husky_sim.identification.pieces import PERIOD, Piece
from lg_husky_sim.signals import BodyTwist, FloatArray, TimeSeries
from lg_husky_sim.simulation.kernel import COLUMNS
from lg_husky_sim.simulation.simulator import Simulator
import numpy as np
import pytest

COUNT = 1200
AFTER = round(RESET / PERIOD) + 1
RATE = COLUMNS.index('wheel_left')


def plant(torque: float) -> Plant:
    model, ripple = load_model(), Effect('torque_ripple', 'both')
    return compile_model(model.structure.with_effect(ripple)).at(model.parameters.with_entries(
        *effect_entries(ripple, {'ripple_cos': torque, 'ripple_sin': 0.0})))


def simulated(torque: float, angles: FloatArray | None = None) -> FloatArray:
    commands = TimeSeries(np.array([0.0]), np.array([[0.6, 0.0]]), ('forward', 'yaw'))
    turned = None if angles is None else TimeSeries(
        PERIOD * np.arange(COUNT + 1), angles, ('left', 'right'))
    piece = Piece('drive', 0, 0.0, COUNT, commands, (), None, BodyTwist(), (0.0, 0.0),
                  (0.0, 0.0), turned=turned)
    return simulate_piece(Simulator(plant(torque), PERIOD, fine_pose=False), piece)


def test_measured_angles_that_agree_change_nothing() -> None:
    free = simulated(2.0)
    held = simulated(2.0, free[:, ANGLES])
    assert held == pytest.approx(free, abs=1e-9)
    assert float(np.ptp(free[AFTER:, RATE])) > 0.1


def test_the_phase_follows_the_measured_wheel() -> None:
    free, smooth = simulated(2.0), simulated(0.0)
    opposite = simulated(2.0, free[:, ANGLES] + np.pi)
    own = (free - smooth)[AFTER + 100:2 * AFTER, RATE]
    other = (opposite - smooth)[AFTER + 100:2 * AFTER, RATE]
    own, other = own - own.mean(), other - other.mean()
    assert float(np.corrcoef(own, other)[0, 1]) < -0.95


def test_the_encoder_goes_on_without_a_jump() -> None:
    angles = simulated(2.0)[:, ANGLES]
    steps = np.diff(simulated(2.0, angles + np.array([1.0, -2.0]))[:, ANGLES], axis=0)
    assert float(np.max(np.abs(steps))) < 1.2 * float(np.max(np.abs(np.diff(angles, axis=0))))


def test_the_play_of_a_gear_is_no_angle_of_the_wheel() -> None:
    """An encoder that is ahead by the play says where the wheel is all the same."""
    model, play = load_model(), Effect('gear_backlash')
    loose = compile_model(model.structure.with_effect(play)).at(
        model.parameters.with_entries(*effect_entries(play, {'play': 0.2})))
    stamps = np.array([0.0, 3.0, 6.0])
    commands = TimeSeries(stamps, np.array([[0.6, 0.0], [-0.6, 0.0], [0.6, 0.0]]),
                          ('forward', 'yaw'))
    piece = Piece('drive', 0, 0.0, COUNT, commands, (), None, BodyTwist(), (0.0, 0.0),
                  (0.0, 0.0))
    simulator = Simulator(loose, PERIOD, fine_pose=False)
    free = simulate_piece(simulator, piece)
    held = simulate_piece(simulator, replace(piece, turned=TimeSeries(
        PERIOD * np.arange(COUNT + 1), free[:, ANGLES], ('left', 'right'))))
    assert held == pytest.approx(free, abs=1e-9)
