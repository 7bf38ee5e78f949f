# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Values and rates of change from samples with noise and uneven stamps."""

from __future__ import annotations

from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np
from scipy.ndimage import median_filter

WINDOW = 0.5
"""Length of the samples that a rate of change is taken from [s]."""

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
        Whether the window begins at `time` instead of being centred on it.

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
        return part.values.mean(axis=0), np.zeros(len(series.names))
    spread = offsets - offsets.mean()
    slope: FloatArray = spread @ part.values / (spread @ spread)
    value: FloatArray = part.values.mean(axis=0) - slope * offsets.mean()
    return value, slope


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
