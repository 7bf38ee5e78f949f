# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Hat functions: one at its knot, zero from the next knots on, linear between."""

from __future__ import annotations

from collections.abc import Sequence

from lg_husky_sim.signals import FloatArray
import numpy as np


def hats(values: FloatArray, low: float, high: float, count: int) -> FloatArray:
    """Return the hat functions of values over a range, shape (n, count)."""
    place = np.clip((values - low) / max(high - low, 1e-12) * (count - 1), 0.0, count - 1.0)
    left = np.minimum(place.astype(np.int64), count - 2)
    share = place - left
    found = np.zeros((values.size, count))
    rows = np.arange(values.size)
    found[rows, left] = 1.0 - share
    found[rows, left + 1] = share
    return found


def products_of_hats(values: Sequence[FloatArray], ranges: Sequence[tuple[float, float]],
                     count: int) -> FloatArray:
    """Return products of hat functions of d quantities, each over its range, (n, count^d)."""
    found = np.ones((values[0].size, 1))
    for one, (low, high) in zip(values, ranges, strict=True):
        own = hats(one, low, high, count)
        found = (found[:, :, None] * own[:, None, :]).reshape(one.size, -1)
    return found
