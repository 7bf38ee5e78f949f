# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Exact linear algebra modulo a prime.

Whether a set of variables is independent must not hang on rounding, nor on the values that
parameters happen to have. So every parameter gets a generic (pseudo-random, fixed) number and
ranks are found exactly, modulo 2^31 - 1; the chance that a generic rank comes out too low is
below 1e-6 (Schwartz-Zippel), and results are the same on every machine.
"""

from __future__ import annotations

import ast
from fractions import Fraction
import hashlib

from lg_husky_sim.linear_graph.expressions import CONSTANTS, number_of, parse
import numpy as np
from numpy.typing import NDArray

PRIME = 2**31 - 1
IntArray = NDArray[np.int64]


def generic_value(text: str) -> int:
    """
    Return the residue of an expression, each of its parameters having a generic number.

    Equal expressions of equal parameters give equal residues, so that two transformers of one
    and the same ratio are known to be in step. A function of parameters counts as a parameter.
    """
    try:
        return _residue(parse(text)) or _named(text)
    except ZeroDivisionError:
        return _named(text)


def _residue(node: ast.expr) -> int:
    match node:
        case ast.Constant(value=value):
            fraction = Fraction(repr(value))
            return fraction.numerator * pow(fraction.denominator, -1, PRIME) % PRIME
        case ast.Name(id=name) if name not in CONSTANTS:
            return _named(name)
        case ast.UnaryOp(op=op, operand=operand):
            return (-1 if isinstance(op, ast.USub) else 1) * _residue(operand) % PRIME
        case ast.BinOp(left=left, op=ast.Pow(), right=right):
            power = number_of(right)
            if power is not None and power.is_integer():
                return _power(_residue(left), int(power))
        case ast.BinOp(left=left, op=op, right=right):
            one, two = _residue(left), _residue(right)
            match op:
                case ast.Add():
                    return (one + two) % PRIME
                case ast.Sub():
                    return (one - two) % PRIME
                case ast.Mult():
                    return one * two % PRIME
                case _:
                    return one * _power(two, -1) % PRIME
    return _named(ast.unparse(node))


def _power(residue: int, power: int) -> int:
    if residue == 0 and power < 0:
        raise ZeroDivisionError
    return pow(residue, power, PRIME)


def _named(name: str) -> int:
    digest = hashlib.sha256(name.encode()).digest()
    return int.from_bytes(digest[:8], 'big') % (PRIME - 1) + 1


def generic_numbers(count: int) -> tuple[int, ...]:
    """Return fixed pseudo-random residues that stand for independent parameters."""
    return tuple(_named(f'independent parameter {at}') for at in range(count))


class Elimination:
    """
    Gaussian elimination of a system of homogeneous equations, one chosen column at a time.

    Parameters
    ----------
    matrix : array_like of int, shape (n_rows, n_columns)
        One equation a row.

    """

    def __init__(self, matrix: IntArray) -> None:
        """Start with all rows unused."""
        self._rows: IntArray = np.mod(np.asarray(matrix, dtype=np.int64), PRIME)

    def pivot(self, column: int) -> bool:
        """
        Use an unused equation to express the column by the others.

        Returns
        -------
        bool
            False if no unused equation contains it: it is then free, given the columns
            eliminated so far.

        """
        candidates = np.flatnonzero(self._rows[:, column])
        if candidates.size == 0:
            return False
        at = int(candidates[0])
        row = self._rows[at] * pow(int(self._rows[at, column]), -1, PRIME) % PRIME
        rest = np.delete(self._rows, at, axis=0)
        changed = candidates[1:] - 1
        if changed.size:
            rest[changed] = (rest[changed] - np.outer(rest[changed, column], row) % PRIME) % PRIME
        self._rows = rest
        return True


def is_regular(matrix: IntArray) -> bool:
    """Tell whether a square matrix is invertible modulo the prime."""
    elimination = Elimination(matrix)
    return all(elimination.pivot(column) for column in range(matrix.shape[1]))
