# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Non-linear and modulated elements: exact linear part, laws closed around it."""

from __future__ import annotations

from pathlib import Path

from lg_husky_sim.errors import GraphError, ParameterError
from lg_husky_sim.linear_graph import (
    Branch,
    Characteristic,
    compile_numeric,
    derive,
    Domain,
    Form,
    Kind,
    LinearGraph,
    TwoPort,
)
from lg_husky_sim.linear_graph.laws import expression_of, LAWS
from lg_husky_sim.linear_graph.netlist import read_netlist
from lg_husky_sim.linear_graph.nonlinear import RightHandSide
import numpy as np
import pytest
from scipy.integrate import solve_ivp

E, M, R = Domain.ELECTRICAL, Domain.TRANSLATIONAL, Domain.ROTATIONAL
EXAMPLES = Path(__file__).resolve().parents[2] / 'examples' / 'linear_graph'


def test_car_with_drag_follows_the_closed_solution() -> None:
    netlist = read_netlist(EXAMPLES / 'rowell_5_11_car_with_drag.yaml')
    mass, drag, force = 1200.0, 0.7, 900.0
    rhs = RightHandSide(netlist.graph, {'m': mass, 'c_d': drag}, netlist.outputs)
    assert rhs.space.inputs == ('F_p', 'F_0')
    result = solve_ivp(rhs, (0.0, 60.0), [0.0], args=([force, 0.0],), rtol=1e-10, atol=1e-12)
    # m dv/dt = F - c v^2 from rest: v = v_end tanh(t c v_end / m)
    end = np.sqrt(force / drag)
    np.testing.assert_allclose(result.y[0], end * np.tanh(result.t * drag * end / mass),
                               rtol=1e-7, atol=1e-9)
    assert result.y[0, -1] > 0.8 * end


def test_linearised_law_equals_a_linear_element() -> None:
    body = (Branch('F', Kind.THROUGH_SOURCE, M, 'ground', 'x'),
            Branch('m', Kind.A_TYPE, M, 'x', 'ground', 'm'))
    damper = Branch('b', Kind.D_TYPE, M, 'x', 'ground', 'b')
    as_law = Branch('b', Kind.D_TYPE, M, 'x', 'ground',
                    characteristic=Characteristic('b*z', ('v(b)',), ('b',)))
    values = {'m': 2.0, 'b': 3.0}
    for graph in (LinearGraph((*body, damper)), LinearGraph((*body, as_law))):
        space = compile_numeric(graph, ['F(b)']).at(values)
        np.testing.assert_allclose(space.A, [[-1.5]])
        np.testing.assert_allclose(space.C, [[3.0]])
        assert space.efforts == ()
        assert str(derive(graph).A[0, 0]) == '-b/m'


def test_a_law_with_a_signal_stays_an_effort_even_if_linear() -> None:
    graph = LinearGraph((
        Branch('m', Kind.A_TYPE, M, 'x', 'ground', 'm'),
        Branch('F', Kind.THROUGH_SOURCE, M, 'x', 'ground', characteristic=Characteristic(
            'heat*z', ('v(m)',), ('heat',), modulated=True))))
    space = compile_numeric(graph).at({'m': 2.0})
    assert space.efforts == ('F',)
    np.testing.assert_allclose(space.A, [[0.0]])
    np.testing.assert_allclose(space.G, [[-0.5]])


def test_linear_loop_through_a_modulated_source_is_solved() -> None:
    # v_amp = g (v_in - v_amp/2): an amplifier with feedback through a divider
    graph = LinearGraph((
        Branch('V', Kind.ACROSS_SOURCE, E, 'in', 'ground'),
        Branch('amp', Kind.ACROSS_SOURCE, E, 'out', 'ground',
               characteristic=Characteristic('g*(z1 - z2)', ('V(V)', 'V(R_2)'), ('g',))),
        Branch('R_1', Kind.D_TYPE, E, 'out', 'mid', 'R'),
        Branch('R_2', Kind.D_TYPE, E, 'mid', 'ground', 'R'),
        Branch('C', Kind.A_TYPE, E, 'load', 'ground', 'C'),
        Branch('R_3', Kind.D_TYPE, E, 'out', 'load', 'R')))
    gain = 100.0
    space = compile_numeric(graph, ['V(amp)']).at({'g': gain, 'R': 2.0, 'C': 0.5})
    np.testing.assert_allclose(space.D, [[gain / (1.0 + gain / 2.0)]])
    np.testing.assert_allclose(space.A, [[-1.0]])


def diode_with(*more: Branch) -> LinearGraph:
    return LinearGraph((
        Branch('V', Kind.ACROSS_SOURCE, E, 'a', 'ground'),
        Branch('R', Kind.D_TYPE, E, 'a', 'b', 'R'),
        Branch('D', Kind.D_TYPE, E, 'b', 'ground', form=Form.DAMPING,
               characteristic=Characteristic('diode', ('V(D)',), ('I_s', 'V_t'))), *more))


def test_storage_breaks_a_non_linear_loop() -> None:
    inductor = Branch('L', Kind.T_TYPE, E, 'b', 'ground', 'L')
    with pytest.raises(GraphError, match=r'algebraic loop D <- V\(D\) <- D'):
        compile_numeric(diode_with(inductor))
    capacitor = Branch('C', Kind.A_TYPE, E, 'b', 'ground', 'C')
    values = {'R': 100.0, 'I_s': 1e-12, 'V_t': 0.026, 'C': 1e-6, 'L': 1.0}
    rhs = RightHandSide(diode_with(inductor, capacitor), values)
    rate = rhs(0.0, [0.6, 0.001], [5.0])
    current = 1e-12 * (np.exp(0.6 / 0.026) - 1.0)
    np.testing.assert_allclose(rate, [((5.0 - 0.6) / 100.0 - current - 0.001) / 1e-6, 0.6])


def crank(*more: Branch) -> LinearGraph:
    """Return an inertia driving a rod over a crank whose ratio hangs on the spring's force."""
    return LinearGraph((
        Branch('J', Kind.A_TYPE, R, 'a', 'ground', 'J'),
        Branch('tau', Kind.THROUGH_SOURCE, R, 'ground', 'a'),
        Branch('k', Kind.T_TYPE, M, 'b', 'ground', 'K'), *more),
        (TwoPort('crank', Kind.TRANSFORMER, (M, 'b', 'ground'), (R, 'a', 'ground'),
                 characteristic=Characteristic('r*cos(z)', ('F(k)',), ('r',))),))


def test_modulated_transformer_conserves_power_and_chains_efforts() -> None:
    values = {'J': 2.0, 'K': 3.0, 'r': 0.1, 'd': 5.0}
    damped = crank(Branch('d', Kind.D_TYPE, M, 'b', 'ground', 'd'))
    with pytest.raises(GraphError, match=r'argument F\(crank.1\) .* depends directly on the '
                                         r"effort of 'crank.1'.*chained=True"):
        compile_numeric(damped)
    rhs = RightHandSide(damped, values, [
        'v(crank.1)', 'F(crank.1)', 'omega(crank.2)', 'tau(crank.2)'])
    state, ratio = [0.7, 0.4], 0.1 * np.cos(0.4)
    speed = ratio * 0.7
    force = 0.4 + 5.0 * speed
    np.testing.assert_allclose(rhs(0.0, state, [1.5]), [(1.5 - ratio * force) / 2.0, 3.0 * speed])
    v, f, omega, tau = rhs.output(state, [1.5])
    np.testing.assert_allclose([v, f, omega, tau], [speed, -force, 0.7, ratio * force])
    np.testing.assert_allclose(v * f + omega * tau, 0.0, atol=1e-15)


def test_modulated_gyrator_is_a_motor_with_a_controlled_field() -> None:
    graph = LinearGraph((
        Branch('V', Kind.ACROSS_SOURCE, E, 'a', 'ground'),
        Branch('L', Kind.T_TYPE, E, 'a', 'b', 'L'),
        Branch('V_f', Kind.ACROSS_SOURCE, E, 'f', 'ground'),
        Branch('L_f', Kind.T_TYPE, E, 'f', 'g', 'L_f'),
        Branch('R_f', Kind.D_TYPE, E, 'g', 'ground', 'R_f'),
        Branch('m', Kind.A_TYPE, M, 'x', 'ground', 'm')),
        (TwoPort('G', Kind.TRANSFORMER, (E, 'b', 'ground'), (M, 'x', 'ground'),
                 characteristic=Characteristic('k*z', ('i(L_f)',), ('k',))),))
    rhs = RightHandSide(graph, {'L': 0.5, 'L_f': 0.25, 'R_f': 2.0, 'm': 4.0, 'k': 3.0})
    assert rhs.space.states == ('v(m)', 'i(L)', 'i(L_f)')
    np.testing.assert_allclose(
        rhs(0.0, [1.1, 0.7, 0.2], [12.0, 6.0]),
        [3.0 * 0.2 * 0.7 / 4.0, (12.0 - 3.0 * 0.2 * 1.1) / 0.5, (6.0 - 2.0 * 0.2) / 0.25])


def test_loop_of_two_laws_is_named_with_both() -> None:
    law = Characteristic('p*z**3', ('i(b)',), ('p',))
    graph = LinearGraph((
        Branch('C', Kind.A_TYPE, E, 'n', 'ground', 'C'),
        Branch('R', Kind.D_TYPE, E, 'n', 'x', 'R'),
        Branch('a', Kind.ACROSS_SOURCE, E, 'x', 'y', characteristic=law),
        Branch('b', Kind.ACROSS_SOURCE, E, 'y', 'ground',
               characteristic=Characteristic('p*z**3', ('V(a)',), ('p',)))))
    with pytest.raises(GraphError, match=r'algebraic loop a <- i\(b\) <- '):
        compile_numeric(graph, chained=True)


def test_missing_parameters_and_wrong_inputs_are_named() -> None:
    graph = diode_with(Branch('C', Kind.A_TYPE, E, 'b', 'ground', 'C'))
    values = {'R': 1.0, 'C': 1.0, 'I_s': 1.0, 'V_t': 1.0}
    del values['V_t']
    with pytest.raises(ParameterError, match=r"parameter 'V_t' of the law of 'D' has no value"):
        RightHandSide(graph, values)
    rhs = RightHandSide(graph, {**values, 'V_t': 1.0})
    with pytest.raises(ParameterError, match=r'2 input\(s\) given; the graph has 1: V'):
        rhs(0.0, [0.0], [1.0, 2.0])


def test_input_derivatives_are_refused_where_they_cannot_be_given() -> None:
    netlist = read_netlist(EXAMPLES / 'loop_of_capacitors.yaml')
    with pytest.raises(GraphError, match=r'excess storage C_2 differentiates an input'):
        RightHandSide(netlist.graph, {'C_1': 1.0, 'C_2': 1.0, 'R': 1.0})


def test_a_law_of_an_input_s_rate_of_change_is_refused() -> None:
    """A force by the current of a capacitor across a source would need the voltage's rate."""
    graph = LinearGraph((
        Branch('V_s', Kind.ACROSS_SOURCE, E, 'a', 'e'),
        Branch('C_x', Kind.A_TYPE, E, 'a', 'e', 'C'),
        Branch('m', Kind.A_TYPE, M, 'b', 't', 'm'),
        Branch('d', Kind.D_TYPE, M, 'b', 't', 'd'),
        Branch('F', Kind.THROUGH_SOURCE, M, 't', 'b',
               characteristic=Characteristic('k*z1**3', ('i(C_x)',), ('k',))),
    ), ground={E: 'e', M: 't'})
    with pytest.raises(GraphError, match=r'depends on the rate of change of input .V_s.; put'):
        compile_numeric(graph, ['v(m)'])


@pytest.mark.parametrize(('name', 'parameters', 'z', 'value'), [
    ('coulomb', (2.0, 0.1), 0.05, 2.0 * np.tanh(0.5)),
    ('viscous_coulomb', (3.0, 2.0, 0.1), 0.05, 0.15 + 2.0 * np.tanh(0.5)),
    ('stribeck', (1.0, 2.0, 0.5, 0.1), 0.5, (1.0 + np.exp(-1.0)) * np.tanh(5.0)),
    ('quadratic', (3.0,), -2.0, -12.0),
    ('orifice', (2.0, 0.0), -4.0, -4.0),
    ('diode', (2.0, 0.5), 0.5, 2.0 * (np.e - 1.0)),
    ('cubic', (2.0, 3.0), -1.0, -5.0),
    ('saturation', (2.0,), 1.0, 2.0 * np.tanh(0.5)),
    ('proportional', (4.0,), 1.5, 6.0),
])
def test_named_laws_give_their_formulas(name: str, parameters: tuple[float, ...], z: float,
                                        value: float) -> None:
    from lg_husky_sim.linear_graph.expressions import evaluate
    names = tuple(f'q{at}' for at in range(len(parameters)))
    found = evaluate(expression_of(name, 1, names),
                     {**dict(zip(names, parameters, strict=True)), 'z1': z})
    assert found == pytest.approx(value, rel=1e-12)
    assert LAWS[name].about


@pytest.mark.parametrize('name', LAWS)
def test_each_argument_and_parameter_of_a_law_has_a_meaning(name: str) -> None:
    from lg_husky_sim.linear_graph.expressions import names_in
    law = LAWS[name]
    assert set(names_in(law.expression)) == {
        *(f'z{at + 1}' for at in range(len(law.arguments))),
        *(f'p{at + 1}' for at in range(len(law.parameters)))}
    assert all((*law.arguments, *law.parameters))
