# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Student's t of whitened innovations, under which single ones may be far off.

With nu degrees of freedom an innovation e costs c(e) more than one that is nought, and counts in a
reweighted least-squares step as much as its weight w(e)::

    c(e) = (nu + 1) / 2 log(1 + e^2 / nu),   w(e) = c'(e) / e = (nu + 1) / (nu + e^2)
"""

from __future__ import annotations

from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.signals import FloatArray
import numpy as np


def costs(whitened: FloatArray) -> FloatArray:
    """
    Return what each innovation costs.

    Parameters
    ----------
    whitened : numpy.ndarray
        Of any shape, in standard deviations.

    Returns
    -------
    numpy.ndarray
        Of the same shape [nats].

    """
    nu = setting('student')
    each: FloatArray = 0.5 * (nu + 1.0) * np.log1p(whitened * whitened / nu)
    return each


def cost(whitened: FloatArray) -> float:
    """Return what all innovations cost together [nats]."""
    return float(np.sum(costs(whitened)))


def weights(whitened: FloatArray) -> FloatArray:
    """Return how much each innovation counts in a step, of the same shape."""
    nu = setting('student')
    each: FloatArray = (nu + 1.0) / (nu + whitened * whitened)
    return each
