# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Everything about a graph that does not hang on numbers, worked out once.

Each edge e has a primary variable c_e (across if e is in the normal tree, through if it is a
link) and a secondary one d_e. Kirchhoff's laws make d = S c with S of -1, 0 and 1, skew under the
power product. The primary variables fall into states x, inputs u, efforts f, excess storages s
and algebraic ones a (D-types, ports, linear modulated sources), where each algebraic c_a is a sum
of terms: a value of an element times a variable.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from lg_husky_sim.errors import GraphError
from lg_husky_sim.linear_graph.elements import Characteristic, Kind, SOURCES
from lg_husky_sim.linear_graph.graph import LinearGraph, Variable
from lg_husky_sim.linear_graph.normal_tree import normal_tree, NormalTree
import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Value:
    """
    An expression of the graph and what is allowed for it.

    Parameters
    ----------
    owner : str
        Branch, two-port or source that it belongs to.
    text : str
        The expression.
    rule : str
        'positive', 'not negative', 'not zero' or 'any'.

    """

    owner: str
    text: str
    rule: str


@dataclass(frozen=True)
class Term:
    """
    One summand of an algebraic primary variable: sign * value^(+-1) * (row . c).

    Parameters
    ----------
    edge : int
        Edge whose primary variable the term adds to.
    value : int
        Position in ``Structure.values``.
    inverse : bool
        Whether the value divides.
    sign : int
        +1 or -1.
    source : Variable
        The variable that is multiplied.

    """

    edge: int
    value: int
    inverse: bool
    sign: int
    source: Variable


@dataclass(frozen=True, eq=False)
class Structure:
    """
    A graph's equations with the numbers left out.

    Parameters
    ----------
    graph : LinearGraph
        Where it comes from.
    tree : NormalTree
        Its normal tree.
    secondary : numpy.ndarray, shape (n_edges, n_edges)
        S in d = S c.
    in_tree : tuple of bool
        For each edge.
    states, excess : tuple of int
        Edges of independent and of dependent storages.
    inputs : tuple of str
        Names of inputs.
    input_edges : tuple of (int, int)
        Edge of each source and the position of its input.
    efforts : tuple of int
        Edges whose value is a named effort.
    laws : mapping of int to Characteristic
        The law of each effort.
    linear_laws : mapping of int to Characteristic
        The law of each other edge that has one; it is also in ``terms``.
    algebraic : tuple of int
        Edges solved for.
    terms : tuple of Term
        Their equations.
    values : tuple of Value
        All expressions.
    storage_values : mapping of int to int
        Edge of a storage to the position of its value.
    stiff : frozenset of int
        Edges of T-types whose value is a stiffness, the inverse of an inertance.
    outputs, arguments : tuple of Variable
        What is asked for, and the arguments of the efforts, one after the other.

    """

    graph: LinearGraph
    tree: NormalTree
    secondary: FloatArray
    in_tree: tuple[bool, ...]
    states: tuple[int, ...]
    excess: tuple[int, ...]
    inputs: tuple[str, ...]
    input_edges: tuple[tuple[int, int], ...]
    efforts: tuple[int, ...]
    laws: Mapping[int, Characteristic]
    linear_laws: Mapping[int, Characteristic]
    algebraic: tuple[int, ...]
    terms: tuple[Term, ...]
    values: tuple[Value, ...]
    storage_values: Mapping[int, int]
    stiff: frozenset[int]
    outputs: tuple[Variable, ...]
    arguments: tuple[Variable, ...]

    def row(self, variable: Variable) -> FloatArray:
        """Return the variable as a row over the primary variables c, shape (n_edges,)."""
        if variable.is_across == self.in_tree[variable.edge]:
            row = np.zeros(len(self.in_tree))
            row[variable.edge] = 1.0
            return row
        row = np.array(self.secondary[variable.edge])
        return row

    def rows(self, variables: Sequence[Variable]) -> FloatArray:
        """Return variables as rows over c, shape (n_variables, n_edges)."""
        return np.array([self.row(v) for v in variables]).reshape(-1, len(self.in_tree))

    def primary(self, edge: int) -> Variable:
        """Return the edge's primary variable."""
        across = self.in_tree[edge]
        return Variable(edge, across, self.graph.variable_name(edge, across))

    def dual(self, edge: int) -> Variable:
        """Return the edge's secondary variable."""
        across = not self.in_tree[edge]
        return Variable(edge, across, self.graph.variable_name(edge, across))

    def names(self, edges: Sequence[int]) -> tuple[str, ...]:
        """Return the texts of edges' primary variables."""
        return tuple(self.primary(edge).name for edge in edges)

    def characteristic(self, edge: int) -> Characteristic:
        """Return the law of an effort."""
        return self.laws[edge]


def analyse(graph: LinearGraph, outputs: Sequence[str] = ()) -> Structure:
    """
    Work out the structure of a graph.

    Parameters
    ----------
    graph : LinearGraph
        The graph.
    outputs : sequence of str
        Variables such as ``'v(M_H)'``.

    Returns
    -------
    Structure

    Raises
    ------
    GraphError
        If there is no normal tree, or an unknown output.

    """
    wanted = []
    for text in outputs:
        try:
            wanted.append(graph.variable(text))
        except GraphError as error:
            raise GraphError(f'unknown output: {error}') from error
    tree = normal_tree(graph)
    in_tree = tuple(edge.name in set(tree.tree) for edge in graph.edges)
    storages = [graph.edge_index(b.name) for b in
                (*graph.of_kind(Kind.A_TYPE), *graph.of_kind(Kind.T_TYPE))]
    dependent = {graph.edge_index(name) for name in tree.dependent}
    states = tuple(edge for edge in storages if edge not in dependent)
    builder = _Builder(graph, in_tree)
    builder.collect()
    return Structure(
        graph, tree, _secondary(graph, in_tree), in_tree, states,
        tuple(edge for edge in storages if edge in dependent),
        tuple(builder.inputs), tuple(builder.input_edges), tuple(builder.laws),
        builder.laws, builder.linear_laws,
        tuple(dict.fromkeys(builder.algebraic)), tuple(builder.terms), tuple(builder.values),
        builder.storage_values,
        frozenset(at for at, branch in enumerate(graph.branches) if branch.is_stiffness),
        tuple(wanted), tuple(builder.arguments))


def check_asked(structure: Structure) -> None:
    """
    Check that there is anything to derive.

    Raises
    ------
    GraphError
        If there is neither a state nor an output.

    """
    if not structure.states and not structure.outputs:
        raise GraphError('the graph has no state: it needs an A-type or a T-type whose variable '
                         'is not fixed by sources and two-ports alone, or outputs to derive')


def _secondary(graph: LinearGraph, in_tree: tuple[bool, ...]) -> FloatArray:
    incidence = graph.incidence()
    tree = [at for at, flag in enumerate(in_tree) if flag]
    links = [at for at, flag in enumerate(in_tree) if not flag]
    cutsets = np.rint(np.linalg.solve(incidence[:, tree], incidence[:, links]))
    secondary = np.zeros((len(in_tree), len(in_tree)))
    secondary[np.ix_(tree, links)] = -cutsets       # continuity: through_tree = -Q through_link
    secondary[np.ix_(links, tree)] = cutsets.T      # compatibility: across_link = Q^T across_tree
    return secondary + 0.0


_Part = tuple[int, bool, int, Variable]


def modulated(ratio: Characteristic, inverse: bool, sign: int, variable: str) -> Characteristic:
    """Return the law of one port of a modulated two-port: sign * ratio^(+-1) * variable."""
    last = f'z{len(ratio.of) + 1}'
    value = ratio.expression if ratio.expression.isidentifier() else f'({ratio.expression})'
    factor = f'{last}/{value}' if inverse else f'{value}*{last}'
    return Characteristic(f'-{factor}' if sign < 0 else factor, (*ratio.of, variable),
                          ratio.parameters, ratio.modulated)


class _Builder:
    """Collects the equations edge by edge."""

    def __init__(self, graph: LinearGraph, in_tree: tuple[bool, ...]) -> None:
        self.graph, self.in_tree = graph, in_tree
        self.inputs: list[str] = []
        self.input_edges: list[tuple[int, int]] = []
        self.laws: dict[int, Characteristic] = {}
        self.linear_laws: dict[int, Characteristic] = {}
        self.arguments: list[Variable] = []
        self.algebraic: list[int] = []
        self.terms: list[Term] = []
        self.values: list[Value] = []
        self.storage_values: dict[int, int] = {}

    def collect(self) -> None:
        for edge, branch in enumerate(self.graph.branches):
            if branch.characteristic is not None:
                self._characteristic(edge, branch.characteristic)
            elif branch.kind in SOURCES:
                if branch.input_name not in self.inputs:
                    self.inputs.append(branch.input_name)
                self.input_edges.append((edge, self.inputs.index(branch.input_name)))
            elif branch.kind is Kind.D_TYPE:
                inverse = branch.is_damping == self.in_tree[edge]
                at = self._value(branch.name, branch.value,
                                 'positive' if inverse else 'not negative')
                self._term(edge, at, inverse, 1, self._variable(edge, not self.in_tree[edge]))
            else:
                self.storage_values[edge] = self._value(branch.name, branch.value, 'positive')
        for position, two_port in enumerate(self.graph.two_ports):
            one = len(self.graph.branches) + 2 * position
            equations = self._transformer if two_port.kind is Kind.TRANSFORMER else self._gyrator
            parts = equations(one, one + 1)
            if two_port.characteristic is not None:
                for edge, inverse, sign, source in parts:
                    self._characteristic(edge, modulated(
                        two_port.characteristic, inverse, sign, source.name))
                continue
            at = self._value(two_port.name, two_port.value, 'not zero')
            for edge, inverse, sign, source in parts:
                self._term(edge, at, inverse, sign, source)

    def _characteristic(self, edge: int, characteristic: Characteristic) -> None:
        linear = characteristic.linear
        sources = [self.graph.variable(text) for text in characteristic.of]
        if linear is None:
            self.laws[edge] = characteristic
            self.arguments += sources
            return
        self.linear_laws[edge] = characteristic
        self.algebraic.append(edge)
        name = self.graph.edges[edge].name
        for argument, source in zip(characteristic.arguments, sources, strict=True):
            if argument in linear:
                at = self._value(name, linear[argument], 'any')
                self._term(edge, at, False, 1, source)

    def _transformer(self, one: int, two: int) -> tuple[_Part, _Part]:
        if self.in_tree[one]:       # v1 = n v2, f2 = -n f1
            return ((one, False, 1, self._variable(two, True)),
                    (two, False, -1, self._variable(one, False)))
        return ((two, True, 1, self._variable(one, True)),         # v2 = v1/n, f1 = -f2/n
                (one, True, -1, self._variable(two, False)))

    def _gyrator(self, one: int, two: int) -> tuple[_Part, _Part]:
        if self.in_tree[one]:       # v1 = r f2, v2 = -r f1
            return ((one, False, 1, self._variable(two, False)),
                    (two, False, -1, self._variable(one, False)))
        return ((one, True, -1, self._variable(two, True)),        # f1 = -v2/r, f2 = v1/r
                (two, True, 1, self._variable(one, True)))

    def _variable(self, edge: int, is_across: bool) -> Variable:
        return Variable(edge, is_across, self.graph.variable_name(edge, is_across))

    def _value(self, owner: str, text: str, rule: str) -> int:
        self.values.append(Value(owner, text, rule))
        return len(self.values) - 1

    def _term(self, edge: int, value: int, inverse: bool, sign: int, source: Variable) -> None:
        self.algebraic.append(edge)
        self.terms.append(Term(edge, value, inverse, sign, source))
