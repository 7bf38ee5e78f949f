# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Robust regression of one signal's changes on those of others, with their common delay.

Over any window [a, b]::

    change of the reference = sum of factor * (change of a source, late by d) + offset * (b - a)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray

#: Stamps with the integral of what a stream measures.
Way = tuple[FloatArray, FloatArray]
#: A reference with its sources.
Pair = tuple[Way, tuple[Way, ...]]


@dataclass(frozen=True)
class Number:
    """An estimate with its 95 % interval."""

    value: float
    low: float
    high: float

    @property
    def deviation(self) -> float:
        """Its standard deviation."""
        return (self.high - self.low) / (2.0 * setting('two_sided'))

    def is_off(self, value: float, by: float) -> bool:
        """Return whether it is off a value by more than something, beyond doubt."""
        apart = abs(self.value - value) - by
        return apart > setting('beyond_doubt') * self.deviation


@dataclass(frozen=True)
class Regression:
    """
    How a reference follows its sources.

    Parameters
    ----------
    factors : tuple of Number
        Of each source; NaN for one that hardly moves.
    late : Number
        How much later the sources' stamps are than the reference's [s].
    offset : Number
        What the reference changes by per second where the sources stand still.
    explained : float
        Share of the reference's motion that the sources explain, 0 to 1.
    interval : float
        Longest usual interval of the signals [s].
    seconds : float
        That were compared.

    """

    factors: tuple[Number, ...]
    late: Number
    offset: Number
    explained: float
    interval: float
    seconds: float


def regression(pairs: Sequence[Pair], least: Sequence[float], *, offset: bool
               ) -> Regression | None:
    """
    Regress references on sources over windows of half a second.

    Parameters
    ----------
    pairs : sequence of (Way, tuple of Way)
        One for each segment.
    least : sequence of float
        Rate of each source from which it moves [unit of the source per second].
    offset : bool
        Whether the reference may change while the sources stand still.

    Returns
    -------
    Regression or None
        None where they do not run together, or move, for long enough.

    """
    reach, span = setting('latest'), setting('relation_window')
    used, intervals = [], []
    for reference, sources in pairs:
        ways = (reference, *sources)
        if min(times.size for times, _ in ways) < 4 or not all(
                np.all(np.isfinite(way)) for _, way in ways):
            continue
        start = max(times[0] for times, _ in ways) + reach
        edges = np.arange(start, min(times[-1] for times, _ in ways) - reach, span)
        if edges.size > 2:
            used.append((reference, sources, edges))
            intervals.append(max(float(np.median(np.diff(times))) for times, _ in ways))
    seconds = sum(float(edges[-1] - edges[0]) for _, _, edges in used)
    if seconds < setting('least_compared'):
        return None
    windows = _Windows(tuple(used), offset)
    moves = windows.moving(least)
    if not moves.any():
        return None
    windows = _Windows(windows.ways, offset, tuple(moves.tolist()))
    steps = round(reach / setting('late_step'))
    late = min((setting('late_step') * k for k in range(-steps, steps + 1)), key=windows.misfit)
    return _refined(windows, late, max(intervals), seconds)


@dataclass(frozen=True, eq=False)
class _Windows:
    # Integrals over all segments, the windows in which they are compared, and the sources used.

    ways: tuple[tuple[Way, tuple[Way, ...], FloatArray], ...]
    offset: bool
    used: tuple[bool, ...] = ()

    def rows(self, late: float) -> tuple[FloatArray, FloatArray, FloatArray, NDArray[np.int64]]:
        """Return changes of the reference, the regressors, slopes by lateness, and blocks."""
        columns: list[tuple[FloatArray, ...]] = []
        blocks, first = [], 0
        half = 0.5 * setting('late_step')
        for (times, way), sources, edges in self.ways:
            change = np.diff(np.interp(edges, times, way))
            at = [np.column_stack([np.interp(edges + late + shift, own, rolled)
                                   for own, rolled in sources]) for shift in (-half, 0.0, half)]
            span = np.diff(edges)[:, None] * self.offset
            columns.append((change, np.hstack([np.diff(at[1], axis=0), span]),
                            np.diff(at[2] - at[0], axis=0) / (2.0 * half)))
            block = ((edges[:-1] - edges[0]) / setting('relation_block')).astype(np.int64) + first
            first = int(block[-1]) + 1
            blocks.append(block)
        reference, table, slopes = (np.concatenate(c) for c in zip(*columns, strict=True))
        if self.used:
            table[:, :-1] *= self.used
        return reference, table, slopes, np.concatenate(blocks)

    def moving(self, least: Sequence[float]) -> NDArray[np.bool_]:
        """Return which sources move for long enough."""
        _, table, _, _ = self.rows(0.0)
        span = np.concatenate([np.diff(edges) for _, _, edges in self.ways])[:, None]
        moved = np.sum(span * (np.abs(table[:, :-1]) > np.array(least) * span), axis=0)
        enough: NDArray[np.bool_] = moved >= setting('least_moved')
        return enough

    def misfit(self, late: float) -> float:
        """Return the mean absolute residual; not squared: jumps of a pose do not choose it."""
        reference, table, _, _ = self.rows(late)
        return float(np.mean(np.abs(_robust(table, reference)[1])))


def _robust(table: FloatArray, reference: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    # Coefficients, residuals and weights: single jumps of a pose do not count.
    weight = np.ones(reference.size)
    best: FloatArray = np.zeros(table.shape[1])
    # At rest there is no residual at all: weights must not be those of rounding.
    least = max(setting('least_spread') * float(np.sqrt(np.mean(reference ** 2))),
                float(np.finfo(float).tiny))
    for _ in range(int(setting('reweighted'))):
        best = np.asarray(np.linalg.lstsq(
            table * weight[:, None], reference * weight, rcond=None)[0], dtype=np.float64)
        residual = reference - table @ best
        wide = max(_spread(residual), least)
        weight = 1.0 / np.sqrt(1.0 + (residual / (setting('outlier') * wide)) ** 2)
    return best, reference - table @ best, weight


def _spread(values: FloatArray) -> float:
    # The median deviation, as a standard deviation of a normal distribution.
    return float(np.median(np.abs(values)) / setting('median_of_normal'))


def _refined(windows: _Windows, late: float, interval: float, seconds: float) -> Regression:
    # Gauss-Newton on the lateness with the coefficients; covariance of blocks (sandwich).
    begun = late
    for _ in range(int(setting('late_rounds'))):
        reference, table, slopes, blocks = windows.rows(late)
        best, residual, weight = _robust(table, reference)
        table = np.column_stack([table, slopes @ best[:-1]])
        move = np.linalg.lstsq(table * weight[:, None], residual * weight, rcond=None)[0][-1]
        late = float(np.clip(late + move, begun - setting('late_step'),
                             begun + setting('late_step')))
    reference, table, slopes, blocks = windows.rows(late)
    best, residual, weight = _robust(table, reference)
    table = np.column_stack([table, slopes @ best[:-1]])
    square = weight ** 2
    normal = np.linalg.pinv((table * square[:, None]).T @ table)
    scores = np.zeros((int(blocks[-1]) + 1, table.shape[1]))
    np.add.at(scores, blocks, table * (square * residual)[:, None])
    covariance = normal @ (scores.T @ scores) @ normal
    half = setting('two_sided') * np.sqrt(np.maximum(np.diag(covariance), 0.0))

    def number(value: float, place: int) -> Number:
        return Number(value, value - float(half[place]), value + float(half[place]))
    total = float(np.sum(square * reference ** 2))
    explained = 1.0 - float(np.sum(square * residual ** 2)) / total if total > 0.0 else 0.0
    count = best.size - 1
    factors = tuple(
        number(float(best[k]), k) if not windows.used or windows.used[k] else Number(
            np.nan, np.nan, np.nan) for k in range(count))
    return Regression(factors, number(late, count + 1), number(float(best[count]), count),
                      explained, interval, seconds)
