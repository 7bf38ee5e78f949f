# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What a fit gains on data that it was not fitted to, and how steadily."""

from __future__ import annotations

import math

from lg_husky_sim.diagnosis.fits import Fit
from lg_husky_sim.identification.noise import Metric
from lg_husky_sim.identification.problem import Observations
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Folds and block length of the held-out gain [s].
FOLDS = 4
BLOCK = 5.0
#: Part of the whole information on a number that is kept when a fold is left out.
HELD = 0.05


def folds_of(observations: Observations) -> FloatArray:
    """Return the fold of each value: blocks in time, dealt in turn, shape (n_values,)."""
    fold = np.zeros(observations.times.size)
    for one in observations.slices:
        part = slice(one.first, one.last)
        shift = observations.recordings.index(observations.pieces[one.piece].recording)
        fold[part] = (np.floor(observations.times[part] / BLOCK) + shift) % FOLDS
    return fold


def held_out_cost(observations: Observations, fit: Fit, metric_: Metric, folds: FloatArray
                  ) -> FloatArray:
    """
    Return half the squared whitened residual of each value when its fold is not fitted.

    One linear step from the full estimate, where the gradient vanishes, stands for the refit
    without a fold.

    Parameters
    ----------
    observations : Observations
    fit : Fit
    metric_ : Metric
    folds : numpy.ndarray, shape (n_values,)

    Returns
    -------
    numpy.ndarray, shape (n_values,)
    """
    solution = fit.solution
    white = metric_.whiten(observations, observations.measured - solution.predicted)
    slope = metric_.whiten(observations, solution.jacobian)
    deviations = np.array([u.deviation for u in solution.unknowns])
    weights = 1.0 / deviations ** 2
    cost = np.zeros(white.size)
    whole = np.einsum('ij,ij->j', slope, slope)
    for fold in range(FOLDS):
        out = folds == fold
        inside, own = slope[~out], slope[out]
        curvature = inside.T @ inside + np.diag(weights)
        # What shows in one fold only cannot be estimated without it; it then stays where it is.
        curvature += HELD * np.diag(whole) + 1e-12 * np.eye(curvature.shape[0])
        left = white[out] + own @ np.linalg.solve(curvature, own.T @ white[out])
        cost[out] = 0.5 * left ** 2
    return cost


def strain(fit: Fit) -> float:
    """Return what a recalibration costs: half the squared deviations from nominal [nats]."""
    known = [u for u in fit.solution.unknowns if u.local is None and math.isfinite(u.deviation)]
    return 0.5 * sum(((u.varied(fit.solution.values[u.name]) - u.centre) / u.deviation) ** 2
                     for u in known)


def energy(observations: Observations, fit: Fit, metric_: Metric) -> float:
    """Return the sum of squares of the scaled residual, correlation left in."""
    plain = metric_.uncorrelated
    scaled = plain.whiten(observations, observations.measured - fit.solution.predicted)
    return float(np.sum(np.minimum(scaled ** 2, 1e6)))


def instability(observations: Observations, gain: FloatArray) -> float:
    """
    Return how much of a gain some blocks lose again.

    Parameters
    ----------
    observations : Observations
    gain : numpy.ndarray, shape (n_values,)
        Held-out gain of each value [nats].

    Returns
    -------
    float
        Sum of the losing blocks over that of the gaining ones; near zero for real physics.
    """
    cells: dict[tuple[str, int], float] = {}
    for one in observations.slices:
        recording = observations.pieces[one.piece].recording
        number = np.floor(observations.times[one.first:one.last] / BLOCK).astype(np.int64)
        for block in np.unique(number):
            key = (recording, int(block))
            cells[key] = cells.get(key, 0.0) + float(
                np.sum(gain[one.first:one.last][number == block]))
    lost = sum(-value for value in cells.values() if value < 0.0)
    won = sum(value for value in cells.values() if value > 0.0)
    return lost / max(won, 1e-9)
