# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Effects of battery, driver and motors act one behind the other, in a driver's order.

The reference is a driver written out here, around the plain robot's matrices: it shares neither
the laws nor what hands voltages on with the simulation.
"""

from __future__ import annotations

from collections.abc import Mapping
import itertools
import math

from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.linear_graph.nonlinear import RightHandSide
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.simulation.events import trajectory
from lg_husky_sim.testing.radau import NOISE
import numpy as np
import pytest
from scipy.integrate import solve_ivp

SIZES: dict[str, dict[str, float]] = {
    'driver_deadband': {'dead_voltage': 1.5},
    'voltage_saturation': {'clip_voltage': 8.0},
    'battery_droop': {'droop_rate': 0.04, 'droop_floor': 0.5},
    'battery_sag': {'bus_resistance': 0.8},
    'current_limit': {'current_limit': 4.0},
    'motor_heating': {'heating_rate': 0.001, 'cooling_time': 20.0},
}
"""Sizes at which each takes volts away in the drive below."""
FORMS = ('zone', 'band', 'soft')
"""Of the dead band; with the last one, limits are soft as well."""
LIMITS = ('voltage_saturation', 'current_limit')
PAIRS = [*itertools.combinations(SIZES, 2), tuple(SIZES)]
STAMPS = np.array([0.0, 0.31, 0.64, 0.98, 1.3, 1.71])
TWISTS = np.array([[0.5, 0.2], [0.1, 0.1], [-0.9, 0.6], [0.7, -0.5], [0.04, 0.06], [0.9, 0.9]])
TIMES = np.linspace(0.0, 2.1, 300)
COMMANDS = TimeSeries(STAMPS, TWISTS, ('forward', 'yaw'))


def structure_of(names: tuple[str, ...], form: str = 'zone', also: str = '') -> Structure:
    structure = Structure()
    for name in names:
        shaped = name == 'driver_deadband' or (name in LIMITS and form == 'soft')
        structure = structure.with_effect(Effect(name, shape=form if shaped else ''))
    return structure.with_effect(Effect(also)) if also else structure


def robot(structure: Structure) -> tuple[Plant, dict[str, float]]:
    own = [p.parameter() for e in structure.effects for p in e.parameters()]
    parameters = load_model().parameters.with_entries(*own)
    parameters = parameters.replacing({
        name: value for sizes in SIZES.values() for name, value in sizes.items()
        if name in parameters})
    return compile_model(structure).at(parameters), dict(parameters.items())


def limited(size: float, limit: float, form: str) -> float:
    """Return a size that a limit holds back."""
    if form == 'soft' and math.isfinite(limit):
        return float(size / (1.0 + (size / limit) ** 3) ** (1.0 / 3.0))
    return min(size, limit)


def winding_voltages(asked: FloatArray, rates: FloatArray, currents: FloatArray,
                     heat: FloatArray, time: float, p: Mapping[str, float], form: str
                     ) -> FloatArray:
    """Return what a driver gives a cold winding of each motor [V], asked for voltages."""
    duty = np.array(asked)
    dead = p.get('dead_voltage', 0.0)
    for side, volts in enumerate(asked):
        size = abs(volts)
        if dead and form == 'zone':
            size = max(size - dead, 0.0)
        elif dead and form == 'band':
            size *= 0.5 * (1.0 + math.tanh((size - dead) / p['dead_edge']))
        elif dead:
            size *= 1.0 - math.exp(-(size / dead) ** 2)
        duty[side] = math.copysign(limited(size, p.get('clip_voltage', math.inf), form), volts)
    duty /= p['supply_voltage']
    lost = min(p.get('droop_rate', 0.0) * time, p.get('droop_floor', 0.0))
    bus = p['supply_voltage'] * (1.0 - lost) - p.get('bus_resistance', 0.0) * (duty @ currents)
    ohms = p['motor_resistance'] + p.get('heating_rate', 0.0) * heat
    back = p['torque_constant'] * p['gear_ratio'] * rates
    # A limit that holds the current: as far from the back-EMF as the warm winding lets it be.
    given = duty * bus
    if 'current_limit' in p:
        warm = (ohms - p['motor_resistance']) * currents
        room = p['motor_resistance'] * p['current_limit']
        free = given - back - warm
        given = back + warm + np.array([math.copysign(limited(abs(one), room, form), one)
                                        for one in free])
    return np.asarray(given - (ohms - p['motor_resistance']) * currents)


def reference(p: Mapping[str, float], form: str) -> TimeSeries:
    """Integrate the plain robot behind that driver in steps that no kink slips through."""
    plain = compile_model(Structure()).at(load_model().parameters)
    one, n = plain.sets[0], len(plain.states)
    currents = [plain.states.index(f'i(L_{number})') for number in (1, 2)]
    stage = one.command

    def rates(time: float, s: FloatArray, asked: FloatArray) -> FloatArray:
        heat = s[n + 3:]
        y = one.rows[:4] @ s[:n]
        volts = winding_voltages(asked, y[:2], s[currents], heat, time, p, form)
        return np.concatenate([
            one.a @ s[:n] + one.b @ volts,
            [y[2] * math.cos(s[n + 2]), y[2] * math.sin(s[n + 2]), y[3]],
            s[currents] ** 2 - heat / p.get('cooling_time', 1.0)])

    s, seen = np.zeros(n + 5), [np.zeros(n + 5)]
    for twist, begin, end in zip(TWISTS, STAMPS, [*STAMPS[1:], TIMES[-1]], strict=True):
        turn = stage.volts_per_rate * twist[1]
        asked = np.clip(stage.volts_per_speed * twist[0] + np.array([-turn, turn]),
                        -p['supply_voltage'], p['supply_voltage'])
        inside = [time for time in TIMES if begin < time <= end]
        found = solve_ivp(rates, (begin, end), s, 'DOP853', np.unique([*inside, end]),
                          args=(asked,), rtol=1e-8, atol=1e-10, max_step=1e-3)
        seen.extend(found.y[:, :len(inside)].T)
        s = found.y[:, -1]
    states = np.array(seen)
    y = states[:, :n] @ one.rows[:4].T
    return TimeSeries(TIMES, np.column_stack([y[:, 0], y[:, 1], y[:, 3], states[:, n:n + 3]]),
                      tuple(NOISE))


@pytest.mark.parametrize('names', PAIRS, ids='-'.join)
def test_a_series_is_simulated_as_a_driver_is_built(names: tuple[str, ...]) -> None:
    """To a hundredth of the noise of each sensor; adding up errs by many times the noise."""
    form = FORMS[PAIRS.index(names) % len(FORMS)]
    plant, values = robot(structure_of(names, form))
    seen, expected = trajectory(plant, COMMANDS, TIMES), reference(values, form)
    for name, noise in NOISE.items():
        np.testing.assert_allclose(
            seen.column(name), expected.column(name), rtol=0.0, atol=0.01 * noise,
            err_msg=f'{names} {form}: {name}')


@pytest.mark.parametrize('names', PAIRS, ids='-'.join)
def test_the_order_of_naming_means_nothing(names: tuple[str, ...]) -> None:
    one, other = (trajectory(robot(structure_of(order))[0], COMMANDS, TIMES)
                  for order in (names, names[::-1]))
    np.testing.assert_array_equal(one.values, other.values)


@pytest.mark.parametrize('also', ['', 'coulomb_drivetrain'])
@pytest.mark.parametrize('names', PAIRS, ids='-'.join)
def test_the_graph_says_what_is_simulated(names: tuple[str, ...], also: str) -> None:
    """The laws that a graph is derived and exported with hand on the same voltages."""
    structure = structure_of(names, also=also)
    plant, values = robot(structure)
    one = plant.sets[0]
    draws = np.random.default_rng(5)
    graph = RightHandSide(structure.network().graph, values | {'time': 0.9, 'heat': 7.0})
    from lg_husky_sim.husky.laws import CONTEXT, evaluate, MEMORY
    context, memory = np.zeros(CONTEXT), np.zeros(MEMORY)
    context[0], memory[:2] = 0.9, 7.0
    for _ in range(20):
        x, u = draws.normal(scale=3.0, size=len(plant.states)), draws.uniform(-12.0, 12.0, 2)
        out = np.zeros(one.laws.size)
        evaluate(0, one.laws[None], one.coefficients[None], one.offsets[None],
                 one.h @ x + one.k @ u, context, memory, out)
        said = graph.efforts(x, u)
        for own in ('E_', '_1'), ('E_', '_2'), ('T_', 'L'), ('T_', 'R'):
            rows = [j for j, name in enumerate(graph.space.efforts)
                    if name.startswith(own[0]) and name.endswith(own[1])]
            assert out[rows].sum() == pytest.approx(said[rows].sum(), rel=1e-11, abs=1e-11)


def test_a_dead_band_gets_what_a_speed_loop_gives_not_what_it_asks_for() -> None:
    """What a loop asks for beyond the supply passes no band: it is never given."""
    from lg_husky_sim.husky.laws import CEILING, Law
    for form in FORMS:
        plant, values = robot(structure_of(('driver_deadband',), form, also='speed_loop'))
        one = plant.sets[0]
        driver = one.laws != Law.CLIP
        assert driver.sum() == 2
        np.testing.assert_array_equal(one.coefficients[driver, CEILING],
                                      values['supply_voltage'])
