# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Invariants over random graphs in all domains, 1000 draws each, with fixed seeds.

The independent solution is a sparse tableau in complex frequency: Kirchhoff's laws and every
element's law as one system, without tree, causality or states.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
import random

from lg_husky_sim.errors import GraphError
from lg_husky_sim.linear_graph import (
    Branch,
    compile_numeric,
    Domain,
    Form,
    Kind,
    LinearGraph,
    NumericModel,
    StateSpace,
    TwoPort,
)
import numpy as np
from numpy.typing import ArrayLike, NDArray
import pytest

DRAWS = 1000
PASSIVE = (Kind.A_TYPE, Kind.T_TYPE, Kind.D_TYPE)
SOURCES = (Kind.ACROSS_SOURCE, Kind.THROUGH_SOURCE)
GROUNDED = (Domain.TRANSLATIONAL, Domain.ROTATIONAL, Domain.THERMAL)
Values = dict[str, float]


@dataclass(frozen=True)
class Draw:
    """A random graph with numbers, compiled with all across and through variables as outputs."""

    graph: LinearGraph
    values: Values
    model: NumericModel
    space: StateSpace


def all_variables(graph: LinearGraph) -> list[str]:
    return [graph.variable_name(edge, across) for across in (True, False)
            for edge in range(len(graph.edges))]


def random_graph(dice: random.Random) -> tuple[LinearGraph, Values]:
    """Return a random graph, not always a valid one, and a number for each parameter."""
    branches: list[Branch] = []
    two_ports: list[TwoPort] = []
    nodes: dict[Domain, list[str]] = {}

    def add(domain: Domain, kind: Kind, tail: str, head: str) -> None:
        if kind is Kind.T_TYPE and domain is Domain.THERMAL:
            kind = Kind.D_TYPE
        if kind is Kind.A_TYPE and domain in GROUNDED:
            tail, head = (tail, 'ground') if dice.random() < 0.7 else ('ground', tail)
        name = f'e{len(branches)}'
        forms = {Kind.D_TYPE: (Form.DAMPING, Form.RESISTANCE),
                 Kind.T_TYPE: (Form.STIFFNESS, Form.INERTANCE)}.get(kind)
        branches.append(Branch(name, kind, domain, tail, head, name,
                               dice.choice(forms) if forms else None))

    for number, domain in enumerate(dice.sample(list(Domain), dice.randint(1, 3))):
        nodes[domain] = [f'n{number}{at}' for at in range(dice.randint(1, 4))]
        for at, node in enumerate(nodes[domain]):
            add(domain, dice.choice(PASSIVE), node, dice.choice(['ground', *nodes[domain][:at]]))
        for _ in range(dice.randint(1, 4)):
            tail, head = dice.sample(['ground', *nodes[domain]], 2)
            if tail == 'ground':
                tail, head = head, tail
            add(domain, dice.choice((*PASSIVE, *PASSIVE, *SOURCES)), tail, head)
    coupled = [domain for domain in nodes if domain is not Domain.THERMAL]
    for at in range(dice.randint(0, 4) if coupled else 0):
        ports = []
        for _ in range(2):
            domain = dice.choice(coupled)
            tail, head = dice.sample(['ground', *nodes[domain]], 2)
            ports.append((domain, tail, head))
        kind = dice.choice((Kind.TRANSFORMER, Kind.GYRATOR))
        two_ports.append(TwoPort(f'p{at}', kind, ports[0], ports[1], f'p{at}'))
    graph = LinearGraph(tuple(branches), tuple(two_ports))
    values = {name: dice.uniform(0.2, 3.0) for name in graph.names}
    values.update({p.name: values[p.name] * dice.choice((-1.0, 1.0)) for p in two_ports})
    return graph, values


@pytest.fixture(scope='module', name='draws')
def draw_graphs() -> list[Draw]:
    """Return valid random graphs; at least every fifth attempt must be one."""
    dice = random.Random(20240117)
    found: list[Draw] = []
    attempts = 0
    while len(found) < DRAWS:
        attempts += 1
        assert attempts < 5 * DRAWS
        try:
            graph, values = random_graph(dice)
            model = compile_numeric(graph, all_variables(graph))
        except GraphError:
            continue
        found.append(Draw(graph, values, model, model.at(values)))
    return found


def powers(draw: Draw, state: ArrayLike, inputs: ArrayLike, input_rates: ArrayLike,
           ) -> NDArray[np.float64]:
    """Return across times through, for every edge."""
    space = draw.space
    y = (space.C @ np.asarray(state) + space.D @ np.asarray(inputs)
         + space.F @ np.asarray(input_rates))
    across, through = np.split(y, 2)
    product: NDArray[np.float64] = across * through
    return product


def test_power_sums_to_zero_over_all_branches(draws: list[Draw]) -> None:
    numbers = np.random.default_rng(11)
    with_excess = with_two_ports = 0
    for draw in draws:
        n, m = draw.space.B.shape
        power = powers(draw, numbers.normal(size=n), numbers.normal(size=m),
                       numbers.normal(size=m))
        assert abs(power.sum()) <= 1e-9 * max(1.0, np.abs(power).sum())
        with_excess += bool(draw.model.dependent)
        with_two_ports += bool(draw.graph.two_ports)
    assert with_excess > DRAWS / 10
    assert with_two_ports > DRAWS / 3


def test_passive_networks_never_gain_energy(draws: list[Draw]) -> None:
    numbers = np.random.default_rng(12)
    for draw in draws:
        n, m = draw.space.B.shape
        power = powers(draw, numbers.normal(size=n), np.zeros(m), np.zeros(m))
        stored = sum(power[at] for at, branch in enumerate(draw.graph.branches)
                     if branch.kind in (Kind.A_TYPE, Kind.T_TYPE))
        lost = sum(power[at] for at, branch in enumerate(draw.graph.branches)
                   if branch.kind is Kind.D_TYPE and branch.domain is not Domain.THERMAL)
        scale = max(1.0, np.abs(power).sum())
        assert stored <= 1e-9 * scale
        assert lost >= -1e-9 * scale
        largest = max(1.0, float(np.abs(draw.space.A).max(initial=0.0)))
        assert draw.space.poles.real.max(initial=0.0) <= 1e-6 * largest


def transfer(space: StateSpace, s: complex) -> NDArray[np.complex128]:
    """Return outputs over inputs at a complex frequency."""
    n = space.A.shape[0]
    states = np.linalg.solve(s * np.eye(n) - space.A, space.B + s * space.E)
    found: NDArray[np.complex128] = space.C @ states + space.D + s * space.F
    return found


def tableau(graph: LinearGraph, values: Mapping[str, float], s: complex,
            inputs: tuple[str, ...]) -> NDArray[np.complex128]:
    """Solve Kirchhoff's laws and the elements' laws at once for all across and through."""
    incidence = graph.incidence()
    nodes, count = incidence.shape
    size = nodes + 2 * count
    left = np.zeros((size, size), dtype=complex)
    right = np.zeros((size, len(inputs)), dtype=complex)
    v, f = nodes, nodes + count
    left[:count, :nodes], left[:count, v:f] = -incidence.T, np.eye(count)
    left[count:count + nodes, f:] = incidence
    row = count + nodes
    for at, branch in enumerate(graph.branches):
        value = values[branch.value or branch.name]
        match branch.kind:
            case Kind.ACROSS_SOURCE:
                left[row, v + at], right[row, inputs.index(branch.input_name)] = 1.0, 1.0
            case Kind.THROUGH_SOURCE:
                left[row, f + at], right[row, inputs.index(branch.input_name)] = 1.0, 1.0
            case Kind.A_TYPE:
                left[row, f + at], left[row, v + at] = 1.0, -s * value
            case Kind.T_TYPE:
                inertance = 1.0 / value if branch.form is Form.STIFFNESS else value
                left[row, v + at], left[row, f + at] = 1.0, -s * inertance
            case _:
                resistance = 1.0 / value if branch.form is Form.DAMPING else value
                left[row, v + at], left[row, f + at] = 1.0, -resistance
        row += 1
    for number, two_port in enumerate(graph.two_ports):
        one = len(graph.branches) + 2 * number
        two, ratio = one + 1, values[two_port.name]
        if two_port.kind is Kind.TRANSFORMER:
            left[row, v + one], left[row, v + two] = 1.0, -ratio
            left[row + 1, f + two], left[row + 1, f + one] = 1.0, ratio
        else:
            left[row, v + one], left[row, f + two] = 1.0, -ratio
            left[row + 1, v + two], left[row + 1, f + one] = 1.0, ratio
        row += 2
    solution: NDArray[np.complex128] = np.linalg.solve(left, right)[nodes:].astype(
        np.complex128)
    return solution


def close(found: NDArray[np.complex128], expected: NDArray[np.complex128]) -> bool:
    scale = max(1.0, float(np.abs(expected).max(initial=0.0)))
    return bool(np.abs(found - expected).max(initial=0.0) <= 1e-7 * scale)


def test_matrices_agree_with_an_independent_tableau(draws: list[Draw]) -> None:
    driven = 0
    for draw in draws:
        s = complex(0.37, 1.91)
        expected = tableau(draw.graph, draw.values, s, draw.space.inputs)
        assert close(transfer(draw.space, s), expected), draw.graph
        driven += expected.size > 0
    assert driven > DRAWS / 3


def renamed(draw: Draw, dice: random.Random) -> tuple[LinearGraph, Values]:
    """Return the graph with other names, another order and shuffled nodes."""
    names = {name: f'x{dice.randrange(10**9)}_{at}' for at, name in enumerate(draw.graph.names)}
    nodes = {node: f'm{dice.randrange(10**9)}_{at}'
             for at, (_, node) in enumerate(draw.graph.nodes)}
    nodes['ground'] = 'ground'
    branches = [replace(
        b, name=names[b.name], tail=nodes[b.tail], head=nodes[b.head],
        value=b.input_name if b.kind in SOURCES else names[b.name])
        for b in draw.graph.branches]
    two_ports = [replace(
        t, name=names[t.name], value=names[t.name],
        port1=(t.port1[0], nodes[t.port1[1]], nodes[t.port1[2]]),
        port2=(t.port2[0], nodes[t.port2[1]], nodes[t.port2[2]])) for t in draw.graph.two_ports]
    dice.shuffle(branches)
    dice.shuffle(two_ports)
    values = {names[name]: value for name, value in draw.values.items()}
    return LinearGraph(tuple(branches), tuple(two_ports)), values


def test_naming_and_order_do_not_matter(draws: list[Draw]) -> None:
    dice = random.Random(4)
    s = complex(-0.21, 0.83)
    for draw in draws:
        graph, values = renamed(draw, dice)
        names = {new: old for old, new in zip(
            sorted(draw.values, key=lambda n: draw.values[n]),
            sorted(values, key=lambda n: values[n]), strict=True)}
        model = compile_numeric(graph, all_variables(graph))
        space = model.at(values)
        assert len(space.states) == len(draw.space.states)
        edge_names = [edge.name.replace(edge.owner.name, names[edge.owner.name])
                      for edge in graph.edges]
        old = [edge.name for edge in draw.graph.edges]
        places = [edge_names.index(name) for name in old]
        rows = [*places, *(len(places) + at for at in places)]
        columns = [space.inputs.index(name) for name in draw.space.inputs]
        found = transfer(space, s)[np.ix_(rows, columns)]
        assert close(found, transfer(draw.space, s)), draw.graph


def split(draw: Draw, dice: random.Random) -> tuple[LinearGraph, Values]:
    """Replace one passive element by two halves, in series or in parallel."""
    branch = dice.choice([b for b in draw.graph.branches if b.kind in PASSIVE])
    grounded = branch.kind is Kind.A_TYPE and branch.domain in GROUNDED
    in_series = dice.random() < 0.5 and not grounded
    # values that add in series: resistances, inertances; in parallel: the others
    adds = (branch.kind is Kind.D_TYPE and not branch.is_damping) or (
        branch.kind is Kind.T_TYPE and not branch.is_stiffness)
    share, value = dice.uniform(0.2, 0.8), draw.values[branch.name]
    parts = (share * value, (1.0 - share) * value) if adds == in_series else (
        value / share, value / (1.0 - share))
    first = replace(branch, head='middle') if in_series else branch
    second = replace(branch, name='half', value='half',
                     tail='middle' if in_series else branch.tail)
    graph = draw.graph.with_branches(second).replacing(first)
    return graph, {**draw.values, branch.name: parts[0], 'half': parts[1]}


def test_series_and_parallel_halves_make_the_whole(draws: list[Draw]) -> None:
    dice = random.Random(5)
    s = complex(0.6, 1.1)
    for draw in draws:
        graph, values = split(draw, dice)
        halved = {b.name for b in graph.branches
                  if b.name == 'half' or values[b.name] != draw.values[b.name]}
        kept = [(edge.name, across) for across in (True, False) for edge in draw.graph.edges
                if edge.name not in halved]
        outputs = [graph.variable_name(graph.edge_index(name), across) for name, across in kept]
        space = compile_numeric(graph, outputs).at(values)
        old = [draw.space.outputs.index(name) for name in outputs]
        assert close(transfer(space, s), transfer(draw.space, s)[old]), (draw.graph, graph)
