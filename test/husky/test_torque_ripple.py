# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A torque that ripples with the turn of a wheel: how often a turn, and on which side."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.simulation import rollout
import numpy as np

Maker = Callable[..., Plant]


def _driven(plant: Plant) -> TimeSeries:
    commands = TimeSeries(np.array([0.0]), np.array([[0.6, 0.0]]), ('forward', 'yaw'))
    return rollout(plant, commands, 8.0, 0.02)


def _harmonics(robot: Maker, effect: Effect, **numbers: float) -> dict[str, FloatArray]:
    """Return the first and second harmonic of each side's rate over the turn of the left wheel."""
    run, base = _driven(robot(effect, **numbers)), _driven(robot())
    steady = slice(200, None)
    angle = run.column('angle_left')[steady]
    found = {}
    for side in ('left', 'right'):
        extra = (run.column(f'wheel_{side}') - base.column(f'wheel_{side}'))[steady]
        found[side] = np.array([abs(np.mean((extra - extra.mean()) * np.exp(1j * turns * angle)))
                                for turns in (1, 2)])
    return found


def test_it_comes_once_a_turn_on_its_side(robot: Maker) -> None:
    found = _harmonics(robot, Effect('torque_ripple', 'left'), ripple_cos=3.0, ripple_sin=0.0)
    assert found['left'][0] > 5.0 * found['left'][1]
    assert found['left'][0] > 2.0 * found['right'][0]


def test_it_has_a_second_harmonic_where_it_is_told_one(robot: Maker) -> None:
    found = _harmonics(robot, Effect('torque_ripple', 'left', 'twice'), ripple_cos=0.0,
                       ripple_sin=0.0, ripple_cos_twice=3.0, ripple_sin_twice=0.0)
    assert found['left'][1] > 5.0 * found['left'][0]
    assert found['left'][1] > 2.0 * found['right'][1]
