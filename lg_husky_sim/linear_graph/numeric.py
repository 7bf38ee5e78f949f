# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Numbers into a linear graph: structure once, matrices in some tens of microseconds.

No computer algebra is involved: the algebraic variables are found by one small dense solve.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from lg_husky_sim.errors import GraphError, ParameterError
from lg_husky_sim.linear_graph.elements import Branch, TwoPort
from lg_husky_sim.linear_graph.expressions import compile_tuple, evaluate, GLOBALS, names_in
from lg_husky_sim.linear_graph.graph import close_name, LinearGraph
from lg_husky_sim.linear_graph.loops import effort_order
from lg_husky_sim.linear_graph.modular import generic_numbers
from lg_husky_sim.linear_graph.singular import culprits, is_rounding, singular_error
from lg_husky_sim.linear_graph.state_space import FloatArray, MATRICES, StateSpace
from lg_husky_sim.linear_graph.structure import analyse, check_asked, Structure
import numpy as np

SMALLEST = float(np.finfo(np.float64).tiny)
TOLERANCE = 1e-9


def compile_numeric(graph: LinearGraph, outputs: Sequence[str] = (), *,
                    chained: bool = False) -> NumericModel:
    """
    Analyse a graph once, for many evaluations with different parameters.

    Parameters
    ----------
    graph : LinearGraph
        The graph.
    outputs : sequence of str
        Variables to put out, such as ``'v(M_H)'``, ``'i(L_1)'`` or ``'tau(T_ML.2)'``.
    chained : bool
        Allow the argument of one effort to hang at once on other efforts (matrix N). A loop is
        refused in any case.

    Returns
    -------
    NumericModel
        ``model.at(values)`` gives the matrices.

    Raises
    ------
    GraphError
        If the graph has no normal tree, nothing to derive, an output is unknown, or an effort
        hangs on itself (an algebraic loop through a non-linear law).

    Examples
    --------
    >>> from lg_husky_sim.linear_graph import Branch, compile_numeric, Domain, Kind, LinearGraph
    >>> graph = LinearGraph((
    ...     Branch('F_s', Kind.THROUGH_SOURCE, Domain.TRANSLATIONAL, 'ground', 'body'),
    ...     Branch('m', Kind.A_TYPE, Domain.TRANSLATIONAL, 'body', 'ground', 'm'),
    ...     Branch('b', Kind.D_TYPE, Domain.TRANSLATIONAL, 'body', 'ground', 'b')))
    >>> compile_numeric(graph, ['v(m)']).at({'m': 2.0, 'b': 3.0}).A
    array([[-1.5]])

    """
    structure = analyse(graph, outputs)
    check_asked(structure)
    return NumericModel(structure, chained)


class NumericModel:
    """
    A graph ready to take numbers; see :func:`compile_numeric`.

    Parameters
    ----------
    structure : Structure
        The analysed graph.
    chained : bool
        Whether efforts may hang on others, see :func:`compile_numeric`.

    Attributes
    ----------
    order : tuple of int
        Positions of the efforts in an order in which they can be evaluated.

    """

    def __init__(self, structure: Structure, chained: bool = False) -> None:
        """Lay out the constant matrices and check the efforts."""
        self.structure = structure
        self.chained = chained
        self.order: tuple[int, ...] = ()
        self.graph = structure.graph
        self.states = structure.names(structure.states)
        self.inputs = structure.inputs
        self.outputs = tuple(variable.name for variable in structure.outputs)
        self.efforts = tuple(self.graph.edges[edge].name for edge in structure.efforts)
        self.arguments = tuple(variable.name for variable in structure.arguments)
        self.dependent = structure.tree.dependent
        self._names = (self.states, self.inputs, self.outputs, self.efforts, self.arguments)
        self._layout()
        self._refuse_effort_loops()

    def __reduce__(self) -> tuple[type[NumericModel], tuple[Structure, bool]]:
        """Travel between processes as the structure alone; code objects cannot."""
        return NumericModel, (self.structure, self.chained)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters of all element values, not of the laws of efforts."""
        return tuple(dict.fromkeys(
            name for value in self.structure.values for name in names_in(value.text)))

    def _layout(self) -> None:
        structure = self.structure
        values = structure.values
        self._code = compile_tuple(tuple(value.text for value in values))
        self._globals: dict[str, Any] = dict(GLOBALS)
        lowest = {'positive': SMALLEST, 'not negative': 0.0}
        self._lower = np.array([lowest.get(value.rule, -np.inf) for value in values])
        self._least = np.array([SMALLEST if value.rule == 'not zero' else 0.0
                                for value in values])
        terms, algebraic = structure.terms, structure.algebraic
        self._pick = np.array([term.value for term in terms], dtype=np.intp)
        self._inverse = np.array([term.inverse for term in terms], dtype=bool)
        known, self._slices = self._known_columns()
        term_rows = structure.rows([term.source for term in terms])
        sign = np.array([float(term.sign) for term in terms])[:, None]
        self._term_known = sign * (term_rows @ known)
        self._term_algebraic = sign * term_rows[:, list(algebraic)]
        self._one_each = [term.edge for term in terms] == list(algebraic)
        self._gather = np.array([[float(term.edge == edge) for term in terms]
                                 for edge in algebraic]).reshape(len(algebraic), len(terms))
        self._identity = np.eye(len(algebraic))
        wanted = [*(structure.dual(edge) for edge in (*structure.states, *structure.excess)),
                  *structure.arguments, *structure.outputs]
        rows = structure.rows(wanted)
        self._row_known = rows @ known
        self._row_algebraic = np.ascontiguousarray(rows[:, list(algebraic)])
        storages = (*structure.states, *structure.excess)
        self._storage = np.array([structure.storage_values[edge] for edge in storages],
                                 dtype=np.intp)
        self._stiff = np.array([edge in structure.stiff for edge in storages], dtype=bool)

    def _known_columns(self) -> tuple[FloatArray, tuple[int, int, int]]:
        """Return c over (x, u, f, s) without the algebraic part, and where each begins."""
        structure = self.structure
        n, m, k = len(structure.states), len(structure.inputs), len(structure.efforts)
        known = np.zeros((len(structure.in_tree), n + m + k + len(structure.excess)))
        for column, edge in enumerate(structure.states):
            known[edge, column] = 1.0
        for edge, position in structure.input_edges:
            known[edge, n + position] = 1.0
        for column, edge in enumerate((*structure.efforts, *structure.excess), start=n + m):
            known[edge, column] = 1.0
        return known, (n, n + m, n + m + k)

    def at(self, values: Mapping[str, float]) -> StateSpace:
        """
        Put numbers in.

        Parameters
        ----------
        values : mapping of str to float
            Parameters by name, SI; more than the graph needs is allowed.

        Returns
        -------
        StateSpace

        Raises
        ------
        ParameterError
            If a parameter is missing or an element's value is not allowed.

        """
        try:
            # only what parse() has checked is ever compiled
            raw = np.array(eval(self._code, self._globals, values),  # noqa: S307
                           dtype=np.float64)
        except (NameError, KeyError, ArithmeticError, ValueError, TypeError) as error:
            raise self._explained(values) from error
        size = np.abs(raw)
        if not ((raw >= self._lower) & (size >= self._least) & (size < np.inf)).all():
            raise self._explained(values)
        return self._state_space(*self._parts(raw))

    def _parts(self, raw: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the wanted rows over (x, u, f, s), and the storages' values."""
        picked = raw[self._pick]
        np.reciprocal(picked, out=picked, where=self._inverse)
        factor = picked[:, None]
        coupling, drive = factor * self._term_algebraic, factor * self._term_known
        if not self._one_each:
            coupling, drive = self._gather @ coupling, self._gather @ drive
        matrix = self._identity - coupling
        try:
            solved = np.asarray(np.linalg.solve(matrix, drive), dtype=np.float64)
        except np.linalg.LinAlgError as error:
            raise self._singular(matrix, raw) from error
        if is_rounding(matrix, drive, solved):
            raise self._singular(matrix, raw)
        storage = raw[self._storage]
        np.reciprocal(storage, out=storage, where=self._stiff)
        return self._row_known + self._row_algebraic @ solved, storage

    def _state_space(self, rows: FloatArray, storage: FloatArray) -> StateSpace:
        structure = self.structure
        n, m, k = len(structure.states), len(structure.inputs), len(structure.efforts)
        s, q = len(structure.excess), len(structure.arguments)
        to_input, to_effort, to_excess = self._slices
        drive = rows[:n, :to_excess]
        rest = rows[n + s:]
        if s == 0:
            rates = drive / storage[:, None]
            derivative = np.zeros((n, m))
            feed = rest
            feed_derivative = np.zeros((len(rest), m))
        else:
            dependent, coupling = rows[n:n + s], rows[:n, to_excess:] * storage[n:]
            mass = np.diag(storage[:n]) - coupling @ dependent[:, :n]
            right = np.hstack([drive, coupling @ dependent[:, to_input:to_effort]])
            try:
                solved = np.linalg.solve(mass, right)
            except np.linalg.LinAlgError as error:
                names = [self.graph.edges[edge].name for edge in structure.excess]
                raise ParameterError(
                    f'the storages around {", ".join(names)} cancel with these values; check the '
                    'gains of modulated sources') from error
            rates = np.asarray(solved[:, :to_excess], dtype=np.float64)
            derivative = np.asarray(solved[:, to_excess:], dtype=np.float64)
            # through of an excess A-type (across of an excess T-type) = value * d(dependent)/dt
            lever = rest[:, to_excess:] * storage[n:]
            feed = rest[:, :to_excess] + lever @ dependent[:, :n] @ rates
            feed_derivative = lever @ (dependent[:, :n] @ derivative
                                       + dependent[:, to_input:to_effort])
        arguments, out = feed[:q], feed[q:]
        return StateSpace(
            rates[:, :n], rates[:, n:n + m], out[:, :n], out[:, n:n + m], derivative,
            feed_derivative[q:], rates[:, n + m:n + m + k], arguments[:, :n],
            arguments[:, n:n + m], out[:, n + m:n + m + k], arguments[:, n + m:n + m + k],
            *self._names)

    def generic(self) -> StateSpace:
        """Return the model with generic values: what is zero in it is zero for all values."""
        rows, storage = self._parts(self._generic_values())
        found = self._state_space(rows, storage)
        clean: dict[str, Any] = {
            name: np.where(np.abs(matrix) > TOLERANCE, matrix, 0.0)
            for name, matrix in ((name, getattr(found, name)) for name in MATRICES)}
        return replace(found, **clean)

    def _generic_values(self) -> FloatArray:
        """Return generic positive values, the same for the same parameter."""
        parameters = {name: 0.5 + number / 2**31 for name, number in zip(
            self.parameters, generic_numbers(len(self.parameters)), strict=True)}
        raw = []
        for at, value in enumerate(self.structure.values):
            try:
                number = evaluate(value.text, parameters)
            except (ArithmeticError, ValueError, TypeError):
                number = 1.0 + 0.37 * at
            raw.append(abs(number) if value.rule in ('positive', 'not negative') else number)
        return np.array([number if abs(number) > 1e-6 else 0.7 for number in raw])

    def _refuse_effort_loops(self) -> None:
        structure = self.structure
        self.order = tuple(range(len(structure.efforts)))
        s, n, q = len(structure.excess), len(structure.states), len(structure.arguments)
        if not structure.efforts and not s:
            return
        rows, storage = self._parts(self._generic_values())
        to_input, to_effort, to_excess = self._slices
        for at, edge in enumerate(structure.excess):
            name = self.graph.edges[edge].name
            if np.all(np.abs(rows[n + at]) < TOLERANCE):
                raise GraphError(f'{structure.dual(edge).name} of storage {name!r} is held at '
                                 'zero by the branches around it; remove the storage, or the '
                                 'two-port that shorts or opens it')
            for column in np.flatnonzero(np.abs(rows[n + at, to_effort:]) > TOLERANCE):
                other = (*structure.efforts, *structure.excess)[int(column)]
                raise GraphError(
                    f'{structure.dual(edge).name} of excess storage {name!r} is set by '
                    f'{self.graph.edges[other].name!r}, whose rate of change is not known; '
                    'put a D-type in series with the one or in parallel to the other')
        arguments = rows[n + s:n + s + q]
        direct = arguments[:, to_effort:to_excess]
        if s:
            dependent, coupling = rows[n:n + s], rows[:n, to_excess:] * storage[n:]
            mass = np.diag(storage[:n]) - coupling @ dependent[:, :n]
            rates = np.linalg.solve(mass, rows[:n, to_effort:to_excess])
            direct = direct + arguments[:, to_excess:] * storage[n:] @ dependent[:, :n] @ rates
            self._refuse_derivatives(arguments[:, to_excess:] * storage[n:],
                                     dependent[:, to_input:to_effort])
        counts = [len(structure.characteristic(edge).of) for edge in structure.efforts]
        self.order = effort_order(np.abs(direct) > TOLERANCE, counts, self.efforts,
                                  self.arguments, self.chained)

    def _refuse_derivatives(self, lever: FloatArray, by_input: FloatArray) -> None:
        for row, column in zip(*np.nonzero(np.abs(lever @ by_input) > TOLERANCE), strict=True):
            raise GraphError(
                f'the argument {self.arguments[row]} of a non-linear law depends on the rate of '
                f'change of input {self.inputs[column]!r}; put a D-type in series with the source')

    def _singular(self, matrix: FloatArray, raw: FloatArray) -> ParameterError:
        structure = self.structure
        found = {structure.algebraic[at] for at in culprits(matrix)}
        values = {structure.values[term.value].owner: float(raw[term.value])
                  for term in structure.terms if term.edge in found}
        return singular_error(self.graph, tuple(values), values)

    def _explained(self, values: Mapping[str, float]) -> ParameterError:
        """Return the error that names the first value that is not allowed."""
        for value in self.structure.values:
            same = value.text == value.owner
            shown = f'{value.owner!r}' if same else f'{value.owner!r} = {value.text}'
            for name in names_in(value.text):
                if name not in values:
                    hint = '' if name in self.graph.names else close_name(name, values)
                    return ParameterError(
                        f'parameter {name!r} of element {shown} has no value{hint}')
            try:
                number = evaluate(value.text, values)
            except (ArithmeticError, ValueError, TypeError) as error:
                return ParameterError(f'element {shown} cannot be evaluated: {error}')
            rules = {'positive': number >= SMALLEST, 'not negative': number >= 0.0,
                     'not zero': abs(number) >= SMALLEST, 'any': True}
            if not (np.isfinite(number) and rules[value.rule]):
                allowed = 'finite' if value.rule == 'any' else f'finite and {value.rule}'
                unit = self._unit(value.owner) if value.rule != 'any' else ''
                return ParameterError(f'element {shown} = {number:g}{unit} is not allowed; '
                                      f'it must be {allowed}')
        return ParameterError('the values of the elements are not single numbers')

    def _unit(self, name: str) -> str:
        from lg_husky_sim.linear_graph.units import unit_needed
        elements: tuple[Branch | TwoPort, ...] = (*self.graph.branches, *self.graph.two_ports)
        unit = unit_needed(next(one for one in elements if one.name == name))
        return '' if unit == '1' else f' {unit}'


__all__ = ['NumericModel', 'compile_numeric']
