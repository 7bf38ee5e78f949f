# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The interpreter of laws against the expressions that the linear graph sees."""

from __future__ import annotations

import math

from lg_husky_sim.husky.laws import CONTEXT, evaluate, EXPRESSIONS, HELD, Law, MEMORY, WIDTH
from lg_husky_sim.linear_graph.expressions import compile_tuple, GLOBALS
from lg_husky_sim.signals import FloatArray
import numpy as np
import pytest

# Which coefficients and arguments each law takes.
COEFFICIENTS = {
    Law.COULOMB: 4, Law.QUADRATIC: 1, Law.WHILE_MOVING: 2, Law.MODULATED_DAMPING: 1,
    Law.HEADING: 2, Law.WHEEL_PHASE: 8, Law.SLIP_SATURATION: 2, Law.CURRENT_LIMIT: 3,
    Law.DEAD_ZONE: 1, Law.DEAD_BAND: 2, Law.SOFT_BAND: 1, Law.CLIP: 1, Law.BUS_SAG: 2,
    Law.DROOP: 2, Law.SOFT_CLIP: 1, Law.SOFT_CURRENT_LIMIT: 3,
    Law.HEATING: 3, Law.BACKLASH: 2, Law.FRICTION_CIRCLE: 3, Law.STICTION: 5,
    Law.YIELDING: 2,
}
ARGUMENTS = {Law.MODULATED_DAMPING: 2, Law.CURRENT_LIMIT: 2, Law.SOFT_CURRENT_LIMIT: 2,
             Law.BUS_SAG: 4, Law.BACKLASH: 2, Law.FRICTION_CIRCLE: 2, Law.STICTION: 2}
SIDED = (Law.WHEEL_PHASE, Law.HEATING, Law.STICTION)


def opcode(law: int, coefficients: FloatArray, z: FloatArray, context: FloatArray | None = None,
           memory: FloatArray | None = None, before: int = 0) -> float:
    """Evaluate one row of the interpreter, its arguments ``before`` places into z."""
    row = np.zeros((1, 1, WIDTH))
    row[0, 0, :len(coefficients)] = coefficients
    out = np.full(1, math.nan)
    evaluate(0, np.array([[law]]), row, np.array([[before]]),
             np.concatenate([np.full(before, 99.0), z]),
             np.zeros(CONTEXT) if context is None else context,
             np.zeros(MEMORY) if memory is None else memory, out)
    return float(out[0])


def expression(law: Law, coefficients: FloatArray, z: FloatArray, **signals: float) -> float:
    values = {f'p{i}': float(c) for i, c in enumerate(coefficients)}
    values |= {f'z{i + 1}': float(v) for i, v in enumerate(z)}
    (value,) = eval(compile_tuple((EXPRESSIONS[law],)), dict(GLOBALS), values | signals)
    return float(value)


def test_every_law_has_an_expression_and_is_tested() -> None:
    assert set(EXPRESSIONS) == set(Law)
    assert set(COEFFICIENTS) | {Law.TABLE} == set(Law)


@pytest.mark.parametrize('law', COEFFICIENTS)
def test_expression_and_opcode_agree(law: Law) -> None:
    generator = np.random.default_rng(int(law))
    values = []
    for _ in range(300):
        p = generator.uniform(0.05, 3.0, COEFFICIENTS[law])
        side = int(generator.integers(2))
        if law in SIDED:
            p[2] = side
        z = generator.normal(scale=2.0, size=ARGUMENTS.get(law, 1))
        context = np.abs(generator.normal(scale=3.0, size=CONTEXT))
        memory = generator.uniform(-1.0, 1.0, MEMORY)
        signals = {'time': context[0], 'heading': context[1], 'angle': context[4 + side],
                   'heat': memory[side], 'held': memory[HELD + side]}
        got = opcode(law, p, z, context, memory, before=int(generator.integers(3)))
        assert got == pytest.approx(expression(law, p, z, **signals), rel=1e-12, abs=1e-13)
        values.append(got)
    assert np.ptp(values) > 0.1


def test_friction_resists_and_is_odd() -> None:
    for law, p in ((Law.COULOMB, [2.0, 0.1, 0.3, 1.0]), (Law.QUADRATIC, [2.0])):
        for rate in (0.01, 0.5, 3.0):
            assert opcode(law, np.array(p), np.array([rate])) < 0.0
            assert opcode(law, np.array(p), np.array([-rate])) == -opcode(
                law, np.array(p), np.array([rate]))
    assert opcode(Law.COULOMB, np.array([2.0, 0.01, 0.0, 1.0]), np.array([1.0])) == (
        pytest.approx(-2.0))


def test_current_limit_holds_the_current() -> None:
    """With the added voltage, (V - T w)/R stays within the limit; inside it nothing is added."""
    limit, resistance, transmission = 5.0, 0.4, 3.5
    p = np.array([limit, resistance, transmission])
    for volts, rate in ((20.0, 0.0), (-24.0, 3.0), (3.0, 0.5), (0.0, 6.0)):
        added = opcode(Law.CURRENT_LIMIT, p, np.array([volts, rate]))
        free = (volts - transmission * rate) / resistance
        assert (volts + added - transmission * rate) / resistance == pytest.approx(
            max(-limit, min(limit, free)))
        assert (added == 0.0) == (abs(free) <= limit)


def test_a_soft_current_limit_comes_to_it_little_by_little() -> None:
    limit, resistance, transmission = 5.0, 0.4, 3.5
    p = np.array([limit, resistance, transmission])

    def current(free: float, rate: float) -> float:
        volts = resistance * free + transmission * rate
        added = opcode(Law.SOFT_CURRENT_LIMIT, p, np.array([volts, rate]))
        return (volts + added - transmission * rate) / resistance
    assert current(0.5, 3.0) == pytest.approx(0.5, rel=1e-3)
    assert current(-5.0, 1.0) == pytest.approx(-5.0 / 2.0 ** (1.0 / 3.0))
    assert current(500.0, -2.0) == pytest.approx(5.0, rel=1e-3)


def test_voltage_laws() -> None:
    def reached(law: Law, p: list[float], volts: float) -> float:
        return volts + opcode(law, np.array(p), np.array([volts]))
    for volts in (-20.0, -1.0, 0.0, 0.5, 3.0, 15.0):
        assert reached(Law.CLIP, [10.0], volts) == pytest.approx(max(-10.0, min(10.0, volts)))
        assert reached(Law.DEAD_ZONE, [2.0], volts) == pytest.approx(
            math.copysign(max(abs(volts) - 2.0, 0.0), volts))
        assert reached(Law.DEAD_BAND, [2.0, 0.05], volts) == pytest.approx(
            volts if abs(volts) > 2.0 else 0.0, abs=1e-12)
        assert reached(Law.SOFT_CLIP, [10.0], 100.0 * volts) == pytest.approx(
            math.copysign(10.0, volts) if volts else 0.0, rel=0.05)
        assert reached(Law.SOFT_CLIP, [10.0], 0.05 * volts) == pytest.approx(
            0.05 * volts, rel=4e-4)
    assert reached(Law.SOFT_CLIP, [10.0], -10.0) == pytest.approx(-10.0 / 2.0 ** (1.0 / 3.0))
    assert reached(Law.SOFT_BAND, [2.0], 2.0) == pytest.approx(2.0 - 2.0 / math.e)
    assert reached(Law.SOFT_BAND, [2.0], -15.0) == pytest.approx(-15.0)


def test_bus_sag_is_the_drop_of_what_both_bridges_draw() -> None:
    """Duty d = V/Vs draws d i of the bus: both bridges lose their duty's share of R I_bus."""
    supply, resistance = 24.0, 0.1
    left, right, i_left, i_right = 12.0, -6.0, 4.0, -3.0
    bus = (left * i_left + right * i_right) / supply
    added = opcode(Law.BUS_SAG, np.array([resistance, supply]),
                   np.array([left, right, i_left, i_right]))
    assert added == pytest.approx(-left / supply * resistance * bus)


def test_droop_stops_at_its_floor_and_starts_at_zero() -> None:
    p, z = np.array([0.01, 0.3]), np.array([10.0])
    for time, share in ((-5.0, 0.0), (0.0, 0.0), (10.0, 0.1), (1000.0, 0.3)):
        context = np.zeros(CONTEXT)
        context[0] = time
        assert opcode(Law.DROOP, p, z, context) == pytest.approx(-10.0 * share, abs=1e-15)


@pytest.mark.parametrize('knots', [2, 5, 9, 20])
def test_tables_are_straight_between_knots(knots: int) -> None:
    generator = np.random.default_rng(knots)
    heights = generator.normal(size=knots)
    low, high = -1.5, 2.0
    row = np.concatenate([[-1.0, low, high, knots], heights])
    for place in generator.uniform(low - 1.0, high + 1.0, 100):
        expected = np.interp(place, np.linspace(low, high, knots), heights)
        assert opcode(Law.TABLE, row, np.array([place])) == pytest.approx(expected, abs=1e-12)
        context = np.zeros(CONTEXT)
        context[3] = place
        assert opcode(Law.TABLE, np.concatenate([[3.0], row[1:]]), np.zeros(1),
                      context) == pytest.approx(expected, abs=1e-12)


def test_periodic_tables_come_round() -> None:
    heights = np.random.default_rng(0).normal(size=9)
    row = np.concatenate([[1.0, 0.0, 2.0 * math.pi, -9.0], heights])
    edges = 2.0 * math.pi / 9.0 * np.arange(10)
    for heading in np.linspace(-20.0, 20.0, 101):
        context = np.zeros(CONTEXT)
        context[1] = heading
        expected = np.interp(heading % (2.0 * math.pi), edges, np.append(heights, heights[0]))
        assert opcode(Law.TABLE, row, np.zeros(1), context) == pytest.approx(expected, abs=1e-10)
