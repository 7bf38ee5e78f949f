# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Named mistakes of a linear graph; each message says which branch and what to do."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lg_husky_sim.errors import GraphError
from lg_husky_sim.linear_graph.elements import Branch, Domain, Kind, SOURCES, TwoPort
from lg_husky_sim.linear_graph.expressions import names_in

if TYPE_CHECKING:
    from lg_husky_sim.linear_graph.graph import Edge, LinearGraph, Node

USUAL_GROUNDS = ('0', 'gnd', 'grnd', 'ground', 'earth', 'reference')
"""Names that ground often has, in small letters."""


def check_graph(graph: LinearGraph) -> None:
    """
    Check everything that can be seen from the graph's shape.

    Raises
    ------
    GraphError
        For the first mistake found.

    """
    if not graph.edges:
        raise GraphError('the graph has no branches')
    _check_names(graph)
    _check_nodes(graph)
    _check_grounding(graph)
    _check_masses(graph)
    _check_across_loops(graph)
    _check_characteristics(graph)
    _check_inputs(graph)


def check_complete(graph: LinearGraph) -> None:
    """
    Check what may be missing while a graph is being edited, but not when it is derived.

    Raises
    ------
    GraphError
        If through sources alone connect a node, or a branch ends at nothing.

    """
    _check_through_cuts(graph)
    _check_open_ends(graph)


def check_number(element: Branch | TwoPort, number: float, shown: str) -> None:
    """
    Check the number of a passive element, as far as it holds whatever the graph is.

    Parameters
    ----------
    element : Branch or TwoPort
        Storage, dissipator or two-port.
    number : float
        Its value.
    shown : str
        The value as it is written.

    Raises
    ------
    GraphError
        If a storage is not positive, a dissipator negative, or the value of a two-port zero.

    """
    if isinstance(element, TwoPort):
        allowed, right = 'not zero', number != 0.0
    elif element.kind is Kind.D_TYPE:
        allowed, right = 'zero or positive', number >= 0.0
    else:
        allowed, right = 'positive', number > 0.0
    if not right:
        raise GraphError(f'value = {shown} is not allowed; it must be {allowed}')


def check_symbols(graph: LinearGraph) -> None:
    """
    Check that elements, parameters and inputs can stand in one equation: a name means one thing.

    Raises
    ------
    GraphError
        If a parameter has the name of an element whose value is another one, or a source's input
        the name of an element's value or of a parameter.

    """
    elements: list[Branch | TwoPort] = [*graph.branches, *graph.two_ports]
    values = {e.name: e.value for e in elements if e.characteristic is None
              and not (isinstance(e, Branch) and e.kind in SOURCES)}
    owners: dict[str, str] = {}
    for element in elements:
        law = element.characteristic
        if law is None and element.name not in values:
            continue
        for name in names_in(element.value) if law is None else law.parameters:
            owner = f'of {"" if law is None else "the law of "}{element.name!r}'
            owners.setdefault(name, owner)
            if values.get(name, name) != name:
                raise GraphError(
                    f'parameter {name!r} {owner} has the name of element '
                    f'{name!r}, whose value is {values[name]!r}; give one of them another name')
    for source in graph.of_kind(*SOURCES):
        name = source.input_name
        if source.characteristic is None and (name in values or name in owners):
            other = f'parameter {owners[name]}' if name in owners else 'value of an element'
            raise GraphError(f'the input {name!r} of source {source.name!r} has the name of the '
                             f'{other}; give one of them another name')


def _check_names(graph: LinearGraph) -> None:
    seen: set[str] = set()
    for name in graph.names:
        if name in seen:
            raise GraphError(f'the name {name!r} is used twice; every branch and two-port needs '
                             'a name of its own')
        seen.add(name)


def _check_inputs(graph: LinearGraph) -> None:
    first: dict[str, Branch] = {}
    for source in graph.of_kind(*SOURCES):
        if source.characteristic is not None:
            continue
        one = first.setdefault(source.input_name, source)
        if (one.kind, one.domain) != (source.kind, source.domain):
            raise GraphError(
                f'sources {one.name!r} ({one.domain.value} {one.kind.value}) and {source.name!r} '
                f'({source.domain.value} {source.kind.value}) share the input '
                f'{source.input_name!r}, but not its unit; give each its own')


def _check_nodes(graph: LinearGraph) -> None:
    owner: dict[str, Edge] = {}
    for edge in graph.edges:
        ground = graph.ground_of(edge.domain)
        for node in (edge.tail, edge.head):
            if node == ground:
                continue
            first = owner.setdefault(node[1], edge)
            if first.domain is not edge.domain:
                raise GraphError(
                    f'node {node[1]!r} is {first.domain.value} at {first.name!r} and '
                    f'{edge.domain.value} at {edge.name!r}; only a two-port joins domains, so '
                    'correct the domain or give the nodes two names')


def _check_grounding(graph: LinearGraph) -> None:
    for domain in graph.domains:
        edges = [edge for edge in graph.edges if edge.domain is domain]
        ground = graph.ground_of(domain)
        if all(ground not in (edge.tail, edge.head) for edge in edges):
            raise GraphError(
                f'the {domain.value} domain has no ground: no branch touches node {ground[1]!r}; '
                f'connect one of {", ".join(edge.name for edge in edges[:6])} to it, or say which '
                f'node is ground: {_usual_ground(graph, domain) or "ground: NODE"}')
        reached = Forest()
        for edge in edges:
            reached.join(edge.tail, edge.head)
        for edge in edges:
            if reached.find(edge.tail) != reached.find(ground):
                part = [e.name for e in edges if reached.find(e.tail) == reached.find(edge.tail)]
                raise GraphError(
                    f'node {edge.tail[1]!r} floats: {", ".join(part[:6])} '
                    f'{"has" if len(part) == 1 else "have"} no way to the '
                    f'{domain.value} ground {ground[1]!r}; connect one of them to it'
                    f'{_other_ground(graph, domain)}')


def _usual_ground(graph: LinearGraph, domain: Domain) -> str:
    """Return what to write where a node has a usual name of ground and is none; '' for none."""
    names = (name for kind, name in graph.nodes
             if kind is domain and name != graph.ground_of(domain)[1])
    return next((f'ground: {name}' for name in names if name.lower() in USUAL_GROUNDS), '')


def _other_ground(graph: LinearGraph, domain: Domain) -> str:
    usual = _usual_ground(graph, domain)
    return f', or write {usual} if that node is ground' if usual else ''


def _check_masses(graph: LinearGraph) -> None:
    inertial = {Domain.TRANSLATIONAL: 'velocity of a mass', Domain.THERMAL:
                'temperature of a heat capacity', Domain.ROTATIONAL: 'speed of an inertia'}
    for branch in graph.of_kind(Kind.A_TYPE):
        ground = graph.ground_of(branch.domain)[1]
        if branch.domain in inertial and ground not in (branch.tail, branch.head):
            raise GraphError(f'A-type {branch.name!r} lies between {branch.tail!r} and '
                             f'{branch.head!r}; the {inertial[branch.domain]} is measured against '
                             f'ground, so one end must be {ground!r}')


def _check_across_loops(graph: LinearGraph) -> None:
    forest = Forest()
    sources = graph.of_kind(Kind.ACROSS_SOURCE)
    for at, branch in enumerate(sources):
        tail, head = (branch.domain, branch.tail), (branch.domain, branch.head)
        if not forest.join(tail, head):
            path = path_between(sources[:at], tail, head)
            raise GraphError(f'across sources {", ".join((*path, branch.name))} form a loop, so '
                             'they may contradict each other; remove one, or put a D-type in '
                             'series')


def path_between(branches: tuple[Branch, ...], start: Node, end: Node) -> tuple[str, ...]:
    """Return the names of the branches on the only way between two nodes of a forest."""
    ways: dict[Node, tuple[str, ...]] = {start: ()}
    frontier = [start]
    while frontier and end not in ways:
        node = frontier.pop()
        for branch in branches:
            pair = ((branch.domain, branch.tail), (branch.domain, branch.head))
            if node in pair:
                other = pair[1] if pair[0] == node else pair[0]
                if other not in ways:
                    ways[other] = (*ways[node], branch.name)
                    frontier.append(other)
    return ways.get(end, ())


def _check_through_cuts(graph: LinearGraph) -> None:
    forest = Forest()
    sources = [e for e in graph.edges
               if isinstance(e.owner, Branch) and e.owner.kind is Kind.THROUGH_SOURCE]
    for edge in graph.edges:
        if edge not in sources:
            forest.join(edge.tail, edge.head)
    for domain in graph.domains:
        ground = forest.find(graph.ground_of(domain))
        for node in (n for n in graph.nodes if n[0] is domain):
            if forest.find(node) != ground:
                part = forest.find(node)
                cut = [e.name for e in sources
                       if (forest.find(e.tail) == part) != (forest.find(e.head) == part)]
                sources_say = (
                    f'through source {cut[0]} alone connects node {node[1]!r}, so its flow has '
                    'no other way' if len(cut) == 1 else
                    f'through sources {", ".join(cut)} alone connect node {node[1]!r}, so they '
                    'may contradict each other')
                raise GraphError(f'{sources_say} and the across variable is open; put another '
                                 f'element in parallel{_other_ground(graph, domain)}')


def _check_open_ends(graph: LinearGraph) -> None:
    """Refuse nodes with one branch, unless it is an A-type at rest or a source of a signal."""
    at_node: dict[Node, list[Edge]] = {}
    for edge in graph.edges:
        for node in (edge.tail, edge.head):
            at_node.setdefault(node, []).append(edge)
    for node, edges in at_node.items():
        owner = edges[0].owner
        if len(edges) > 1 or node == graph.ground_of(node[0]) or (
                isinstance(owner, Branch) and owner.kind in (Kind.A_TYPE, Kind.ACROSS_SOURCE)):
            continue
        raise GraphError(f'node {node[1]!r} has no branch but {edges[0].name!r}, so nothing can '
                         'flow through it; correct the node, or connect another element')


def _check_characteristics(graph: LinearGraph) -> None:
    elements: list[Branch | TwoPort] = [*graph.branches, *graph.two_ports]
    for element in elements:
        if element.characteristic is None:
            continue
        for text in element.characteristic.of:
            try:
                graph.variable(text)
            except GraphError as error:
                raise GraphError(f'characteristic of {element.name!r}: {error}') from error


class Forest:
    """Sets of nodes joined so far (union-find)."""

    def __init__(self) -> None:
        """Start with every node by itself."""
        self._parent: dict[Node, Node] = {}

    def find(self, node: Node) -> Node:
        """Return the representative of the node's set."""
        while (parent := self._parent.get(node, node)) != node:
            self._parent[node] = self._parent.get(parent, parent)
            node = parent
        return node

    def join(self, one: Node, other: Node) -> bool:
        """Join two sets; False if they were one already."""
        first, second = self.find(one), self.find(other)
        if first == second:
            return False
        self._parent[first] = second
        return True
