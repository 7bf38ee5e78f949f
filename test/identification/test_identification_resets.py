# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What depends on a wheel's angle acts where the wheel really was, and encoders do not jump."""

from __future__ import annotations

from dataclasses import replace

from lg_husky_sim.diagnosis.hypotheses.hypothesis import entries_of
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.identification.fit_segments import FitSegment, PERIOD
from lg_husky_sim.identification.segment_simulation import ANGLES, RESET, simulate_segment
from lg_husky_sim.signals import BodyTwist, FloatArray, TimeSeries
from lg_husky_sim.simulation.effort_kernel import WHEEL_ERROR
from lg_husky_sim.simulation.event_kernel import COLUMNS
from lg_husky_sim.simulation.simulator import Simulator
import numpy as np
import pytest

COUNT = 1200
STAMPS: FloatArray = PERIOD * np.arange(COUNT + 1, dtype=np.float64)
AFTER = round(RESET / PERIOD) + 1
RATE = COLUMNS.index('wheel_left')


def plant(torque: float) -> Plant:
    model, ripple = load_model(), Effect('torque_ripple', 'both')
    return compile_model(model.structure.with_effect(ripple)).at(model.parameters.with_entries(
        *entries_of(ripple, {'ripple_cos': torque, 'ripple_sin': 0.0})))


def simulated(torque: float, angles: FloatArray | None = None) -> FloatArray:
    commands = TimeSeries(np.array([0.0]), np.array([[0.6, 0.0]]), ('forward', 'yaw'))
    turned = None if angles is None else TimeSeries(STAMPS, angles, ('left', 'right'))
    segment = FitSegment('drive', 0, 0.0, COUNT, commands, (), None, BodyTwist(), (0.0, 0.0),
                         (0.0, 0.0), turned=turned)
    return simulate_segment(Simulator(plant(torque), PERIOD, fine_pose=False), segment)


def test_measured_angles_that_agree_change_nothing() -> None:
    free = simulated(2.0)
    held = simulated(2.0, free[:, ANGLES])
    assert held == pytest.approx(free, abs=1e-9)
    assert float(np.ptp(free[AFTER:, RATE])) > 0.1


def test_the_phase_follows_the_measured_wheel() -> None:
    free, smooth = simulated(2.0), simulated(0.0)
    elsewhere = free[:, ANGLES] + np.where(np.arange(COUNT + 1) > 0, np.pi, 0.0)[:, None]
    opposite = simulated(2.0, elsewhere)
    own = (free - smooth)[AFTER + 100:2 * AFTER, RATE]
    other = (opposite - smooth)[AFTER + 100:2 * AFTER, RATE]
    own, other = own - own.mean(), other - other.mean()
    assert float(np.corrcoef(own, other)[0, 1]) < -0.95


def test_the_encoder_goes_on_without_a_jump() -> None:
    angles = simulated(2.0)[:, ANGLES]
    elsewhere = angles + np.array([1.0, -2.0])
    elsewhere[0] = angles[0]
    moved = simulated(2.0, elsewhere)[:, ANGLES]
    assert float(np.max(np.abs(moved - angles))) > 1e-3
    steps = np.diff(moved, axis=0)
    assert float(np.max(np.abs(steps))) < 1.2 * float(np.max(np.abs(np.diff(angles, axis=0))))


def test_a_faulty_encoder_does_not_move_the_wheel() -> None:
    """What an encoder reads is turned back into the wheel's own angle."""
    model = load_model()
    ripple, scale = Effect('torque_ripple', 'both'), Effect('encoder_scale', 'left')
    structure = model.structure.with_effect(ripple).with_effect(scale)
    odd = compile_model(structure).at(model.parameters.with_entries(
        *entries_of(ripple, {'ripple_cos': 2.0, 'ripple_sin': 0.0}),
        *entries_of(scale, {'encoder_factor': 0.8})))
    assert odd.sets[0].sensors.encoder_left == pytest.approx(0.8)
    commands = TimeSeries(np.array([0.0, 3.0, 6.0]), np.array(
        [[0.6, 0.0], [-0.6, 0.0], [0.6, 0.0]]), ('forward', 'yaw'))
    segment = FitSegment('drive', 0, 0.0, COUNT, commands, (), None, BodyTwist(), (0.0, 0.0),
                         (0.0, 0.0))
    simulator = Simulator(odd, PERIOD, fine_pose=False)
    free = simulate_segment(simulator, segment)

    def held(factor: float, shift: float) -> FloatArray:
        read = free[:, ANGLES] * np.array([factor, 1.0])
        read[1:] += shift
        return simulate_segment(simulator, replace(segment, turned=TimeSeries(
            STAMPS, read, ('left', 'right'))))
    assert np.abs(held(0.8, 0.0) - free).max() < WHEEL_ERROR
    for wrong in (held(1.0, 0.0), held(0.8, 1.0)):
        assert float(np.max(np.abs(wrong - free)[:, RATE])) > 0.05
