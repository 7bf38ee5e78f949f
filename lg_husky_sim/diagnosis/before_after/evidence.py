# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Evidence of every change from each recording's quadratic: one linear solve a hypothesis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Quadratic:
    """
    A recording's log likelihood near its set's fit, as 0.5 θ'Hθ - h'θ.

    Parameters
    ----------
    recording : str
    after : bool
    curvature : numpy.ndarray, shape (n, n)
    slope : numpy.ndarray, shape (n,)
    """

    recording: str
    after: bool
    curvature: FloatArray
    slope: FloatArray

    def varying(self, sd: FloatArray) -> tuple[FloatArray, FloatArray, float]:
        """Return curvature, slope and log evidence with the recording's own deviation."""
        inner = sd[:, None] * self.curvature * sd
        inner[np.diag_indices(sd.size)] += 1.0
        left = sd[:, None] * np.linalg.solve(inner, sd[:, None] * np.column_stack(
            [self.curvature, self.slope]))
        curvature = self.curvature - self.curvature @ left[:, :-1]
        slope = self.slope - self.curvature @ left[:, -1]
        sign_log = np.linalg.slogdet(inner)[1]
        return curvature, slope, float(0.5 * self.slope @ left[:, -1] - 0.5 * sign_log)


@dataclass(frozen=True, eq=False)
class Solution:
    """
    A hypothesis solved.

    Parameters
    ----------
    evidence : float
        Log evidence [nats], up to a constant shared by all.
    shared : numpy.ndarray, shape (n,)
        Parameters before.
    shift : numpy.ndarray, shape (k,)
        What differs after.
    covariance : numpy.ndarray, shape (k, k)
    """

    evidence: float
    shared: FloatArray
    shift: FloatArray
    covariance: FloatArray


@dataclass(frozen=True, eq=False)
class Evidence:
    """
    All recordings' quadratics with the priors.

    Parameters
    ----------
    quadratics : sequence of Quadratic
    mean, sd : numpy.ndarray, shape (n,)
        Prior of what is shared.
    recording_sd : numpy.ndarray, shape (n,)
        Deviations from recording to recording.
    change_sd : numpy.ndarray, shape (n,)
        Prior of a change.
    """

    quadratics: Sequence[Quadratic]
    mean: FloatArray
    sd: FloatArray
    recording_sd: FloatArray
    change_sd: FloatArray

    def solve(self, changed: NDArray[np.intp]) -> Solution:
        """Return the solution where the parameters of these indices differ after."""
        n, k = self.mean.size, changed.size
        precision = np.zeros((n + k, n + k))
        slope = np.zeros(n + k)
        precision[np.arange(n), np.arange(n)] = 1.0 / self.sd ** 2
        slope[:n] = self.mean / self.sd ** 2
        own = np.arange(n, n + k)
        precision[own, own] = 1.0 / self.change_sd[changed] ** 2
        prior = (-0.5 * float(np.sum((self.mean / self.sd) ** 2))
                 - float(np.sum(np.log(self.sd))) - float(np.sum(np.log(self.change_sd[changed]))))
        for one in self.quadratics:
            curvature, direction, constant = one.varying(self.recording_sd)
            prior += constant
            precision[:n, :n] += curvature
            slope[:n] += direction
            if one.after and k:
                precision[:n, n:] += curvature[:, changed]
                precision[n:, :n] += curvature[changed]
                precision[n:, n:] += curvature[np.ix_(changed, changed)]
                slope[n:] += direction[changed]
        covariance = np.linalg.inv(precision)
        at = covariance @ slope
        evidence = prior + 0.5 * float(slope @ at) - 0.5 * float(np.linalg.slogdet(precision)[1])
        return Solution(evidence, at[:n], at[n:], np.asarray(covariance[n:, n:], dtype=np.float64))
