# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Random commands, stamps, times and numbers against scipy's DOP853, for the whole catalogue."""

from __future__ import annotations

from lg_husky_sim.husky.effects import catalogue, Effect
from lg_husky_sim.husky.laws import Law
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.simulation.events import trajectory
from lg_husky_sim.testing.radau import NOISE, Reference
import numpy as np
import pytest

SENSORS = {name for name, kind in catalogue().items() if kind.subsystem.value == 'sensor'}
STOPS = (Law.STICTION,)
"""Laws whose memories have stops, which scipy does not know: they have tests of their own."""


def drawn(effect: Effect | None, seed: int) -> Plant:
    """Return the robot, every number drawn around its nominal or first size."""
    draws = np.random.default_rng(seed)
    structure = Structure() if effect is None else Structure().with_effect(effect)
    own = [p.parameter() for e in structure.effects for p in e.parameters()]
    parameters = load_model().parameters.with_entries(*own)
    values = {name: float(np.clip(value * draws.uniform(0.7, 1.4),
                                  parameters.entry(name).lower, parameters.entry(name).upper))
              for name, value in parameters.items()}
    return compile_model(structure).at(parameters.replacing(values))


EFFECTS = [Effect(name, side, shape) for name, kind in catalogue().items()
           if name not in SENSORS and not kind.needs_onset
           for side in kind.sides[:2] for shape in kind.shapes]
LAWS = {effect: set(drawn(effect, 0).sets[0].laws.tolist()) for effect in EFFECTS}
EFFORTS = [effect for effect, laws in LAWS.items() if laws and laws.isdisjoint(STOPS)]
LINEAR = [None, *(effect for effect, laws in LAWS.items() if not laws)]
"""A jump, a ramp and a clamp are events, and the rest of these equations is linear."""


def worst(plant: Plant, seed: int, rtol: float, atol: float) -> FloatArray:
    """Return the largest error of each channel over a random drive, in parts of its noise."""
    draws = np.random.default_rng(seed + 100)
    stamps = np.cumsum(draws.exponential(0.15, 8))
    commands = TimeSeries(stamps - stamps[0], draws.uniform(-0.9, 0.9, (8, 2)),
                          ('forward', 'yaw'))
    times = np.sort(draws.uniform(0.0, commands.times[-1] + 0.2, 60))
    expected = Reference(plant, rtol, atol, 'DOP853').trajectory(commands, times)
    seen = trajectory(plant, commands, times)
    assert np.ptp(expected.column('wheel_left')) > 1.0
    return np.array([np.abs(seen.column(name) - expected.column(name)).max() / noise
                     for name, noise in NOISE.items()])


@pytest.mark.parametrize('effect', EFFORTS,
                         ids=lambda e: f'{e.id}-{e.side}-{e.shape}')
def test_efforts_err_by_less_than_a_hundredth_of_the_noise(effect: Effect) -> None:
    assert worst(drawn(effect, 1), 1, 1e-8, 1e-10).max() < 0.01


@pytest.mark.parametrize('effect', LINEAR, ids=lambda e:
                         'nominal' if e is None else f'{e.id}-{e.side}-{e.shape}')
def test_the_linear_part_is_exact(effect: Effect | None) -> None:
    """To 1e-9 of what a wheel, the gyro and the heading show; x and y to 1e-8 m."""
    errors = worst(drawn(effect, 2), 2, 3e-13, 1e-15) * np.array(list(NOISE.values()))
    np.testing.assert_array_less(errors, [1e-8, 1e-8, 2e-9, 1e-8, 1e-8, 2e-9])


@pytest.mark.parametrize('limit', [13.02, 13.46, 15.08, 16.54])
def test_a_kink_is_noticed_wherever_in_a_step_it_is(limit: float) -> None:
    """At these limits a quarter of a step alone sees nothing of where the current is let go."""
    structure = Structure().with_effect(Effect('current_limit'))
    own = [p.parameter() for e in structure.effects for p in e.parameters()]
    plant = compile_model(structure).at(load_model().parameters.with_entries(*own).replacing(
        {'current_limit': limit}))
    commands = TimeSeries(np.zeros(1), np.array([[0.5, 0.0]]), ('forward', 'yaw'))
    times = np.linspace(0.0, 0.02, 81)
    expected = Reference(plant, 1e-9, 1e-11, 'DOP853').trajectory(commands, times)
    seen = trajectory(plant, commands, times)
    error = np.abs(seen.column('wheel_left') - expected.column('wheel_left')).max()
    assert error < 0.01 * NOISE['wheel_left']
