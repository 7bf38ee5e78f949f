# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A Gauss-Newton step inside bounds, and which numbers they keep from moving."""

from __future__ import annotations

from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray


def step_inside(normal: FloatArray, slope: FloatArray, low: FloatArray, high: FloatArray
                ) -> FloatArray:
    """
    Return the step of normal equations that stays inside bounds.

    Numbers that would leave them stop there, and the others make the best of it.

    Parameters
    ----------
    normal : numpy.ndarray, shape (k, k)
        Normal matrix, positive definite.
    slope : numpy.ndarray, shape (k,)
        Right-hand side: the step without bounds is ``normal^-1 slope``.
    low, high : numpy.ndarray, shape (k,)
        Least (at most zero) and largest (at least zero) move of each number.

    Returns
    -------
    numpy.ndarray, shape (k,)

    """
    move: FloatArray = np.asarray(np.linalg.solve(normal, slope), dtype=np.float64)
    free = np.ones(move.size, dtype=np.bool_)
    for _ in range(move.size):
        beyond = free & ((move < low) | (move > high))
        if not np.any(beyond):
            break
        free &= ~beyond
        move = np.asarray(np.clip(move, low, high), dtype=np.float64)
        if np.any(free):
            rest = slope[free] - normal[np.ix_(free, ~free)] @ move[~free]
            move[free] = np.linalg.solve(normal[np.ix_(free, free)], rest)
    return move


def held(places: FloatArray, slope: FloatArray, low: FloatArray, high: FloatArray
         ) -> NDArray[np.bool_]:
    """
    Return which numbers are at a bound that they would cross.

    Parameters
    ----------
    places : numpy.ndarray, shape (k,)
        Inside the bounds.
    slope : numpy.ndarray, shape (k,)
        Down the cost.
    low, high : numpy.ndarray, shape (k,)
        Bounds of each place.

    Returns
    -------
    numpy.ndarray of bool, shape (k,)

    """
    found: NDArray[np.bool_] = ((places <= low) & (slope < 0.0)) | (
        (places >= high) & (slope > 0.0))
    return found
