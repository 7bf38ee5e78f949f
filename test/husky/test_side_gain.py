# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The same voltage may do a little more on one side than on the other."""

from __future__ import annotations

import math

from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.simulation.events import COLUMNS, trajectory
import numpy as np
import pytest


def driven(ratio: float, left: float, right: float, *effects: Effect) -> FloatArray:
    """Return what a robot does of which the sides get such voltages."""
    model = load_model()
    values = model.parameters
    volts = values['supply_voltage'] * values['command_gain']
    forward, yaw = 0.5 * (left + right) / volts, (
        0.5 * (right - left) / (volts * values['turn_ratio']))
    plant = compile_model(Structure(effects=effects)).at(
        values.replacing({'side_gain_ratio': ratio}))
    commands = TimeSeries(np.array([0.0]), np.array([[forward, yaw]]), ('forward', 'yaw'))
    return trajectory(plant, commands, [0.05, 0.4, 3.0]).values


def test_a_ratio_is_one_of_voltages() -> None:
    """The robot of ratio r does what the even one does with voltages that are r apart."""
    ratio = 1.04
    uneven, even = driven(ratio, 9.0, 8.0), driven(
        1.0, 9.0 * math.sqrt(ratio), 8.0 / math.sqrt(ratio))
    # The voltages that are sent are those before that.
    shared = [k for k, name in enumerate(COLUMNS) if not name.startswith('voltage')]
    np.testing.assert_allclose(uneven[:, shared], even[:, shared], rtol=1e-9, atol=1e-9)
    assert uneven[-1, COLUMNS.index('voltage_left')] == pytest.approx(9.0)
    turns = COLUMNS.index('heading')
    assert driven(ratio, 9.0, 9.0)[-1, turns] < -1e-3 < driven(1.0, 9.0, 9.0)[-1, turns]


def test_sides_change_places_with_the_ratio() -> None:
    there, back = driven(1.03, 7.0, 5.0), driven(1.0 / 1.03, 5.0, 7.0)
    left, right = COLUMNS.index('wheel_left'), COLUMNS.index('wheel_right')
    np.testing.assert_allclose(there[:, left], back[:, right], rtol=1e-9)
    np.testing.assert_allclose(there[:, COLUMNS.index('heading')],
                               -back[:, COLUMNS.index('heading')], rtol=1e-9)
