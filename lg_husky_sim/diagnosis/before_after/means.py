# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Simulated rows as samples read them, averaged in bins."""

from __future__ import annotations

from lg_husky_sim.jit import jit
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray


@jit
def mean_in_bins(rows: FloatArray, first: int, start: float, step: float, times: FloatArray,
                 edges: NDArray[np.intp], later: float, goes_on: bool, out: FloatArray) -> None:
    """
    Read rows at the stamps of samples, and average these in bins.

    Parameters
    ----------
    rows : numpy.ndarray, shape (n_rows, n_outputs, n_lanes)
        Evenly spaced in time; between two it is linear.
    first : int
        Of the outputs that are read; the others follow it.
    start, step : float
        Time of the first row and spacing [s].
    times : numpy.ndarray, shape (n_samples,)
        Stamps [s].
    edges : numpy.ndarray of int, shape (n_bins,)
        First sample of each bin.
    later : float
        What is added to the stamps [s].
    goes_on : bool
        Before the first row and after the last one, rows change as beside them: a wheel turns on,
        and has not stopped where the simulation ends. Else they are those at the end.
    out : numpy.ndarray, shape (n_bins, k, n_lanes)
        Receives the means.

    """
    last = rows.shape[0] - 1.000001
    for b in range(edges.size):
        begin = edges[b]
        end = edges[b + 1] if b + 1 < edges.size else times.size
        for c in range(out.shape[1]):
            for j in range(out.shape[2]):
                out[b, c, j] = 0.0
        for i in range(begin, end):
            place = (times[i] + later - start) / step
            if not goes_on:
                place = min(max(place, 0.0), last)
            index = min(max(int(place), 0), rows.shape[0] - 2)
            share = place - index
            for c in range(out.shape[1]):
                for j in range(out.shape[2]):
                    out[b, c, j] += (rows[index, first + c, j] * (1.0 - share)
                                     + rows[index + 1, first + c, j] * share)
        for c in range(out.shape[1]):
            for j in range(out.shape[2]):
                out[b, c, j] /= end - begin
