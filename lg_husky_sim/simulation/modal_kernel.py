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
from typing import NamedTuple

from lg_husky_sim.jit import jit_part
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray


class Packed(NamedTuple):
    """
    What the kernel needs of a plant; the first axis counts its sets of matrices.

    Parameters
    ----------
    onset : numpy.ndarray, shape (2,)
        Kind (0: first set always; 1: second set from time [s] on; 2: second set where x is at or
        beyond a place [m]; 3: before it) and the value.
    stages : numpy.ndarray, shape (n_sets, 8)
        Latency [s], slew forward and yaw [m/s², rad/s²], limit forward and yaw [m/s, rad/s],
        volts per speed and per yaw rate [V·s/m, V·s/rad], clamp [V] (0: none).
    counts : numpy.ndarray, shape (n_sets, 7)
        Real modes, pairs, efforts; whether efforts need the pose, a memory, the voltages, what
        their arguments add up to.
    rates : numpy.ndarray, shape (n_sets, n_modes)
        Of the modes [1/s].
    out_of, into : numpy.ndarray, shapes (n_sets, n, n_modes), (n_sets, n_modes, n)
        States of modes, modes of states.
    bm, gm : numpy.ndarray, shapes (n_sets, 2 or n_efforts, n_modes)
        What voltages and efforts do to the modes.
    hm, k : numpy.ndarray, shapes (n_sets, n_modes or 2, n_arguments)
        Arguments of the efforts.
    cy : numpy.ndarray, shape (n_sets, 11, n + 2 + n_efforts)
        Outputs of the plant, then the derivatives of yaw rate and speed: of modes, voltages and
        efforts.
    ci : numpy.ndarray, shape (n_sets, 4, n)
        Wheel rates, speed and yaw rate.
    laws, coefficients, offsets : numpy.ndarray, shapes (n_sets, n_efforts[, laws.WIDTH])
    first_step : numpy.ndarray, shape (n_sets, 1)
        After a jump [s].
    """

    onset: FloatArray
    stages: FloatArray
    counts: NDArray[np.int64]
    rates: FloatArray
    out_of: FloatArray
    into: FloatArray
    bm: FloatArray
    gm: FloatArray
    hm: FloatArray
    k: FloatArray
    cy: FloatArray
    ci: FloatArray
    laws: FloatArray
    coefficients: FloatArray
    offsets: FloatArray
    first_step: FloatArray


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
def phis(t: float, rates: FloatArray, c: int, n_real: int, n_pairs: int, p: FloatArray) -> None:
    """Put phi_1 to phi_4 of rates times ``t`` [s] into the rows 0 to 3 of ``p[0]``."""
    for i in range(p.shape[2]):
        p[0, 0, i], p[0, 1, i], p[0, 2, i], p[0, 3, i] = real_phis(rates[c, i] * t)
    for k in range(n_real, n_real + n_pairs):
        m = k + n_pairs
        re, im = rates[c, k] * t, rates[c, m] * t
        size = math.exp(re)
        (p[0, 0, k], p[0, 0, m], p[0, 1, k], p[0, 1, m], p[0, 2, k], p[0, 2, m], p[0, 3, k],
         p[0, 3, m]) = pair_phis(re, im, size * math.cos(im) - 1.0, size * math.sin(im))


@jit_part
def doubled(t: float, rates: FloatArray, c: int, n_real: int, n_pairs: int, p: FloatArray,
            k0: int) -> None:
    """
    Put phi_k of rates times 2 ``t`` into ``p[k0 + 1]``, from those at ``t`` [s] in ``p[k0]``.

    2^k phi_k(2z) = exp(z) phi_k(z) + sum of phi_j(z)/(k - j)! for j = 1 to k.
    """
    for i in range(p.shape[2]):
        f1, f2, f3, f4 = p[k0, 0, i], p[k0, 1, i], p[k0, 2, i], p[k0, 3, i]
        e = 1.0 + rates[c, i] * t * f1
        p[k0 + 1, 0, i] = 0.5 * (e * f1 + f1)
        p[k0 + 1, 1, i] = 0.25 * (e * f2 + f1 + f2)
        p[k0 + 1, 2, i] = 0.125 * (e * f3 + 0.5 * f1 + f2 + f3)
        p[k0 + 1, 3, i] = 0.0625 * (e * f4 + T3 * f1 + 0.5 * f2 + f3 + f4)
    for k in range(n_real, n_real + n_pairs):
        m = k + n_pairs
        re, im = rates[c, k] * t, rates[c, m] * t
        a = 1.0 + re * p[k0, 0, k] - im * p[k0, 0, m]
        b = re * p[k0, 0, m] + im * p[k0, 0, k]
        for i in range(4):
            f, g = p[k0, i, k], p[k0, i, m]
            p[k0 + 1, i, k], p[k0 + 1, i, m] = a * f - b * g, a * g + b * f
        for i in (k, m):
            f1, f2, f3, f4 = p[k0, 0, i], p[k0, 1, i], p[k0, 2, i], p[k0, 3, i]
            p[k0 + 1, 0, i] = 0.5 * (p[k0 + 1, 0, i] + f1)
            p[k0 + 1, 1, i] = 0.25 * (p[k0 + 1, 1, i] + f1 + f2)
            p[k0 + 1, 2, i] = 0.125 * (p[k0 + 1, 2, i] + 0.5 * f1 + f2 + f3)
            p[k0 + 1, 3, i] = 0.0625 * (p[k0 + 1, 3, i] + T3 * f1 + 0.5 * f2 + f3 + f4)


@jit_part
def advance(t: float, first: int, xi: FloatArray, r: FloatArray, q: FloatArray, p: FloatArray,
            node: int, n_real: int, n_pairs: int, out: FloatArray) -> None:
    """
    Put the modes (``first`` = 0) or their integrals (1) at ``t`` [s] into ``out``.

    ``q`` holds q_1 and q_2 in its rows, ``p[node]`` the phis.
    """
    begin = 1.0 if first == 0 else t
    scale = t if first == 0 else t * t
    scale1 = scale * t
    scale2 = 2.0 * scale1 * t
    for i in range(out.size):
        out[i] = begin * xi[i] + scale * (p[node, first, i] * r[i]) + (
            scale1 * (p[node, first + 1, i] * q[0, i])
            + scale2 * (p[node, first + 2, i] * q[1, i]))
    for k in range(n_real, n_real + n_pairs):
        m = k + n_pairs
        real = scale * (p[node, first, k] * r[k] - p[node, first, m] * r[m])
        imag = scale * (p[node, first, k] * r[m] + p[node, first, m] * r[k])
        for d in range(2):
            factor = scale1 if d == 0 else scale2
            f, g = p[node, first + 1 + d, k], p[node, first + 1 + d, m]
            real += factor * (f * q[d, k] - g * q[d, m])
            imag += factor * (f * q[d, m] + g * q[d, k])
        out[k] = begin * xi[k] + real
        out[m] = begin * xi[m] + imag


@jit_part
def rate_of(c: int, rates: FloatArray, n_real: int, n_pairs: int, xi: FloatArray,
            q: FloatArray, out: FloatArray) -> None:
    """Put lambda xi + q into ``out``."""
    for i in range(out.size):
        out[i] = rates[c, i] * xi[i] + q[i]
    for k in range(n_real, n_real + n_pairs):
        m = k + n_pairs
        out[k] = rates[c, k] * xi[k] - rates[c, m] * xi[m] + q[k]
        out[m] = rates[c, k] * xi[m] + rates[c, m] * xi[k] + q[m]


@jit_part
def add_product(matrices: FloatArray, c: int, vector: FloatArray, count: int,
                out: FloatArray) -> None:
    """Add matrix times vector to ``out``; row j of the stored matrix is its column j."""
    for j in range(count):
        value = vector[j]
        for i in range(out.size):
            out[i] += matrices[c, j, i] * value
