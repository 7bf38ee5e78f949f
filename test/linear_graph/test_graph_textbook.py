# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Textbook systems against their printed matrices, in symbols and in numbers.

Rowell and Wormley's examples 5.1 to 5.11 as StateMint's public test suite prints them, Garbini's
systems of the same suite, and classics; the sources stand in the netlists themselves.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lg_husky_sim.linear_graph import compile_numeric, derive
from lg_husky_sim.linear_graph.netlist import Netlist, read_netlist
import numpy as np
import pytest
import sympy

EXAMPLES = Path(__file__).resolve().parents[2] / 'examples' / 'linear_graph'


@dataclass(frozen=True)
class Printed:
    """Matrices as texts: rows by ';', entries by ','; those left out are zero."""

    states: str
    matrices: dict[str, str]
    dependent: tuple[str, ...] = field(default=())


SYSTEMS = {
    'rowell_5_1_rlc_parallel': Printed('V(C) i(L)', {
        'A': '-1/(R*C), -1/C; 1/L, 0', 'B': '1/(R*C); 0',
        'C': '-1/R, 0; -1, 0; 1, 0; -1/R, -1', 'D': '1/R; 1; 0; 1/R'}),
    'rowell_5_2_mass_spring': Printed('v(m) F(K)', {
        'A': '0, -1/m; K, 0', 'B': '1/m; 0', 'C': '1, 0'}),
    'rowell_5_3_mass_spring_damper': Printed('v(m) F(K)', {
        'A': '-B/m, -1/m; K, 0', 'B': '1/m; 0', 'C': '1, 0; 0, 1'}),
    'rowell_5_4_flywheel': Printed('omega(J)', {
        'A': '-(B1 + B2)/J', 'B': 'B2/J', 'C': '1'}),
    'rowell_5_5_rlc_series': Printed('V(C) i(L)', {
        'A': '0, 1/C; -1/L, -R/L', 'B': '0; 1/L', 'C': '-1, -R; 0, 1; 1, 0', 'D': '1; 0; 0'}),
    'rowell_5_6_pipe_and_tank': Printed('P(C) Q(I_p)', {
        'A': '-1/(R_1*C), 1/C; -1/I_p, -R_p/I_p', 'B': '0; 1/I_p', 'C': '1, 0; 0, 1'}),
    'rowell_5_7_heated_body': Printed('T(C)', {
        'A': '-1/(C*(R1 + R2))', 'B': 'R2/(C*(R1 + R2))', 'C': '1'}),
    'rowell_5_9_excess_spring': Printed('v(m) F(K1)', {
        'A': '-B2/m, 0; 0, -K1*K2/(B1*(K1 + K2))', 'B': '1/m; 0', 'C': '0, 1/B1',
        'E': '0; K1/(K1 + K2)'}, ('K2',)),
    'rowell_5_11_car_with_drag': Printed('v(m)', {
        'A': '0', 'B': '1/m, -1/m', 'C': '1', 'G': '-1/m', 'H': '1'}),
    'quarter_car': Printed('v(M_B) v(M_W) F(K_S) F(K_T)', {
        'A': '-B_S/M_B, B_S/M_B, 1/M_B, 0; B_S/M_W, (-B_S - B_T)/M_W, -1/M_W, 1/M_W;'
             '-K_S, K_S, 0, 0; 0, -K_T, 0, 0',
        'B': '0; B_T/M_W; 0; K_T', 'C': '-B_S, B_S, 0, 0; 0, -B_T, 0, 0', 'D': '0; B_T'}),
    'motor_and_pulley': Printed('omega(J_M)', {
        'A': '-(B + K_m**2/R)/(J_M + J_L/n**2)', 'B': 'K_m/R/(J_M + J_L/n**2)',
        'C': '1/n; -K_m/R; -K_m', 'D': '0; 1/R; 1'}, ('J_L',)),
    'inertial_actuator': Printed('v(M) F(K)', {
        'A': '-(K_m**2 + B*R)/(M*R), -1/M; K, 0',
        'B': 'K_m/(M*R), (K_m**2 + B*R)/(M*R); 0, -K',
        'C': '-(K_m**2 + B*R)/R, -1', 'D': 'K_m/R, (K_m**2 + B*R)/R'}),
    'motor_and_spring': Printed('omega(J) tau(K)', {
        'A': '-K_m**2/(J*R), -1/J; K, 0', 'B': 'K_m/(J*R); 0', 'C': '0, 1; 1, 0'}),
    'motor_with_compliant_shaft': Printed('omega(J_m) omega(J_l) i(L) tau(K)', {
        'A': '-B_m/J_m, 0, k_t/J_m, -1/J_m; 0, -B_l/J_l, 0, 1/J_l;'
             '-k_t/L, 0, -R/L, 0; K, -K, 0, 0',
        'B': '0, 0; 0, -1/J_l; 1/L, 0; 0, 0', 'C': '0, 1, 0, 0; 0, 0, 1, 0'}),
    'two_tanks': Printed('P(C_1) P(C_2)', {
        'A': '-1/(R_1*C_1), 1/(R_1*C_1); 1/(R_1*C_2), -(1/R_1 + 1/R_2)/C_2',
        'B': '1/C_1; 0', 'C': '0, 1/R_2'}),
    'rack_and_pinion': Printed('omega(J)', {
        'A': '-r**2*b/(J + r**2*m)', 'B': '1/(J + r**2*m)', 'C': 'r; -m*r**3*b/(J + r**2*m)',
        'D': '0; m*r/(J + r**2*m)'}, ('m',)),
    'gyrator_makes_an_inductor': Printed('V(C)', {
        # i_1 = -V_C/r, so that di_1/dt = (V_s - R i_1)/(r^2 C): an inductor of r^2 C
        'A': '-R/(r_g**2*C)', 'B': '-1/(r_g*C)', 'C': '-1/r_g'}),
    'loop_of_capacitors': Printed('V(C_1)', {
        'A': '-1/(R*(C_1 + C_2))', 'B': '1/(R*(C_1 + C_2))', 'E': 'C_2/(C_1 + C_2)',
        'C': '-1; C_2/(R*(C_1 + C_2))', 'D': '1; -C_2/(R*(C_1 + C_2))',
        'F': '0; C_1*C_2/(C_1 + C_2)'}, ('C_2',)),
    'inductors_in_series': Printed('i(L_1)', {
        'A': '-R/(L_1 + L_2)', 'B': '1/(L_1 + L_2)', 'C': '-R*L_2/(L_1 + L_2)',
        'D': 'L_2/(L_1 + L_2)'}, ('L_2',)),
    'sallen_key': Printed('V(C_1) V(C_2)', {
        # states: V(C_1) = V_a - g V_b, V(C_2) = V_b
        'A': '-(1/R_1 + 1/R_2)/C_1, -(g/R_1 + (g - 1)/R_2)/C_1; 1/(R_2*C_2), (g - 1)/(R_2*C_2)',
        'B': '1/(R_1*C_1); 0', 'C': '0, g'}),
    'hydro_mechanical': Printed('v(m) F(K)', {
        'A': '-(A**2*(R_f + R_l) + B)/m, -1/m; K, 0', 'B': 'A*R_l*TF/m; 0',
        'C': '-A*R_f, 0; 1, 0'}),
}


def matrix(text: str) -> Any:
    """Return a printed matrix as a SymPy matrix in plain symbols."""
    rows = [[entry.strip() for entry in row.split(',')] for row in text.split(';')]
    names = {'E': sympy.Symbol('E'), 'C': sympy.Symbol('C')}
    return sympy.Matrix([[sympy.sympify(entry, locals=names) for entry in row] for row in rows])


def load(name: str) -> Netlist:
    return read_netlist(EXAMPLES / f'{name}.yaml')


def test_every_example_has_its_printed_matrices_and_there_are_fourteen_and_more() -> None:
    assert {path.stem for path in EXAMPLES.glob('*.yaml')} >= set(SYSTEMS)
    assert len(SYSTEMS) >= 14


@pytest.mark.parametrize('name', SYSTEMS)
def test_symbols_are_as_printed(name: str) -> None:
    printed, netlist = SYSTEMS[name], load(name)
    model = derive(netlist.graph, netlist.outputs)
    assert ' '.join(model.states) == printed.states
    assert model.dependent == printed.dependent
    for key in ('A', 'B', 'C', 'D', 'E', 'F', 'G', 'H', 'K'):
        found = getattr(model, key)
        expected = matrix(printed.matrices[key]) if key in printed.matrices else (
            sympy.zeros(*found.shape))
        assert found.shape == expected.shape, key
        assert sympy.simplify(found - expected).is_zero_matrix, (key, found, expected)


@pytest.mark.parametrize('name', SYSTEMS)
def test_numbers_are_as_printed(name: str) -> None:
    printed, netlist = SYSTEMS[name], load(name)
    model = compile_numeric(netlist.graph, netlist.outputs)
    dice = np.random.default_rng(7)
    for _ in range(3):
        values = {p: float(dice.uniform(0.3, 3.0)) for p in (*model.parameters, 'c_d')}
        numbers = model.at(values)
        symbols = {sympy.Symbol(p): number for p, number in values.items()}
        for key, text in printed.matrices.items():
            expected = np.array(matrix(text).subs(symbols), dtype=float)
            np.testing.assert_allclose(getattr(numbers, key), expected, rtol=1e-10, atol=1e-12,
                                       err_msg=key)


def test_standard_form_of_the_excess_spring() -> None:
    netlist = load('rowell_5_9_excess_spring')
    reduced = derive(netlist.graph, netlist.outputs).standard_form()
    assert reduced.E.is_zero_matrix
    k1, k2, b1, m = sympy.symbols('K1 K2 B1 m')
    expected = sympy.Matrix([1 / m, -k1**2 * k2 / (b1 * (k1 + k2)**2)])
    assert sympy.simplify(reduced.B - expected).is_zero_matrix
    assert sympy.simplify(reduced.D[0] - k1 / (b1 * (k1 + k2))) == 0
    values = {'K1': 2.0, 'K2': 3.0, 'B1': 5.0, 'B2': 7.0, 'm': 11.0}
    numbers = compile_numeric(netlist.graph, netlist.outputs).at(values).standard_form()
    np.testing.assert_allclose(numbers.B[1, 0], -4.0 * 3.0 / (5.0 * 25.0))
    np.testing.assert_allclose(numbers.D[0, 0], 2.0 / (5.0 * 5.0))
