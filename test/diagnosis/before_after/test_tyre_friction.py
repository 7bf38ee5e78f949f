# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The friction of the base's tyres, sliding in any direction, against Coulomb's law by hand."""

from __future__ import annotations

from collections.abc import Callable

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
#: Sliding speed over grip at which a tyre saturates [m/s].
EDGE = 0.05


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


def braked(speed: float, shape: float) -> float:
    """Return the deceleration, over the most there is, of locked wheels at a speed [m/s]."""
    base = base_of(settings(), load_model().parameters)
    values = dict(zip(base.names, base.values(base.start), strict=True))
    values |= {'grip_along': GRIP[0], 'stiffness_ratio': 1.0, 'creep_speed': EDGE,
               'creep_share': 1e-4, 'creep_shape': shape, 'deflection': 1e-8, 'rolling': 0.0,
               'com_height': 0.0}
    step, count = 1e-6, 40
    out = np.empty((count + 1, len(OUTPUTS), 1))
    simulate(np.array([[values[name]] for name in ROBOT]), base.fixed, step,
             np.zeros((count, 2, 1)), np.zeros((count, 2)), np.zeros((count + 1, 2, 1)), True,
             np.array([[speed], [0.0], [0.0], [0.0], [0.0]]), (0,), out)
    lost = float(out[-2, 0, 0] - out[-1, 0, 0]) / step
    return float(lost / (GRIP[0] * base.settings.simulation['gravity']))


@pytest.mark.parametrize('speed', [0.005, 0.02, 0.05, 0.2, 2.0])
@pytest.mark.parametrize(('shape', 'law', 'within'), [
    (0.0, lambda s: s / (s + 1.0), 0.005),
    (1.3, np.tanh, 0.06),
    (1.0, lambda s: s * (s + 1.0) / (s * s + s + 1.0), 0.005)])
def test_a_tyre_saturates_as_sharply_as_its_shape_says(
        speed: float, shape: float, law: Callable[[float], float], within: float) -> None:
    """What slides s in parts of the edge pushes, over grip in parts of it, by these laws."""
    slid = speed / (GRIP[0] * EDGE)
    assert braked(speed, shape) == pytest.approx(law(slid), abs=within)


def test_beyond_the_shape_of_tanh_the_force_has_a_peak() -> None:
    peak, far = braked(3.0 * GRIP[0] * EDGE, 1.8), braked(200.0 * GRIP[0] * EDGE, 1.8)
    assert peak > 1.1
    assert far == pytest.approx(1.0, abs=0.02)


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
