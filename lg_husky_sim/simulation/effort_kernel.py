# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Parts of the event-driven kernel: one step of a plant with efforts.

A parabola through the efforts at the start, the middle and the end of a step forces the modes;
middle and end are found by iteration. What the laws differ from it at a quarter is the error.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from lg_husky_sim.husky.laws import evaluate, GAPS, HELD
from lg_husky_sim.jit import jit_part
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation.modal_kernel import add_product, advance, doubled, Packed, phis

#: Error of a step that is allowed: wheel rates [rad/s], speed [m/s], yaw rate [rad/s].
WHEEL_ERROR, SPEED_ERROR, YAW_ERROR = 2e-5, 3e-6, 5e-6
#: Iterations of a step at most, and the share of the allowed error at which they end.
ITERATIONS, CONVERGED = 8, 0.1
#: Error of a step, as a multiple of what the laws differ from the parabola at its quarter.
DEFECT = 2.0
#: Speed from which a ripple counts whole, in widths of its standstill.
AWAY = 3.0
#: Bounds of the slope of an effort in its own change, for Steffensen's step.
STEEPEST, FLATTEST = -50.0, 0.5


class Step(NamedTuple):
    """
    Arrays of a step: modes ``xi``, ``r`` and ``q`` of :mod:`modal_kernel`, and its efforts.

    ``f`` has the efforts at the start, the middle and the end in rows, ``parabola`` the other
    coefficients of the parabola through them, ``former`` those of the step before. ``z`` has the
    laws' arguments at those three places and at a quarter, ``swept`` their integrals, ``kept`` the
    memories at the middle and the end; in ``p``, ``change`` and ``old`` are a quarter, the middle
    and the end.
    """

    xi: FloatArray
    r: FloatArray
    q: FloatArray
    u: FloatArray
    du: FloatArray
    f: FloatArray
    parabola: FloatArray
    former: FloatArray
    z: FloatArray
    line: FloatArray
    swept: FloatArray
    context: FloatArray
    now: FloatArray
    kept: FloatArray
    tangent: FloatArray
    p: FloatArray
    xt: FloatArray
    work: FloatArray
    ut: FloatArray
    four: FloatArray
    change: FloatArray
    old: FloatArray
    new: FloatArray


@jit_part
def effect(plant: Packed, c: int, step: Step, row: int, node: int, t: float) -> float:
    """
    Return what a change of the efforts (a row) over ``t`` [s] does, in parts of what is allowed.

    ``node`` is the row of the phis for ``t``.
    """
    n_real, n_pairs, efforts = plant.counts[c, 0], plant.counts[c, 1], plant.counts[c, 2]
    work, p = step.work, step.p
    for i in range(work.size):
        work[i] = 0.0
    for e in range(efforts):
        value = t * step.change[row, e]
        for i in range(work.size):
            work[i] += plant.gm[c, e, i] * value
    for i in range(n_real):
        work[i] *= p[node, 0, i]
    for i in range(n_real, n_real + n_pairs):
        m = i + n_pairs
        real = p[node, 0, i] * work[i] - p[node, 0, m] * work[m]
        work[m] = p[node, 0, i] * work[m] + p[node, 0, m] * work[i]
        work[i] = real
    left, right, speed, rate = 0.0, 0.0, 0.0, 0.0
    for i in range(plant.ci.shape[2]):
        left += plant.ci[c, 0, i] * work[i]
        right += plant.ci[c, 1, i] * work[i]
        speed += plant.ci[c, 2, i] * work[i]
        rate += plant.ci[c, 3, i] * work[i]
    return max(max(abs(left), abs(right)) / WHEEL_ERROR,
               max(abs(speed) / SPEED_ERROR, abs(rate) / YAW_ERROR))


@jit_part
def memories(plant: Packed, c: int, begin: FloatArray, z: FloatArray, swept: FloatArray,
             node: int, step: float, now: FloatArray) -> None:
    """
    Put the memories after ``step`` [s] into ``now``: at the middle (0) or the end (1).

    ``swept`` has the integrals of the laws' arguments, where a law needs them exactly: what is
    held at rest would creep with the error of a mean.
    """
    for i in range(begin.size):
        now[i] = begin[i]
    for j in range(plant.counts[c, 2]):
        o = plant.offsets[c, j]
        p0, p1 = plant.coefficients[c, j, 0], plant.coefficients[c, j, 1]
        side = int(plant.coefficients[c, j, 2])
        if plant.laws[c, j] == 13:
            mean = 0.5 * (z[0, o] ** 2 + z[1, o] ** 2)
            if node == 1:
                mean = (z[0, o] ** 2 + 4.0 * z[1, o] ** 2 + z[2, o] ** 2) / 6.0
            now[side] = begin[side] * math.exp(-step / p1) + step * mean
        elif plant.laws[c, j] == 14:
            mean = 0.5 * (z[0, o] / p1 - z[0, o + 1] + z[1, o] / p1 - z[1, o + 1])
            if node == 1:
                mean = (z[0, o] / p1 - z[0, o + 1] + 4.0 * (z[1, o] / p1 - z[1, o + 1])
                        + z[2, o] / p1 - z[2, o + 1]) / 6.0
            now[GAPS + side] = max(-0.5 * p0, min(0.5 * p0, begin[GAPS + side] + step * mean))
        elif plant.laws[c, j] == 17:
            share = z[node + 1, o + 1] / plant.coefficients[c, j, 3]
            limit = p1 * math.exp(-share * share)
            now[HELD + side] = max(-limit, min(limit, begin[HELD + side] + swept[o]))


@jit_part
def arguments(plant: Packed, c: int, row: int, xi: FloatArray, u: FloatArray, z: FloatArray,
              line: FloatArray) -> None:
    """Put the laws' arguments at modes and voltages into ``line`` and a row of ``z``."""
    for i in range(line.size):
        line[i] = 0.0
    add_product(plant.hm, c, xi, xi.size, line)
    if plant.counts[c, 5]:
        add_product(plant.k, c, u, 2, line)
    for i in range(line.size):
        z[row, i] = line[i]


@jit_part
def surroundings(context: FloatArray, time: float, s: FloatArray, n: int, four: FloatArray,
                 tangent: FloatArray) -> None:
    """Put time, heading, x, y and angles after the integrals ``four`` of a step in context."""
    context[0] = time
    context[1] = s[n + 3] + four[3]
    half = 0.5 * four[3]
    c, d = math.cos(half), math.sin(half)
    context[2] = s[n + 4] + four[2] * (tangent[0] * c - tangent[1] * d)
    context[3] = s[n + 5] + four[2] * (tangent[1] * c + tangent[0] * d)
    context[4] = s[n] + four[0]
    context[5] = s[n + 1] + four[1]


@jit_part
def _efforts_at(plant: Packed, c: int, s: FloatArray, n: int, time: float, at: float, node: int,
                step: Step, memory: FloatArray) -> None:
    # Evaluate the laws at a quarter (node 0), the middle (1) or the end (2) into step.new.
    n_real, n_pairs = plant.counts[c, 0], plant.counts[c, 1]
    advance(at, 0, step.xi, step.r, step.q, step.p, node, n_real, n_pairs, step.xt)
    step.ut[0], step.ut[1] = step.u[0] + at * step.du[0], step.u[1] + at * step.du[1]
    arguments(plant, c, node if node > 0 else 3, step.xt, step.ut, step.z, step.line)
    step.context[0] = time + at
    if plant.counts[c, 3]:
        advance(at, 1, step.xi, step.r, step.q, step.p, node, n_real, n_pairs, step.xt)
        for o in range(4):
            step.four[o] = 0.0
            for i in range(plant.ci.shape[2]):
                step.four[o] += plant.ci[c, o, i] * step.xt[i]
        surroundings(step.context, time + at, s, n, step.four, step.tangent)
    if plant.counts[c, 4]:
        if node > 0:
            if plant.counts[c, 6]:
                if not plant.counts[c, 3]:
                    advance(at, 1, step.xi, step.r, step.q, step.p, node, n_real, n_pairs,
                            step.xt)
                for i in range(step.swept.size):
                    step.swept[i] = 0.0
                add_product(plant.hm, c, step.xt, step.xt.size, step.swept)
            memories(plant, c, memory, step.z, step.swept, node - 1, at, step.now)
        for i in range(memory.size):
            if node > 0:
                step.kept[node - 1, i] = step.now[i]
            else:
                step.now[i] = 0.5 * (memory[i] + step.kept[0, i])
    evaluate(c, plant.laws, plant.coefficients, plant.offsets, step.line, step.context,
             step.now, step.new)


@jit_part
def bend(plant: Packed, c: int, h: float, step: Step) -> None:
    """Set the parabola through the efforts, and the slope and bend of the modes' forcing."""
    for i in range(step.work.size):
        step.q[0, i] = plant.bm[c, 0, i] * step.du[0] + plant.bm[c, 1, i] * step.du[1]
        step.q[1, i] = 0.0
    scale = 1.0 / h
    for e in range(plant.counts[c, 2]):
        linear = (4.0 * step.f[1, e] - 3.0 * step.f[0, e] - step.f[2, e]) * scale
        square = 2.0 * (step.f[0, e] - 2.0 * step.f[1, e] + step.f[2, e]) * (scale * scale)
        step.parabola[0, e], step.parabola[1, e] = linear, square
        for i in range(step.work.size):
            step.q[0, i] += plant.gm[c, e, i] * linear
            step.q[1, i] += plant.gm[c, e, i] * square


@jit_part
def _passed(plant: Packed, c: int, step: Step) -> float:
    # Error where a step passes by the standstill, at which a ripple vanishes for a moment that
    # may lie between all places where it is asked.
    error = 0.0
    for e in range(plant.counts[c, 2]):
        if plant.laws[c, e] == 5:
            o, width = plant.offsets[c, e], plant.coefficients[c, e, 3]
            first, middle, end = step.z[0, o], step.z[1, o], step.z[2, o]
            lower, upper = min(first, min(middle, end)), max(first, max(middle, end))
            if lower < AWAY * width and upper > -AWAY * width:
                error = max(error, ((upper - lower) / width) ** 4)
    return error


@jit_part
def solve(plant: Packed, c: int, s: FloatArray, n: int, time: float, h: float, before: float,
          step: Step, memory: FloatArray) -> float:
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
        Length of the step before [s], whose parabola is ``step.former``; 0 after a jump.
    step : Step
    memory : numpy.ndarray
        Memories at the start.

    Returns
    -------
    float
        Error in parts of what is allowed; negative where the iteration does not converge.
    """
    half, quarter = 0.5 * h, 0.25 * h
    n_real, n_pairs, efforts = plant.counts[c, 0], plant.counts[c, 1], plant.counts[c, 2]
    phis(quarter, plant.rates, c, n_real, n_pairs, step.p)
    doubled(quarter, plant.rates, c, n_real, n_pairs, step.p, 0)
    doubled(half, plant.rates, c, n_real, n_pairs, step.p, 1)
    for node in range(1, 3):
        at = half if node == 1 else h
        for e in range(efforts):
            step.f[node, e], step.old[node, e] = step.f[0, e], 0.0
            if before > 0.0:
                # The parabola before, of which the start is the end, goes on.
                square = step.former[1, e]
                slope = step.former[0, e] + 2.0 * before * square
                step.f[node, e] += at * (slope + at * square)
    error, converged = 0.0, False
    for iteration in range(ITERATIONS + 1):
        # In the end, once more: what the laws say at a quarter, where no parabola was asked.
        last, error = error, 0.0
        bend(plant, c, h, step)
        for k in range(1 if converged else 2):
            node = 0 if converged else k + 1
            at = quarter if converged else (half if node == 1 else h)
            _efforts_at(plant, c, s, n, time, at, node, step, memory)
            for e in range(efforts):
                told = step.f[node, e]
                if converged:
                    told += quarter * (step.parabola[0, e] + quarter * step.parabola[1, e])
                step.change[node, e] = step.new[e] - told
            if converged:
                return max(DEFECT * effect(plant, c, step, 0, 2, h), _passed(plant, c, step))
            error = max(error, effect(plant, c, step, node, node, at))
        for node in range(1, 3):
            for e in range(efforts):
                # Steffensen's step: dissipation may be far stiffer than the modes.
                change, old = step.change[node, e], step.old[node, e]
                slope = change / old if old != 0.0 else 0.0
                step.old[node, e] = change
                step.f[node, e] += change / (1.0 - max(STEEPEST, min(FLATTEST, slope)))
        converged = error < CONVERGED or error * error < 0.3 * CONVERGED * last
        if not converged and iteration == ITERATIONS - 1:
            return -1.0
    return -1.0
