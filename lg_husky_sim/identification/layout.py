# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Normal equations in which every segment has unknowns of its own beside those that all share.

A segment's own unknowns move its own values alone. So the derivatives by the first own unknown of
every segment fit into one column, those by the second into the next, and one simulation gives
each; and the equations are solved segment by segment, then once for what is shared.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from lg_husky_sim.identification.problem import Observations
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray


class Local(Protocol):
    """What is to be known of an unknown: its segment and its column there, or None if shared."""

    @property
    def local(self) -> tuple[int, int] | None:
        """Return the number of the segment, and of the column."""


class Layout:
    """
    Which unknowns share a column of the derivatives.

    Parameters
    ----------
    observations : Observations
    unknowns : sequence
        Segments with own unknowns have the same columns.

    Attributes
    ----------
    shared : numpy.ndarray of int, shape (n_shared,)
        Unknowns that all segments share.
    own : numpy.ndarray of int, shape (n_segments, n_own)
        Unknowns of each segment that has its own.
    rows : tuple of slice
        Values of each of these segments.

    """

    def __init__(self, observations: Observations, unknowns: Sequence[Local]) -> None:
        self.size = len(unknowns)
        self.shared = np.array([i for i, u in enumerate(unknowns) if u.local is None], dtype=int)
        places = {u.local: i for i, u in enumerate(unknowns) if u.local is not None}
        segments = sorted({segment for segment, _ in places})
        columns = sorted({column for _, column in places})
        self.own = np.array(
            [[places[segment, column] for column in columns] for segment in segments],
            dtype=int).reshape(len(segments), len(columns))
        self.rows = tuple(_rows(observations, segment) for segment in segments)

    @property
    def columns(self) -> int:
        """Columns of the packed derivatives: the shared unknowns', then the own ones'."""
        return self.shared.size + self.own.shape[1]

    def project(self, slope: FloatArray, values: FloatArray) -> FloatArray:
        """
        Return the derivatives, transposed, times values.

        Parameters
        ----------
        slope : numpy.ndarray, shape (n_values, columns)
            Packed.
        values : numpy.ndarray, shape (n_values,)
            Whitened residuals, or what else there is for each value.

        Returns
        -------
        numpy.ndarray, shape (n_unknowns,)

        """
        if not self.own.size:
            return np.asarray(slope.T @ values)
        n = self.shared.size
        found = np.zeros(self.size)
        found[self.shared] = slope[:, :n].T @ values
        for own, rows in zip(self.own, self.rows, strict=True):
            found[own] = slope[rows, n:].T @ values[rows]
        return found

    def gram(self, slope: FloatArray) -> FloatArray:
        """
        Return the derivatives, transposed, times themselves.

        Parameters
        ----------
        slope : numpy.ndarray, shape (n_values, columns)
            Packed.

        Returns
        -------
        numpy.ndarray, shape (n_unknowns, n_unknowns)
            Zero between own unknowns of different segments.

        """
        if not self.own.size:
            return np.asarray(slope.T @ slope)
        n = self.shared.size
        found = np.zeros((self.size, self.size))
        found[np.ix_(self.shared, self.shared)] = slope[:, :n].T @ slope[:, :n]
        for own, rows in zip(self.own, self.rows, strict=True):
            block = slope[rows, n:].T @ slope[rows]
            found[np.ix_(own, self.shared)] = block[:, :n]
            found[np.ix_(self.shared, own)] = block[:, :n].T
            found[np.ix_(own, own)] = block[:, n:]
        return found

    def solve(self, matrix: FloatArray, right: FloatArray, free: NDArray[np.bool_]
              ) -> FloatArray:
        """
        Solve for the unknowns that are free, in the sense of least squares.

        Parameters
        ----------
        matrix : numpy.ndarray, shape (n_unknowns, n_unknowns)
            As :meth:`gram` gives it, with anything positive added to its diagonal.
        right : numpy.ndarray, shape (n_unknowns,)
            Right-hand side, as :meth:`project` gives it.
        free : numpy.ndarray of bool, shape (n_unknowns,)
            Which unknowns may move.

        Returns
        -------
        numpy.ndarray, shape (n_unknowns,)
            Zero where not free.

        """
        found = np.zeros(self.size)
        if not self.own.size:
            part = np.ix_(free, free)
            found[free] = np.linalg.lstsq(matrix[part], right[free], rcond=None)[0]
            return found
        shared = self.shared[free[self.shared]]
        inner, across = self._blocks(matrix, free)
        across = across[:, :, free[self.shared]]
        aside = np.where(free[self.own], right[self.own], 0.0)
        solved = np.linalg.solve(inner, np.concatenate([across, aside[:, :, None]], axis=2))
        left = matrix[np.ix_(shared, shared)] - np.einsum('pij,pik->jk', across,
                                                          solved[:, :, :-1])
        rest = right[shared] - np.einsum('pij,pi->j', across, solved[:, :, -1])
        found[shared] = np.linalg.lstsq(left, rest, rcond=None)[0]
        own = solved[:, :, -1] - solved[:, :, :-1] @ found[shared]
        found[self.own] = np.where(free[self.own], own, 0.0)
        return found

    def _blocks(self, matrix: FloatArray, free: NDArray[np.bool_]
                ) -> tuple[FloatArray, FloatArray]:
        # What couples the own unknowns of each segment, shape (n_segments, n_own, n_own), and them
        # with the shared ones, shape (n_segments, n_own, n_shared); held ones stand alone.
        inner = matrix[self.own[:, :, None], self.own[:, None, :]]
        across = matrix[self.own[:, :, None], self.shared[None, None, :]]
        held = ~free[self.own]
        inner[held[:, :, None] | held[:, None, :]] = 0.0
        across[held] = 0.0
        place = np.arange(self.own.shape[1])
        inner[:, place, place] += held
        return inner, across

    def eliminate(self, matrix: FloatArray, slope: FloatArray
                  ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """
        Take the own unknowns out of the equations of the shared ones.

        Parameters
        ----------
        matrix : numpy.ndarray, shape (n_unknowns, n_unknowns)
            Curvature, priors included.
        slope : numpy.ndarray, shape (n_values, columns)
            Packed.

        Returns
        -------
        curvature : numpy.ndarray, shape (n_shared, n_shared)
            Of the shared unknowns where the own ones follow them.
        along : numpy.ndarray, shape (n_values, n_shared)
            Derivatives by the shared unknowns while the own ones follow.
        follow : numpy.ndarray, shape (n_segments, n_own, n_shared)
            Minus by how much the own unknowns follow the shared ones.
        alone : numpy.ndarray, shape (n_segments, n_own)
            Variance of each own unknown if the shared ones were known.

        """
        n = self.shared.size
        if not self.own.size:
            none = np.zeros(self.own.shape)
            return matrix, slope, np.zeros((*self.own.shape, n)), none
        inner, across = self._blocks(matrix, np.ones(self.size, dtype=bool))
        inverse = np.linalg.inv(inner)
        follow = inverse @ across
        curvature = matrix[np.ix_(self.shared, self.shared)] - np.einsum(
            'pij,pik->jk', across, follow)
        along = np.array(slope[:, :n])
        for rows, one in zip(self.rows, follow, strict=True):
            along[rows] -= slope[rows, n:] @ one
        return curvature, along, follow, np.diagonal(inverse, axis1=1, axis2=2)


def _rows(observations: Observations, segment: int) -> slice:
    slices = [one for one in observations.slices if one.segment == segment]
    return slice(slices[0].first, slices[-1].last) if slices else slice(0, 0)
