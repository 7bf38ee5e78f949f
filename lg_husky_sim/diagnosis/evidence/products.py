# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Products of long columns, some rows at a time, so that copies of them stay in the cache."""

from __future__ import annotations

from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.signals import FloatArray
import numpy as np


def row_slices(count: int) -> list[slice]:
    """Return the slices of rows that are worked on together."""
    rows = int(setting('row_batch'))
    return [slice(first, first + rows) for first in range(0, count, rows)]


def normal_matrix(columns: FloatArray, weights: FloatArray) -> FloatArray:
    """
    Return the weighted products of columns, ``C' diag(w) C``.

    Parameters
    ----------
    columns : numpy.ndarray, shape (n, m)
        Taken a few rows at a time, to need little memory.
    weights : numpy.ndarray, shape (n,)
        Of each row.

    Returns
    -------
    numpy.ndarray, shape (m, m)

    """
    normal = np.zeros((columns.shape[1], columns.shape[1]))
    for some in row_slices(len(columns)):
        normal += (columns[some] * weights[some, None]).T @ columns[some]
    return normal
