# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Tyres that are low on air: smaller, and harder to roll, on one side."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.husky.effects import catalogue, Effect
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.simulation.events import trajectory
import numpy as np
import pytest

Maker = Callable[..., Plant]
P = dict(load_model().parameters.items())
DRAG = 8.0
ARM = {'left': 0.5 * P['track'], 'right': -0.5 * P['track']}


def settled(plant: Plant, forward: float, yaw: float = 0.0) -> FloatArray:
    """Return forward speed [m/s] and yaw rate [rad/s] 6 s after a command from rest."""
    command = TimeSeries(np.zeros(1), np.array([[forward, yaw]]), ('forward', 'yaw'))
    run = trajectory(plant, command, np.array([6.0]))
    return np.array([run.column('forward')[0], run.column('yaw_rate')[0]])


def soft(robot: Maker, side: str, drag: float = DRAG, radius: float = 0.0) -> Plant:
    return robot(Effect('wheel_radius_mismatch', side, 'soft'), radius_change=radius,
                 tyre_drag=drag)


def test_soft_forms_have_a_drag_and_firm_ones_have_none() -> None:
    kind = catalogue()['wheel_radius_mismatch']
    assert kind.shapes[0] == 'firm'
    for shape in kind.shapes:
        numbers = {p.name for p in Effect(kind.id, 'left', shape).parameters()}
        more = {'tyre_drag', 'tyre_drag_speed'} if shape.startswith('soft') else set()
        assert numbers == {'radius_change', *more}


@pytest.mark.parametrize('side', ['left', 'right'])
def test_of_a_contact_the_axle_feels_the_radius_squared(robot: Maker, side: str) -> None:
    """As a side whose tyres slip less by that factor does."""
    contact = robot(Effect('wheel_radius_mismatch', side, 'firm_contact'), radius_change=0.05)
    both = robot(Effect('wheel_radius_mismatch', side, 'firm'),
                 Effect('viscous_asymmetry', side, 'slip'), radius_change=0.05,
                 damping_change=1.05 ** 2 - 1.0)
    np.testing.assert_allclose(contact.sets[0].a, both.sets[0].a, rtol=1e-12)
    assert np.any(contact.sets[0].a != robot(
        Effect('wheel_radius_mismatch', side, 'firm'), radius_change=0.05).sets[0].a)


@pytest.mark.parametrize('side', ['left', 'right'])
def test_its_drag_is_a_force_and_a_moment_of_half_the_track(robot: Maker, side: str) -> None:
    """Ahead, as rolling resistance and a pull of that arm do: to the soft side."""
    expected = settled(robot('rolling_resistance', 'yaw_pull', rolling_force=DRAG,
                             pull_moment=ARM[side] * DRAG), 0.6)
    found = settled(soft(robot, side), 0.6)
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    assert found[1] * ARM[side] > 0.0


def test_back_it_drags_the_other_way(robot: Maker) -> None:
    plant = soft(robot, 'left')
    np.testing.assert_allclose(settled(plant, -0.6), -settled(plant, 0.6), rtol=1e-6)


def test_on_the_spot_it_pushes_the_base_where_the_other_side_goes(robot: Maker) -> None:
    """The left side goes back when the base turns to the left: its drag is ahead."""
    speed, rate = settled(soft(robot, 'left'), 0.0, 0.6)
    free = settled(robot(), 0.0, 0.6)
    assert speed > 1e-3
    assert 0.0 < rate < free[1]


@pytest.mark.parametrize('side', ['left', 'right'])
def test_without_drag_it_is_the_firm_form(robot: Maker, side: str) -> None:
    firm = robot(Effect('wheel_radius_mismatch', side, 'firm'), radius_change=-0.04)
    np.testing.assert_allclose(settled(soft(robot, side, 0.0, -0.04), 0.5, 0.3),
                               settled(firm, 0.5, 0.3), rtol=1e-9)
