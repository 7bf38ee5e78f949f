# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Parts of the event-driven kernel: several points of one step at once.

Points are the columns of every array here, so that they fill the vectors of the processor.
"""

from __future__ import annotations

import math

from lg_husky_sim.jit import jit_part
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation.arrays import (
    ACCELERATION,
    BEND,
    DRIVEN,
    DU,
    EFFORTS,
    F,
    GOALS,
    GROWN,
    INTEGRALS,
    LANES,
    LAST,
    MOTION,
    OUTPUTS,
    Packed,
    PAIRS,
    PARABOLA,
    RATE,
    RATES,
    REALS,
    ROWS,
    SLOPE,
    U,
    Work,
    XI,
)
from lg_husky_sim.simulation.modal_kernel import (
    far_phis,
    near_phis,
    pair_phis,
    real_phis,
    T2,
    T3,
    T4,
    T5,
    T6,
    T7,
)

#: Largest part of an argument [-] whose series has seven terms.
SERIES = 0.05
#: Angle [rad] up to which the series of the sine, with five terms, is exact.
SMALL_ANGLE = 0.05


@jit_part
def spread(c: int, modal: FloatArray, n_real: int, n_pairs: int, modes: FloatArray,
           lanes: FloatArray, values: int) -> None:
    """Put the modes at all points into the rows from ``values`` on, and their integrals."""
    count = lanes.shape[1]  # a number that the compiler does not know: it would not use vectors
    for i in range(n_real):
        rate, x0, r0, q1, q2 = (modal[c, RATES, i], modes[XI, i], modes[RATE, i],
                                modes[SLOPE, i], 2.0 * modes[BEND, i])
        if q1 != 0.0 or q2 != 0.0:
            for g in range(count):
                t = lanes[GOALS, g]
                p1, p2, p3, p4 = real_phis(rate * t)
                lanes[values + i, g] = x0 + t * (p1 * r0 + t * (p2 * q1 + t * (p3 * q2)))
                lanes[INTEGRALS + i, g] = t * (x0 + t * (p2 * r0 + t * (p3 * q1 + t * (p4 * q2))))
        elif abs(rate) * lanes[GOALS, count - 1] < 1.0:
            for g in range(count):
                t = lanes[GOALS, g]
                p1, p2 = near_phis(rate * t)
                lanes[values + i, g] = x0 + t * (p1 * r0)
                lanes[INTEGRALS + i, g] = t * (x0 + t * (p2 * r0))
        elif abs(rate) * lanes[GOALS, 0] >= 1.0:
            for g in range(count):
                t = lanes[GOALS, g]
                p1, p2 = far_phis(rate * t)
                lanes[values + i, g] = x0 + t * (p1 * r0)
                lanes[INTEGRALS + i, g] = t * (x0 + t * (p2 * r0))
        else:
            for g in range(count):
                t = lanes[GOALS, g]
                p1, p2, _, _ = real_phis(rate * t)
                lanes[values + i, g] = x0 + t * (p1 * r0)
                lanes[INTEGRALS + i, g] = t * (x0 + t * (p2 * r0))
    for k in range(n_real, n_real + n_pairs):
        m = k + n_pairs
        re, im = modal[c, RATES, k], modal[c, RATES, m]
        _grow(re, im, lanes)
        x0, y0, r0, s0 = modes[XI, k], modes[XI, m], modes[RATE, k], modes[RATE, m]
        q1, w1, q2, w2 = (modes[SLOPE, k], modes[SLOPE, m], 2.0 * modes[BEND, k],
                          2.0 * modes[BEND, m])
        for g in range(count):
            t = lanes[GOALS, g]
            p1, o1, p2, o2, p3, o3, p4, o4 = pair_phis(
                re * t, im * t, lanes[GROWN, g], lanes[GROWN + 1, g])
            lanes[values + k, g] = x0 + t * (p1 * r0 - o1 * s0 + t * (
                p2 * q1 - o2 * w1 + t * (p3 * q2 - o3 * w2)))
            lanes[values + m, g] = y0 + t * (p1 * s0 + o1 * r0 + t * (
                p2 * w1 + o2 * q1 + t * (p3 * w2 + o3 * q2)))
            lanes[INTEGRALS + k, g] = t * (x0 + t * (p2 * r0 - o2 * s0 + t * (
                p3 * q1 - o3 * w1 + t * (p4 * q2 - o4 * w2))))
            lanes[INTEGRALS + m, g] = t * (y0 + t * (p2 * s0 + o2 * r0 + t * (
                p3 * w1 + o3 * q1 + t * (p4 * w2 + o4 * q2))))


@jit_part
def _grow(re: float, im: float, lanes: FloatArray) -> None:
    # exp(z) - 1 at all points: its series for a part of z, doubled as often as is needed.
    count = lanes.shape[1]
    size = (abs(re) + abs(im)) * lanes[GOALS, count - 1]
    share, halvings = 1.0, 0
    while size * share > SERIES:
        share *= 0.5
        halvings += 1
    for g in range(count):
        t = lanes[GOALS, g] * share
        a, b = re * t, im * t
        x, y = T6 + a * T7, b * T7
        x, y = T5 + a * x - b * y, a * y + b * x
        x, y = T4 + a * x - b * y, a * y + b * x
        x, y = T3 + a * x - b * y, a * y + b * x
        x, y = T2 + a * x - b * y, a * y + b * x
        x, y = 1.0 + a * x - b * y, a * y + b * x
        lanes[GROWN, g], lanes[GROWN + 1, g] = a * x - b * y, a * y + b * x
    for _ in range(halvings):
        for g in range(count):
            x, y = lanes[GROWN, g], lanes[GROWN + 1, g]
            lanes[GROWN, g], lanes[GROWN + 1, g] = x * (2.0 + x) - y * y, 2.0 * y * (1.0 + x)


@jit_part
def combine(matrices: FloatArray, c: int, first: int, rows: int, count: int, lanes: FloatArray,
            source: int, target: int) -> None:
    """Put some rows of a matrix times ``count`` rows of the lanes into others of them."""
    for o in range(rows):
        a0, a1, a2, a3, a4, a5, a6, a7 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(count):
            w = matrices[c, first + o, i]
            a0 += w * lanes[source + i, 0]
            a1 += w * lanes[source + i, 1]
            a2 += w * lanes[source + i, 2]
            a3 += w * lanes[source + i, 3]
            a4 += w * lanes[source + i, 4]
            a5 += w * lanes[source + i, 5]
            a6 += w * lanes[source + i, 6]
            a7 += w * lanes[source + i, 7]
        (lanes[target + o, 0], lanes[target + o, 1], lanes[target + o, 2],
         lanes[target + o, 3]) = a0, a1, a2, a3
        (lanes[target + o, 4], lanes[target + o, 5], lanes[target + o, 6],
         lanes[target + o, 7]) = a4, a5, a6, a7


@jit_part
def read(plant: Packed, c: int, work: Work) -> None:
    """Fill the lanes for their goals: what is driven under voltages and efforts of a step."""
    efforts, lanes, few = work.efforts, work.lanes, work.few
    n, count = plant.bases.shape[2], plant.counts[c, EFFORTS]
    values = INTEGRALS + n
    spread(c, plant.modal, plant.counts[c, REALS], plant.counts[c, PAIRS], work.modes, lanes,
           values)
    for i in range(2):
        for g in range(LANES):
            lanes[values + n + i, g] = few[U, i] + lanes[GOALS, g] * few[DU, i]
    for e in range(count):
        for g in range(LANES):
            t = lanes[GOALS, g]
            lanes[values + n + 2 + e, g] = efforts[F, e] + t * (
                efforts[PARABOLA, e] + t * efforts[PARABOLA + 1, e])
    combine(plant.outputs, c, 0, ROWS, n + 2 + count, lanes, values, OUTPUTS)
    combine(plant.modal, c, MOTION, 4, n, lanes, INTEGRALS, DRIVEN)


@jit_part
def sine_of(angle: float) -> float:
    """Return the sine [1] of an angle that is mostly small [rad]."""
    if abs(angle) > SMALL_ANGLE:
        return math.sin(angle)
    square = angle * angle
    return angle * (1.0 - square * T3 * (1.0 - square / 20.0 * (1.0 - square / 42.0 * (
        1.0 - square / 72.0))))


@jit_part
def go(width: float, went: float, turned: float, few: FloatArray, lanes: FloatArray, g: int
       ) -> tuple[float, float, float, float]:
    """
    Follow the base from the last point to the point ``g``.

    Corrected trapezoid of the sine and of the missing part of the cosine.

    Parameters
    ----------
    width, went, turned : float
        Time [s], way [m] and turn [rad] between the points.
    few, lanes, g
        With speed, yaw rate and their derivatives at the last point, and at the point.

    Returns
    -------
    tuple of float
        The way along and across the last direction [m], the sine of the turn and what its cosine
        is less than one.

    """
    speed, rate = lanes[OUTPUTS + 2, g], lanes[OUTPUTS + 3, g]
    acceleration = lanes[OUTPUTS + ACCELERATION, g]
    sine, half = sine_of(turned), sine_of(0.5 * turned)
    less = -2.0 * half * half
    twelfth = width * width / 12.0
    along = went + 0.5 * width * speed * less - twelfth * (
        acceleration * less - speed * rate * sine)
    across = 0.5 * width * speed * sine + twelfth * (
        few[LAST, 0] * few[LAST, 1] - acceleration * sine - speed * rate * (1.0 + less))
    return along, across, sine, less


@jit_part
def go_by_arc(went: float, turned: float) -> tuple[float, float, float, float]:
    """Return, as :func:`go`, what an arc of this way [m] and turn [rad] does."""
    half = 0.5 * turned
    sine, quarter = sine_of(half), sine_of(0.5 * half)
    cosine = 1.0 - 2.0 * quarter * quarter
    chord = went * (sine / half) if half != 0.0 else went
    return chord * cosine, chord * sine, 2.0 * sine * cosine, -2.0 * sine * sine


@jit_part
def write_row(out: FloatArray, place: int, lanes: FloatArray, g: int, s: FloatArray, n: int
              ) -> None:
    """Write an output row."""
    for i in range(7):
        out[place, i] = lanes[OUTPUTS + i, g]
    for i in range(4):
        out[place, 7 + i] = s[n + i] + lanes[DRIVEN + i, g]
    for i in range(2):
        out[place, 11 + i] = s[n + 4 + i]
        out[place, 13 + i] = lanes[OUTPUTS + 7 + i, g]
