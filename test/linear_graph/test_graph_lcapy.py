# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Electrical graphs against lcapy's modified nodal analysis, an independent implementation."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lg_husky_sim.linear_graph import (
    Branch,
    compile_numeric,
    Domain,
    Kind,
    LinearGraph,
    StateSpace,
    TwoPort,
)
from lg_husky_sim.linear_graph.netlist import read_netlist
import numpy as np
import pytest

lcapy: Any = pytest.importorskip(
    'lcapy', reason='lcapy, the independent nodal solution, is not here: pip install lcapy')

EXAMPLES = Path(__file__).resolve().parents[2] / 'examples' / 'linear_graph'
E = Domain.ELECTRICAL
POINTS = (0.3 + 1.1j, 2.0 + 0.0j, -0.1 + 4.0j)
LETTERS = {Kind.D_TYPE: 'R', Kind.A_TYPE: 'C', Kind.T_TYPE: 'L'}


def bridge() -> tuple[LinearGraph, str]:
    """Return a Wheatstone bridge of all kinds behind a transformer, and its output."""
    branches = (
        Branch('V_s', Kind.ACROSS_SOURCE, E, 'p', 'ground'),
        Branch('R_0', Kind.D_TYPE, E, 'p', 'q', 'R_0'),
        Branch('R_1', Kind.D_TYPE, E, 'a', 'b', 'R_1'),
        Branch('C_1', Kind.A_TYPE, E, 'b', 'ground', 'C_1'),
        Branch('L_1', Kind.T_TYPE, E, 'a', 'c', 'L_1'),
        Branch('R_2', Kind.D_TYPE, E, 'c', 'ground', 'R_2'),
        Branch('C_2', Kind.A_TYPE, E, 'b', 'c', 'C_2'))
    transformer = TwoPort('n', Kind.TRANSFORMER, (E, 'q', 'ground'), (E, 'a', 'ground'), 'n')
    return LinearGraph(branches, (transformer,)), 'V(C_2)'


def example(name: str, output: str) -> tuple[LinearGraph, str]:
    return read_netlist(EXAMPLES / f'{name}.yaml').graph, output


SYSTEMS = {
    'parallel': lambda: example('rowell_5_1_rlc_parallel', 'V(C)'),
    'series': lambda: example('rowell_5_5_rlc_series', 'V(L)'),
    'loop of capacitors': lambda: example('loop_of_capacitors', 'V(C_2)'),
    'inductors in series': lambda: example('inductors_in_series', 'V(L_2)'),
    'gyrator': lambda: example('gyrator_makes_an_inductor', 'V(C)'),
    'Sallen-Key': lambda: example('sallen_key', 'V(C_2)'),
    'bridge': bridge,
}


def to_lcapy(graph: LinearGraph, values: dict[str, float]) -> Any:
    """Return lcapy's circuit of a graph, its voltage source left out."""
    names = [name for _, name in graph.nodes if name != 'ground']
    numbers = {'ground': 0, **{name: at + 1 for at, name in enumerate(names)}}
    lines = []
    for at, branch in enumerate(graph.branches):
        tail, head = numbers[branch.tail], numbers[branch.head]
        if branch.kind in LETTERS:
            lines.append(f'{LETTERS[branch.kind]}{at} {tail} {head} {values[branch.value]}')
        elif branch.characteristic is not None:
            # the only modulated source here follows the voltage of a capacitor to ground
            (controlling,) = branch.characteristic.of
            node = next(b.tail for b in graph.branches if f'V({b.name})' == controlling)
            lines.append(f'E{at} {tail} {head} {numbers[node]} 0 {values["g"]}')
    for at, two_port in enumerate(graph.two_ports):
        (_, *one), (_, *two) = two_port.port1, two_port.port2
        ends = ' '.join(str(numbers[node]) for node in (*two, *one))
        value = values[two_port.value]
        # lcapy: secondary first; its ratio is secondary over primary, ours primary over secondary
        lines.append(f'TF{at} {ends} {1.0 / value}' if two_port.kind is Kind.TRANSFORMER else
                     f'GY{at} {ends} {value}')
    return lcapy.Circuit('\n'.join(lines)), numbers


def transfer(space: StateSpace, s: complex) -> complex:
    states = np.linalg.solve(s * np.eye(len(space.states)) - space.A, space.B + s * space.E)
    found = space.C @ states + space.D + s * space.F
    return complex(found[0, 0])


@pytest.mark.parametrize('name', SYSTEMS)
def test_transfer_function_is_lcapy_s(name: str) -> None:
    graph, output = SYSTEMS[name]()
    model = compile_numeric(graph, [output])
    dice = np.random.default_rng(3)
    values = {p: float(np.round(dice.uniform(0.5, 2.0), 3)) for p in model.parameters}
    circuit, numbers = to_lcapy(graph, values)
    edge = graph.edges[graph.variable(output).edge]
    source = graph.of_kind(Kind.ACROSS_SOURCE)[0]
    found = circuit.transfer(numbers[source.tail], 0, numbers[edge.tail[1]],
                             numbers[edge.head[1]]).sympy
    (s,) = found.free_symbols
    for point in POINTS:
        expected = complex(found.subs(s, point).evalf())
        ours = transfer(model.at(values), point)
        if name == 'gyrator':       # the sense of a gyrator's second port is a convention
            assert abs(abs(ours) - abs(expected)) < 1e-9
        else:
            assert abs(ours - expected) < 1e-9 * max(1.0, abs(expected))
