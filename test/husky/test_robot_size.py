# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What is typical of a robot of another size."""

from __future__ import annotations

from dataclasses import replace

from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.robot_size import HUSKY, RobotSize, size_of
import pytest

ROBOT = RobotSize(2.0, 4.0, 3.0)


@pytest.mark.parametrize(('unit', 'factor'), [
    ('kg', 2.0), ('N', 2.0), ('N·m', 8.0), ('kg·m²', 32.0), ('N·m·s/rad', 16.0), ('N·m/rad', 8.0),
    ('N·s²/m²', 0.5), ('N·s²/rad', 8.0), ('V', 3.0), ('V·s/rad', 6.0), ('A', 4.0 / 3.0),
    ('Ω', 9.0 / 4.0), ('H', 9.0 / 2.0), ('m', 4.0)])
def test_a_number_is_in_proportion_by_the_dimensions_of_its_unit(unit: str, factor: float) -> None:
    """With one gravity, a power is mass times length to the power of a half."""
    assert ROBOT.factor(unit) == pytest.approx(factor, rel=1e-12)


@pytest.mark.parametrize('unit', ['1', 's', '1/s', 'rad', 'rad/s', 'rad/s²', 'm/s', 'm/s²', ''])
def test_how_a_robot_is_driven_says_nothing_of_its_size(unit: str) -> None:
    assert ROBOT.factor(unit) == 1.0


def test_the_husky_is_as_large_as_itself() -> None:
    model = load_model()
    assert size_of(model.parameters, model.parameters) == HUSKY
    structure = model.in_proportion().structure
    for effect in (Effect('payload'), Effect('battery_sag'), Effect('coulomb_drivetrain', 'left')):
        assert structure.with_effect(effect).effects[-1].parameters() == effect.parameters()


def test_a_heavy_robot_carries_heavy_loads_and_a_light_one_feels_small_ones() -> None:
    model = load_model()
    for times in (0.1, 6.0):
        own = replace(model, parameters=model.parameters.replacing({
            'mass': times * model.parameters['mass']}))
        found = own.in_proportion().structure.with_effect(Effect('payload')).effects[-1]
        here, there = found.parameters()[0], Effect('payload').parameters()[0]
        assert here.negligible == pytest.approx(times * there.negligible)
        assert here.starts == pytest.approx([times * start for start in there.starts])
        assert (here.lower, here.upper) == pytest.approx(
            (times * there.lower, times * there.upper))
