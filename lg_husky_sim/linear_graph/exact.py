# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Transfer functions in numbers, exact until the last step.

Numbers are taken as the decimal fractions that they are written as. Both determinants of the
descriptor are found at as many points s as their degrees need, by one sparse elimination a point,
and the polynomials by interpolation; so poles and zeros that cancel do so exactly, and what is
left is rounded once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import count
from typing import Any

from lg_husky_sim.errors import GraphError, ParameterError
from lg_husky_sim.linear_graph.descriptor import between, descriptor
from lg_husky_sim.linear_graph.expressions import evaluate, names_in
from lg_husky_sim.linear_graph.graph import LinearGraph
from lg_husky_sim.linear_graph.rational import add_scaled, Row, to_sympy
from lg_husky_sim.linear_graph.state_space import FloatArray
from lg_husky_sim.linear_graph.structure import analyse, Structure
import numpy as np
from numpy.typing import NDArray

GENERIC_POINT = (1_000_003, 7_919)
"""A fraction s at which no entry of a descriptor is zero but by its structure."""
ROOT_DIGITS, ROOT_STEPS = 20, 200
"""Digits to which roots are found, and most steps of the simultaneous iteration for them."""


def exact_values(structure: Structure, values: Mapping[str, float]) -> list[Any]:
    """Return the number of each of ``structure.values``, rational where its expression is."""
    import sympy
    from sympy import QQ

    found: dict[str, Any] = {}
    for text in dict.fromkeys(value.text for value in structure.values):
        number = to_sympy(text).subs({sympy.Symbol(name): sympy.Rational(repr(float(
            values[name]))) for name in names_in(text)})
        if not number.is_Rational:
            number = sympy.Rational(repr(float(evaluate(text, values))))
        found[text] = QQ.from_sympy(number)
    return [found[value.text] for value in structure.values]


def exact_fraction(structure: Structure, values: Mapping[str, float], source: int
                   ) -> tuple[Any, Any]:
    """
    Return numerator and denominator of the first output over an input.

    Parameters
    ----------
    structure : Structure
        Analysed graph; its first output counts.
    values : mapping of str to float
        Parameters by name, SI.
    source : int
        Which input.

    Returns
    -------
    tuple of sympy.Poly
        In ``s`` over the rational numbers, without common factors; the denominator's first
        coefficient is 1.

    """
    import sympy
    from sympy import QQ

    numbers = exact_values(structure, values)

    def rows_at(point: Any) -> list[Row]:
        return descriptor(structure, numbers, point, QQ(1), structure.outputs[0], source)

    part = between(rows_at(QQ(*GENERIC_POINT)))
    order = _order(part.of(rows_at(QQ(*GENERIC_POINT))))
    # the degrees are at most one for each storage, and one more for an input's derivative
    size = len(structure.states) + len(structure.excess) + 2
    points: list[Any] = []
    above: list[Any] = []
    below: list[Any] = []
    for point in map(QQ, count(1)):
        answer = _eliminated(part.of(rows_at(point)), order)
        if answer is not None:
            points.append(point)
            above.append(answer[0] * answer[1])
            below.append(answer[1])
        if len(points) == size:
            break
    s = sympy.Symbol('s')
    numerator, denominator = (sympy.Poly.from_list(_interpolated(points, samples), s, domain=QQ)
                              for samples in (above, below))
    common = numerator.gcd(denominator)
    numerator, denominator = numerator.exquo(common), denominator.exquo(common)
    return numerator.quo_ground(denominator.LC()), denominator.monic()


def _order(rows: list[Row]) -> list[tuple[int, int]]:
    """Return pivots of least fill-in (Markowitz)."""
    left = [dict(row) for row in rows]
    last = len(rows) - 1
    waiting = set(range(last))
    order = []
    while waiting:
        counts: dict[int, int] = {}
        for at in waiting:
            for column in left[at]:
                counts[column] = counts.get(column, 0) + 1
        costs = [((len(left[at]) - 1) * (counts[column] - 1), at, column)
                 for at in waiting for column in left[at] if column != last]
        if not costs:
            raise GraphError('the equations of the graph are singular with these values')
        _, row, column = min(costs)
        waiting.remove(row)
        order.append((row, column))
        _clear(left, row, column, waiting)
    return order


def _clear(rows: list[Row], row: int, column: int, others: set[int]) -> None:
    for at in others:
        if column in rows[at]:
            add_scaled(rows[at], rows[row], -rows[at][column] / rows[row][column])
            rows[at].pop(column, None)


def _eliminated(rows: list[Row], order: list[tuple[int, int]]) -> tuple[Any, Any] | None:
    """Return output over input, and the determinant but for its sign; None at a zero pivot."""
    from sympy import QQ

    left = [dict(row) for row in rows]
    last = len(rows) - 1
    waiting = set(range(last + 1))
    product = QQ(1)
    for row, column in order:
        pivot = left[row].get(column)
        if not pivot:
            return None
        product *= pivot
        waiting.remove(row)
        _clear(left, row, column, waiting)
    return left[last].get(last, QQ(0)), product


def _interpolated(points: list[Any], samples: list[Any]) -> list[Any]:
    """Return the polynomial through samples, highest power first (Newton)."""
    parts = list(samples)
    for order in range(1, len(points)):
        for at in range(len(points) - 1, order - 1, -1):
            parts[at] = (parts[at] - parts[at - 1]) / (points[at] - points[at - order])
    found = [parts[-1]]
    for point, part in zip(points[-2::-1], parts[-2::-1], strict=True):
        shifted = [*found, part]
        for at, value in enumerate(found):
            shifted[at + 1] -= point * value
        found = shifted
    while len(found) > 1 and not found[0]:
        found.pop(0)
    return found


@dataclass(frozen=True, eq=False)
class Fraction:
    """
    A transfer function in numbers, without common factors.

    Parameters
    ----------
    numerator, denominator : numpy.ndarray
        Coefficients, highest power of s first; the denominator's first is 1.
    zeros, poles : numpy.ndarray of complex
        [1/s].

    """

    numerator: FloatArray
    denominator: FloatArray
    zeros: NDArray[np.complex128]
    poles: NDArray[np.complex128]


def fraction_of(graph: LinearGraph, output: str, source: str, values: Mapping[str, float]
                ) -> Fraction:
    """Return the transfer function from an input to a variable; numbers must be allowed."""
    structure = analyse(graph, [output])
    above, below = exact_fraction(structure, values, structure.inputs.index(source))
    arrays = (coefficients(above), coefficients(below), roots(above), roots(below))
    for array in arrays:
        array.setflags(write=False)
    return Fraction(*arrays)


def roots(polynomial: Any) -> NDArray[np.complex128]:
    """Return where a polynomial over the rational numbers is zero, slowest last."""
    from sympy.polys.polytools import NoConvergence

    found: list[complex] = []
    for factor, power in polynomial.sqf_list()[1]:
        try:
            own = [complex(root) for root in factor.nroots(n=ROOT_DIGITS, maxsteps=ROOT_STEPS)]
        except NoConvergence:
            own = list(np.roots(coefficients(factor)))
        found += own * power
    array = np.array(found, dtype=np.complex128)
    return array[np.lexsort((array.imag, array.real))]


def coefficients(polynomial: Any) -> FloatArray:
    """
    Return a polynomial's coefficients, highest power first.

    Raises
    ------
    ParameterError
        If they are too large for floating-point numbers.

    """
    try:
        return np.array([float(value) for value in polynomial.all_coeffs()])
    except OverflowError as error:
        raise ParameterError('the coefficients of the transfer function are beyond 1e308; take '
                             'fewer states, or slower ones') from error
