# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Transfer functions of many states, in symbols and in numbers, against the matrices."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
import random
import signal
from typing import Any

import lg_husky_sim as lg
from lg_husky_sim.errors import GraphError
from lg_husky_sim.linear_graph import compile_numeric, LinearGraph
from lg_husky_sim.linear_graph.cancelling import cancelled
from lg_husky_sim.linear_graph.elements import SOURCES
from lg_husky_sim.linear_graph.exact import fraction_of
import numpy as np
import pytest
from scipy.linalg import eigvals
import sympy
from sympy.polys.matrices import DomainMatrix

EXAMPLES = sorted((Path(__file__).parents[2] / 'examples' / 'linear_graph').glob('*.yaml'))
S = sympy.Symbol('s')
POINT = (sympy.Rational(37, 100), sympy.Rational(191, 100))


def ladder(count: int) -> lg.Graph:
    """Return a ladder of resistors and capacitors, all of values of their own."""
    elements: dict[str, Any] = {'V_s': {'is': 'voltage source', 'from': 'n0'}}
    for at in range(count):
        elements[f'R_{at}'] = {'is': 'resistor', 'from': f'n{at}', 'to': f'n{at + 1}',
                               'value': 1.0 + 0.1 * at}
        elements[f'C_{at}'] = {'is': 'capacitor', 'from': f'n{at + 1}', 'value': 1.0 + 0.07 * at}
    return lg.graph({'elements': elements, 'outputs': [f'V(C_{count - 1})']})


@pytest.fixture
def in_seconds() -> Iterator[None]:
    """Stop a test that computes for more than half a minute; the old way took minutes."""
    def stop(*_: object) -> None:
        raise TimeoutError

    # By the processor's time, which other tests on the same cores do not take.
    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, 30.0)
    yield
    signal.setitimer(signal.ITIMER_PROF, 0.0)
    signal.signal(signal.SIGPROF, before)


def of_matrices(graph: lg.Graph, output: str, source: str, s: complex, **values: float) -> complex:
    space = compile_numeric(graph.graph, [output], chained=True).at({**graph.values, **values})
    at = space.inputs.index(source)
    drive = space.B[:, at] + s * space.E[:, at]
    state = np.linalg.solve(s * np.eye(len(space.states)) - space.A, drive)
    return complex((space.C @ state)[0] + space.D[0, at] + s * space.F[0, at])


def value_at(expression: Any, values: dict[str, float]) -> complex:
    numbers = {sympy.Symbol(name): sympy.Rational(repr(value)) for name, value in values.items()}
    return complex(expression.subs(numbers).subs(S, POINT[0] + sympy.I * POINT[1]).evalf(30))


@pytest.mark.parametrize('path', EXAMPLES, ids=lambda path: path.stem)
def test_symbols_and_numbers_agree_with_the_matrices_of_every_example(path: Path) -> None:
    graph = lg.graph(path)
    dice = random.Random(5)
    model = compile_numeric(graph.graph, graph.outputs, chained=True)
    laws = [name for law in model.structure.laws.values() for name in law.parameters]
    values = {name: round(dice.uniform(0.3, 3.0), 3) for name in (*model.parameters, *laws)}
    s = complex(*map(float, POINT))
    for output in model.outputs:
        for source in model.inputs:
            expected = of_matrices(graph, output, source, s, **values)
            symbols = graph.transfer_function(output, source, by_parameter=True)
            assert value_at(symbols, values) == pytest.approx(expected, rel=1e-9, abs=1e-12)
            numbers = graph.transfer_function(output, source, numbers=True, by_parameter=False,
                                              **values)
            assert numbers(s) == pytest.approx(expected, rel=1e-9, abs=1e-12)
            degrees = [sympy.Poly(part, S).degree() for part in sympy.fraction(symbols)]
            assert degrees[1] == len(numbers.poles)
            assert symbols == 0 or degrees[0] == len(numbers.zeros)


@pytest.mark.usefixtures('in_seconds')
@pytest.mark.parametrize('output', ['v(M_H)', 'omega(J_LW)', 'tau(B_FL)'])
def test_the_husky_in_symbols_takes_seconds(output: str) -> None:
    husky = lg.Husky()
    found = husky.transfer_function(output, 'V_S1')
    # every element has a number of its own, so that nothing cancels by symmetry
    own = LinearGraph(
        tuple(one if one.kind in SOURCES else replace(one, value=one.name)
              for one in husky.graph.branches),
        tuple(replace(one, value=one.name) for one in husky.graph.two_ports), husky.graph.ground)
    values = {name: (3.0 + at) / 8.0 for at, name in enumerate(own.names)}
    graph = lg.Graph('', own, values, [output])
    expected = of_matrices(graph, output, 'V_S1', complex(*map(float, POINT)))
    assert value_at(found, values) == pytest.approx(expected, rel=1e-9)
    assert len(graph.transfer_function(numbers=True, source='V_S1').poles) == 6


@pytest.mark.usefixtures('in_seconds')
def test_what_left_and_right_share_cancels() -> None:
    """One motor moves the body by half the sum of both sides: three states in place of six."""
    names = ('gear_ratio torque_constant wheel_damping wheel_radius mass motor_inductance '
             'wheel_inertia motor_resistance')
    g, k, b, r, m, ind, j, res = sympy.symbols(names)
    motor = res + ind * S
    side = j * S + 2 * b + (k * g) ** 2 / motor
    # of the body's and a wheel's balance, both sides alike, with half the voltage on each
    wheel = k * g / motor / 2
    expected = wheel * 4 * b / r / ((m * S + 4 * b / r**2) * side - 8 * b**2 / r**2)
    found = lg.Husky().transfer_function('v(M_H)', 'V_S1', by_parameter=True)
    assert sympy.simplify(found - expected) == 0
    assert sympy.Poly(sympy.fraction(found)[1], S).degree() == 3


@pytest.mark.usefixtures('in_seconds')
def test_too_long_an_answer_is_refused_at_once() -> None:
    for count in (12, 100):
        with pytest.raises(GraphError, match='more than 20000 terms; put numbers in'):
            ladder(count).transfer_function()


@pytest.mark.usefixtures('in_seconds')
def test_the_elastic_belts_of_ten_states_by_parameter() -> None:
    belts = lg.graph('expanded')
    found = belts.transfer_function('v(M_H)', 'V_S1', by_parameter=True)
    numbers = belts.transfer_function('v(M_H)', 'V_S1', numbers=True)
    assert sympy.Poly(sympy.fraction(found)[1], S).degree() == len(numbers.poles) == 5
    values = {str(name): belts.values[str(name)] for name in found.free_symbols - {S}}
    assert value_at(found, values) == pytest.approx(numbers(complex(*map(float, POINT))))


def test_a_common_factor_of_all_variables_is_found() -> None:
    ring, x, y, z = sympy.ring('x, y, z', sympy.ZZ)
    common = x * y + z + 1
    above, below = cancelled(common * (x - y) * 6, common * (z - 2) * -4)
    assert (above, below) in [(-3 * (x - y), 2 * (z - 2)), (3 * (x - y), -2 * (z - 2))]
    above, below = cancelled(y * (x + z), y * y * (x - z))
    assert (above, below) == (x + z, y * (x - z))
    assert cancelled(ring.zero, x) == (0, 1)


def test_a_part_that_the_input_does_not_drive_is_left_out() -> None:
    graph = lg.graph("""
        elements:
          V_1: {is: voltage source, from: a}
          R_1: {is: resistor, from: a, to: b, value: 2}
          C_1: {is: capacitor, from: b, value: 3}
          V_2: {is: voltage source, from: d}
          R_2: {is: resistor, from: d, to: e, value: 2}
          C_2: {is: capacitor, from: e, value: 3}
        outputs: [V(C_1), V(C_2)]
        """)
    assert str(graph.transfer_function('V(C_1)', 'V_1')) == '1/(C_1*R_1*s + 1)'
    assert graph.transfer_function('V(C_2)', 'V_1') == 0
    nothing = graph.transfer_function('V(C_2)', 'V_1', numbers=True)
    assert (nothing.gain, len(nothing.poles), nothing.dc_gain) == (0.0, 0, 0.0)


def test_poles_of_the_husky_are_the_eigenvalues() -> None:
    husky = lg.Husky()
    for output, count in (('v(M_H)', 3), ('omega(J_LW)', 6), ('omega(J_H)', 3)):
        found = husky.transfer_function(output, 'V_S1', numbers=True).poles
        assert len(found) == count
        gaps = np.abs(found[:, None] - husky.poles()[None, :]).min(axis=1)
        assert (gaps <= 1e-9 * np.abs(found)).all()


def test_zeros_and_poles_of_thirty_states_are_exact() -> None:
    """Roots of the polynomial's coefficients in double precision are off by more than 1."""
    graph = ladder(30)
    found = fraction_of(graph.graph, 'V(C_29)', 'V_s', graph.values)
    np.testing.assert_allclose(np.sort(found.poles.real), np.sort(eigvals(graph.numeric().A).real),
                               rtol=1e-9)
    assert found.zeros.size == 0
    current = graph.transfer_function('V(C_0)', numbers=True)
    assert len(current.zeros) == 29


def test_a_double_pole_is_double() -> None:
    graph = lg.graph("""
        elements:
          F: {is: force source, from: ground, to: m}
          M: {is: mass, from: m, value: 1}
          B: {is: damper, from: m, value: 2}
          K: {is: spring, from: m, value: 1}
        outputs: [v(M)]
        """)
    found = graph.transfer_function(numbers=True)
    np.testing.assert_allclose(found.poles, [-1.0, -1.0], rtol=1e-14)
    assert str(graph.transfer_function()) == 's/(B*s + K + M*s**2)'


def test_functions_of_parameters_are_symbols_of_their_own() -> None:
    graph = lg.graph("""
        parameters: {a: 4, b: 2}
        elements:
          V_s: {is: voltage source, from: p}
          R: {is: resistor, from: p, to: q, value: sqrt(a)*b}
          C: {is: capacitor, from: q, value: pi/b}
        outputs: [V(C)]
        """)
    a = sympy.Symbol('a')
    found = graph.transfer_function(by_parameter=True)
    assert sympy.simplify(found - 1 / (sympy.pi * sympy.sqrt(a) * S + 1)) == 0
    numbers = graph.transfer_function(numbers=True)
    assert numbers.poles == pytest.approx([-1.0 / (2.0 * np.pi)])


def test_any_variable_is_an_output() -> None:
    graph = ladder(2)
    assert str(graph.transfer_function('i(R_0)').subs('s', 0)) == '0'
    with pytest.raises(GraphError, match="unknown output: no branch 'R0' in the graph; did you"):
        graph.transfer_function('i(R0)')


@pytest.mark.parametrize('path', EXAMPLES, ids=lambda path: path.stem)
def test_symbols_are_those_of_determinants_over_the_field(path: Path) -> None:
    """The matrices' own: slow, but with nothing but the definition in it."""
    graph = lg.graph(path)
    model = graph.symbolic
    pencil = S * sympy.eye(len(model.states)) - model.A
    for row, output in enumerate(model.outputs):
        whole = pencil.row_join(-(model.B + S * model.E)[:, 0]).col_join(
            model.C[row, :].row_join((model.D + S * model.F)[row, :1]))
        above, below = (DomainMatrix.from_Matrix(one).to_field() for one in (whole, pencil))
        expected = above.domain.to_sympy(above.det()) / below.domain.to_sympy(below.det())
        found = graph.transfer_function(output, model.inputs[0])
        assert sympy.cancel(found - expected) == 0
