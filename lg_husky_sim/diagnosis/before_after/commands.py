# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The command as a base takes it: late, limited, and with a limited rate of change."""

from __future__ import annotations

from lg_husky_sim.jit import jit
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray


@jit
def accepted(times: FloatArray, values: FloatArray, late: float, most: float, slew: float,
             begin: float, start: float, step: float, out: FloatArray) -> None:
    """
    Fill in the mean of the accepted command in each step, exactly.

    What is asked for is constant between commands, so what is accepted follows it along straight
    lines, whose corners lie anywhere in a step. A command that counts from the next step on would
    act by up to a step too late, and with a jump wherever a dead time passes a step.

    Parameters
    ----------
    times, values : numpy.ndarray, shape (n,)
        Stamps [s] and commands, each held until the next [m/s or rad/s]; none before the first.
    late : float
        Dead time [s].
    most : float
        Limit of the command [m/s or rad/s].
    slew : float
        Limit of its rate of change [m/s² or rad/s²].
    begin : float
        What is accepted at the start [m/s or rad/s].
    start, step : float
        Of the first step, and its length [s].
    out : numpy.ndarray, shape (n_steps,)
        Filled.

    """
    now, target, place, k = start, 0.0, begin, 0
    while k < times.size and times[k] + late <= now:
        target = min(max(values[k], -most), most)
        k += 1
    for s in range(out.size):
        end = start + (s + 1) * step
        if place == target and (k == times.size or times[k] + late > end):
            out[s], now = place, end
            continue
        total = 0.0
        while now < end:
            until = end
            if k < times.size and times[k] + late < end:
                until = max(times[k] + late, now)
            span = until - now
            way = target - place
            ramp = min(abs(way) / slew, span)
            reached = target if ramp < span else place + min(max(way, -slew * ramp), slew * ramp)
            total += 0.5 * (place + reached) * ramp + reached * (span - ramp)
            place, now = reached, until
            if until < end or (k < times.size and times[k] + late <= now):
                target = min(max(values[k], -most), most)
                k += 1
        out[s] = total / step


@jit
def spread(taken: FloatArray, which: NDArray[np.intp], column: int, out: FloatArray) -> None:
    """
    Give each robot the command that it takes.

    Parameters
    ----------
    taken : numpy.ndarray, shape (n_rows, n_steps)
        What is taken, each once.
    which : numpy.ndarray of int, shape (n_lanes,)
        Row of each robot.
    column : int
        Of the output.
    out : numpy.ndarray, shape (n_steps, 2, n_lanes)
        Its column is filled.

    """
    for k in range(out.shape[0]):
        for j in range(out.shape[2]):
            out[k, column, j] = taken[which[j], k]
