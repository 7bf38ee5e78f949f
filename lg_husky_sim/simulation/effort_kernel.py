# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Parts of the event-driven kernel: one step of a plant with efforts.

A parabola through the efforts at the start, the middle and the end of a step forces the modes;
middle and end are found by iteration.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from lg_husky_sim.husky.laws import evaluate
from lg_husky_sim.jit import jit_call, jit_part
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation.modal_kernel import add_product, advance, Packed, phis

#: Error of a step that is allowed: wheel rates [rad/s], speed [m/s], yaw rate [rad/s].
WHEEL_ERROR, SPEED_ERROR, YAW_ERROR = 2e-5, 3e-6, 5e-6
#: Iterations of a step at most, and the share of the allowed error at which they end.
ITERATIONS, CONVERGED = 8, 0.1
#: Error of a parabola inside its step, as a share of its cubic term; of the first step
#: after a jump, as a share of its square term.
CUBIC, SQUARE = 0.05, 0.1
#: Bounds of the slope of an effort in its own change, for Steffensen's step.
STEEPEST, FLATTEST = -50.0, 0.5


class Step(NamedTuple):
    """
    Arrays of a step: modes ``xi``, ``r`` and ``q`` of :mod:`modal_kernel`, and its efforts.

    Efforts at the start, the middle and the end: ``f0``, ``fm``, ``fe``; the parabola's other
    coefficients: ``a1``, ``a2``, and those of the step before: ``b1``, ``b2``. ``z`` has the
    laws' arguments at those three places in rows, ``middle`` and ``finish`` are the
    memories at the latter two.
    """

    xi: FloatArray
    r: FloatArray
    q: FloatArray
    u: FloatArray
    du: FloatArray
    f0: FloatArray
    fm: FloatArray
    fe: FloatArray
    a1: FloatArray
    a2: FloatArray
    b1: FloatArray
    b2: FloatArray
    z: FloatArray
    line: FloatArray
    context: FloatArray
    middle: FloatArray
    finish: FloatArray
    tangent: FloatArray
    pm: FloatArray
    pe: FloatArray
    xt: FloatArray
    work: FloatArray
    ut: FloatArray
    four: FloatArray
    dm: FloatArray
    de: FloatArray
    old_m: FloatArray
    old_e: FloatArray
    new: FloatArray


@jit_part
def effect(plant: Packed, c: int, change: FloatArray, t: float, p: FloatArray, work: FloatArray,
           four: FloatArray) -> float:
    """Return what a change of the efforts over ``t`` [s] does, in parts of what is allowed."""
    n_real, n_pairs = plant.counts[c, 0], plant.counts[c, 1]
    for i in range(work.size):
        work[i] = 0.0
    add_product(plant.gm, c, change, change.size, work)
    for i in range(n_real):
        work[i] *= t * p[0, i]
    for i in range(n_real, n_real + n_pairs):
        m = i + n_pairs
        real = t * (p[0, i] * work[i] - p[0, m] * work[m])
        work[m] = t * (p[0, i] * work[m] + p[0, m] * work[i])
        work[i] = real
    for i in range(4):
        four[i] = 0.0
    add_product(plant.ci, c, work, work.size, four)
    wheels = max(abs(four[0]), abs(four[1])) / WHEEL_ERROR
    base = max(abs(four[2]) / SPEED_ERROR, abs(four[3]) / YAW_ERROR)
    return float(max(wheels, base))


@jit_part
def memories(plant: Packed, c: int, begin: FloatArray, z: FloatArray, last: int, step: float,
             memory: FloatArray) -> None:
    """Put heat and play after ``step`` [s] into ``memory``: at the middle (1) or the end (2)."""
    for i in range(memory.size):
        memory[i] = begin[i]
    for j in range(plant.counts[c, 2]):
        o = plant.offsets[c, j]
        p0, p1 = plant.coefficients[c, j, 0], plant.coefficients[c, j, 1]
        side = int(plant.coefficients[c, j, 2])
        if plant.laws[c, j] == 13:
            mean = 0.5 * (z[0, o] ** 2 + z[1, o] ** 2)
            if last == 2:
                mean = (z[0, o] ** 2 + 4.0 * z[1, o] ** 2 + z[2, o] ** 2) / 6.0
            memory[side] = begin[side] * math.exp(-step / p1) + step * mean
        elif plant.laws[c, j] == 14:
            mean = 0.5 * (z[0, o] / p1 - z[0, o + 1] + z[1, o] / p1 - z[1, o + 1])
            if last == 2:
                mean = (z[0, o] / p1 - z[0, o + 1] + 4.0 * (z[1, o] / p1 - z[1, o + 1])
                        + z[2, o] / p1 - z[2, o + 1]) / 6.0
            memory[2 + side] = max(-0.5 * p0, min(0.5 * p0, begin[2 + side] + step * mean))


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
                p: FloatArray, step: Step, memory: FloatArray, kept: FloatArray) -> None:
    # Evaluate the laws at the middle (node 1) or the end (2) into step.new.
    n_real, n_pairs = plant.counts[c, 0], plant.counts[c, 1]
    advance(at, 0, step.xi, step.r, step.q, p, n_real, n_pairs, 2, step.xt)
    step.ut[0], step.ut[1] = step.u[0] + at * step.du[0], step.u[1] + at * step.du[1]
    arguments(plant, c, node, step.xt, step.ut, step.z, step.line)
    step.context[0] = time + at
    if plant.counts[c, 3]:
        advance(at, 1, step.xi, step.r, step.q, p, n_real, n_pairs, 2, step.xt)
        for i in range(4):
            step.four[i] = 0.0
        add_product(plant.ci, c, step.xt, step.xt.size, step.four)
        surroundings(step.context, time + at, s, n, step.four, step.tangent)
    memories(plant, c, memory, step.z, node, at, kept)
    evaluate(c, plant.laws, plant.coefficients, plant.offsets, step.line, step.context, kept,
             step.new)


@jit_part
def bend(plant: Packed, c: int, h: float, step: Step) -> None:
    """Put the parabola through the efforts and the voltages' slope into a1, a2 and q."""
    for e in range(step.f0.size):
        step.a1[e] = (4.0 * step.fm[e] - 3.0 * step.f0[e] - step.fe[e]) / h
        step.a2[e] = 2.0 * (step.f0[e] - 2.0 * step.fm[e] + step.fe[e]) / (h * h)
    for i in range(step.work.size):
        linear = plant.bm[c, 0, i] * step.du[0] + plant.bm[c, 1, i] * step.du[1]
        square = 0.0
        for e in range(step.f0.size):
            linear += plant.gm[c, e, i] * step.a1[e]
            square += plant.gm[c, e, i] * step.a2[e]
        step.q[0, i], step.q[1, i] = linear, square


@jit_part
def _stiffly(found: FloatArray, change: FloatArray, old: FloatArray) -> None:
    # Steffensen's step, effort by effort: dissipation may be far stiffer than the modes.
    for e in range(found.size):
        slope = change[e] / old[e] if old[e] != 0.0 else 0.0
        old[e] = change[e]
        found[e] += change[e] / (1.0 - max(STEEPEST, min(FLATTEST, slope)))


@jit_call
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
        Length of the step before [s], whose parabola a1 and a2 still hold; 0 after a jump.
    step : Step
    memory : numpy.ndarray
        Memories at the start.

    Returns
    -------
    float
        Error in parts of what is allowed; negative where the iteration does not converge.
    """
    half = 0.5 * h
    n_real, n_pairs = plant.counts[c, 0], plant.counts[c, 1]
    phis(half, plant.rates, c, n_real, n_pairs, step.pm)
    phis(h, plant.rates, c, n_real, n_pairs, step.pe)
    for e in range(step.f0.size):
        step.fm[e], step.fe[e] = step.f0[e], step.f0[e]
        step.old_m[e], step.old_e[e] = 0.0, 0.0
        if before > 0.0:
            # The parabola before, of which f0 is the end, goes on.
            slope = step.b1[e] + 2.0 * before * step.b2[e]
            step.fm[e] += half * (slope + half * step.b2[e])
            step.fe[e] += h * (slope + h * step.b2[e])
    error = 0.0
    for _ in range(ITERATIONS):
        bend(plant, c, h, step)
        _efforts_at(plant, c, s, n, time, half, 1, step.pm, step, memory, step.middle)
        for e in range(step.f0.size):
            step.dm[e] = step.new[e] - step.fm[e]
        _efforts_at(plant, c, s, n, time, h, 2, step.pe, step, memory, step.finish)
        for e in range(step.f0.size):
            step.de[e] = step.new[e] - step.fe[e]
        error = max(effect(plant, c, step.dm, half, step.pm, step.work, step.four),
                    effect(plant, c, step.de, h, step.pe, step.work, step.four))
        _stiffly(step.fm, step.dm, step.old_m)
        _stiffly(step.fe, step.de, step.old_e)
        if error < CONVERGED:
            break
    if error >= CONVERGED:
        return -1.0
    bend(plant, c, h, step)
    for e in range(step.f0.size):
        if before > 0.0:
            # The cubic term that the parabola leaves out, from the middle of the step before.
            back = -0.5 * before
            was = step.f0[e] + back * (step.b1[e] + 1.5 * before * step.b2[e])
            cube = (step.f0[e] + back * (step.a1[e] + back * step.a2[e]) - was) / (
                back * (back - half) * (back - h))
            step.dm[e] = CUBIC * h * h * h * cube
        else:
            step.dm[e] = SQUARE * 0.5 * h * h * step.a2[e]
    return effect(plant, c, step.dm, h, step.pe, step.work, step.four)
