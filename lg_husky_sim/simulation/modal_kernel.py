# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Parts of the event-driven kernel: modes under a forcing that is a polynomial of time.

With xi' = lambda xi + q_0 + q_1 t + q_2 t² and r = lambda xi_0 + q_0::

    xi(t)          = xi_0 + t phi_1 r + t² phi_2 q_1 + 2 t³ phi_3 q_2
    int_0^t xi ds  = t xi_0 + t² phi_2 r + t³ phi_3 q_1 + 2 t⁴ phi_4 q_2

where phi_k is that of lambda t: phi_1(z) = (exp(z) - 1)/z, phi_{k+1}(z) = (phi_k(z) - 1/k!)/z.
Vectors hold the real modes first, then the real parts of the pairs, then their imaginary parts.
"""

from __future__ import annotations

import math

from lg_husky_sim.jit import jit_part
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation.arrays import BEND, INSIDE, PHI, RATE, RATES, SLOPE, XI

#: Factors: divisions would cost most of a step.
_T = tuple(1.0 / math.factorial(k) for k in range(18))
T1, T2, T3, T4, T5, T6, T7, T8, T9 = _T[1:10]
T10, T11, T12, T13, T14, T15, T16, T17 = _T[10:18]
#: Halvings of an argument before its series, and the largest argument [-] that counts: beyond
#: it the exponential is nothing.
HALVINGS, FAR = 10, 50.0
SMALL = 1.0 / 2.0 ** HALVINGS


@jit_part
def growth(z: float) -> float:
    """Return exp(z) - 1 for z <= 0 by its series for z/1024, doubled ten times: no branches."""
    y = max(z, -FAR) * SMALL
    e = y * (1.0 + y * (T2 + y * (T3 + y * (T4 + y * (T5 + y * (T6 + y * T7))))))
    e = e * (2.0 + e)
    e = e * (2.0 + e)
    e = e * (2.0 + e)
    e = e * (2.0 + e)
    e = e * (2.0 + e)
    e = e * (2.0 + e)
    e = e * (2.0 + e)
    e = e * (2.0 + e)
    e = e * (2.0 + e)
    return e * (2.0 + e)


@jit_part
def near_phis(w: float) -> tuple[float, float]:
    """Return phi_1 and phi_2 where no argument of several is as large as one."""
    low = w * w
    high = low * low
    s4 = (((T4 + w * T5) + low * (T6 + w * T7))
          + high * ((T8 + w * T9) + low * (T10 + w * T11))
          + high * high * ((T12 + w * T13) + low * (T14 + w * T15)))
    s2 = T2 + w * (T3 + w * s4)
    return 1.0 + w * s2, s2


@jit_part
def far_phis(z: float) -> tuple[float, float]:
    """Return phi_1 and phi_2 where none of several is smaller."""
    far = 1.0 / z
    f1 = growth(z) * far
    return f1, (f1 - 1.0) * far


@jit_part
def real_phis(z: float) -> tuple[float, float, float, float]:
    """Return phi_1 to phi_4, without branches: the processor's vectors take several at once."""
    near = abs(z) < 1.0
    w = z if near else 1.0
    far = 1.0 / (1.0 if near else z)
    low = w * w
    high = low * low
    s4 = (((T4 + w * T5) + low * (T6 + w * T7))
          + high * ((T8 + w * T9) + low * (T10 + w * T11))
          + high * high * ((T12 + w * T13) + low * (T14 + w * T15)))
    s3 = T3 + w * s4
    s2 = T2 + w * s3
    s1 = 1.0 + w * s2
    f1 = growth(z) * far
    f2 = (f1 - 1.0) * far
    f3 = (f2 - T2) * far
    f4 = (f3 - T3) * far
    return (s1 if near else f1, s2 if near else f2, s3 if near else f3, s4 if near else f4)


@jit_part
def pair_phis(re: float, im: float, e_re: float, e_im: float) -> tuple[
        float, float, float, float, float, float, float, float]:
    """Return the real and imaginary parts of phi_1 to phi_4 of z, given exp(z) - 1."""
    square = re * re + im * im
    near = square < 1.0
    a, b = (re if near else 0.0), (im if near else 0.0)
    x, y = T16 + a * T17, b * T17
    x, y = T15 + a * x - b * y, a * y + b * x
    x, y = T14 + a * x - b * y, a * y + b * x
    x, y = T13 + a * x - b * y, a * y + b * x
    x, y = T12 + a * x - b * y, a * y + b * x
    x, y = T11 + a * x - b * y, a * y + b * x
    x, y = T10 + a * x - b * y, a * y + b * x
    x, y = T9 + a * x - b * y, a * y + b * x
    x, y = T8 + a * x - b * y, a * y + b * x
    x, y = T7 + a * x - b * y, a * y + b * x
    x, y = T6 + a * x - b * y, a * y + b * x
    x, y = T5 + a * x - b * y, a * y + b * x
    x4, y4 = T4 + a * x - b * y, a * y + b * x
    x3, y3 = T3 + a * x4 - b * y4, a * y4 + b * x4
    x2, y2 = T2 + a * x3 - b * y3, a * y3 + b * x3
    x1, y1 = 1.0 + a * x2 - b * y2, a * y2 + b * x2
    far = 1.0 / (1.0 if near else square)
    a, b = re * far, -im * far
    f1, g1 = a * e_re - b * e_im, a * e_im + b * e_re
    f2, g2 = a * (f1 - 1.0) - b * g1, a * g1 + b * (f1 - 1.0)
    f3, g3 = a * (f2 - T2) - b * g2, a * g2 + b * (f2 - T2)
    f4, g4 = a * (f3 - T3) - b * g3, a * g3 + b * (f3 - T3)
    return (x1 if near else f1, y1 if near else g1, x2 if near else f2, y2 if near else g2,
            x3 if near else f3, y3 if near else g3, x4 if near else f4, y4 if near else g4)


@jit_part
def phis(t: float, modal: FloatArray, c: int, n_real: int, n_pairs: int, modes: FloatArray
         ) -> None:
    """Put phi_1 to phi_4 of the rates times ``t`` [s] into the rows from PHI on."""
    for i in range(modes.shape[1]):
        (modes[PHI, i], modes[PHI + 1, i], modes[PHI + 2, i], modes[PHI + 3, i]) = real_phis(
            modal[c, RATES, i] * t)
    for k in range(n_real, n_real + n_pairs):
        m = k + n_pairs
        re, im = modal[c, RATES, k] * t, modal[c, RATES, m] * t
        size = math.exp(re)
        (modes[PHI, k], modes[PHI, m], modes[PHI + 1, k], modes[PHI + 1, m], modes[PHI + 2, k],
         modes[PHI + 2, m], modes[PHI + 3, k], modes[PHI + 3, m]) = pair_phis(
            re, im, size * math.cos(im) - 1.0, size * math.sin(im))


@jit_part
def added(t: float, ratio: float, modal: FloatArray, c: int, n_real: int, n_pairs: int,
          modes: FloatArray, p: int, q: int, d: int) -> None:
    """
    Put phi_k of the rates times (1 + ratio) ``t`` into the rows from ``d`` on.

    Those at ``t`` are in the rows from ``p`` on, those at ``ratio t`` from ``q`` on: with r for
    the ratio, z = lambda t and j = 1 to k, (1 + r)^k phi_k(z + r z) = r^k exp(z) phi_k(r z) +
    sum of r^(k - j) phi_j(z)/(k - j)!.
    """
    r2 = ratio * ratio
    s1 = 1.0 / (1.0 + ratio)
    s2, s3, s4 = s1 * s1, s1 * s1 * s1, s1 * s1 * s1 * s1
    for i in range(modes.shape[1]):
        f1, f2, f3, f4 = modes[p, i], modes[p + 1, i], modes[p + 2, i], modes[p + 3, i]
        e = 1.0 + modal[c, RATES, i] * t * f1
        modes[d, i] = s1 * (ratio * e * modes[q, i] + f1)
        modes[d + 1, i] = s2 * (r2 * e * modes[q + 1, i] + ratio * f1 + f2)
        modes[d + 2, i] = s3 * (ratio * r2 * e * modes[q + 2, i] + 0.5 * r2 * f1 + ratio * f2 + f3)
        modes[d + 3, i] = s4 * (r2 * r2 * e * modes[q + 3, i] + T3 * ratio * r2 * f1
                                + 0.5 * r2 * f2 + ratio * f3 + f4)
    for k in range(n_real, n_real + n_pairs):
        m = k + n_pairs
        re, im = modal[c, RATES, k] * t, modal[c, RATES, m] * t
        a = 1.0 + re * modes[p, k] - im * modes[p, m]
        b = re * modes[p, m] + im * modes[p, k]
        for i in range(4):
            f, g = modes[q + i, k], modes[q + i, m]
            modes[d + i, k], modes[d + i, m] = a * f - b * g, a * g + b * f
        for i in range(k, m + 1, n_pairs):
            f1, f2, f3, f4 = modes[p, i], modes[p + 1, i], modes[p + 2, i], modes[p + 3, i]
            modes[d, i] = s1 * (ratio * modes[d, i] + f1)
            modes[d + 1, i] = s2 * (r2 * modes[d + 1, i] + ratio * f1 + f2)
            modes[d + 2, i] = s3 * (ratio * r2 * modes[d + 2, i] + 0.5 * r2 * f1 + ratio * f2 + f3)
            modes[d + 3, i] = s4 * (r2 * r2 * modes[d + 3, i] + T3 * ratio * r2 * f1
                                    + 0.5 * r2 * f2 + ratio * f3 + f4)


@jit_part
def advance(t: float, first: int, modes: FloatArray, p: int, n_real: int, n_pairs: int) -> None:
    """
    Put the modes (``first`` = 0) or their integrals (1) at ``t`` [s] into the row INSIDE.

    Their phis are in the rows from ``p`` on.
    """
    begin = 1.0 if first == 0 else t
    scale = t if first == 0 else t * t
    scale1 = scale * t
    scale2 = 2.0 * scale1 * t
    p += first
    for i in range(modes.shape[1]):
        modes[INSIDE, i] = begin * modes[XI, i] + scale * (modes[p, i] * modes[RATE, i]) + (
            scale1 * (modes[p + 1, i] * modes[SLOPE, i])
            + scale2 * (modes[p + 2, i] * modes[BEND, i]))
    for k in range(n_real, n_real + n_pairs):
        m = k + n_pairs
        real = scale * (modes[p, k] * modes[RATE, k] - modes[p, m] * modes[RATE, m])
        imag = scale * (modes[p, k] * modes[RATE, m] + modes[p, m] * modes[RATE, k])
        for d in range(2):
            factor = scale1 if d == 0 else scale2
            f, g = modes[p + 1 + d, k], modes[p + 1 + d, m]
            real += factor * (f * modes[SLOPE + d, k] - g * modes[SLOPE + d, m])
            imag += factor * (f * modes[SLOPE + d, m] + g * modes[SLOPE + d, k])
        modes[INSIDE, k] = begin * modes[XI, k] + real
        modes[INSIDE, m] = begin * modes[XI, m] + imag


@jit_part
def rate_of(c: int, modal: FloatArray, n_real: int, n_pairs: int, modes: FloatArray, force: int
            ) -> None:
    """Put lambda xi + q into the row RATE; the row ``force`` has q."""
    for i in range(modes.shape[1]):
        modes[RATE, i] = modal[c, RATES, i] * modes[XI, i] + modes[force, i]
    for k in range(n_real, n_real + n_pairs):
        m = k + n_pairs
        modes[RATE, k] = (modal[c, RATES, k] * modes[XI, k]
                          - modal[c, RATES, m] * modes[XI, m] + modes[force, k])
        modes[RATE, m] = (modal[c, RATES, k] * modes[XI, m]
                          + modal[c, RATES, m] * modes[XI, k] + modes[force, m])
