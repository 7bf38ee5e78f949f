# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A first-order low pass; scipy.signal would take half a second to import."""

from __future__ import annotations

from lg_husky_sim.jit import jit
from lg_husky_sim.signals import FloatArray
import numpy as np


@jit
def _follow(values: FloatArray, keep: float, share: float, out: FloatArray) -> None:
    # Begins at rest at the first value.
    memory = share * values[0]
    for k in range(values.size):
        out[k] = memory + (1.0 - share) * values[k]
        memory = (share - keep) * values[k] + keep * out[k]


def low_passed(values: FloatArray, step: float, lag: float) -> FloatArray:
    """
    Return a signal behind a first-order low pass; exact where it is straight within a step.

    Parameters
    ----------
    values : numpy.ndarray, shape (n,)
        Evenly spaced; the filter begins at rest at the first one.
    step : float
        Spacing [s].
    lag : float
        Time constant [s].

    Returns
    -------
    numpy.ndarray, shape (n,)
    """
    keep = float(np.exp(-step / lag))
    out = np.empty(values.size)
    _follow(np.ascontiguousarray(values), keep, lag / step * (1.0 - keep), out)
    return out
