# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Element values as rational functions, and sparse elimination with them.

SymPy's field of rational functions keeps every entry cancelled, so that a derivation needs no
simplification afterwards and 100 storages are no burden. A function of parameters (``sqrt(a)``)
becomes a generator of its own. Roots are simplified as if all parameters were positive.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Mapping
from typing import Any

from lg_husky_sim.errors import GraphError
from lg_husky_sim.linear_graph.expressions import CONSTANTS, names_in, parse

Row = dict[int, Any]


def to_sympy(text: str) -> Any:
    """
    Return an expression of the graph as a SymPy expression in plain symbols.

    Raises
    ------
    GraphError
        If it divides by zero whatever its parameters are.

    """
    import sympy

    expression = _convert(parse(text))
    if expression.has(sympy.zoo, sympy.nan):
        raise GraphError(f'expression {text!r} divides by zero whatever its parameters are')
    if expression.atoms(sympy.Function) or any(
            not power.exp.is_Integer for power in expression.atoms(sympy.Pow)):
        # whoever writes abs() expects either sign
        assumed = {'real' if expression.has(sympy.Abs) else 'positive': True}
        special = {symbol: sympy.Symbol(symbol.name, **assumed)
                   for symbol in expression.free_symbols}
        simpler = sympy.simplify(expression.subs(special))
        expression = simpler.subs({new: old for old, new in special.items()})
    return expression


def _convert(node: ast.AST) -> Any:
    import sympy

    match node:
        case ast.Constant(value=value):
            return sympy.Rational(repr(value))
        case ast.Name(id=name):
            return sympy.pi if name in CONSTANTS else sympy.Symbol(name)
        case ast.UnaryOp(op=op, operand=operand):
            return -_convert(operand) if isinstance(op, ast.USub) else _convert(operand)
        case ast.BinOp(left=left, op=op, right=right):
            one, two = _convert(left), _convert(right)
            match op:
                case ast.Add():
                    return one + two
                case ast.Sub():
                    return one - two
                case ast.Mult():
                    return one * two
                case ast.Div():
                    return one / two
                case _:
                    return one ** two
        case ast.Call(func=ast.Name(id=name), args=[argument]):
            function = {'abs': 'Abs'}.get(name, name)
            return getattr(sympy, function)(_convert(argument))
    raise GraphError(f'{ast.unparse(node)!r} is not an expression')


class RationalField:
    """
    The field of rational functions in all parameters of some expressions.

    Parameters
    ----------
    texts : iterable of str
        Expressions of the graph.

    """

    def __init__(self, texts: Iterable[str]) -> None:
        """Collect the generators and build the field."""
        import sympy
        from sympy.polys.fields import sfield

        texts = list(dict.fromkeys(texts))
        expressions = [to_sympy(text) for text in texts]
        # one generator at least, and the same order of generators in every run
        symbols = sorted({name for text in texts for name in names_in(text)} | {'_unused'})
        seeds = [sympy.Symbol(name) for name in symbols]
        self._field, elements = sfield([*seeds, *expressions], order='lex')
        self._elements: Mapping[str, Any] = dict(
            zip(texts, elements[len(seeds):], strict=True))

    @property
    def one(self) -> Any:
        """Return the number one."""
        return self._field.one

    def element(self, text: str) -> Any:
        """Return the element of an expression given at the start."""
        return self._elements[text]

    def integer(self, number: float) -> Any:
        """Return a whole number as an element."""
        return self._field(int(number))


def add_scaled(target: Row, source: Mapping[int, Any], factor: Any) -> None:
    """Add a multiple of a sparse row to another one, dropping what cancels."""
    for column, value in source.items():
        total = target[column] + factor * value if column in target else factor * value
        if total:
            target[column] = total
        else:
            target.pop(column, None)


def solve(rows: list[Row], right: list[Row]) -> list[Row]:
    """
    Solve a sparse square system with several right sides.

    Parameters
    ----------
    rows : list of dict
        Column to entry, one dict an equation; not changed.
    right : list of dict
        Right sides, column to entry; not changed.

    Returns
    -------
    list of dict
        Solution, one dict an unknown.

    Raises
    ------
    GraphError
        If the system is singular whatever the parameters are.

    """
    left = [dict(row) for row in rows]
    known = [dict(row) for row in right]
    waiting = set(range(len(rows)))
    order: list[tuple[int, int]] = []
    while waiting:
        pivot = _cheapest(left, waiting)
        if pivot is None:
            raise GraphError('the algebraic equations of the graph are singular whatever the '
                             'parameters are; check modulated sources and two-ports')
        row, column = pivot
        waiting.remove(row)
        order.append(pivot)
        for other in waiting:
            if column in left[other]:
                factor = -left[other][column] / left[row][column]
                add_scaled(left[other], left[row], factor)
                add_scaled(known[other], known[row], factor)
    solution: list[Row] = [{} for _ in rows]
    for row, column in reversed(order):
        total = dict(known[row])
        for other, value in left[row].items():
            if other != column:
                add_scaled(total, solution[other], -value)
        inverse = 1 / left[row][column]
        solution[column] = {at: value * inverse for at, value in total.items()}
    return solution


def _cheapest(rows: list[Row], waiting: set[int]) -> tuple[int, int] | None:
    """Return the pivot of least fill-in (Markowitz), preferring the simplest entry."""
    counts: dict[int, int] = {}
    for row in waiting:
        for column in rows[row]:
            counts[column] = counts.get(column, 0) + 1
    best: tuple[int, int, int, int] | None = None
    for row in sorted(waiting):
        for column, value in rows[row].items():
            cost = (len(rows[row]) - 1) * (counts[column] - 1)
            if best is None or cost <= best[0]:
                key = (cost, len(value.numer) + len(value.denom), row, column)
                best = key if best is None else min(best, key)
    return None if best is None else (best[2], best[3])
