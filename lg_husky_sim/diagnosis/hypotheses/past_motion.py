# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Efforts that follow the past motion, at some balance: dynamics without a name.

A load that swings, a tyre that winds up, casters that turn round: the effort is no function of
the motion of the moment, but of how it came about. What is left of the residual is then a linear
response to a signal u of the motion (model error modelling, Ljung 1999)::

    f(t) = sum c_k ∫ hat_k(s) u(t - s) ds

with hat functions of the lag s whose knots are dense at first and far apart later. u is a speed,
or only its sign: dry friction and casters do not ask how fast.
"""

from __future__ import annotations

import math

from lg_husky_sim.diagnosis.hypotheses.hat_functions import hats
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Arguments of such efforts: the quantity, whether only its sign counts, and it in words.
PAST = {
    'past_forward': ('forward', False, 'the past forward speed'),
    'past_direction': ('forward', True, 'the past direction of travel'),
    'past_yaw': ('yaw', False, 'the past yaw rate'),
    'past_turn': ('yaw', True, 'the past sense of turning'),
    'past_wheel_rate': ('wheel_rate', False, 'the past rate of these wheels'),
}


def responses(signal: FloatArray, times: FloatArray, argument: str, count: int) -> FloatArray:
    """
    Return the responses to the past of a signal, one a knot.

    Parameters
    ----------
    signal : numpy.ndarray, shape (n,)
        The quantity of :data:`PAST`; before the first time it was as it is then.
    times : numpy.ndarray, shape (n,)
        Evenly spaced [s].
    argument : str
        Key of :data:`PAST`.
    count : int
        Number of knots.

    Returns
    -------
    numpy.ndarray, shape (n, count)
        [unit of the signal, of a sign '1'] times seconds.

    """
    if PAST[argument][1]:
        signal = np.clip(signal / setting('still_speed'), -1.0, 1.0)
    step = float(times[1] - times[0])
    lags = np.arange(0.0, setting('longest_past'), step)
    first = setting('first_past')
    kernels = step * hats(np.log1p(lags / first), 0.0,
                          math.log1p(setting('longest_past') / first), count)
    whole = np.concatenate([np.full(lags.size - 1, signal[0]), signal])
    return np.column_stack([np.convolve(whole, kernel, 'valid') for kernel in kernels.T])
