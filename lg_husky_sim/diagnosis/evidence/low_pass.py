# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
First-order low passes of a rate: one that is known with its integral, and one of messages.

Between two times the rate is the parabola that has its values at both and the integral between
them, and the filter answers a parabola in closed form::

    y' = (c0 + c1 s + c2 s^2 - y) / T
    y(s) = c0 + c1 (s - T) + c2 (s^2 - 2 T s + 2 T^2) + (y(0) - c0 + c1 T - 2 c2 T^2) e^(-s / T)

A driver that filters what it is about to send follows its messages x_k instead, each with the same
share of its last answer: ``y_k = share y_(k-1) + (1 - share) x_k``.
"""

from __future__ import annotations

from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.jit import jit
from lg_husky_sim.signals import FloatArray
import numpy as np


@jit
def _follow(times: FloatArray, rates: FloatArray, turned: FloatArray, lag: float,
            shortest: float, out: FloatArray) -> None:
    # Begins at rest at the first rate.
    out[0] = rates[0]
    for k in range(1, times.size):
        step = times[k] - times[k - 1]
        if step <= 0.0:
            out[k] = out[k - 1]
            continue
        first, last = rates[k - 1], rates[k]
        mean = 0.5 * (first + last)
        if step > shortest:
            mean = (turned[k] - turned[k - 1]) / step
        slope = (6.0 * mean - 4.0 * first - 2.0 * last) / step
        bend = 3.0 * (first + last - 2.0 * mean) / (step * step)
        steady = first - slope * lag + 2.0 * bend * lag * lag
        out[k] = (steady + slope * step + bend * step * (step - 2.0 * lag)
                  + (out[k - 1] - steady) * np.exp(-step / lag))


def low_passed(times: FloatArray, rates: FloatArray, turned: FloatArray, lag: float
               ) -> FloatArray:
    """
    Return a rate behind a first-order low pass.

    Parameters
    ----------
    times : numpy.ndarray, shape (n,)
        Not decreasing [s]; the filter begins at rest at the first.
    rates : numpy.ndarray, shape (n,)
        At these times [rad/s].
    turned : numpy.ndarray, shape (n,)
        Their integral [rad].
    lag : float
        Time constant [s].

    Returns
    -------
    numpy.ndarray, shape (n,)
        [rad/s]

    """
    out = np.empty(times.size)
    _follow(np.ascontiguousarray(times), np.ascontiguousarray(rates),
            np.ascontiguousarray(turned), lag, setting('filter_shortest'), out)
    return out


def followed_by_message(values: FloatArray, share: float) -> FloatArray:
    """
    Return messages behind a first-order filter of them.

    Parameters
    ----------
    values : numpy.ndarray, shape (n,)
        The filter begins at rest at the first.
    share : float
        Of its last answer in the next one, from 0 to below 1 [1].

    Returns
    -------
    numpy.ndarray, shape (n,)

    """
    if share <= 0.0 or not values.size:
        return values
    # Most logs know no such filter, and scipy.signal takes long to load.
    from scipy.signal import lfilter
    found: FloatArray = lfilter([1.0 - share], [1.0, -share], values, zi=[share * values[0]])[0]
    return found
