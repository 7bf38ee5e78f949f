# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Exact linear algebra modulo a prime.

Whether a set of variables is independent must not hang on rounding, nor on the values that
parameters happen to have. So generic (random, fixed) ratios are put in and ranks are found
exactly, modulo 2^31 - 1; the chance that a generic rank comes out too low is below 1e-6
(Schwartz-Zippel), and the draw is fixed, so results are the same on every machine.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

PRIME = 2**31 - 1
IntArray = NDArray[np.int64]


def generic_numbers(count: int) -> tuple[int, ...]:
    """Return fixed pseudo-random residues that stand for independent parameters."""
    numbers, state = [], 20240229
    for _ in range(count):
        state = (state * 6364136223846793005 + 1442695040888963407) % 2**64
        numbers.append((state >> 33) % (PRIME - 2) + 1)
    return tuple(numbers)


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

    @property
    def rows_left(self) -> int:
        """Number of equations not yet used."""
        return int(self._rows.shape[0])

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
