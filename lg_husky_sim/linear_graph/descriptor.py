# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The Laplace-transformed equations of a graph as one sparse system, and its determinants.

Every edge's primary variable c is an unknown: M(s) c = b(s) u, y = d(s) c + f(s) u. The transfer
function is, by Cramer's rule, det([M, -b; d, f]) / det(M). The system has one element's value in
an entry and no quotient but those that the elements themselves have, so its determinants are
polynomials, found without any division: what does not lie between input and output is left out,
equations with an entry of 1 or -1 are used up, and the small rest is expanded by minors.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from lg_husky_sim.errors import GraphError
from lg_husky_sim.linear_graph.graph import Variable
from lg_husky_sim.linear_graph.rational import add_scaled, RationalField, Row
from lg_husky_sim.linear_graph.structure import Structure
import numpy as np

MOST_PRODUCTS = 500_000
"""Products of two terms that determinants in symbols may take, some five seconds."""
MOST_TERMS = 20_000
"""Terms that they may have, some 300 pages; the Husky's have 1,000, with elastic belts 17,000."""


def descriptor(structure: Structure, values: Sequence[Any], s: Any, one: Any, output: Variable,
               source: int) -> list[Row]:
    """
    Return the rows of [M, -b; d, f], the output's last.

    Parameters
    ----------
    structure : Structure
        Analysed graph, with rules for its elements.
    values : sequence
        Number or rational function of each of ``structure.values``.
    s, one : same type
        The Laplace variable and the number one.
    output : Variable
        Whose row is the last.
    source : int
        Which input; the other inputs and the efforts of laws that are not linear are zero.

    Returns
    -------
    list of dict
        Column to entry, in the order of edges but those that are no unknowns; the input's column
        is the last.

    """
    unknown = {edge: at for at, edge in enumerate(
        (*structure.states, *structure.excess, *structure.algebraic))}
    last = len(unknown)
    column = dict(unknown)
    column.update({edge: last for edge, at in structure.input_edges if at == source})

    def entries(variable: Variable, factor: Any) -> Row:
        row = structure.row(variable)
        found: Row = {}
        for edge in map(int, np.flatnonzero(row)):
            if edge in column:
                add_scaled(found, {column[edge]: factor}, one if row[edge] > 0 else -one)
        return found

    rows: list[Row] = [{} for _ in range(last)]
    for edge in (*structure.states, *structure.excess):
        value = values[structure.storage_values[edge]]
        storage = (1 / value if edge in structure.stiff else value) * s
        if edge in structure.states:    # storage s c = dual
            rows[unknown[edge]] = {unknown[edge]: storage}
            add_scaled(rows[unknown[edge]], entries(structure.dual(edge), one), -one)
        else:                           # c = storage s dual
            rows[unknown[edge]] = {unknown[edge]: one}
            add_scaled(rows[unknown[edge]], entries(structure.dual(edge), storage), -one)
    for edge in structure.algebraic:
        rows[unknown[edge]] = {unknown[edge]: one}
    for term in structure.terms:
        value = values[term.value]
        factor = (1 / value if term.inverse else value) * term.sign
        add_scaled(rows[unknown[term.edge]], entries(term.source, factor), -one)
    return [*rows, entries(output, one)]


@dataclass(frozen=True)
class Between:
    """
    What lies between an input and an output: rows and columns of a descriptor.

    All else is left out of both determinants, which then lose the same diagonal blocks.

    Parameters
    ----------
    rows, columns : tuple of int
        The output's row and the input's column are the last.

    """

    rows: tuple[int, ...]
    columns: tuple[int, ...]

    def of(self, rows: list[Row]) -> list[Row]:
        """Return a descriptor's part; its columns are numbered anew."""
        place = {column: at for at, column in enumerate(self.columns)}
        return [{place[column]: value for column, value in rows[at].items() if column in place}
                for at in self.rows]


def between(rows: list[Row]) -> Between:
    """
    Find what the input drives and what acts on the output.

    Raises
    ------
    GraphError
        If the system is singular whatever the parameters are.

    """
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import maximum_bipartite_matching

    n = len(rows) - 1
    if not n:
        return Between((0,), (0,))
    where = np.array([(at, column) for at, row in enumerate(rows[:n]) for column in row
                      if column < n], dtype=np.intp).reshape(-1, 2)
    pattern = csr_matrix((np.ones(len(where)), (where[:, 0], where[:, 1])), shape=(n, n))
    column_of = [int(at) for at in maximum_bipartite_matching(pattern, perm_type='column')]
    if min(column_of) < 0:
        raise GraphError('the algebraic equations of the graph are singular whatever the '
                         'parameters are; check modulated sources and two-ports')
    # equation `at` gives variable column_of[at] from the other variables in it
    acts_on: list[set[int]] = [set() for _ in range(n)]
    hangs_on: list[set[int]] = [set() for _ in range(n)]
    driven = set()
    for own, row in zip(column_of, rows[:n], strict=True):
        for column in row:
            if column == n:
                driven.add(own)
            elif column != own:
                acts_on[column].add(own)
                hangs_on[own].add(column)
    kept = _reached(driven, acts_on) & _reached({c for c in rows[n] if c < n}, hangs_on)
    return Between((*(at for at in range(n) if column_of[at] in kept), n), (*sorted(kept), n))


def _reached(start: set[int], to: list[set[int]]) -> set[int]:
    found, waiting = set(start), list(start)
    while waiting:
        new = to[waiting.pop()] - found
        found |= new
        waiting += new
    return found


def determinants(field: RationalField, rows: list[Row]) -> tuple[Any, Any]:
    """
    Return det([M, -b; d, f]) and det(M), both times one and the same factor.

    Parameters
    ----------
    field : RationalField
        To which the entries of the rows belong.
    rows : list of dict
        What :func:`between` has left of a :func:`descriptor` of rational functions.

    Returns
    -------
    tuple of polynomials
        Elements of SymPy's sparse polynomial ring below the field.

    Raises
    ------
    GraphError
        If they would take too long.

    """
    left_over = MOST_PRODUCTS

    def spend(count: int) -> None:
        nonlocal left_over
        left_over -= count
        if left_over < 0:
            raise _too_long()

    one = field.one.numer
    left = [_without_quotients(row, one) for row in rows[:-1]]
    # the output's row has whole numbers only
    below: Row = {column: value.numer for column, value in rows[-1].items()}
    while (pivot := _unit_pivot(left, len(rows) - 1)) is not None:
        at, column = pivot
        own = left.pop(at)
        for row in (*left, below):
            if column in row:
                factor = -row[column] * own[column]         # an entry of 1 or -1
                spend(sum(map(len, own.values())) * len(factor))
                add_scaled(row, own, factor)
    found = _by_minors(left, below, len(rows) - 1, one, spend)
    if sum(map(len, found)) > MOST_TERMS:
        raise _too_long()
    return found


def _too_long() -> GraphError:
    return GraphError(
        f'the transfer function in symbols would have more than {MOST_TERMS} terms; put numbers '
        'in (numbers=True), or let elements share parameters (by_parameter=True)')


def _without_quotients(row: Row, one: Any) -> Row:
    common = one
    for value in row.values():
        common = common.lcm(value.denom)
    return {column: value.numer * common.exquo(value.denom) for column, value in row.items()}


def _unit_pivot(rows: list[Row], last: int) -> tuple[int, int] | None:
    """Return row and column of the entry of 1 or -1 with the least fill-in (Markowitz)."""
    counts: dict[int, int] = {}
    for row in rows:
        for column in row:
            counts[column] = counts.get(column, 0) + 1
    best: tuple[int, int, int] | None = None
    for at, row in enumerate(rows):
        for column, value in row.items():
            if column != last and value.is_ground and abs(value.LC) == 1:
                key = ((len(row) - 1) * (counts[column] - 1), at, column)
                best = key if best is None else min(best, key)
    return None if best is None else best[1:]


def _by_minors(rows: list[Row], below: Row, last: int, one: Any,
               spend: Callable[[int], None]) -> tuple[Any, Any]:
    """Return both determinants, each minor of the first k rows worked out once."""
    place = {column: at for at, column in enumerate(sorted(
        {column for row in rows for column in row} - {last}))}
    place[last] = len(place)
    waiting = [{place[column]: value for column, value in row.items()} for row in rows]
    minors: dict[int, Any] = {0: one}
    seen: set[int] = set()
    while waiting:      # the row that brings in the fewest new columns first
        row = min(waiting, key=lambda row: len(row.keys() - seen))
        waiting.remove(row)
        seen |= row.keys()
        minors = _expanded(minors, row, spend)
    whole = (1 << len(place)) - 1
    denominator = minors.get(whole ^ (1 << place[last]), 0 * one)
    minors = _expanded(minors, {place[column]: value for column, value in below.items()}, spend)
    return minors.get(whole, 0 * one), denominator


def _expanded(minors: dict[int, Any], row: Row, spend: Callable[[int], None]) -> dict[int, Any]:
    """Return the minors of one row more; keys have a bit for each column."""
    found: dict[int, Any] = {}
    for columns, minor in minors.items():
        for column, value in row.items():
            if not columns >> column & 1:
                spend(len(minor) * len(value))
                sign = (-1) ** (columns >> column).bit_count()
                add_scaled(found, {columns | 1 << column: minor}, sign * value)
    return found
