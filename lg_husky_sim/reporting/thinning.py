# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Fewer samples of a signal for a page, its extremes and gaps kept."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

from lg_husky_sim.reporting.data import Trace
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray


def _extremes(values: FloatArray, edges: NDArray[np.int64]) -> set[int]:
    # The places of the smallest and the largest value between each two edges.
    kept: set[int] = set()
    for first, last in pairwise(edges.tolist()):
        part = values[first:last]
        known = np.flatnonzero(np.isfinite(part))
        if known.size:
            kept.add(first + int(known[np.argmin(part[known])]))
            kept.add(first + int(known[np.argmax(part[known])]))
    return kept


def thinned(trace: Trace, most: int) -> Trace:
    """
    Return a trace with about as many samples as can be seen.

    Parameters
    ----------
    trace : Trace
        Measured and predicted values of one quantity.
    most : int
        Samples that it may have, apart from those beside gaps.

    Returns
    -------
    Trace
        The smallest and largest measured value of each short stretch are kept, those of the
        first and last model's error too, and so is each gap.

    """
    count = trace.times.size
    if count <= most:
        return trace
    models = list(trace.predicted.values())
    signals = [trace.measured, *(trace.measured - one for one in models[:1] + models[1:][-1:])]
    edges = np.linspace(0, count, max(2, most // (2 * len(signals))) + 1).astype(np.int64)
    kept = {0, count - 1}
    for values in signals:
        kept |= _extremes(values, edges)
        holes = np.flatnonzero(np.diff(np.isfinite(values).astype(np.int8)) != 0)
        kept |= {*holes[:most].tolist(), *(holes[:most] + 1).tolist()}
    places = np.array(sorted(kept))
    return replace(
        trace, times=trace.times[places], measured=trace.measured[places],
        predicted={name: values[places] for name, values in trace.predicted.items()},
        sigma=None if trace.sigma is None else trace.sigma[places], errors={})


def paired(x: Trace, y: Trace, most: int) -> tuple[Trace, Trace]:
    """
    Return x and y of a path at the same, fewer, times.

    Parameters
    ----------
    x, y : Trace
        Of one recording, at the same times.
    most : int
        Samples that each may have.

    Returns
    -------
    tuple of Trace
        Every n-th sample.

    """
    step = -(-x.times.size // most)
    if step <= 1:
        return x, y

    def every(trace: Trace) -> Trace:
        # A gap that falls between two samples must stay one.
        cut = slice(None, None, step)
        return replace(trace, times=trace.times[cut], measured=_gapped(trace.measured, step),
                       predicted={n: _gapped(v, step) for n, v in trace.predicted.items()},
                       sigma=None if trace.sigma is None else trace.sigma[cut], errors={})
    return every(x), every(y)


def _gapped(values: FloatArray, step: int) -> FloatArray:
    found = np.array(values[::step])
    padded = np.append(values, np.zeros(found.size * step - values.size))
    found[np.isnan(padded.reshape(found.size, step)).any(axis=1)] = np.nan
    return found


def longest_stretch(times: FloatArray, error: FloatArray, length: float) -> tuple[float, float]:
    """
    Return the stretch of a signal in which an error is largest.

    Parameters
    ----------
    times : numpy.ndarray, shape (n,)
        [s].
    error : numpy.ndarray, shape (n,)
        At each time; what is not a number counts nothing.
    length : float
        Of the stretch [s].

    Returns
    -------
    tuple of float
        Start and end [s]; the whole signal where it is not longer.

    """
    known = times[np.isfinite(times)]
    if not known.size or known[-1] - known[0] <= length:
        return (float(known[0]), float(known[-1])) if known.size else (0.0, 1.0)
    total = np.concatenate([[0.0], np.cumsum(np.nan_to_num(error))])
    last = np.searchsorted(times, times + length, side='right')
    first = int(np.argmax(total[last] - total[:times.size]))
    start = min(float(times[first]), float(known[-1]) - length)
    return start, start + length
