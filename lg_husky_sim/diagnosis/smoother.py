# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Estimate unknown inputs over time: a smoother, computed as regularised least squares.

Each input is a first-order Markov process, so that its prior has a banded precision, and so has
the posterior, since the memory of the robot is short. What a recalibration can move is estimated
along, within its priors. The evidence of a family of inputs is its marginal likelihood: a family
that needs less freedom to explain the same residual has more of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import itertools
import math

from lg_husky_sim.diagnosis.fits import Fit
from lg_husky_sim.diagnosis.unknown_inputs import Bins, Input, KNOT, Responses
from lg_husky_sim.identification.least_squares import Unknown
from lg_husky_sim.signals import FloatArray
import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.sparse import csc_matrix

#: Correlation times [s] and relative sizes of the processes that are tried.
TIMES = (0.3, 3.0, 60.0)
SIZES = (0.1, 0.4, 1.6, 6.4, 25.0)


@dataclass(frozen=True, eq=False)
class Estimate:
    """
    Inputs over one piece.

    Parameters
    ----------
    piece : int
    times : numpy.ndarray, shape (n_knots,)
        On the recording's clock [s].
    values, deviations : numpy.ndarray, shape (n_knots, n_inputs)
        Estimate and its standard deviation [unit of each input].
    gains : numpy.ndarray, shape (n_rows,)
        Drop of the half squared residual of each row of the bins [nats].
    """

    piece: int
    times: FloatArray
    values: FloatArray
    deviations: FloatArray
    gains: FloatArray


@dataclass(frozen=True, eq=False)
class Explanation:
    """
    What a family of inputs explains together.

    Parameters
    ----------
    inputs : tuple of Input
    evidence : float
        Logarithm of the marginal likelihood against no input at all [nats].
    estimates : tuple of Estimate
        One for each piece.
    """

    inputs: tuple[Input, ...]
    evidence: float
    estimates: tuple[Estimate, ...]


def _prior(count: int, sizes: Sequence[float], time: float, width: int) -> FloatArray:
    # Banded precision (lower form) of independent first-order Markov processes.
    k = len(sizes)
    share = math.exp(-KNOT / time)
    band = np.zeros((width + 1, count * k))
    for place, size in enumerate(sizes):
        inner = 1.0 / (size ** 2 * (1.0 - share ** 2))
        diagonal = np.full(count, inner * (1.0 + share ** 2))
        diagonal[[0, -1]] = inner
        band[0, place::k] = diagonal
        band[k, place:(count - 1) * k:k] = -share * inner
    return band


def _banded(matrix: csc_matrix, width: int) -> FloatArray:
    band = np.zeros((width + 1, matrix.shape[0]))
    for offset in range(width + 1):
        diagonal = matrix.diagonal(-offset)
        band[offset, :diagonal.size] = diagonal
    return band


@dataclass(frozen=True, eq=False)
class _System:
    # Normal equations of one piece: inputs (banded), and the recalibration beside them.
    design: csc_matrix
    band: FloatArray
    along: FloatArray  # (n, 1 + n_unknowns): of the residual and of the slopes
    beside: FloatArray  # (1 + n_unknowns, 1 + n_unknowns): products of residual and slopes
    knots: FloatArray
    width: int

    def reduced(self, sizes: Sequence[float], time: float) -> tuple[float, FloatArray, FloatArray]:
        # Half the logarithm of the determinants, what is left beside, and the solution.
        prior = _prior(self.knots.size, sizes, time, self.width)
        factor = cholesky_banded(self.band + prior, lower=True)
        own = cholesky_banded(prior, lower=True)
        solved = cho_solve_banded((factor, True), self.along)
        volume = float(np.sum(np.log(factor[0])) - np.sum(np.log(own[0])))
        return volume, self.beside - self.along.T @ solved, solved

    def deviations(self, sizes: Sequence[float], time: float) -> FloatArray:
        prior = _prior(self.knots.size, sizes, time, self.width)
        factor = cholesky_banded(self.band + prior, lower=True)
        inverse = cho_solve_banded((factor, True), np.eye(len(self.along)))
        spreads: FloatArray = np.sqrt(np.maximum(np.diag(inverse), 0.0))
        return spreads


def _system(one: Bins, responses: Responses, inputs: Sequence[Input]) -> _System:
    k = len(inputs)
    start, end = float(one.begins.min()), float(one.ends.max())
    count = max(3, math.ceil((end - start) / KNOT) + 2)
    knots: FloatArray = start + KNOT * np.arange(count, dtype=np.float64)
    design = responses.design(one, inputs, knots)
    square = (design.T @ design).tocsc()
    entries = square.tocoo()
    reach = int(np.max(np.abs(entries.row - entries.col), initial=0))
    width = min(max(reach, k), knots.size * k - 1)
    outside = np.column_stack([one.values, one.slopes]) / one.deviations[:, None]
    return _System(design, _banded(square, width), design.T @ outside, outside.T @ outside,
                   knots, width)


def _marginal(beside: FloatArray, unknowns: Sequence[Unknown], values: Mapping[str, float]
              ) -> tuple[float, FloatArray]:
    # Log-likelihood after the recalibration is integrated out, and where it moves.
    weights = np.array([1.0 / u.deviation for u in unknowns])
    pull = np.array([(u.centre - u.varied(values[u.name])) / u.deviation
                     if math.isfinite(u.deviation) else 0.0 for u in unknowns])
    curvature = beside[1:, 1:] + np.diag(weights ** 2)
    curvature += 1e-9 * np.diag(np.diag(curvature)) + 1e-12 * np.eye(len(curvature))
    along = beside[1:, 0] + weights * pull
    moved: FloatArray = np.linalg.solve(curvature, along)
    volume = float(np.linalg.slogdet(curvature)[1])
    return float(0.5 * (along @ moved) - 0.5 * beside[0, 0] - 0.5 * volume), moved


def explain(fit: Fit, bins: Sequence[Bins], responses: Responses, inputs: Sequence[Input],
            spreads: bool = True) -> Explanation:
    """
    Estimate a family of inputs, their sizes and correlation time chosen by the evidence.

    What a recalibration can move is estimated along with them, within its priors: a fit without
    the inputs has hidden part of them in its parameters.

    Parameters
    ----------
    fit : Fit
    bins : sequence of Bins
        Of :func:`~lg_husky_sim.diagnosis.unknown_inputs.binned`.
    responses : Responses
    inputs : sequence of Input
        All estimated together.
    spreads : bool
        Whether standard deviations are wanted; NaN without.

    Returns
    -------
    Explanation
    """
    k, solution = len(inputs), fit.solution
    systems = [_system(one, responses, inputs) for one in bins]
    without, _ = _marginal(np.sum([s.beside for s in systems], axis=0), solution.unknowns,
                           solution.values)
    best: tuple[float, tuple[float, ...], float] = (-math.inf, (), TIMES[0])
    for time, relative in itertools.product(TIMES, SIZES):
        sizes = tuple(relative * one.size for one in inputs)
        parts = [system.reduced(sizes, time) for system in systems]
        value, _ = _marginal(np.sum([p[1] for p in parts], axis=0), solution.unknowns,
                             solution.values)
        value -= sum(part[0] for part in parts)
        if value > best[0]:
            best = (value, sizes, time)
    value, sizes, time = best
    parts = [system.reduced(sizes, time) for system in systems]
    _, moved = _marginal(np.sum([p[1] for p in parts], axis=0), solution.unknowns,
                         solution.values)
    _, alone = _marginal(np.sum([s.beside for s in systems], axis=0), solution.unknowns,
                         solution.values)
    estimates = []
    for one, system, part in zip(bins, systems, parts, strict=True):
        mean = part[2] @ np.concatenate([[1.0], -moved])
        before = (one.values - one.slopes @ alone) / one.deviations
        after = (one.values - one.slopes @ moved) / one.deviations - system.design @ mean
        spread_of = system.deviations(sizes, time) if spreads else np.full(mean.size, np.nan)
        estimates.append(Estimate(one.piece, system.knots, mean.reshape(-1, k),
                                  spread_of.reshape(-1, k), 0.5 * (before ** 2 - after ** 2)))
    return Explanation(tuple(inputs), max(value - without, 0.0), tuple(estimates))
