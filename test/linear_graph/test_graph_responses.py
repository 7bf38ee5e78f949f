# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Transfer functions, poles, zeros, step and Bode against formulas of the textbook."""

from __future__ import annotations

import lg_husky_sim as lg
from lg_husky_sim.errors import GraphError, ParameterError, SettingsError
import numpy as np
import pytest
from scipy.linalg import eigvals
import sympy

LEAD = """
elements:
  V_s: {is: voltage source, from: a}
  R_1: {is: resistor, from: a, to: b, value: 2}
  C:   {is: capacitor, from: a, to: b, value: 0.5}
  R_2: {is: resistor, from: b, value: 3}
outputs: [V(R_2)]
"""
DIVIDER = """
elements:
  V_s: {is: voltage source, from: a}
  C_1: {is: capacitor, from: a, to: b, value: 1}
  C_2: {is: capacitor, from: b, value: 3}
  R:   {is: resistor, from: b, value: 2}
outputs: [V(C_2)]
"""
MASS = """
elements:
  F: {is: force source, from: ground, to: m}
  M: {is: mass, from: m, value: 2}
outputs: [v(M)]
"""


def symbols(text: str) -> dict[str, sympy.Symbol]:
    return {name: sympy.Symbol(name) for name in text.split()}


def test_the_transfer_function_of_a_lead_network() -> None:
    expected = sympy.sympify('R_2*(R_1*C*s + 1)/(R_1*R_2*C*s + R_1 + R_2)',
                             locals=symbols('R_1 R_2 C s'))
    assert sympy.simplify(lg.graph(LEAD).transfer_function() - expected) == 0


def test_poles_and_zeros_of_a_lead_network() -> None:
    """A zero at -1/(R_1 C) and a pole at -(R_1 + R_2)/(R_1 R_2 C)."""
    graph = lg.graph(LEAD)
    assert graph.zeros() == pytest.approx([-1.0])
    assert graph.poles() == pytest.approx([-5.0 / 3.0])
    assert graph.zeros(R_1=4.0) == pytest.approx([-0.5])


def test_the_rate_of_change_of_an_input_counts() -> None:
    """Capacitors in series: C_1 R s/((C_1 + C_2) R s + 1), a step begins at C_1/(C_1 + C_2)."""
    graph = lg.graph(DIVIDER)
    expected = sympy.sympify('C_1*R*s/((C_1 + C_2)*R*s + 1)', locals=symbols('C_1 C_2 R s'))
    assert sympy.simplify(graph.transfer_function() - expected) == 0
    assert graph.zeros() == pytest.approx([0.0])
    times = np.linspace(0.0, 20.0, 41)
    np.testing.assert_allclose(graph.step(times).column('V(C_2)'),
                               0.25 * np.exp(-times / 8.0), rtol=1e-9)
    gain, phase = graph.bode([1e-3, 0.125, 1e3])
    np.testing.assert_allclose(gain, 20 * np.log10([
        2e-3 / np.hypot(8e-3, 1.0), 0.25 / np.sqrt(2.0), 0.25]), rtol=1e-6)
    np.testing.assert_allclose(phase[1], 45.0)


def test_bode_of_the_husky_is_that_of_its_matrices() -> None:
    husky = lg.Husky()
    space = husky.numeric()
    rates = [0.1, 3.0, 400.0]
    gain, _ = husky.bode(rates, 'v(M_H)', space.inputs[0])
    row = space.outputs.index('v(M_H)')
    for rate, found in zip(rates, gain, strict=True):
        inverse = np.linalg.inv(1j * rate * np.eye(6) - space.A)
        assert found == pytest.approx(20 * np.log10(abs((space.C @ inverse @ space.B)[row, 0])))


def test_zeros_of_the_husky_are_those_of_its_matrices() -> None:
    """The finite eigenvalues of the pencil of A, B and C."""
    husky = lg.Husky()
    space = husky.numeric()
    found = husky.zeros('omega(J_LW)', space.inputs[0])
    row = space.outputs.index('omega(J_LW)')
    assert len(found) == 4      # two fewer than poles: voltage, current, torque, speed
    whole = np.block([[space.A, space.B[:, :1]], [space.C[[row]], np.zeros((1, 1))]])
    expected = eigvals(whole, np.diag([1.0] * 6 + [0.0]))
    expected = expected[np.abs(expected) < 1e5]
    np.testing.assert_allclose(np.sort(found.real), np.sort(expected.real), rtol=1e-6)
    fraction = husky.transfer_function('omega(J_LW)', space.inputs[0], numbers=True)
    steady = -(space.C @ np.linalg.solve(space.A, space.B))[row, 0]
    assert fraction.dc_gain == pytest.approx(steady)


def test_a_static_graph_answers_at_once() -> None:
    graph = lg.graph("""
        elements:
          V_s: {is: voltage source, from: a}
          R_1: {is: resistor, from: a, to: b, value: 1}
          R_2: {is: resistor, from: b, value: 3}
        outputs: [V(R_2)]
        """)
    assert str(graph.transfer_function()) == 'R_2/(R_1 + R_2)'
    assert (len(graph.zeros()), len(graph.poles())) == (0, 0)
    assert graph.step([0.0, 1.0]).values.tolist() == [[0.75], [0.75]]
    assert graph.bode([1.0]).phase.tolist() == [0.0]


def test_what_cannot_be_answered_is_said() -> None:
    with pytest.raises(GraphError, match="unknown output: no branch 'R' in the graph; there are"):
        lg.graph(LEAD).transfer_function('V(R)')
    with pytest.raises(GraphError, match=r'name one output of V\(R_2\), i\(C\)'):
        lg.graph(LEAD, outputs=['V(R_2)', 'i(C)']).transfer_function()
    with pytest.raises(ParameterError, match='equally spaced from 0'):
        lg.graph(LEAD).step([0.0, 1.0, 3.0])
    with pytest.raises(SettingsError, match=r'step response of i\(C_2\) begins with an impulse'):
        lg.graph(DIVIDER, outputs=['i(C_2)']).step([0.0, 1.0])
    with pytest.raises(GraphError, match="an element or a parameter is called 's'"):
        lg.graph(LEAD.replace('C: ', 's: ')).transfer_function()
    with pytest.raises(ParameterError, match="'soon' is not an array of numbers"):
        lg.graph(LEAD).step('soon')
    with pytest.raises(ParameterError, match='one or more angular frequencies'):
        lg.graph(LEAD).bode([-1.0])
    with pytest.raises(GraphError, match=r"name one, such as output='V\(C\)'"):
        lg.graph(LEAD.replace('outputs: [V(R_2)]', '')).step()
    with pytest.raises(ParameterError, match='there is a pole at 0 rad/s'):
        lg.graph(MASS).bode([1.0, 0.0])
