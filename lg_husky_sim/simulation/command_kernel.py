# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Parts of the event-driven kernel: what a command does, and until when voltages are straight."""

from __future__ import annotations

import math
from typing import NamedTuple

from lg_husky_sim.jit import jit_part
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation.modal_kernel import Packed
import numpy as np
from numpy.typing import NDArray

#: Relative room in which a voltage is at its clamp; time that tells two events apart [s].
ROOM, APART = 1e-9, 1e-12


class Drive(NamedTuple):
    """
    What the command does at an event, for forward speed and yaw rate.

    ``wanted`` is in force, ``shaped`` behind limits and ramps, ``slopes`` are those of the ramps,
    ``ramps`` the times at which they end, ``goals`` where; ``given`` counts the commands that
    have taken effect.
    """

    wanted: FloatArray
    shaped: FloatArray
    slopes: FloatArray
    ramps: FloatArray
    goals: FloatArray
    given: NDArray[np.int64]


@jit_part
def _clamped(u: FloatArray, du: FloatArray, clamp: float, t: float, until: float) -> float:
    # Hold voltages at the clamp, and return when the next one meets or leaves it.
    for i in range(2):
        over = abs(u[i]) - clamp
        outward = du[i] * u[i]
        if over >= -ROOM * clamp and (outward >= 0.0 or over > ROOM * clamp):
            if outward < 0.0:
                until = min(until, t + over / abs(du[i]))
            u[i] = math.copysign(clamp, u[i])
            du[i] = 0.0
        elif outward > 0.0 or (du[i] != 0.0 and u[i] == 0.0):
            until = min(until, t - over / abs(du[i]))
        elif outward < 0.0:
            until = min(until, t + (abs(u[i]) + clamp) / abs(du[i]))
    return until


@jit_part
def next_event(plant: Packed, c: int, t: float, end: float, stamps: FloatArray,
               values: FloatArray,
               drive: Drive, u: FloatArray, du: FloatArray) -> float:
    """Set the voltages and their slopes from t on, and return until when they are straight."""
    latency = plant.stages[c, 0]
    given = drive.given[0]
    while given < stamps.size and stamps[given] + latency <= t:
        drive.wanted[0], drive.wanted[1] = values[given, 0], values[given, 1]
        given += 1
    drive.given[0] = given
    until = end
    while given < stamps.size and stamps[given] + latency < until:
        if values[given, 0] != drive.wanted[0] or values[given, 1] != drive.wanted[1]:
            until = stamps[given] + latency
        given += 1
    for i in range(2):
        limit, slew = plant.stages[c, 3 + i], plant.stages[c, 1 + i]
        if t >= drive.ramps[i]:
            drive.shaped[i] = drive.goals[i]
        drive.goals[i] = max(-limit, min(limit, drive.wanted[i]))
        if slew == np.inf:
            drive.shaped[i] = drive.goals[i]
        drive.slopes[i], drive.ramps[i] = 0.0, np.inf
        if drive.shaped[i] != drive.goals[i]:
            drive.slopes[i] = math.copysign(slew, drive.goals[i] - drive.shaped[i])
            drive.ramps[i] = t + (drive.goals[i] - drive.shaped[i]) / drive.slopes[i]
            until = min(until, drive.ramps[i])
    speed, turn = plant.stages[c, 5], plant.stages[c, 6]
    u[0] = speed * drive.shaped[0] - turn * drive.shaped[1]
    u[1] = speed * drive.shaped[0] + turn * drive.shaped[1]
    du[0] = speed * drive.slopes[0] - turn * drive.slopes[1]
    du[1] = speed * drive.slopes[0] + turn * drive.slopes[1]
    clamp = plant.stages[c, 7]
    if clamp > 0.0:
        until = _clamped(u, du, clamp, t, until)
    if until <= t < end:
        until = min(end, t + APART * max(1.0, abs(t)))
    return until
