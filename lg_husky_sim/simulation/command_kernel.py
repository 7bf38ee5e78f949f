# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Parts of the event-driven kernel: what a command does, and until when voltages are straight."""

from __future__ import annotations

import math

from lg_husky_sim.jit import jit_part
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation.arrays import (
    AIMS,
    CLAMP,
    COMMANDED,
    DU,
    LATENCY,
    LIMIT,
    LIMITED,
    RAMPS,
    SLEW,
    SLOPES,
    SPEED_VOLTS,
    TURN_VOLTS,
    U,
)

#: Relative room in which a voltage is at its clamp; time that tells two events apart [s].
ROOM, APART = 1e-9, 1e-12


@jit_part
def _clamped(few: FloatArray, clamp: float, t: float, until: float) -> float:
    # Hold voltages at the clamp, and return when the next one meets or leaves it.
    for i in range(2):
        u, du = few[U, i], few[DU, i]
        over, outward = abs(u) - clamp, du * u
        if over >= -ROOM * clamp and (outward >= 0.0 or over > ROOM * clamp):
            if outward < 0.0:
                until = min(until, t + over / abs(du))
            few[U, i], few[DU, i] = math.copysign(clamp, u), 0.0
        elif outward > 0.0 or (du != 0.0 and u == 0.0):
            until = min(until, t - over / abs(du))
        elif outward < 0.0:
            until = min(until, t + (abs(u) + clamp) / abs(du))
    return until


@jit_part
def next_event(stages: FloatArray, c: int, t: float, end: float, stamps: FloatArray,
               values: FloatArray, given: int, few: FloatArray) -> tuple[float, int]:
    """
    Set the voltages and their slopes from t on.

    Return until when they are straight [s], and how many commands have taken effect, of which
    ``given`` had done so before.
    """
    latency = stages[c, LATENCY]
    while given < stamps.size and stamps[given] + latency <= t:
        few[COMMANDED, 0], few[COMMANDED, 1] = values[given, 0], values[given, 1]
        given += 1
    until, k = end, given
    while k < stamps.size and stamps[k] + latency < until:
        if values[k, 0] != few[COMMANDED, 0] or values[k, 1] != few[COMMANDED, 1]:
            until = stamps[k] + latency
        k += 1
    for i in range(2):
        limit, slew = stages[c, LIMIT + i], stages[c, SLEW + i]
        if t >= few[RAMPS, i]:
            few[LIMITED, i] = few[AIMS, i]
        few[AIMS, i] = max(-limit, min(limit, few[COMMANDED, i]))
        if slew == math.inf:
            few[LIMITED, i] = few[AIMS, i]
        few[SLOPES, i], few[RAMPS, i] = 0.0, math.inf
        if few[LIMITED, i] != few[AIMS, i]:
            few[SLOPES, i] = math.copysign(slew, few[AIMS, i] - few[LIMITED, i])
            few[RAMPS, i] = t + (few[AIMS, i] - few[LIMITED, i]) / few[SLOPES, i]
            until = min(until, few[RAMPS, i])
    speed, turn = stages[c, SPEED_VOLTS], stages[c, TURN_VOLTS]
    few[U, 0] = speed * few[LIMITED, 0] - turn * few[LIMITED, 1]
    few[U, 1] = speed * few[LIMITED, 0] + turn * few[LIMITED, 1]
    few[DU, 0] = speed * few[SLOPES, 0] - turn * few[SLOPES, 1]
    few[DU, 1] = speed * few[SLOPES, 0] + turn * few[SLOPES, 1]
    clamp = stages[c, CLAMP]
    if clamp > 0.0:
        until = _clamped(few, clamp, t, until)
    if until <= t < end:
        until = min(end, t + APART * max(1.0, abs(t)))
    return until, given
