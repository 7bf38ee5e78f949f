# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Efforts that are one function of the same arguments are evaluated once, to the same effect."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from lg_husky_sim.husky.effects import catalogue, Effect
from lg_husky_sim.husky.laws import Law
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.simulation.merging import merged
import lg_husky_sim.simulation.modes as modes
from lg_husky_sim.simulation.simulator import Simulator
import numpy as np
import pytest

Maker = Callable[..., Plant]
#: Driving and scrubbing share the adhesion of each wheel.
TYRES = Effect('traction_saturation', shape='circle')
#: Forward speed [m/s] and yaw rate [rad/s] of three seconds of hard turning, at 50 Hz.
DRIVE = np.repeat([[0.8, 0.9], [-0.5, 0.6], [0.0, -0.9]], 50, axis=0)


def test_tyres_of_one_side_slip_alike(robot: Maker) -> None:
    plant = robot(TYRES)
    circles = [int(np.sum(one.laws == Law.FRICTION_CIRCLE))
               for one in (plant.sets[0], merged(plant.sets[0]))]
    assert circles == [8, 4], 'along and across, of four wheels and of two sides'


@pytest.mark.parametrize('name', sorted(catalogue()))
def test_the_drive_is_the_same(robot: Maker, monkeypatch: pytest.MonkeyPatch,
                               name: str) -> None:
    plant = robot(TYRES, *([] if name == TYRES.id else [name]))
    simulator = Simulator(plant, 0.02)
    _, one = simulator.run(simulator.initial(), DRIVE)
    monkeypatch.setattr(modes, 'merged', lambda same: same)
    apart = Simulator(plant, 0.02)
    _, other = apart.run(apart.initial(), DRIVE)
    np.testing.assert_allclose(one, other, rtol=1e-8, atol=1e-9)


def test_efforts_that_remember_or_differ_stay_apart(robot: Maker) -> None:
    one = robot(TYRES).sets[0]
    heating = replace(one, laws=np.full_like(one.laws, int(Law.HEATING)))
    assert merged(heating) is heating
    stiffer = np.array(one.coefficients)
    stiffer[:, 0] *= 1.0 + 1e-9 * np.arange(one.laws.size)
    differing = replace(one, coefficients=stiffer)
    assert merged(differing) is differing
