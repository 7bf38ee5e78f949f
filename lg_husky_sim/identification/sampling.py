# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Read a simulated column at the stamps of a sensor."""

from __future__ import annotations

from lg_husky_sim.identification.fit_segments import PERIOD
from lg_husky_sim.jit import compiled, jit
from lg_husky_sim.signals import FloatArray
import numpy as np

_COMPILED = compiled()


@jit
def _loop(column: FloatArray, start: float, period: float, times: FloatArray) -> FloatArray:
    # What the arrays below do, in one pass: most stamps are asked for thousands of times. The
    # period is told, since machine code on disk would keep another module's old constant.
    last = column.size - 1.000001
    out = np.empty(times.size)
    for i in range(times.size):
        place = min(max((times[i] - start) / period, 0.0), last)
        left = int(place)
        share = place - left
        out[i] = column[left] * (1.0 - share) + column[left + 1] * share
    return out


def sample(column: FloatArray, start: float, times: FloatArray) -> FloatArray:
    """
    Interpolate a column of a grid, straight between its steps and constant beyond its ends.

    Parameters
    ----------
    column : numpy.ndarray, shape (count + 1,)
        At ``start``, ``start + PERIOD``, ...; at least two.
    start : float
        On the recording's clock [s].
    times : numpy.ndarray, shape (n,)
        On the same clock [s].

    Returns
    -------
    numpy.ndarray, shape (n,)

    """
    if _COMPILED:
        return _loop(column, start, PERIOD, times)
    place = np.clip((times - start) / PERIOD, 0.0, column.size - 1.000001)
    left = place.astype(np.int64)
    share = place - left
    sampled: FloatArray = column[left] * (1.0 - share) + column[left + 1] * share
    return sampled
