# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a finding leaves that its name should have explained.

A name outside the catalogue often comes in the guise of one inside it: a gyro that clips looks
like one that reads too little. The guise leaves a residual that is a plain function of what the
sensor should read; the true effect does not.
"""

from __future__ import annotations

import math

from lg_husky_sim.diagnosis.evidence import FOLDS, folds_of
from lg_husky_sim.diagnosis.fits import Fit, shared_metric
from lg_husky_sim.diagnosis.screening import Projector
from lg_husky_sim.diagnosis.unnamed import ridge
from lg_husky_sim.identification.problem import Observations
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Knots of a function of the reading.
KNOTS = 9
#: Gain of an effect below which chance and guises weigh [nats]; the most that they take away.
THIN, THIN_WEIGHT = 400.0, 0.5
#: Most that a remaining function of the reading takes away, and the part of the finding's gain
#: at which half of it is taken.
GUISE_WEIGHT, GUISE_HALF = 0.6, 0.1


def reading_gain(observations: Observations, fit: Fit) -> float:
    """
    Return what a smooth function of one channel's own reading would still explain.

    Parameters
    ----------
    observations : Observations
    fit : Fit
        With what was found.

    Returns
    -------
    float
        Gain on blocks that were not fitted, of the best channel [nats].
    """
    solution = fit.solution
    columns = {name: hats(solution.predicted, observations.channel_mask(name))
               for name in observations.channels}
    metric = shared_metric(observations, fit, [])
    deviations = np.array([u.deviation for u in solution.unknowns])
    residual = observations.measured - solution.predicted
    projector = Projector(observations, metric, residual, solution.jacobian, deviations,
                          np.zeros(deviations.size))
    target, folds = projector.residual[:projector.size], folds_of(observations)
    best = 0.0
    for own in columns.values():
        seen = projector.projected(own)[:projector.size]
        gain = 0.0
        for fold in range(FOLDS):
            out = folds == fold
            if not np.any(out) or np.all(out):
                continue
            left = target[out] - seen[out] @ ridge(seen[~out], target[~out])
            gain += 0.5 * float(target[out] @ target[out] - left @ left)
        best = max(best, gain)
    return best


def hats(values: FloatArray, mask: np.typing.NDArray[np.bool_]) -> FloatArray:
    """Return hat functions over the range of some values, zero elsewhere, (n_values, KNOTS)."""
    columns = np.zeros((values.size, KNOTS))
    own = values[mask]
    if own.size:
        low, high = np.quantile(own, [0.01, 0.99])
        place = np.clip((own - low) / max(float(high - low), 1e-9), 0.0, 1.0) * (KNOTS - 1)
        columns[mask] = np.maximum(0.0, 1.0 - np.abs(place[:, None] - np.arange(KNOTS)))
    return columns


def belief(gain: float, share: float, remaining: float) -> float:
    """
    Return by how much a name is believed, beside its rivals.

    Parameters
    ----------
    gain : float
        Held-out gain of the finding [nats].
    share : float
        Of what was unexplained.
    remaining : float
        Of :func:`reading_gain` [nats].

    Returns
    -------
    float
        1 for full belief.
    """
    thin = THIN_WEIGHT * math.exp(-max(gain, 0.0) / THIN) * (1.0 - min(max(share, 0.0), 1.0))
    left = max(remaining, 0.0) / max(gain, 1.0)
    return (1.0 - thin) * (1.0 - GUISE_WEIGHT * left / (left + GUISE_HALF))
