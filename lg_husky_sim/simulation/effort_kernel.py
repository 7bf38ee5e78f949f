# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Parts of the event-driven kernel: one step of a plant with efforts.

A parabola through the efforts at the start, the middle and the end of a step forces the modes;
middle and end are found by iteration. What the laws differ from it at a quarter and at three
quarters is the error: a kink between would show at one of them only.
"""

from __future__ import annotations

import math

from lg_husky_sim.husky.laws import evaluate, HELD
from lg_husky_sim.husky.laws import MEMORY as MEMORIES
from lg_husky_sim.jit import jit_part
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation.arrays import (
    ADDING,
    ASTRAY,
    BEND,
    BETWEEN,
    CHANGE,
    CONTEXT,
    DU,
    EFFORTS,
    F,
    FED,
    FORCE,
    FORMER,
    GAINS,
    INPUTS,
    INSIDE,
    KEPT,
    MEMORY,
    MOTION,
    NEW,
    NOW,
    OLD,
    Packed,
    PAIRS,
    PARABOLA,
    PART,
    PHI,
    POSED,
    REALS,
    REMEMBERING,
    SLOPE,
    SWEPT,
    TANGENT,
    U,
    U_INSIDE,
    WAY,
    Work,
    XI,
)
from lg_husky_sim.simulation.modal_kernel import added, advance, phis

#: Error of a step that is allowed: wheel rates [rad/s], speed [m/s], yaw rate [rad/s].
WHEEL_ERROR, SPEED_ERROR, YAW_ERROR = 2e-5, 3e-6, 5e-6
#: Iterations of a step at most, and the share of the allowed error at which they end.
ITERATIONS, CONVERGED = 8, 0.1
#: Error of a step, as a multiple of what the laws differ from the parabola between its nodes.
DEFECT = 2.0
#: Speed from which a ripple counts whole, in widths of its standstill.
AWAY = 3.0
#: Bounds of the slope of an effort in its own change, for Steffensen's step.
STEEPEST, FLATTEST = -50.0, 0.5


@jit_part
def effect(plant: Packed, c: int, work: Work, row: int, p: int, t: float) -> float:
    """
    Return what a change of the efforts (a row) over ``t`` [s] does, in parts of what is allowed.

    The phis for ``t`` are in the rows of the modes from ``p`` on.
    """
    n_real, n_pairs = plant.counts[c, REALS], plant.counts[c, PAIRS]
    modal, modes = plant.modal, work.modes
    size = modes.shape[1]
    for i in range(size):
        modes[FORCE, i] = 0.0
    for e in range(plant.counts[c, EFFORTS]):
        value = t * work.efforts[row, e]
        for i in range(size):
            modes[FORCE, i] += modal[c, GAINS + e, i] * value
    for i in range(n_real):
        modes[FORCE, i] *= modes[p, i]
    for i in range(n_real, n_real + n_pairs):
        m = i + n_pairs
        real = modes[p, i] * modes[FORCE, i] - modes[p, m] * modes[FORCE, m]
        modes[FORCE, m] = modes[p, i] * modes[FORCE, m] + modes[p, m] * modes[FORCE, i]
        modes[FORCE, i] = real
    left, right, speed, rate = 0.0, 0.0, 0.0, 0.0
    for i in range(size):
        left += modal[c, MOTION, i] * modes[FORCE, i]
        right += modal[c, MOTION + 1, i] * modes[FORCE, i]
        speed += modal[c, MOTION + 2, i] * modes[FORCE, i]
        rate += modal[c, MOTION + 3, i] * modes[FORCE, i]
    return max(max(abs(left), abs(right)) / WHEEL_ERROR,
               max(abs(speed) / SPEED_ERROR, abs(rate) / YAW_ERROR))


@jit_part
def memories(plant: Packed, c: int, z: FloatArray, node: int, step: float, few: FloatArray
             ) -> None:
    """
    Put the memories after ``step`` [s] into the row NOW: at the middle (1) or the end (2).

    The row SWEPT has the integrals of the laws' arguments, where a law needs them exactly: what
    is held at rest would creep with the error of a mean.
    """
    for i in range(MEMORIES):
        few[NOW, i] = few[MEMORY, i]
    for j in range(plant.counts[c, EFFORTS]):
        o = plant.offsets[c, j]
        p1 = plant.coefficients[c, j, 1]
        side = int(plant.coefficients[c, j, 2])
        if plant.laws[c, j] == 13:
            mean = 0.5 * (z[0, o] ** 2 + z[1, o] ** 2)
            if node == 2:
                mean = (z[0, o] ** 2 + 4.0 * z[1, o] ** 2 + z[2, o] ** 2) / 6.0
            few[NOW, side] = few[MEMORY, side] * math.exp(-step / p1) + step * mean
        elif plant.laws[c, j] == 17:
            share = z[node, o + 1] / plant.coefficients[c, j, 3]
            limit, swept, m = p1 * math.exp(-share * share), z[SWEPT, o], HELD + side
            few[NOW, m] = max(-limit, min(limit, few[MEMORY, m] + swept))
            if node == 1:
                few[WAY, m] = swept
            else:
                # By way of the middle, where the limit may have been less.
                whole = few[NOW, m]
                few[NOW, m] = max(-limit, min(limit, few[KEPT, m] + swept - few[WAY, m]))
                few[ASTRAY, m] = whole - few[NOW, m]


@jit_part
def _read_arguments(plant: Packed, c: int, work: Work, row: int) -> None:
    # Put the laws' arguments at the modes and voltages inside a step into a row of them; what
    # modes add up to, without voltages, into SWEPT.
    z, size = work.arguments, work.modes.shape[1]
    count = z.shape[1]
    for i in range(count):
        z[row, i] = 0.0
    for j in range(size):
        value = work.modes[INSIDE, j]
        for i in range(count):
            z[row, i] += plant.readings[c, j, i] * value
    if plant.counts[c, FED] and row != SWEPT:
        for j in range(2):
            value = work.few[U_INSIDE, j]
            for i in range(count):
                z[row, i] += plant.readings[c, size + j, i] * value


@jit_part
def _surroundings(s: FloatArray, n: int, few: FloatArray) -> None:
    # Put heading, x, y and angles after the integrals of a part of a step into the context.
    four = few[PART]
    few[CONTEXT, 1] = s[n + 3] + four[3]
    half = 0.5 * four[3]
    c, d = math.cos(half), math.sin(half)
    few[CONTEXT, 2] = s[n + 4] + four[2] * (few[TANGENT, 0] * c - few[TANGENT, 1] * d)
    few[CONTEXT, 3] = s[n + 5] + four[2] * (few[TANGENT, 1] * c + few[TANGENT, 0] * d)
    few[CONTEXT, 4] = s[n] + four[0]
    few[CONTEXT, 5] = s[n + 1] + four[1]


@jit_part
def efforts_at(plant: Packed, c: int, s: FloatArray, n: int, time: float, at: float, node: int,
               row: int, work: Work) -> None:
    """
    Evaluate the laws inside a step into the row NEW, ``at`` [s] after its start.

    ``node`` counts the phis: for a quarter of the step, its middle, its end and three quarters;
    ``row`` of the arguments receives those of the laws. At the start, all of it is zero.
    """
    n_real, n_pairs = plant.counts[c, REALS], plant.counts[c, PAIRS]
    modes, few, modal = work.modes, work.few, plant.modal
    few[U_INSIDE, 0] = few[U, 0] + at * few[DU, 0]
    few[U_INSIDE, 1] = few[U, 1] + at * few[DU, 1]
    few[CONTEXT, 0] = time + at
    for first in range(1 + max(plant.counts[c, POSED], plant.counts[c, ADDING])):
        if at > 0.0:
            advance(at, first, modes, PHI + 4 * node, n_real, n_pairs)
        else:
            # Nothing has set the phis, the rate and the forcing yet.
            for i in range(modes.shape[1]):
                modes[INSIDE, i] = modes[XI, i] if first == 0 else 0.0
        if first == 0:
            _read_arguments(plant, c, work, row)
        elif plant.counts[c, POSED]:
            for o in range(4):
                few[PART, o] = 0.0
                for i in range(modes.shape[1]):
                    few[PART, o] += modal[c, MOTION + o, i] * modes[INSIDE, i]
            _surroundings(s, n, few)
        if first == 1 and plant.counts[c, ADDING]:
            _read_arguments(plant, c, work, SWEPT)
    remembered = MEMORY
    if plant.counts[c, REMEMBERING] and at > 0.0:
        remembered = NOW
        between = node == 0 or node == 3
        if not between:
            memories(plant, c, work.arguments, node, at, few)
        for i in range(MEMORIES):
            if not between:
                few[KEPT + node - 1, i] = few[NOW, i]
            elif node == 0:
                few[NOW, i] = 0.5 * (few[MEMORY, i] + few[KEPT, i])
            else:
                few[NOW, i] = 0.5 * (few[KEPT, i] + few[KEPT + 1, i])
    evaluate(c, plant.laws, plant.coefficients, plant.offsets, work.arguments[row], few[CONTEXT],
             few[remembered], work.efforts[NEW])


@jit_part
def bend(plant: Packed, c: int, h: float, work: Work) -> None:
    """Set the parabola through the efforts, and the slope and bend of the modes' forcing."""
    modal, modes, efforts, few = plant.modal, work.modes, work.efforts, work.few
    for i in range(modes.shape[1]):
        modes[SLOPE, i] = (modal[c, INPUTS, i] * few[DU, 0]
                           + modal[c, INPUTS + 1, i] * few[DU, 1])
        modes[BEND, i] = 0.0
    scale = 1.0 / h if h > 0.0 else 0.0
    for e in range(plant.counts[c, EFFORTS]):
        linear, square = 0.0, 0.0
        if h > 0.0:
            linear = (4.0 * efforts[F + 1, e] - 3.0 * efforts[F, e] - efforts[F + 2, e]) * scale
            square = 2.0 * (efforts[F, e] - 2.0 * efforts[F + 1, e] + efforts[F + 2, e]) * (
                scale * scale)
        efforts[PARABOLA, e], efforts[PARABOLA + 1, e] = linear, square
        for i in range(modes.shape[1]):
            modes[SLOPE, i] += modal[c, GAINS + e, i] * linear
            modes[BEND, i] += modal[c, GAINS + e, i] * square


@jit_part
def _passed(plant: Packed, c: int, z: FloatArray) -> float:
    # Error where a step passes by the standstill, at which a ripple vanishes for a moment that
    # may lie between all places where it is asked.
    error = 0.0
    for e in range(plant.counts[c, EFFORTS]):
        if plant.laws[c, e] == 5:
            o, width = plant.offsets[c, e], plant.coefficients[c, e, 3]
            lower = min(z[0, o], min(z[1, o], z[2, o]))
            upper = max(z[0, o], max(z[1, o], z[2, o]))
            if lower < AWAY * width and upper > -AWAY * width:
                error = max(error, ((upper - lower) / width) ** 4)
    return error


@jit_part
def _astray(plant: Packed, c: int, few: FloatArray, efforts: FloatArray) -> None:
    # Put what the efforts differ by whose memory depends on the way into the row CHANGE.
    for e in range(plant.counts[c, EFFORTS]):
        efforts[CHANGE, e] = 0.0
        if plant.laws[c, e] == 17:
            efforts[CHANGE, e] = plant.coefficients[c, e, 0] / plant.coefficients[c, e, 1] * few[
                ASTRAY, HELD + int(plant.coefficients[c, e, 2])]


@jit_part
def solve(plant: Packed, c: int, s: FloatArray, n: int, time: float, h: float, before: float,
          work: Work) -> float:
    """
    Find the efforts of a step.

    Parameters
    ----------
    plant, c
        And the set of it that is in force.
    s, n
        Flat state at the start of the step, and the number of states of graph and controllers.
    time, h : float
        Start and length of the step [s].
    before : float
        Length of the step before [s], whose parabola is FORMER; 0 after a jump.
    work : Work
        Scratch arrays, with the efforts at the start; those of the step are put there.

    Returns
    -------
    float
        Error in parts of what is allowed; negative where the iteration does not converge.

    """
    n_real, n_pairs, count = plant.counts[c, REALS], plant.counts[c, PAIRS], plant.counts[
        c, EFFORTS]
    efforts = work.efforts
    phis(0.25 * h, plant.modal, c, n_real, n_pairs, work.modes)
    for node in range(1, 3):
        at = 0.5 * node * h
        p = PHI + 4 * (node - 1)
        added(0.5 * at, 1.0, plant.modal, c, n_real, n_pairs, work.modes, p, p, p + 4)
        for e in range(count):
            efforts[F + node, e], efforts[OLD + node, e] = efforts[F, e], 0.0
            if before > 0.0:
                # The parabola before, of which the start is the end, goes on.
                square = efforts[FORMER + 1, e]
                slope = efforts[FORMER, e] + 2.0 * before * square
                efforts[F + node, e] += at * (slope + at * square)
    added(0.5 * h, 0.5, plant.modal, c, n_real, n_pairs, work.modes, PHI + 4, PHI, PHI + 12)
    error, converged = 0.0, False
    for iteration in range(ITERATIONS + 1):
        # In the end, once more: what the laws say at the quarters, where no parabola was asked.
        last, error = error, 0.0
        bend(plant, c, h, work)
        for k in range(2):
            node = k + 1
            at = 0.5 * node * h
            if converged:
                node, at = 3 * k, (0.25 + 0.5 * k) * h
            row = CHANGE + (0 if converged else node)
            efforts_at(plant, c, s, n, time, at, node, BETWEEN if converged else node, work)
            for e in range(count):
                told = efforts[F if converged else F + node, e]
                if converged:
                    told += at * (efforts[PARABOLA, e] + at * efforts[PARABOLA + 1, e])
                efforts[row, e] = efforts[NEW, e] - told
            # What a change at the quarters does is done over the whole step.
            error = max(error, effect(plant, c, work, row, PHI + 4 * (2 if converged else node),
                                      h if converged else at))
        if converged:
            if plant.counts[c, ADDING]:
                _astray(plant, c, work.few, efforts)
                error = max(error, effect(plant, c, work, CHANGE, PHI + 8, h))
            return max(DEFECT * error, _passed(plant, c, work.arguments))
        for node in range(1, 3):
            for e in range(count):
                # Steffensen's step: dissipation may be far stiffer than the modes.
                change, old = efforts[CHANGE + node, e], efforts[OLD + node, e]
                slope = change / old if old != 0.0 else 0.0
                efforts[OLD + node, e] = change
                efforts[F + node, e] += change / (1.0 - max(STEEPEST, min(FLATTEST, slope)))
        converged = error < CONVERGED or error * error < 0.3 * CONVERGED * last
        if not converged and iteration == ITERATIONS - 1:
            return -1.0
    return -1.0
