# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Values and rates of change from samples with noise and uneven stamps."""

from __future__ import annotations

from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np
from scipy.ndimage import median_filter

WINDOW = 0.5
"""Length of the samples that a rate of change is taken from [s]."""

CURVED = 8
"""Samples from which on a parabola can be told from noise."""
NEIGHBOURS = 7
SPIKE = 0.2
"""Least distance from its neighbours [m] at which a position is a spike."""


def local_fit(
    series: TimeSeries, time: float, window: float, *, ahead: bool = False,
) -> tuple[FloatArray, FloatArray]:
    """
    Fit a straight line around, or ahead of, a time.

    Parameters
    ----------
    series : TimeSeries
        At least one row.
    time : float
        Where the line is evaluated [s].
    window : float
        Length of the samples used [s]; the nearest two where fewer lie in it.
    ahead : bool
        Whether the window begins at `time` instead of being centred on it. With eight samples
        or more, a parabola takes the line's place where it leaves less than half the squares.

    Returns
    -------
    value, slope : numpy.ndarray, shape (n_channels,)
        Value at `time` and its change per second; with a single row, that row and zeros.

    """
    first = time if ahead else time - 0.5 * window
    part = series.slice(first, first + window)
    if len(part) < 2:
        near = np.sort(np.argsort(np.abs(series.times - time), kind='stable')[:2])
        part = TimeSeries(series.times[near], series.values[near], series.names)
    offsets = part.times - time
    if len(part) < 2 or np.ptp(offsets) == 0.0:
        return np.asarray(part.values.mean(axis=0)), np.zeros(len(series.names))
    line, rest = _polynomial(offsets, part.values, 1)
    value, slope = line[0], line[1]
    if ahead and len(part) >= CURVED:
        curve, less = _polynomial(offsets, part.values, 2)
        bent = less < 0.5 * rest
        value, slope = np.where(bent, curve[0], value), np.where(bent, curve[1], slope)
    return value, slope


def _polynomial(
    offsets: FloatArray, values: FloatArray, degree: int,
) -> tuple[FloatArray, FloatArray]:
    """Return coefficients, lowest first, and the sum of squares that is left of each column."""
    columns = np.vander(offsets, degree + 1, increasing=True)
    coefficients = np.asarray(np.linalg.lstsq(columns, values, rcond=None)[0], dtype=np.float64)
    left: FloatArray = np.sum((values - columns @ coefficients) ** 2, axis=0)
    return coefficients, left


def body_rates(pose: TimeSeries, window: float = WINDOW) -> TimeSeries:
    """
    Derive forward speed and yaw rate from a pose.

    Straight lines are fitted to x, y and heading over a window around each stamp. Positions that
    jump out of the way and back (a scan matched wrongly) are left out first.

    Parameters
    ----------
    pose : TimeSeries
        Names x, y, heading [m, m, rad], heading unwrapped.
    window : float
        Length of the window [s].

    Returns
    -------
    TimeSeries
        Names forward [m/s] and yaw_rate [rad/s] at the pose's stamps, those within half a
        window of either end left out.

    """
    inside = ((pose.times >= pose.times[0] + 0.5 * window)
              & (pose.times <= pose.times[-1] - 0.5 * window)) if len(pose) else np.zeros(0, bool)
    times = pose.times[inside]
    if times.size == 0:
        return TimeSeries(times, np.zeros((0, 2)), ('forward', 'yaw_rate'))
    slopes = _centred_slopes(without_spikes(pose), times, window)
    heading = pose.column('heading')[inside]
    forward = np.cos(heading) * slopes[:, 0] + np.sin(heading) * slopes[:, 1]
    return TimeSeries(times, np.column_stack((forward, slopes[:, 2])), ('forward', 'yaw_rate'))


def without_spikes(pose: TimeSeries) -> TimeSeries:
    """
    Leave out positions that stand apart from their neighbours.

    Parameters
    ----------
    pose : TimeSeries
        Names x, y, heading [m, m, rad].

    Returns
    -------
    TimeSeries
        Without the rows whose position is farther from the median of the seven around them than
        0.2 m and than five times the median distance.

    """
    middle = median_filter(pose.values[:, :2], size=(NEIGHBOURS, 1), mode='nearest')
    distance = np.hypot(*(pose.values[:, :2] - middle).T)
    kept = distance <= max(SPIKE, 5.0 * float(np.median(distance)))
    return TimeSeries(pose.times[kept], pose.values[kept], pose.names)


def _centred_slopes(series: TimeSeries, times: FloatArray, window: float) -> FloatArray:
    """Return the slopes of lines fitted around many times, shape (n_times, n_channels)."""
    low = np.searchsorted(series.times, times - 0.5 * window - 1e-9, side='left')
    high = np.searchsorted(series.times, times + 0.5 * window + 1e-9, side='right')
    origin = series.times[0]  # running sums of offsets from the middle keep their digits
    t = series.times - origin

    def windowed(values: FloatArray) -> FloatArray:
        total = np.concatenate((np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)))
        result: FloatArray = total[high] - total[low]
        return result

    count = np.maximum(high - low, 1)[:, None].astype(np.float64)
    shift = (times - origin)[:, None]
    values = series.values - series.values.mean(axis=0)
    sum_t, sum_tt = windowed(t[:, None]), windowed((t * t)[:, None])
    sum_v, sum_tv = windowed(values), windowed(t[:, None] * values)
    # Moments about each window's own time.
    tau = sum_t - count * shift
    tau2 = sum_tt - 2.0 * shift * sum_t + count * shift**2
    cross = sum_tv - shift * sum_v
    spread = tau2 - tau**2 / count
    with np.errstate(divide='ignore', invalid='ignore'):
        slopes: FloatArray = (cross - tau * sum_v / count) / spread
    slopes[(high - low < 2) | (spread[:, 0] <= 0.0)] = np.nan
    return slopes
