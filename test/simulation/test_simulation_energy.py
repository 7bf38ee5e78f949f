# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Passivity: with no voltage, what is stored in the elements never grows."""

from __future__ import annotations

from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.laws import CONTEXT, evaluate, MEMORY
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation import Simulator
from lg_husky_sim.simulation.effort_kernel import SPEED_ERROR
import numpy as np
import pytest

LOSSES: tuple[tuple[Effect, ...], ...] = (
    (),
    (Effect('belt_compliance'),),
    (Effect('viscous_asymmetry', 'left', 'slip'),),
    (Effect('viscous_asymmetry', 'right', 'bearing'),),
    (Effect('wheel_radius_mismatch', 'left'),),
    (Effect('payload'),),
    (Effect('coulomb_drivetrain', 'left'),),
    (Effect('rolling_resistance'), Effect('yaw_scrub_coulomb'), Effect('quadratic_drag')),
    (Effect('yaw_scrub_speed'),),
    (Effect('traction_saturation'),),
    (Effect('traction_saturation', shape='circle'), Effect('payload', shape='ground')),
    (Effect('motor_heating'),),
    (Effect('belt_compliance'), Effect('coulomb_drivetrain', 'both'),
     Effect('traction_saturation')),
)
"""Effects that only take energy or store it; each tuple is put in together."""

STORES = {
    'omega(J_LW)': 'wheel_inertia', 'omega(J_RW)': 'wheel_inertia', 'v(M_H)': 'mass',
    'omega(J_H)': 'yaw_inertia', 'i(L_1)': 'motor_inductance', 'i(L_2)': 'motor_inductance',
}


def drawn(effects: tuple[Effect, ...], seed: int) -> tuple[Plant, Parameters]:
    """Return a plant with random parameters, up to a factor of four from the paper's."""
    generator = np.random.default_rng(seed)
    structure = Structure()
    for effect in effects:
        structure = structure.with_effect(effect)
    own = [p.parameter() for e in effects for p in e.parameters()]
    parameters = load_model().parameters.with_entries(*own)
    values = {name: float(np.clip(value * 4.0 ** generator.uniform(-1.0, 1.0),
                                  parameters.entry(name).lower, parameters.entry(name).upper))
              for name, value in parameters.items()}
    parameters = parameters.replacing(values)
    return compile_model(structure).at(parameters), parameters


def stored(plant: Plant, values: Parameters) -> FloatArray:
    """Return the weights e of the energy, sum(e x²) [J]."""
    weights = []
    for state in plant.states:
        if state in STORES:
            weight = values[STORES[state]]
            weight += values.get('payload_mass', 0.0) if state == 'v(M_H)' else 0.0
            weight += values.get('payload_inertia', 0.0) if state == 'omega(J_H)' else 0.0
        elif 'K_Belt' in state:
            weight = 1.0 / values['belt_stiffness']
        else:
            weight = values['wheel_inertia'] / 2.0  # of one axle
        weights.append(0.5 * weight)
    return np.array(weights)


def random_states(weights: FloatArray, count: int, seed: int) -> FloatArray:
    """Return states of 1 mJ to 1 kJ, in every direction."""
    generator = np.random.default_rng(seed)
    directions = generator.normal(size=(count, weights.size))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    energies = 10.0 ** generator.uniform(-3.0, 3.0, count)
    scaled: FloatArray = directions * np.sqrt(energies)[:, None] / np.sqrt(weights)
    return scaled


@pytest.mark.parametrize('effects', LOSSES, ids=lambda e: '+'.join(x.id for x in e) or 'nominal')
def test_power_into_the_stores_is_never_positive(effects: tuple[Effect, ...]) -> None:
    """Of the continuous equations: dE/dt = 2 x' W (A x + G f(H x)) at random states."""
    drained = 0
    for seed in range(12):
        plant, values = drawn(effects, seed)
        (one,) = plant.sets
        weights = stored(plant, values)
        for x in random_states(weights, 40, seed):
            f = np.zeros(one.laws.size)
            if f.size:
                evaluate(0, one.laws[None], one.coefficients[None],
                         one.offsets[None], one.h @ x, np.zeros(CONTEXT),
                         np.full(MEMORY, 5.0), f)
            flow = 2.0 * weights * x * (one.a @ x + one.g @ f)
            assert flow.sum() <= 1e-11 * np.abs(flow).sum()
            drained += flow.sum() < 0.0
    assert drained > 400


@pytest.mark.parametrize('effects', LOSSES, ids=lambda e: '+'.join(x.id for x in e) or 'nominal')
def test_steps_never_gain_energy(effects: tuple[Effect, ...]) -> None:
    """Of the stepping: from random motion, coasting on shorted motors at 20 ms."""
    generator = np.random.default_rng(0)
    for seed in range(6):
        plant, values = drawn(effects, seed)
        weights = stored(plant, values)
        simulator = Simulator(plant, 0.02, fine_pose=False)
        state = simulator.initial()
        flat = np.array(state.flat)
        flat[:state.n] = random_states(weights, 1, seed)[0] * generator.uniform(0.1, 1.0)
        energies = [float(weights @ flat[:state.n] ** 2)]
        for _ in range(30):
            simulator_state = type(state)(flat, state.row, state.states)
            after, _ = simulator.run(simulator_state, np.zeros((1, 2)))
            flat = np.array(after.flat)
            energies.append(float(weights @ flat[:state.n] ** 2))
        # At rest dry friction holds the speeds no better than to the error of a step.
        resting = float(np.sum(weights)) * SPEED_ERROR ** 2
        assert np.all(np.diff(energies) <= 1e-12 * energies[0] + resting), energies
        assert energies[-1] < 0.9 * energies[0]


def test_the_check_can_fail() -> None:
    """A scrub that falls with speed feeds the robot, and the same sum says so."""
    parameters = load_model().parameters
    effect = Effect('yaw_scrub_speed')
    own = [p.parameter(-40.0) for p in effect.parameters()]
    values = parameters.with_entries(*own)
    (one,) = compile_model(Structure(effects=(effect,))).at(values).sets
    weights = np.array([0.08, 0.08, 48.39, 3.0556, 0.22e-3, 0.22e-3]) / 2.0
    x = np.array([0.0, 0.0, 2.0, 1.0, 0.0, 0.0])
    f = np.zeros(1)
    evaluate(0, one.laws[None], one.coefficients[None],
             one.offsets[None], one.h @ x, np.zeros(CONTEXT),
             np.zeros(MEMORY), f)
    assert f[0] == pytest.approx(80.0)
    turning = one.a[3, 3] + one.g[3, 0] * f[0]
    assert 2.0 * weights[3] * turning > 0.0
