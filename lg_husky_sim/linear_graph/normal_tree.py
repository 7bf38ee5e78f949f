# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The normal tree of a linear graph: which branches are tree and which are links.

Priorities (Rowell and Wormley, ch. 5 and 6; Karnopp's sequential causality is the same choice in
bond graphs): all across sources in the tree and all through sources links, as many A-types in
the tree and as many T-types links as possible, exactly one port of each transformer and both or
none of each gyrator, then D-types.

With two-ports this is no longer a spanning-tree problem, and trying all placements costs 2^p.
Here the one-ports are chosen first: Kirchhoff's laws and two-ports together make a
power-conserving (Lagrangian) subspace, for which a greedy choice of one variable from each pair
(across, through) is optimal (Borovik, Gelfand and White, Coxeter Matroids, ch. 4). Then the ports
are placed one after the other, each time asking whether a valid rest is left. Both cost a
polynomial number of operations, in exact arithmetic.
"""

from __future__ import annotations

from dataclasses import dataclass

from lg_husky_sim.errors import GraphError
from lg_husky_sim.linear_graph.checks import check_complete, Forest
from lg_husky_sim.linear_graph.elements import Branch, Kind, SOURCES
from lg_husky_sim.linear_graph.graph import LinearGraph
from lg_husky_sim.linear_graph.modular import (
    Elimination,
    generic_numbers,
    generic_value,
    IntArray,
    is_regular,
    PRIME,
)
import numpy as np


@dataclass(frozen=True)
class NormalTree:
    """
    Tree and links of a graph.

    Parameters
    ----------
    tree, links : tuple of str
        Names of edges (ports as ``name.1``), in the graph's order.
    dependent : tuple of str
        Excess storages: A-types that had to be links, T-types that had to be in the tree.

    """

    tree: tuple[str, ...]
    links: tuple[str, ...]
    dependent: tuple[str, ...]


def normal_tree(graph: LinearGraph) -> NormalTree:
    """
    Find the normal tree.

    Parameters
    ----------
    graph : LinearGraph
        Any valid graph.

    Returns
    -------
    NormalTree

    Raises
    ------
    GraphError
        If a branch ends at nothing, sources contradict each other through two-ports, two-ports
        leave a variable open, or a law gives the variable that the rest of the graph already
        fixes.

    """
    check_complete(graph)
    in_tree = _one_ports_in_tree(graph)
    in_tree |= _ports_in_tree(graph, in_tree)
    edges = [edge.name for edge in graph.edges]
    dependent = tuple(
        branch.name for branch in graph.branches
        if (branch.kind is Kind.A_TYPE and branch.name not in in_tree)
        or (branch.kind is Kind.T_TYPE and branch.name in in_tree))
    return NormalTree(tuple(name for name in edges if name in in_tree),
                      tuple(name for name in edges if name not in in_tree), dependent)


def _preference(branch: Branch) -> tuple[int, bool]:
    """Return (priority, whether it should be in the tree)."""
    if branch.kind in SOURCES:
        return 0, branch.kind is Kind.ACROSS_SOURCE
    if branch.kind in (Kind.A_TYPE, Kind.T_TYPE):
        return 1 if branch.kind is Kind.A_TYPE else 2, branch.kind is Kind.A_TYPE
    if branch.characteristic is not None:
        return 3, not branch.is_damping
    return 4, True


def _one_ports_in_tree(graph: LinearGraph) -> set[str]:
    elimination = _interconnection(graph)
    count = len(graph.edges)
    ordered = sorted(graph.branches, key=lambda branch: _preference(branch)[0])
    chosen: set[str] = set()
    for position, branch in enumerate(ordered):
        at = graph.edge_index(branch.name)
        priority, tree = _preference(branch)
        # a tree branch keeps its across variable, so its through variable (column + count) goes
        if not elimination.pivot(at + count if tree else at):
            if priority in (0, 3):
                raise _conflict(graph, ordered[:position], branch)
            tree = not tree
            elimination.pivot(at + count if tree else at)
        if tree:
            chosen.add(branch.name)
    return chosen


def _interconnection(graph: LinearGraph) -> Elimination:
    """Return Kirchhoff's laws and two-ports over (across, through), ports eliminated."""
    count = len(graph.edges)
    incidence = graph.incidence()
    tree, links = _any_forest(graph)
    loops = np.rint(np.linalg.solve(incidence[:, tree], incidence[:, links])).astype(np.int64)
    rows = np.zeros((count + 2 * len(graph.two_ports), 2 * count), dtype=np.int64)
    for row, link in enumerate(links):                      # across_link = Q^T across_tree
        rows[row, link] = 1
        rows[row, tree] = -loops[:, row]
    for row, branch in enumerate(tree, start=len(links)):   # through_tree = -Q through_link
        rows[row, count + branch] = 1
        rows[row, [count + link for link in links]] = loops[row - len(links)]
    ports = []
    for at, two_port in enumerate(graph.two_ports):
        ratio = generic_value(two_port.value or two_port.name)
        one, two = (graph.edge_index(f'{two_port.name}.{port}') for port in (1, 2))
        first, second = count + 2 * at, count + 2 * at + 1
        if two_port.kind is Kind.TRANSFORMER:
            rows[first, one], rows[first, two] = 1, -ratio
            rows[second, count + two], rows[second, count + one] = 1, ratio
        else:
            rows[first, one], rows[first, count + two] = 1, -ratio
            rows[second, two], rows[second, count + one] = 1, ratio
        ports.append((two_port.name, (one, two, count + one, count + two)))
    elimination = Elimination(rows)
    for name, columns in ports:
        if not all(elimination.pivot(column) for column in columns):
            raise GraphError(f'two-port {name!r} has a variable that nothing determines (its '
                             'ports are shorted, open, or doubled by other two-ports); connect '
                             'an element to it or remove it')
    return elimination


def _any_forest(graph: LinearGraph) -> tuple[list[int], list[int]]:
    forest = Forest()
    tree: list[int] = []
    links: list[int] = []
    for at, edge in enumerate(graph.edges):
        (tree if forest.join(edge.tail, edge.head) else links).append(at)
    return tree, links


def _conflict(graph: LinearGraph, earlier: list[Branch], branch: Branch) -> GraphError:
    """Name the smallest set of branches that already fixes the branch's variable."""
    count = len(graph.edges)
    needed = list(earlier)
    for candidate in earlier:
        trial = [other for other in needed if other is not candidate]
        if not _is_free(graph, trial, branch, count):
            needed = trial
    edge = graph.edge_index(branch.name)
    variable = graph.variable_name(edge, _preference(branch)[1])
    others = ', '.join(other.name for other in needed) or 'the two-ports alone'
    if branch.kind in SOURCES:
        return GraphError(f'source {branch.name!r} cannot set {variable}: it is already fixed by '
                          f'{others}; remove one of them, or put a D-type between')
    other_way = 'resistance' if branch.is_damping else 'damping'
    return GraphError(f'D-type {branch.name!r}: its law gives {variable}, which is already fixed '
                      f'by {others}; give the inverse law with form {other_way!r}')


def _is_free(graph: LinearGraph, kept: list[Branch], branch: Branch, count: int) -> bool:
    """Tell whether the branch could still take its preferred place after those kept."""
    elimination = _interconnection(graph)
    for other in kept:
        at, tree = graph.edge_index(other.name), _preference(other)[1]
        if not elimination.pivot(at + count if tree else at):
            elimination.pivot(at if tree else at + count)
    at = graph.edge_index(branch.name)
    return elimination.pivot(at + count if _preference(branch)[1] else at)


def _ports_in_tree(graph: LinearGraph, one_ports: set[str]) -> set[str]:
    """Place the ports: tree one-ports contracted, link one-ports deleted."""
    if not graph.two_ports:
        return set()
    nodes = Forest()
    for edge in graph.edges:
        if edge.name in one_ports:
            nodes.join(edge.tail, edge.head)
    grounds = {nodes.find(graph.ground_of(domain)) for domain in graph.domains}
    kept = dict.fromkeys(nodes.find(node) for node in graph.nodes)
    rows = {node: at for at, node in enumerate(n for n in kept if n not in grounds)}
    ports = np.zeros((len(rows), 2 * len(graph.two_ports)), dtype=np.int64)
    for at, edge in enumerate(edge for edge in graph.edges if edge.port):
        for node, sign in ((edge.tail, 1), (edge.head, -1)):
            if nodes.find(node) in rows:
                ports[rows[nodes.find(node)], at] += sign
    gyrators = [two_port.kind is Kind.GYRATOR for two_port in graph.two_ports]
    placed: list[int] = []
    for _ in graph.two_ports:
        for choice in (1, 2):
            if is_regular(_nodal_matrix(ports, gyrators, [*placed, choice])):
                placed.append(choice)
                break
        else:
            raise GraphError(f'two-port {graph.two_ports[len(placed)].name!r} has no valid place '
                             'in a normal tree; connect an element to its ports')
    found = set()
    for two_port, gyrator, choice in zip(graph.two_ports, gyrators, placed, strict=True):
        if gyrator:
            found |= {f'{two_port.name}.1', f'{two_port.name}.2'} if choice == 1 else set()
        else:
            found.add(f'{two_port.name}.{choice}')
    return found


def _nodal_matrix(ports: IntArray, gyrators: list[bool], placed: list[int]) -> IntArray:
    """
    Return a matrix that is regular if and only if the placement can be completed.

    A transformer weighs its ports (1, ratio); in the tree with port 1 is (1, 0), with port 2
    (0, 1). A gyrator is a skew admittance; as links it is 0, in the tree two shorts.
    """
    size = ports.shape[0]
    numbers = generic_numbers(len(gyrators))
    admittance = np.zeros((size, size), dtype=np.int64)
    columns = []
    for at, gyrator in enumerate(gyrators):
        one, two = ports[:, 2 * at], ports[:, 2 * at + 1]
        choice = placed[at] if at < len(placed) else 0
        if gyrator and choice == 0:
            skew = np.outer(one, two) - np.outer(two, one)
            admittance = (admittance + numbers[at] * skew) % PRIME
        elif gyrator and choice == 1:
            columns += [one, two]
        elif not gyrator:
            weights = ((1, numbers[at]), (1, 0), (0, 1))[choice]
            columns.append((weights[0] * one + weights[1] * two) % PRIME)
    border = np.array(columns, dtype=np.int64).reshape(len(columns), size).T
    corner = np.zeros((len(columns), len(columns)), dtype=np.int64)
    return np.block([[admittance, border], [border.T, corner]])
