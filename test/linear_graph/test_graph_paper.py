# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The paper's printed equations and matrices in symbols: rows 1 to 10 of its checkable claims."""

from __future__ import annotations

from pathlib import Path

from lg_husky_sim.husky import network
from lg_husky_sim.linear_graph import (
    Branch,
    compile_numeric,
    derive,
    Domain,
    Kind,
    LinearGraph,
    normal_tree,
    TwoPort,
)
from lg_husky_sim.linear_graph.equations import equations, latex_of, Sum
from lg_husky_sim.linear_graph.netlist import read_netlist
import numpy as np
from numpy.typing import NDArray
import pytest
import sympy

HYDRAULIC = Path(__file__).resolve().parents[2] / 'examples/linear_graph/hydro_mechanical.yaml'

# Eqs. (3) to (6) and (13) to (16), left side's ports spelt out
CONTINUITY = """
i(R_1) = i(L_1)
i(T_ML.1) = i(L_1)
tau(J_LW) = -tau(B_FL) - tau(B_RL) - tau(T_ML.2)
tau(TF_1.1) = tau(B_RL)
tau(TF_2.1) = tau(B_RL)
tau(TF_3.1) = tau(B_FL)
tau(TF_4.1) = tau(B_FL)
F(M_H) = -F(TF_1.2) - F(TF_3.2) - F(TF_5.2) - F(TF_7.2)
tau(J_H) = -tau(TF_2.2) - tau(TF_4.2) - tau(TF_6.2) - tau(TF_8.2) - tau(B_H)
"""
COMPATIBILITY = """
V(L_1) = V(V_S1) - V(T_ML.1) - V(R_1)
omega(T_ML.2) = omega(J_LW)
omega(B_RL) = omega(J_LW) - omega(TF_1.1) - omega(TF_2.1)
omega(B_FL) = omega(J_LW) - omega(TF_3.1) - omega(TF_4.1)
v(TF_1.2) = v(M_H)
v(TF_3.2) = v(M_H)
v(TF_5.2) = v(M_H)
v(TF_7.2) = v(M_H)
omega(TF_2.2) = omega(J_H)
omega(TF_4.2) = omega(J_H)
omega(TF_6.2) = omega(J_H)
omega(TF_8.2) = omega(J_H)
omega(B_H) = omega(J_H)
"""


def as_sets(sums: tuple[Sum, ...]) -> dict[str, frozenset[str]]:
    """Return left side to signed right side, chains taken apart."""
    return {left: frozenset('-+'[sign > 0] + name for sign, name in equation.right)
            for equation in sums for left in equation.left}


def read(text: str) -> dict[str, frozenset[str]]:
    found = {}
    for line in text.strip().splitlines():
        left, right = line.split(' = ')
        terms = right.replace('- ', '-').replace('+ ', '+').split()
        found[left] = frozenset(t if t[0] in '+-' else '+' + t for t in terms)
    return found


def test_continuity_and_compatibility_are_eqs_3_to_6_and_13_to_16(husky: LinearGraph) -> None:
    found = equations(husky)
    continuity, compatibility = as_sets(found.continuity), as_sets(found.compatibility)
    printed = read(CONTINUITY)
    assert {left: continuity[left] for left in printed} == printed
    printed = read(COMPATIBILITY)
    assert {left: compatibility[left] for left in printed} == printed
    assert len(continuity) == len(normal_tree(husky).tree) - 2     # all but the two sources


def test_equations_are_written_as_text_and_latex(husky: LinearGraph) -> None:
    found = equations(husky, by_element=True)
    text = found.text
    assert '  i(R_1) = i(T_ML.1) = i(L_1)\n' in text
    assert '  V(L_1) = V(V_S1) - V(R_1) - V(T_ML.1)\n' in text
    assert '  d i(L_1)/dt = V(L_1)/L_1\n' in text
    assert '  V(T_ML.1) = T_ML*omega(T_ML.2)\n' in text
    assert '  tau(T_ML.2) = -T_ML*i(T_ML.1)\n' in text
    latex = found.latex
    assert r'i_{R_{1}} &= i_{T_{ML},1} = i_{L_{1}} \\' in latex
    assert r'V_{L_{1}} &= V_{V_{S1}} - V_{R_{1}} - V_{T_{ML},1} \\' in latex
    assert r'\frac{d}{dt} i_{L_{1}} &= \frac{1}{L_{1}} V_{L_{1}}' in latex
    assert latex_of('omega(J_LW)') == r'\omega_{J_{LW}}'
    assert latex.count(r'\begin{align}') == latex.count(r'\end{align}') == 3
    assert latex.count('{') == latex.count('}')


@pytest.mark.parametrize('graph', ['simplified', 'expanded', 'hydraulic'])
@pytest.mark.parametrize('by_element', [True, False])
def test_every_latex_equation_can_be_typeset(graph: str, by_element: bool) -> None:
    mathtext = pytest.importorskip('matplotlib.mathtext', reason='matplotlib typesets here')
    chosen = read_netlist(HYDRAULIC).graph if graph == 'hydraulic' else (
        network.simplified() if graph == 'simplified' else network.expanded())
    found = equations(chosen, by_element=by_element)
    lines = [e.latex for e in (*found.continuity, *found.compatibility)]
    lines += [e.latex for e in found.constitutive]
    assert len(lines) > 10
    parser = mathtext.MathTextParser('path')
    for line in lines:
        assert parser.parse(f'${line}$').width > 10.0


def printed_a(inertia: str) -> sympy.Matrix:
    """Return eq. (19), with the given divisor at (4, 3), where the print has none."""
    moment = '-B_FL*TF_3*TF_4 - B_FR*TF_5*TF_6 - B_RL*TF_1*TF_2 - B_RR*TF_7*TF_8'
    rows = (
        ('(-B_FL-B_RL)/J_LW', '0', '(B_FL*TF_3+B_RL*TF_1)/J_LW', '(B_FL*TF_4+B_RL*TF_2)/J_LW',
         'T_ML/J_LW', '0'),
        ('0', '(-B_FR-B_RR)/J_RW', '(B_FR*TF_5+B_RR*TF_7)/J_RW', '(B_FR*TF_6+B_RR*TF_8)/J_RW',
         '0', 'T_MR/J_RW'),
        ('(B_FL*TF_3+B_RL*TF_1)/M_H', '(B_FR*TF_5+B_RR*TF_7)/M_H',
         '(-B_RL*TF_1**2-B_FL*TF_3**2-B_FR*TF_5**2-B_RR*TF_7**2)/M_H', f'({moment})/M_H',
         '0', '0'),
        ('(B_FL*TF_4+B_RL*TF_2)/J_H', '(B_FR*TF_6+B_RR*TF_8)/J_H', f'({moment})/{inertia}',
         '(-B_RL*TF_2**2-B_FL*TF_4**2-B_FR*TF_6**2-B_RR*TF_8**2-B_H)/J_H', '0', '0'),
        ('-T_ML/L_1', '0', '0', '0', '-R_1/L_1', '0'),
        ('0', '-T_MR/L_2', '0', '0', '0', '-R_2/L_2'))
    return sympy.Matrix([[sympy.sympify(entry) for entry in row] for row in rows])


@pytest.mark.parametrize('graph', ['fixture', 'package'])
def test_symbols_are_eqs_19_to_22_but_for_the_erratum(husky: LinearGraph, graph: str) -> None:
    chosen = husky if graph == 'fixture' else network.simplified()
    outputs = ('omega(J_LW)', 'omega(J_RW)', 'v(M_H)', 'omega(J_H)')
    model = derive(chosen, outputs, by_element=True)
    assert model.states == (*outputs, 'i(L_1)', 'i(L_2)')
    difference = (model.A - printed_a('1')).applyfunc(sympy.cancel)
    assert [(i + 1, j + 1) for i in range(6) for j in range(6) if difference[i, j] != 0] == [
        (4, 3)]
    assert (model.A - printed_a('J_H')).applyfunc(sympy.cancel).is_zero_matrix
    one, two = sympy.symbols('L_1 L_2')
    assert sympy.Matrix(4, 2, [0] * 8).col_join(sympy.diag(1 / one, 1 / two)) == model.B
    assert sympy.eye(4).row_join(sympy.zeros(4, 2)) == model.C
    assert model.D.is_zero_matrix
    assert model.E.is_zero_matrix
    assert model.G.shape == (6, 0)


def test_transformer_ratios_of_eqs_8_to_12_reduce_to_half_track_over_radius() -> None:
    model = derive(network.simplified())
    track, radius, damping, inertia = sympy.symbols(
        'track wheel_radius wheel_damping wheel_inertia')
    assert sympy.cancel(model.A[0, 3] + damping * track / (radius * inertia)) == 0
    assert sympy.cancel(model.A[1, 3] - damping * track / (radius * inertia)) == 0
    assert sympy.Symbol('wheelbase') not in model.A.free_symbols


def test_hydraulic_system_of_eq_2_and_what_links_it_to_the_print() -> None:
    graph = read_netlist(HYDRAULIC).graph
    area, r_f, r_l, b, m, k, ratio = sympy.symbols('A R_f R_l B m K TF')
    right = derive(graph, ['P(R_f)', 'v(m)'])
    assert sympy.cancel(right.A[0, 0] + (area**2 * (r_f + r_l) + b) / m) == 0
    assert sympy.cancel(right.B[0, 0] - area * r_l * ratio / m) == 0
    assert sympy.Matrix([[-area * r_f, 0], [1, 0]]) == right.C
    # with both ports of one domain and name, the pump is a conductance -TF and the motor is cut
    # off: that is the printed matrix, term by term
    collided = graph.without('pump', 'w_s').with_branches(Branch(
        'pump', Kind.D_TYPE, Domain.FLUID, 'outlet', 'ground', '-1/TF'))
    wrong = derive(collided, ['P(R_f)', 'v(m)'])
    printed = sympy.Matrix([
        [area**2 * (r_f + r_l - r_f * r_l * ratio) / (m * (r_l * ratio - 1)) - b / m, -1 / m],
        [k, 0]])
    assert (wrong.A - printed).applyfunc(sympy.cancel).is_zero_matrix
    assert wrong.B.shape == (2, 0)
    numbers = {area: 1, r_f: 1, r_l: 1, b: 1, m: 1, k: 1, ratio: 1.2}
    assert printed.subs(numbers)[0, 0] > 0      # a passive system would gain energy
    assert right.A.subs(numbers)[0, 0] < 0
    # here such a collision cannot be written down: names are unique, domains are checked
    with pytest.raises(Exception, match=r"name 'pump' is used twice"):
        graph.with_branches(Branch('pump', Kind.D_TYPE, Domain.FLUID, 'outlet', 'ground', 'x'))
    with pytest.raises(Exception, match=r"node 'motor' is rotational at 'w_s' and fluid at"):
        graph.replacing(TwoPort('pump', Kind.GYRATOR, (Domain.FLUID, 'motor', 'ground'),
                                (Domain.FLUID, 'outlet', 'ground'), '1/TF'))


def expanded_poles(stiffness: float, damping: float, paper: dict[str, float]) -> list[complex]:
    """Return the poles of the 10-state Husky, slowest first."""
    values = {
        'wheel_inertia': paper['J_LW'], 'wheel_radius': paper['r_W'], 'track': 2.0 * paper['c'],
        'wheelbase': 0.512, 'mass': paper['M_H'], 'yaw_inertia': paper['J_H'],
        'yaw_damping': paper['B_H'], 'wheel_damping': paper['B_RL'],
        'motor_resistance': paper['R_1'], 'motor_inductance': paper['L_1'],
        'torque_constant': paper['k_t'], 'gear_ratio': paper['GR'],
        'belt_stiffness': stiffness, 'belt_damping': damping}
    space = compile_numeric(network.expanded()).at(values)
    assert len(space.states) == 10
    return sorted(space.poles.tolist(), key=abs)


def test_expanded_drivetrain_tends_to_the_simplified_one(
        husky: LinearGraph, paper: dict[str, float]) -> None:
    limit = np.sort(compile_numeric(husky).at(paper).poles.real)[::-1]
    errors = []
    for stiffness in (1e7, 1e8, 1e9):
        slow = np.array(expanded_poles(stiffness, 1e-5 * stiffness, paper)[:6])
        assert np.abs(slow.imag).max() < 1e-9 * np.abs(slow.real).max()
        errors.append(float(np.max(np.abs(np.sort(slow.real)[::-1] - limit) / np.abs(limit))))
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 1e-4
    soft = np.array(expanded_poles(100.0, 0.1, paper))
    assert np.abs(soft.imag).max() > 1.0    # a soft belt swings
    assert soft.real.max() < 0.0


def stored_power(a: NDArray[np.float64], values: dict[str, float]) -> float:
    """Return the largest growth of stored energy over all states of unit energy [1/s]."""
    inertia = np.sqrt([values[n] for n in ('J_LW', 'J_RW', 'M_H', 'J_H', 'L_1', 'L_2')])
    scaled = a * inertia[:, None] / inertia[None, :]
    return float(np.linalg.eigvalsh(scaled + scaled.T).max())


def test_the_husky_never_gains_energy_for_1000_draws_but_the_print_does(
        husky: LinearGraph, paper: dict[str, float]) -> None:
    model = compile_numeric(husky)
    dice = np.random.default_rng(19)
    gains = 0
    for _ in range(1000):
        values = {name: value * float(np.exp(dice.normal(scale=0.7)))
                  for name, value in paper.items()}
        a = model.at(values).A
        scale = float(np.abs(a).max())
        assert stored_power(a, values) <= 1e-9 * scale
        printed = np.array(a)
        printed[3, 2] *= values['J_H']      # eq. (19) lacks the divisor at (4, 3)
        gains += stored_power(printed, values) > 1e-9 * scale
    assert gains > 100      # unequal dampings make the printed model gain energy


def test_battery_resistance_shared_by_both_motors_is_one_line_and_a_solved_loop(
        husky: LinearGraph, paper: dict[str, float]) -> None:
    electrical = Domain.ELECTRICAL
    one_battery = husky.without('V_S1', 'V_S2').with_branches(
        Branch('V_bat', Kind.ACROSS_SOURCE, electrical, 'cell', 'ground'))
    joined = one_battery.with_branches(
        Branch('R_bat', Kind.D_TYPE, electrical, 'cell', 'supply_1', 'R_bat'),
        Branch('R_wire', Kind.D_TYPE, electrical, 'supply_1', 'supply_2', 'R_wire'))
    space = compile_numeric(joined, ['V(R_bat)']).at({**paper, 'R_bat': 0.08, 'R_wire': 1e-9})
    np.testing.assert_allclose(space.C, [[0, 0, 0, 0, 0.08, 0.08]], atol=1e-12)
    row = space.states.index('i(L_1)')
    np.testing.assert_allclose(space.A[row, 4:] * paper['L_1'], [-0.54, -0.08], rtol=1e-7)


def test_rolling_resistance_and_yaw_scrub_are_one_line_each(
        husky: LinearGraph, paper: dict[str, float]) -> None:
    from lg_husky_sim.linear_graph import Characteristic
    rolling = Branch('F_roll', Kind.THROUGH_SOURCE, Domain.TRANSLATIONAL, 'body', 'ground',
                     characteristic=Characteristic('coulomb', ('v(M_H)',), ('F_c', 'v_0')))
    scrub = Branch('T_scrub', Kind.THROUGH_SOURCE, Domain.ROTATIONAL, 'yaw', 'ground',
                   characteristic=Characteristic('coulomb', ('omega(J_H)',), ('M_c', 'w_0')))
    space = compile_numeric(husky.with_branches(rolling, scrub), ['F(M_H)']).at(paper)
    plain = compile_numeric(husky).at(paper)
    np.testing.assert_array_equal(space.A, plain.A)
    assert space.efforts == ('F_roll', 'T_scrub')
    assert space.arguments == ('v(M_H)', 'omega(J_H)')
    expected = np.zeros((6, 2))
    expected[2, 0], expected[3, 1] = -1.0 / paper['M_H'], -1.0 / paper['J_H']
    np.testing.assert_allclose(space.G, expected)
    np.testing.assert_array_equal(space.H, np.eye(6)[[2, 3]])
    np.testing.assert_array_equal(space.K, np.zeros((2, 2)))
    np.testing.assert_array_equal(space.L_c, [[-1.0, 0.0]])
