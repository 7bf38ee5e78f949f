# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The friction of the base's tyres, sliding in any direction, against Coulomb's law by hand."""

from __future__ import annotations

from lg_husky_sim.diagnosis.before_after.base import base_of
from lg_husky_sim.diagnosis.before_after.base_names import OUTPUTS, ROBOT
from lg_husky_sim.diagnosis.before_after.base_robot import simulate
from lg_husky_sim.diagnosis.before_after.settings import settings
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.signals import FloatArray
import numpy as np
import pytest

STEP = 0.001
GRIP = np.array([0.8, 0.5])


def sliding(angle: float, ratio: float) -> FloatArray:
    """Return the deceleration over gravity of a base that slides with locked wheels."""
    base = base_of(settings(), load_model().parameters)
    values = dict(zip(base.names, base.values(base.start), strict=True))
    values |= {'grip_along': GRIP[0], 'grip_across': GRIP[1], 'stiffness_ratio': ratio,
               'creep_speed': 1e-3, 'creep_share': 1e-4, 'deflection': 1e-3, 'rolling': 0.0,
               'com_height': 0.0}
    count = 60
    out = np.empty((count + 1, len(OUTPUTS), 1))
    start = np.array([[100.0 * np.cos(angle)], [100.0 * np.sin(angle)], [0.0], [0.0], [0.0]])
    simulate(np.array([[values[name]] for name in ROBOT]), base.fixed, STEP,
             np.zeros((count, 2, 1)), np.zeros((count, 2)), np.zeros((count + 1, 2, 1)), True,
             start, (0,), out)
    lost = -np.diff(out[30:, :2, 0], axis=0).mean(axis=0) / STEP
    return np.asarray(lost / base.settings.simulation['gravity'])


@pytest.mark.parametrize('angle', [0.2, 0.8, 1.3])
def test_friction_of_equal_stiffness_points_against_the_sliding(angle: float) -> None:
    """With Coulomb's two coefficients its size is then that of the ellipse in this direction."""
    direction = np.array([np.cos(angle), np.sin(angle)])
    size = 1.0 / np.hypot(*(direction / GRIP))
    assert sliding(angle, 1.0) == pytest.approx(size * direction, rel=0.02)


@pytest.mark.parametrize('angle', [0.2, 0.8, 1.3])
def test_friction_that_dissipates_the_most_is_that_of_an_elliptic_cone(angle: float) -> None:
    """Of the forces inside the ellipse, F = μ² v / |μ v| takes the most power from the motion."""
    direction = np.array([np.cos(angle), np.sin(angle)])
    expected = GRIP ** 2 * direction / np.hypot(*(GRIP * direction))
    assert sliding(angle, (GRIP[0] / GRIP[1]) ** 2) == pytest.approx(expected, rel=0.02)
