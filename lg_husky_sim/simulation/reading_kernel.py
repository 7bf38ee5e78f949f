# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Parts of the event-driven kernel: several points of one step at once.

Points are the columns of every array here, so that they fill the vectors of the processor.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from lg_husky_sim.jit import jit_part
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation.modal_kernel import (
    Packed,
    pair_phis,
    real_phis,
    T2,
    T3,
    T4,
    T5,
    T6,
    T7,
)

#: Points at once; loops over them are written for this number.
LANES = 8
#: Rows of the outputs: those of the plant, yaw acceleration, derivative of the speed.
YAW_ACCELERATION, ACCELERATION, ROWS = 9, 10, 11
#: Largest part of an argument [-] whose series has seven terms.
SERIES = 0.05
#: Angle [rad] up to which the series of the sine, with five terms, is exact.
SMALL_ANGLE = 0.05


class Block(NamedTuple):
    """
    Points of a step, sorted.

    Parameters
    ----------
    goals : numpy.ndarray, shape (LANES,)
        Times since the start of the step [s]; those beyond the last point repeat it.
    values : numpy.ndarray, shape (n + 2 + n_efforts, LANES)
        Modes, voltages and efforts.
    integrals : numpy.ndarray, shape (n, LANES)
        Of the modes since the start of the step.
    grown : numpy.ndarray, shape (2, LANES)
        exp(z) - 1 of a pair of modes.
    outputs : numpy.ndarray, shape (ROWS, LANES)
    driven : numpy.ndarray, shape (4, LANES)
        What wheels turned [rad], the base went [m] and turned [rad] since the start of the step.
    """

    goals: FloatArray
    values: FloatArray
    integrals: FloatArray
    grown: FloatArray
    outputs: FloatArray
    driven: FloatArray


@jit_part
def spread(c: int, rates: FloatArray, n_real: int, n_pairs: int, xi: FloatArray, r: FloatArray,
           q: FloatArray, block: Block) -> None:
    """Put the modes at all points, and their integrals, into the block."""
    lanes = block.goals.size  # a number that the compiler does not know: it would not use vectors
    for i in range(n_real):
        rate, x0, r0, q1, q2 = rates[c, i], xi[i], r[i], q[0, i], 2.0 * q[1, i]
        for g in range(lanes):
            t = block.goals[g]
            p1, p2, p3, p4 = real_phis(rate * t)
            block.values[i, g] = x0 + t * (p1 * r0 + t * (p2 * q1 + t * (p3 * q2)))
            block.integrals[i, g] = t * (x0 + t * (p2 * r0 + t * (p3 * q1 + t * (p4 * q2))))
    for k in range(n_real, n_real + n_pairs):
        m = k + n_pairs
        re, im = rates[c, k], rates[c, m]
        _grow(re, im, block)
        x0, y0, r0, s0 = xi[k], xi[m], r[k], r[m]
        q1, w1, q2, w2 = q[0, k], q[0, m], 2.0 * q[1, k], 2.0 * q[1, m]
        for g in range(lanes):
            t = block.goals[g]
            p1, o1, p2, o2, p3, o3, p4, o4 = pair_phis(
                re * t, im * t, block.grown[0, g], block.grown[1, g])
            block.values[k, g] = x0 + t * (p1 * r0 - o1 * s0 + t * (
                p2 * q1 - o2 * w1 + t * (p3 * q2 - o3 * w2)))
            block.values[m, g] = y0 + t * (p1 * s0 + o1 * r0 + t * (
                p2 * w1 + o2 * q1 + t * (p3 * w2 + o3 * q2)))
            block.integrals[k, g] = t * (x0 + t * (p2 * r0 - o2 * s0 + t * (
                p3 * q1 - o3 * w1 + t * (p4 * q2 - o4 * w2))))
            block.integrals[m, g] = t * (y0 + t * (p2 * s0 + o2 * r0 + t * (
                p3 * w1 + o3 * q1 + t * (p4 * w2 + o4 * q2))))


@jit_part
def _grow(re: float, im: float, block: Block) -> None:
    # exp(z) - 1 at all points: its series for a part of z, doubled as often as is needed.
    lanes = block.goals.size
    size = (abs(re) + abs(im)) * block.goals[lanes - 1]
    share, halvings = 1.0, 0
    while size * share > SERIES:
        share *= 0.5
        halvings += 1
    for g in range(lanes):
        t = block.goals[g] * share
        a, b = re * t, im * t
        x, y = T6 + a * T7, b * T7
        x, y = T5 + a * x - b * y, a * y + b * x
        x, y = T4 + a * x - b * y, a * y + b * x
        x, y = T3 + a * x - b * y, a * y + b * x
        x, y = T2 + a * x - b * y, a * y + b * x
        x, y = 1.0 + a * x - b * y, a * y + b * x
        block.grown[0, g], block.grown[1, g] = a * x - b * y, a * y + b * x
    for _ in range(halvings):
        for g in range(lanes):
            x, y = block.grown[0, g], block.grown[1, g]
            block.grown[0, g], block.grown[1, g] = x * (2.0 + x) - y * y, 2.0 * y * (1.0 + x)


@jit_part
def combine(matrices: FloatArray, c: int, count: int, vectors: FloatArray, out: FloatArray
            ) -> None:
    """Put a matrix times each column of ``vectors``, of which ``count`` rows count, into out."""
    for o in range(out.shape[0]):
        a0, a1, a2, a3, a4, a5, a6, a7 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(count):
            w = matrices[c, o, i]
            a0 += w * vectors[i, 0]
            a1 += w * vectors[i, 1]
            a2 += w * vectors[i, 2]
            a3 += w * vectors[i, 3]
            a4 += w * vectors[i, 4]
            a5 += w * vectors[i, 5]
            a6 += w * vectors[i, 6]
            a7 += w * vectors[i, 7]
        out[o, 0], out[o, 1], out[o, 2], out[o, 3] = a0, a1, a2, a3
        out[o, 4], out[o, 5], out[o, 6], out[o, 7] = a4, a5, a6, a7


@jit_part
def read(plant: Packed, c: int, efforts: int, xi: FloatArray, r: FloatArray, q: FloatArray,
         u: FloatArray, du: FloatArray, f: FloatArray, parabola: FloatArray, block: Block
         ) -> None:
    """Fill the block for its goals: what is driven under voltages and efforts of a step."""
    n = plant.out_of.shape[1]
    spread(c, plant.rates, plant.counts[c, 0], plant.counts[c, 1], xi, r, q, block)
    for i in range(2):
        for g in range(LANES):
            block.values[n + i, g] = u[i] + block.goals[g] * du[i]
    for e in range(efforts):
        for g in range(LANES):
            t = block.goals[g]
            block.values[n + 2 + e, g] = f[0, e] + t * (parabola[0, e] + t * parabola[1, e])
    combine(plant.cy, c, n + 2 + efforts, block.values, block.outputs)
    combine(plant.ci, c, n, block.integrals, block.driven)


@jit_part
def sine_of(angle: float) -> float:
    """Return the sine [1] of an angle that is mostly small [rad]."""
    if abs(angle) > SMALL_ANGLE:
        return math.sin(angle)
    square = angle * angle
    return angle * (1.0 - square * T3 * (1.0 - square / 20.0 * (1.0 - square / 42.0 * (
        1.0 - square / 72.0))))


@jit_part
def go(width: float, went: float, turned: float, last: FloatArray, block: Block, g: int,
       moved: FloatArray) -> None:
    """
    Follow the base from the last point to the point ``g``.

    Corrected trapezoid of the sine and of the missing part of the cosine.

    Parameters
    ----------
    width, went, turned : float
        Time [s], way [m] and turn [rad] between the points.
    last : numpy.ndarray, shape (4,)
        Speed, yaw rate and their derivatives at the last point.
    block, g
        With the point.
    moved : numpy.ndarray, shape (4,)
        Receives the way along and across the last direction [m], the sine of the turn and what
        its cosine is less than one.
    """
    speed, rate = block.outputs[2, g], block.outputs[3, g]
    acceleration = block.outputs[ACCELERATION, g]
    sine, half = sine_of(turned), sine_of(0.5 * turned)
    less = -2.0 * half * half
    twelfth = width * width / 12.0
    moved[0] = went + 0.5 * width * speed * less - twelfth * (
        acceleration * less - speed * rate * sine)
    moved[1] = 0.5 * width * speed * sine + twelfth * (
        last[0] * last[1] - acceleration * sine - speed * rate * (1.0 + less))
    moved[2], moved[3] = sine, less


@jit_part
def go_by_arc(went: float, turned: float, moved: FloatArray) -> None:
    """Put into ``moved``, as :func:`go`, what an arc of this way [m] and turn [rad] does."""
    half = 0.5 * turned
    sine, quarter = sine_of(half), sine_of(0.5 * half)
    cosine = 1.0 - 2.0 * quarter * quarter
    chord = went * (sine / half) if half != 0.0 else went
    moved[0], moved[1] = chord * cosine, chord * sine
    moved[2], moved[3] = 2.0 * sine * cosine, -2.0 * sine * sine


@jit_part
def write_row(out: FloatArray, place: int, block: Block, g: int, s: FloatArray, n: int,
              play: FloatArray) -> None:
    """Write an output row; encoders turn with the motors, ahead of the wheels by the play."""
    for i in range(7):
        out[place, i] = block.outputs[i, g]
    for i in range(4):
        out[place, 7 + i] = s[n + i] + block.driven[i, g]
    for i in range(2):
        out[place, i] += play[2 + i]
        out[place, 7 + i] += play[i]
        out[place, 11 + i] = s[n + 4 + i]
        out[place, 13 + i] = block.outputs[7 + i, g]
