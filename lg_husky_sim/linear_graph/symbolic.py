# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""State-space models of linear graphs in symbols; SymPy is imported when it is needed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TYPE_CHECKING

from lg_husky_sim.errors import GraphError
from lg_husky_sim.linear_graph.checks import check_symbols
from lg_husky_sim.linear_graph.graph import LinearGraph, Variable
from lg_husky_sim.linear_graph.numeric import NumericModel
from lg_husky_sim.linear_graph.rational import add_scaled, RationalField, Row, solve
from lg_husky_sim.linear_graph.structure import analyse, check_asked, Structure
import numpy as np

if TYPE_CHECKING:
    from lg_husky_sim.linear_graph.equations import Equations


@dataclass(frozen=True, eq=False)
class SymbolicStateSpace:
    """
    A graph's state-space model in symbols.

    dx/dt = A x + B u + E du/dt + G f(z),  z = H x + K u + N f(z),
    y = C x + D u + F du/dt + L_c f(z)

    Parameters
    ----------
    graph : LinearGraph
        Where it comes from.
    A, B, C, D, E, F, G, H, K, L_c, N : sympy.Matrix
        As in :class:`~lg_husky_sim.linear_graph.state_space.StateSpace`.
    states, inputs, outputs, efforts, arguments : tuple of str
        Names of x, u, y, f and z.
    dependent : tuple of str
        Excess storages, whose variables follow from the states.

    """

    graph: LinearGraph
    A: Any
    B: Any
    C: Any
    D: Any
    E: Any
    F: Any
    G: Any
    H: Any
    K: Any
    L_c: Any
    N: Any
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    efforts: tuple[str, ...]
    arguments: tuple[str, ...]
    dependent: tuple[str, ...]

    @property
    def equations(self) -> Equations:
        """Continuity, compatibility and constitutive equations of the graph."""
        from lg_husky_sim.linear_graph.equations import equations

        return equations(self.graph)

    def standard_form(self) -> SymbolicStateSpace:
        """
        Return the model without input derivatives in the state equations.

        The states become x' = x - E u (Rowell and Wormley, ch. 5.5).
        """
        from dataclasses import replace

        import sympy

        if self.E.is_zero_matrix:
            return self
        simpler = sympy.cancel
        return replace(self, B=(self.B + self.A * self.E).applyfunc(simpler),
                       D=(self.D + self.C * self.E).applyfunc(simpler),
                       K=(self.K + self.H * self.E).applyfunc(simpler),
                       E=sympy.zeros(*self.E.shape))


def derive(graph: LinearGraph, outputs: Sequence[str] = (), *,
           by_element: bool = False) -> SymbolicStateSpace:
    """
    Derive the state-space model of a graph in symbols.

    Parameters
    ----------
    graph : LinearGraph
        The graph.
    outputs : sequence of str
        Variables to put out, such as ``'v(M_H)'``.
    by_element : bool
        Write each element's value as a symbol of the element's own name (as the paper's eq. (19)
        does) instead of the expression it has.

    Returns
    -------
    SymbolicStateSpace
        Every entry is a cancelled rational function of the parameters.

    Raises
    ------
    GraphError
        As :func:`~lg_husky_sim.linear_graph.compile_numeric`; by element also if a parameter has
        the name of an element of another value, or an input that of either.

    """
    import sympy

    if by_element:
        check_symbols(graph)
    structure = analyse(graph, outputs)
    check_asked(structure)
    NumericModel(structure, chained=True)     # refuses loops through non-linear laws
    texts = [value.owner if by_element and value.rule != 'any' else value.text
             for value in structure.values]
    derivation = _Derivation(structure, texts)
    n, m = len(structure.states), len(structure.inputs)
    k, q = len(structure.efforts), len(structure.arguments)

    def matrix(rows: list[Row], first: int, count: int) -> Any:
        found = sympy.zeros(len(rows), count)
        for at, row in enumerate(rows):
            for column, value in row.items():
                if first <= column < first + count:
                    found[at, column - first] = value.as_expr()
        return found

    rates, rest = derivation.rates(), derivation.rest()
    z, y = rest[:q], rest[q:]
    after = derivation.derivatives
    return SymbolicStateSpace(
        graph, matrix(rates, 0, n), matrix(rates, n, m), matrix(y, 0, n), matrix(y, n, m),
        matrix(rates, after, m), matrix(y, after, m), matrix(rates, n + m, k), matrix(z, 0, n),
        matrix(z, n, m), matrix(y, n + m, k), matrix(z, n + m, k),
        structure.names(structure.states), structure.inputs,
        tuple(v.name for v in structure.outputs),
        tuple(graph.edges[edge].name for edge in structure.efforts),
        tuple(v.name for v in structure.arguments), structure.tree.dependent)


class _Derivation:
    """
    Sparse elimination over the columns x, u, f, excess and du/dt.

    The same steps as in :mod:`~lg_husky_sim.linear_graph.numeric`, with rational functions.
    """

    def __init__(self, structure: Structure, texts: list[str]) -> None:
        self.structure = structure
        self.field = RationalField(texts)
        self.values = [self.field.element(text) for text in texts]
        n, m, k = len(structure.states), len(structure.inputs), len(structure.efforts)
        self.excess = n + m + k
        self.derivatives = self.excess + len(structure.excess)
        self.known: dict[int, int] = dict(zip(structure.states, range(n), strict=True))
        self.known.update({edge: n + at for edge, at in structure.input_edges})
        for column, edge in enumerate((*structure.efforts, *structure.excess), start=n + m):
            self.known[edge] = column
        self.place = {edge: at for at, edge in enumerate(structure.algebraic)}
        self.algebraic = self._solve_algebraic()
        self.dependent = [self._row(structure.dual(edge)) for edge in structure.excess]
        self._rates: list[Row] = []

    def _split(self, variable: Variable) -> tuple[Row, Row]:
        """Return the variable over the known columns and over the algebraic unknowns."""
        known: Row = {}
        unknown: Row = {}
        row = self.structure.row(variable)
        for edge in np.flatnonzero(row):
            entry = self.field.integer(row[edge])
            if int(edge) in self.known:
                add_scaled(known, {self.known[int(edge)]: entry}, self.field.one)
            else:
                add_scaled(unknown, {self.place[int(edge)]: entry}, self.field.one)
        return known, unknown

    def _solve_algebraic(self) -> list[Row]:
        left: list[Row] = [{at: self.field.one} for at in range(len(self.place))]
        right: list[Row] = [{} for _ in self.place]
        for term in self.structure.terms:
            value = self.values[term.value]
            if not value:
                raise GraphError(f'element {self.structure.values[term.value].owner!r} is zero')
            factor = (1 / value if term.inverse else value) * term.sign
            known, unknown = self._split(term.source)
            add_scaled(left[self.place[term.edge]], unknown, -factor)
            add_scaled(right[self.place[term.edge]], known, factor)
        return solve(left, right)

    def _row(self, variable: Variable) -> Row:
        known, unknown = self._split(variable)
        for at, factor in unknown.items():
            add_scaled(known, self.algebraic[at], factor)
        return known

    def _storage(self, edge: int) -> Any:
        value = self.values[self.structure.storage_values[edge]]
        return 1 / value if edge in self.structure.stiff else value

    def _excess_rate(self, at: int, states: list[Row]) -> Row:
        """Return the variable of an excess storage: value * d(dependent)/dt."""
        total: Row = {}
        for column, value in self.dependent[at].items():
            if column < len(states):
                add_scaled(total, states[column], value)
            else:
                shift = column - len(states) + self.derivatives
                add_scaled(total, {shift: value}, self.field.one)
        scale = self._storage(self.structure.excess[at])
        return {column: value * scale for column, value in total.items()}

    def rates(self) -> list[Row]:
        """Return dx/dt over x, u, f and du/dt."""
        if self._rates:
            return self._rates
        structure = self.structure
        n = len(structure.states)
        # the columns of dx/dt itself stand in for the states' rates
        unknown: list[Row] = [{at: self.field.one} for at in range(n)]
        shifted = self.derivatives + len(structure.inputs)
        left: list[Row] = []
        right: list[Row] = []
        for at, edge in enumerate(structure.states):
            equation: Row = {at: self._storage(edge)}
            drive: Row = {}
            for column, value in self._row(structure.dual(edge)).items():
                if not self.excess <= column < self.derivatives:
                    add_scaled(drive, {column: value}, self.field.one)
                    continue
                excess = self._excess_rate(
                    column - self.excess, [{c + shifted: v for c, v in r.items()}
                                           for r in unknown])
                for other, factor in excess.items():
                    if other >= shifted:
                        add_scaled(equation, {other - shifted: factor}, -value)
                    else:
                        add_scaled(drive, {other: factor}, value)
            left.append(equation)
            right.append(drive)
        self._rates = solve(left, right)
        return self._rates

    def rest(self) -> list[Row]:
        """Return arguments and outputs over x, u, f and du/dt."""
        found = []
        for variable in (*self.structure.arguments, *self.structure.outputs):
            total: Row = {}
            for column, value in self._row(variable).items():
                if self.excess <= column < self.derivatives:
                    add_scaled(total, self._excess_rate(column - self.excess, self.rates()),
                               value)
                else:
                    add_scaled(total, {column: value}, self.field.one)
            found.append(total)
        return found
