# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The numeric path: quick, equal to the symbolic one, polynomial in branches and two-ports."""

from __future__ import annotations

import dataclasses
import pickle

from lg_husky_sim.husky import network
from lg_husky_sim.linear_graph import (
    Branch,
    compile_numeric,
    derive,
    Domain,
    Form,
    Kind,
    LinearGraph,
    normal_tree,
    TwoPort,
)
import numpy as np
from numpy.typing import NDArray
import pytest
import sympy

E = Domain.ELECTRICAL


def ladder(cells: int, kind: Kind = Kind.TRANSFORMER, coupled: bool = False) -> LinearGraph:
    """Return cells of inductor, resistor and capacitor, with a two-port between cells if asked."""
    branches = [Branch('V', Kind.ACROSS_SOURCE, E, 'a0', 'ground')]
    two_ports = []
    for k in range(cells):
        end = f'd{k}' if coupled else f'a{k + 1}'
        branches += [
            Branch(f'L{k}', Kind.T_TYPE, E, f'a{k}', f'b{k}', f'L{k}'),
            Branch(f'R{k}', Kind.D_TYPE, E, f'b{k}', end, f'R{k}'),
            Branch(f'C{k}', Kind.A_TYPE, E, end, 'ground', f'C{k}')]
        if coupled:
            two_ports.append(TwoPort(f'n{k}', kind, (E, end, 'ground'),
                                     (E, f'a{k + 1}', 'ground'), f'n{k}'))
    if coupled:
        branches.append(Branch('load', Kind.D_TYPE, E, f'a{cells}', 'ground', 'R0'))
    return LinearGraph(tuple(branches), tuple(two_ports))


def test_numbers_equal_symbols_for_the_husky(husky: LinearGraph, paper: dict[str, float]) -> None:
    outputs = ['tau(TF_2.2)', 'i(L_1)', 'tau(T_ML.2)']
    numbers = compile_numeric(husky, outputs).at(paper)
    symbols = derive(husky, outputs)
    given = {sympy.Symbol(name): value for name, value in paper.items()}
    for name in ('A', 'B', 'C', 'D'):
        expected = np.array(getattr(symbols, name).subs(given), dtype=float)
        np.testing.assert_allclose(getattr(numbers, name), expected, rtol=1e-10, atol=1e-9)


def test_state_space_is_read_only_and_frozen(husky: LinearGraph, paper: dict[str, float]) -> None:
    space = compile_numeric(husky).at(paper)
    with pytest.raises(ValueError, match='read-only'):
        space.A[0, 0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        space.A = space.B  # type: ignore[misc]
    text = str(space)
    assert text.startswith('x = omega(J_LW), omega(J_RW), v(M_H), omega(J_H), i(L_1), i(L_2)\n')
    assert 'u = V_s1, V_s2' in text


@pytest.mark.parametrize('kind', [Kind.TRANSFORMER, Kind.GYRATOR])
def test_normal_tree_of_forty_two_ports_is_found(kind: Kind) -> None:
    graph = ladder(40, kind, coupled=True)
    assert len(graph.edges) == 202
    tree = normal_tree(graph)    # trying 2^40 placements would take years
    in_tree = set(tree.tree)
    for number in range(40):
        ports = {f'n{number}.1', f'n{number}.2'} & in_tree
        assert len(ports) == 1 if kind is Kind.TRANSFORMER else len(ports) in (0, 2)
    # a gyrator behind a capacitor sets the current of the inductor that follows it
    expected = () if kind is Kind.TRANSFORMER else tuple(f'L{k}' for k in range(1, 40))
    assert tree.dependent == expected


def test_hundred_storages_derive_in_numbers() -> None:
    graph = ladder(50)
    model = compile_numeric(graph)
    space = model.at(dict.fromkeys(model.parameters, 1.0))
    assert len(space.states) == 100
    # capacitors come first: C_k dv_k/dt = i_k - i_k+1 and L_k di_k/dt = v_k-1 - R i_k - v_k
    eye, shift = np.eye(50), np.eye(50, k=1)
    expected = np.block([[np.zeros((50, 50)), eye - shift], [shift.T - eye, -eye]])
    np.testing.assert_allclose(space.A, expected, atol=1e-12)


def test_repeated_source_names_share_one_input() -> None:
    graph = LinearGraph((
        Branch('V_1', Kind.ACROSS_SOURCE, E, 'a', 'ground', 'V_bus'),
        Branch('V_2', Kind.ACROSS_SOURCE, E, 'b', 'ground', 'V_bus'),
        Branch('R_1', Kind.D_TYPE, E, 'a', 'c', 'R'), Branch('R_2', Kind.D_TYPE, E, 'b', 'c', 'R'),
        Branch('C', Kind.A_TYPE, E, 'c', 'ground', 'C')))
    space = compile_numeric(graph).at({'R': 2.0, 'C': 1.0})
    assert space.inputs == ('V_bus',)
    np.testing.assert_allclose(space.B, [[1.0]])


def test_graphs_are_edited_without_changing(husky: LinearGraph) -> None:
    before = husky.fingerprint()
    added = husky.with_branches(
        Branch('B_x', Kind.D_TYPE, Domain.TRANSLATIONAL, 'body', 'ground', 'B_x'))
    assert husky.fingerprint() == before
    assert added.fingerprint() != before
    assert added.without('B_x').fingerprint() == before
    assert added.without('B_x') == husky
    assert hash(added.without('B_x')) == hash(husky)
    doubled = husky.replacing(dataclasses.replace(husky.branches[1], value='2*R_1'))
    assert [b.name for b in doubled.branches] == [b.name for b in husky.branches]
    assert doubled.branches[1].value == '2*R_1'
    ratio = dataclasses.replace(husky.two_ports[0], value='3*k_t*GR')
    assert husky.replacing(ratio).two_ports[0] == ratio


def test_a_compiled_graph_travels_between_processes(
        husky: LinearGraph, paper: dict[str, float]) -> None:
    model = compile_numeric(husky, ['v(M_H)'])
    copy = pickle.loads(pickle.dumps(model))
    np.testing.assert_array_equal(copy.at(paper).A, model.at(paper).A)
    assert copy.outputs == ('v(M_H)',)


def test_ground_names_are_copied_and_other_things_refused() -> None:
    grounds = {E: 'gnd'}
    graph = LinearGraph((Branch('C', Kind.A_TYPE, E, 'a', 'gnd', 'C'),), (), grounds)
    grounds[E] = 'other'
    assert graph.ground_of(E) == (E, 'gnd')
    with pytest.raises(TypeError, match=r'is neither a Branch nor a TwoPort'):
        graph.with_branches('R')  # type: ignore[arg-type]


def test_forms_of_d_and_t_types() -> None:
    source = Branch('F', Kind.THROUGH_SOURCE, Domain.TRANSLATIONAL, 'ground', 'x')
    mass = Branch('m', Kind.A_TYPE, Domain.TRANSLATIONAL, 'x', 'ground', 'm')

    def poles(form_d: Form, form_t: Form, b: float, k: float,
              ) -> NDArray[np.complex128]:
        graph = LinearGraph((source, mass, Branch(
            'b', Kind.D_TYPE, Domain.TRANSLATIONAL, 'x', 'ground', 'b', form_d), Branch(
            'k', Kind.T_TYPE, Domain.TRANSLATIONAL, 'x', 'ground', 'k', form_t)))
        return compile_numeric(graph).at({'m': 1.5, 'b': b, 'k': k}).poles
    expected = poles(Form.DAMPING, Form.STIFFNESS, 4.0, 8.0)
    np.testing.assert_allclose(poles(Form.RESISTANCE, Form.INERTANCE, 0.25, 0.125), expected)


def test_effort_outputs_have_their_feed_through(
        husky: LinearGraph, paper: dict[str, float]) -> None:
    from lg_husky_sim.linear_graph import Characteristic
    drop = Branch('E_b', Kind.ACROSS_SOURCE, E, 'supply_1', 'after', characteristic=Characteristic(
        'cubic', ('i(L_1)',), ('p', 'q')))
    moved = dataclasses.replace(husky.branches[1], tail='after')
    graph = husky.replacing(moved).with_branches(drop)
    space = compile_numeric(graph, ['V(L_1)', 'i(L_1)']).at(paper)
    np.testing.assert_allclose(space.G[4], -1.0 / paper['L_1'])
    np.testing.assert_allclose(space.L_c, [[-1.0], [0.0]])
    np.testing.assert_allclose(space.H, np.eye(6)[[4]])


def test_network_of_the_package_has_the_fixture_s_matrices(
        husky: LinearGraph, paper: dict[str, float]) -> None:
    values = {
        'wheel_inertia': paper['J_LW'], 'wheel_radius': paper['r_W'], 'track': 2.0 * paper['c'],
        'wheelbase': 0.512, 'mass': paper['M_H'], 'yaw_inertia': paper['J_H'],
        'yaw_damping': paper['B_H'], 'wheel_damping': paper['B_RL'],
        'motor_resistance': paper['R_1'], 'motor_inductance': paper['L_1'],
        'torque_constant': paper['k_t'], 'gear_ratio': paper['GR']}
    ours = compile_numeric(network.simplified()).at(values)
    fixture = compile_numeric(husky).at(paper)
    assert ours.states == fixture.states
    np.testing.assert_allclose(ours.A, fixture.A, rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize('value', [
    'sqrt(a)*b', 'a**0.5', 'pi*r**2', 'exp(a)/1e-05', 'abs(a - b)', '(a + b)**2', 'tanh(a) + 1',
    '2', '1.5e-3', 'a**-2', 'sin(a)**2 + cos(a)**2', 'atan(a/b) - -a', 'cos(atan(a/b))',
])
def test_values_mean_the_same_in_numbers_and_symbols(value: str) -> None:
    graph = LinearGraph((
        Branch('V', Kind.ACROSS_SOURCE, E, 'a', 'ground'),
        Branch('R', Kind.D_TYPE, E, 'a', 'b', value),
        Branch('C', Kind.A_TYPE, E, 'b', 'ground', 'C')))
    values = {'a': 0.5, 'b': 2.0, 'r': 3.0, 'C': 1.5}
    symbol = derive(graph).A[0, 0].subs({sympy.Symbol(n): v for n, v in values.items()})
    assert compile_numeric(graph).at(values).A[0, 0] == pytest.approx(float(symbol), rel=1e-12)
