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

import cmath
import math
from typing import NamedTuple

from lg_husky_sim.jit import jit_call, jit_part
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
    counts : numpy.ndarray, shape (n_sets, 6)
        Real modes, pairs, efforts; whether efforts need the pose, a memory, the voltages.
    rates : numpy.ndarray, shape (n_sets, n_modes)
        Of the modes [1/s].
    out_of, into : numpy.ndarray, shapes (n_sets, n, n_modes), (n_sets, n_modes, n)
        States of modes, modes of states.
    bm, gm : numpy.ndarray, shapes (n_sets, 2 or n_efforts, n_modes)
        What voltages and efforts do to the modes.
    hm, k : numpy.ndarray, shapes (n_sets, n_modes or 2, n_arguments)
        Arguments of the efforts.
    cy, cu, cf : numpy.ndarray, shapes (n_sets, n_modes, 2 or n_efforts, 12)
        Outputs of the plant, then the derivatives of yaw rate and speed.
    ci : numpy.ndarray, shape (n_sets, n_modes, 4)
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
    cu: FloatArray
    cf: FloatArray
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


@jit_call
def phis(t: float, rates: FloatArray, c: int, n_real: int, n_pairs: int, p: FloatArray) -> None:
    """
    Put phi_1 to phi_4 of rates times ``t`` [s] into the rows of ``p``.

    Without branches for the real modes, so that they fill the vectors of the processor.
    """
    for i in range(p.shape[1]):
        z = rates[c, i] * t
        # exp(z) - 1 by its series for z/1024, doubled ten times.
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
        e = e * (2.0 + e)
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
        f1 = e * far
        f2 = (f1 - 1.0) * far
        f3 = (f2 - T2) * far
        f4 = (f3 - T3) * far
        p[0, i] = s1 if near else f1
        p[1, i] = s2 if near else f2
        p[2, i] = s3 if near else f3
        p[3, i] = s4 if near else f4
    for k in range(n_real, n_real + n_pairs):
        v = complex(rates[c, k] * t, rates[c, k + n_pairs] * t)
        if abs(v) < 1.0:
            g = complex(T17, 0.0)
            g = T16 + v * g
            g = T15 + v * g
            g = T14 + v * g
            g = T13 + v * g
            g = T12 + v * g
            g = T11 + v * g
            g = T10 + v * g
            g = T9 + v * g
            g = T8 + v * g
            g = T7 + v * g
            g = T6 + v * g
            g = T5 + v * g
            g4 = T4 + v * g
            g3 = T3 + v * g4
            g2 = T2 + v * g3
            g1 = 1.0 + v * g2
        else:
            g1 = (cmath.exp(v) - 1.0) / v
            g2 = (g1 - 1.0) / v
            g3 = (g2 - T2) / v
            g4 = (g3 - T3) / v
        p[0, k], p[0, k + n_pairs] = g1.real, g1.imag
        p[1, k], p[1, k + n_pairs] = g2.real, g2.imag
        p[2, k], p[2, k + n_pairs] = g3.real, g3.imag
        p[3, k], p[3, k + n_pairs] = g4.real, g4.imag


@jit_call
def advance(t: float, first: int, xi: FloatArray, r: FloatArray, q: FloatArray, p: FloatArray,
            n_real: int, n_pairs: int, degree: int, out: FloatArray) -> None:
    """
    Put the modes (``first`` = 0) or their integrals (1) at ``t`` [s] into ``out``.

    ``q`` holds q_1 and q_2 in its rows; ``degree`` is that of the forcing.
    """
    scale = t
    if first == 0:
        for i in range(out.size):
            out[i] = xi[i] + scale * (p[0, i] * r[i])
    else:
        scale = t * t
        for i in range(out.size):
            out[i] = t * xi[i] + scale * (p[1, i] * r[i])
    if degree > 0:
        scale1 = scale * t
        scale2 = 2.0 * scale1 * t
        for i in range(out.size):
            out[i] += scale1 * (p[first + 1, i] * q[0, i]) + scale2 * (
                p[first + 2, i] * q[1, i])
    for k in range(n_real, n_real + n_pairs):
        m = k + n_pairs
        real = p[first, k] * r[k] - p[first, m] * r[m]
        imag = p[first, k] * r[m] + p[first, m] * r[k]
        real *= scale
        imag *= scale
        if degree > 0:
            for d in range(2):
                factor = scale1 if d == 0 else scale2
                real += factor * (p[first + 1 + d, k] * q[d, k] - p[first + 1 + d, m] * q[d, m])
                imag += factor * (p[first + 1 + d, k] * q[d, m] + p[first + 1 + d, m] * q[d, k])
        begin = 1.0 if first == 0 else t
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
