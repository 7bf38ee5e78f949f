# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""How well the numbers and the name of a finding are known."""

from __future__ import annotations

from collections.abc import Sequence
import math

from lg_husky_sim.diagnosis.fits import Fit
from lg_husky_sim.diagnosis.result import Estimate
from lg_husky_sim.identification.noise import Metric
from lg_husky_sim.identification.problem import Observations
from lg_husky_sim.signals import FloatArray
import numpy as np
from scipy.special import chdtrc

#: Half width of a 95 % interval in standard deviations.
TWO_SIDED = 1.96
#: Share of the largest eigenvalue of the scaled information below which nothing is known.
FLAT = 1e-10


def covariance(observations: Observations, fit: Fit, metric: Metric) -> FloatArray:
    """
    Return the covariance of a fit's varied quantities.

    Parameters
    ----------
    observations : Observations
    fit : Fit
    metric : Metric

    Returns
    -------
    numpy.ndarray, shape (n_unknowns, n_unknowns)
        From the whitened Jacobian and the priors, scaled up where the whitened residual is
        larger than one.
    """
    solution = fit.solution
    slope = metric.whiten(observations, solution.jacobian)
    white = metric.whiten(observations, observations.measured - solution.predicted)
    used = max(int(np.count_nonzero(metric.scale)), 1)
    level = max(float(white @ white) / used, 1.0)
    deviations = np.array([u.deviation for u in solution.unknowns])
    information = slope.T @ slope / level + np.diag(1.0 / deviations ** 2)
    scale = 1.0 / np.sqrt(np.maximum(np.diag(information), 1e-12))
    eigenvalues, axes = np.linalg.eigh(information * np.outer(scale, scale))
    # A direction that the data do not touch is open up to the bounds, and not known exactly.
    inside = axes / np.maximum(eigenvalues, FLAT * eigenvalues[-1]) @ axes.T
    result: FloatArray = inside * np.outer(scale, scale)
    return result


def estimates(observations: Observations, fit: Fit, metric: Metric, names: Sequence[str]
              ) -> tuple[Estimate, ...]:
    """
    Return numbers of a fit with 95 % intervals.

    Parameters
    ----------
    observations : Observations
    fit : Fit
    metric : Metric
    names : sequence of str
        Of its unknowns.

    Returns
    -------
    tuple of Estimate
        Intervals are cut at the bounds.
    """
    spread = np.sqrt(np.maximum(np.diag(covariance(observations, fit, metric)), 0.0))
    found = []
    for unknown, deviation in zip(fit.solution.unknowns, spread, strict=True):
        if unknown.name not in names:
            continue
        value = fit.solution.values[unknown.name]
        centre = unknown.varied(value)
        width = TWO_SIDED * float(deviation)
        unit = 's' if unknown.extra else fit.parameters.entry(unknown.name).unit
        found.append(Estimate(unknown.name, value, unit, unknown.value(centre - width),
                              unknown.value(centre + width)))
    return tuple(sorted(found, key=lambda e: list(names).index(e.name)))


def p_value(gain: float, freedom: int, hypotheses: int) -> float:
    """
    Return the chance of such a drop of the half sum of squares without an effect.

    Parameters
    ----------
    gain : float
        [nats].
    freedom : int
        Parameters of the effect.
    hypotheses : int
        How many were looked at.

    Returns
    -------
    float
    """
    single = float(chdtrc(max(freedom, 1), 2.0 * max(gain, 0.0)))
    return min(1.0, single * hypotheses)


def name_confidence(gains: Sequence[float]) -> float:
    """
    Return the posterior share of the first of several rivals.

    Parameters
    ----------
    gains : sequence of float
        Held-out gains [nats], the first that of the named effect. They are divided by a
        temperature, since held-out gains of structurally wrong models are over-confident.

    Returns
    -------
    float
    """
    if not gains:
        return 0.5
    temperature = max(2.0, 0.02 * max(gains[0], 0.0))
    weights = [math.exp(max(-50.0, min(0.0, (g - gains[0]) / temperature))) for g in gains]
    return 1.0 / sum(weights)
