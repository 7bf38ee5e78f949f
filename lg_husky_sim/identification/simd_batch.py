# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Equation (23) for many candidates at once, the objective inside the loop.

Candidates run side by side in the lanes of a batch of 16, so that one machine instruction
(SIMD) serves several of them. Where numba is absent the same formulas run on arrays of all
candidates.
"""

from __future__ import annotations

from lg_husky_sim.identification.modal_decoupling import DecoupledModes
from lg_husky_sim.jit import compiled, jit
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

IntArray = NDArray[np.int64]
#: Candidates that run side by side.
LANES = 16
#: Terms of the exponential's series after scaling.
TERMS = 9
#: Rows of a mode's operator: three states and the integral of the body rate.
ROWS = 4


@jit
def _exponentials(maps: FloatArray) -> None:
    # Each 4 x 4 map in place, from its generator to its hold. Columns are three states and the
    # input, rows three states and the integral: Taylor series after scaling to a norm below
    # 1/4, then squaring, with the products that such maps need and no others.
    total = np.empty((4, 4))
    other = np.empty((4, 4))
    for index in range(maps.shape[0]):
        x = maps[index]
        norm = 0.0
        for i in range(4):
            norm = max(norm, abs(x[i, 0]) + abs(x[i, 1]) + abs(x[i, 2]) + abs(x[i, 3]))
        squarings = 0
        scale = 1.0
        while norm * scale > 0.25 and squarings < 60:
            squarings += 1
            scale *= 0.5
        for i in range(4):
            for j in range(4):
                x[i, j] *= scale
                total[i, j] = 0.0
            if i < 3:
                total[i, i] = 1.0
        for term in range(TERMS, 0, -1):
            share = 1.0 / term
            for i in range(4):
                for j in range(4):
                    value = (x[i, 0] * total[0, j] + x[i, 1] * total[1, j]
                             + x[i, 2] * total[2, j])
                    if j == 3:
                        value += x[i, 3]
                    other[i, j] = value * share
            for i in range(4):
                for j in range(4):
                    total[i, j] = other[i, j]
                if i < 3:
                    total[i, i] += 1.0
        for _ in range(squarings):
            for i in range(4):
                for j in range(4):
                    value = (total[i, 0] * total[0, j] + total[i, 1] * total[1, j]
                             + total[i, 2] * total[2, j])
                    if j == 3:
                        value += total[i, 3]
                    if i == 3:
                        value += total[3, j]
                    other[i, j] = value
            for i in range(4):
                for j in range(4):
                    total[i, j] = other[i, j]
        for i in range(4):
            for j in range(4):
                x[i, j] = total[i, j]


def operators(modes: DecoupledModes, period: float) -> FloatArray:
    """
    Return the exact hold of each mode of each candidate.

    Parameters
    ----------
    modes : DecoupledModes
        Of n candidates.
    period : float
        Step [s].

    Returns
    -------
    numpy.ndarray, shape (2, ROWS, 4, n_candidates)
        Columns are the three states and the input; the last row is the integral of the body
        rate over the step (distance, or turn).

    """
    count = modes.a.shape[0]
    maps = np.zeros((count, 2, ROWS, 4))
    maps[:, :, :3, :3] = modes.a * period
    maps[:, :, :3, 3] = modes.b * period
    maps[:, :, 3, 1] = period
    if compiled():
        _exponentials(maps.reshape(2 * count, ROWS, 4))
    else:
        blocks = np.zeros((count, 2, 5, 5))
        blocks[:, :, :ROWS, :3] = maps[:, :, :, :3]
        blocks[:, :, :ROWS, 4] = maps[:, :, :, 3]
        maps = expm(blocks)[:, :, :ROWS][:, :, :, [0, 1, 2, 4]]
    return np.ascontiguousarray(maps.transpose(1, 2, 3, 0))


@jit
def _lanes(op: FloatArray, stage: FloatArray, begin: FloatArray, commands: FloatArray,
           steps: IntArray, shares: FloatArray, targets: FloatArray, out: FloatArray) -> None:
    # 16 candidates: op (32 * 16), stage (3 * 16), out (16) are flat, candidates fastest.
    s = np.empty(15 * 16)
    for j in range(16):
        for k in range(6):
            s[k * 16 + j] = begin[k]
        s[6 * 16 + j] = begin[6]
        s[7 * 16 + j] = begin[7]
        s[8 * 16 + j] = np.cos(begin[8])
        s[9 * 16 + j] = np.sin(begin[8])
        s[10 * 16 + j] = begin[6]
        s[11 * 16 + j] = begin[7]
    place = 0
    for step in range(commands.shape[0]):
        forward = commands[step, 0]
        yaw = commands[step, 1]
        for j in range(16):
            mean = stage[j] * forward
            half = stage[16 + j] * yaw
            limit = stage[32 + j]
            left = max(-limit, min(limit, mean - half))
            right = max(-limit, min(limit, mean + half))
            u = 0.5 * (left + right)
            a = s[j]
            b = s[16 + j]
            c = s[32 + j]
            s[j] = op[j] * a + op[16 + j] * b + op[32 + j] * c + op[48 + j] * u
            s[16 + j] = op[64 + j] * a + op[80 + j] * b + op[96 + j] * c + op[112 + j] * u
            s[32 + j] = op[128 + j] * a + op[144 + j] * b + op[160 + j] * c + op[176 + j] * u
            path = op[192 + j] * a + op[208 + j] * b + op[224 + j] * c + op[240 + j] * u
            u = 0.5 * (right - left)
            a = s[48 + j]
            b = s[64 + j]
            c = s[80 + j]
            s[48 + j] = op[256 + j] * a + op[272 + j] * b + op[288 + j] * c + op[304 + j] * u
            s[64 + j] = op[320 + j] * a + op[336 + j] * b + op[352 + j] * c + op[368 + j] * u
            s[80 + j] = op[384 + j] * a + op[400 + j] * b + op[416 + j] * c + op[432 + j] * u
            half = 0.5 * (op[448 + j] * a + op[464 + j] * b + op[480 + j] * c + op[496 + j] * u)
            q = half * half
            cosine = 1.0 - q / 2.0 * (1.0 - q / 12.0 * (1.0 - q / 30.0 * (
                1.0 - q / 56.0 * (1.0 - q / 90.0))))
            ratio = 1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (
                1.0 - q / 72.0 * (1.0 - q / 110.0))))
            sine = half * ratio
            chord = path * ratio
            c0 = s[128 + j]
            d0 = s[144 + j]
            c1 = c0 * cosine - d0 * sine
            d1 = d0 * cosine + c0 * sine
            s[160 + j] = s[96 + j]
            s[176 + j] = s[112 + j]
            s[96 + j] += chord * c1
            s[112 + j] += chord * d1
            s[128 + j] = c1 * cosine - d1 * sine
            s[144 + j] = d1 * cosine + c1 * sine
        while place < steps.size and steps[place] == step:
            share = shares[place]
            x = targets[place, 0]
            y = targets[place, 1]
            for j in range(16):
                out[j] += abs(s[160 + j] + share * (s[96 + j] - s[160 + j]) - x)
                out[j] += abs(s[176 + j] + share * (s[112 + j] - s[176 + j]) - y)
            place += 1


@jit
def _all_lanes(op: FloatArray, stage: FloatArray, begin: FloatArray, commands: FloatArray,
               steps: IntArray, shares: FloatArray, targets: FloatArray, out: FloatArray
               ) -> None:
    for block in range(op.shape[0]):
        _lanes(op[block], stage[block], begin, commands, steps, shares, targets, out[block])


def _blocks(op: FloatArray, stage: FloatArray) -> tuple[FloatArray, FloatArray]:
    # Candidates in blocks of LANES, the last one filled up with copies of the last candidate.
    count = op.shape[-1]
    padded = np.minimum(np.arange(-(-count // LANES) * LANES), count - 1)
    rows = op.reshape(32, count)[:, padded].reshape(32, -1, LANES)
    stages = stage.T[:, padded].reshape(3, -1, LANES)
    return (np.ascontiguousarray(rows.transpose(1, 0, 2)).reshape(-1, 32 * LANES),
            np.ascontiguousarray(stages.transpose(1, 0, 2)).reshape(-1, 3 * LANES))


def batch_cost(op: FloatArray, stage: FloatArray, begin: FloatArray, commands: FloatArray,
               steps: IntArray, shares: FloatArray, targets: FloatArray) -> FloatArray:
    """
    Return the sum of absolute x and y errors of each candidate, eq. (23).

    Parameters
    ----------
    op : numpy.ndarray, shape (2, ROWS, 4, n_candidates)
        Of :func:`operators`.
    stage : numpy.ndarray, shape (n_candidates, 3)
        Of :class:`DecoupledModes`.
    begin : numpy.ndarray, shape (9,)
        States of both modes, x, y [m] and heading [rad] at the start.
    commands : numpy.ndarray, shape (n_steps, 2)
        Forward speed [m/s] and yaw rate [rad/s] over each step.
    steps : numpy.ndarray of int64, shape (n_samples,)
        Step in which each measured position lies, not decreasing.
    shares : numpy.ndarray, shape (n_samples,)
        Where within the step, 0 to 1.
    targets : numpy.ndarray, shape (n_samples, 2)
        Measured x and y [m].

    Returns
    -------
    numpy.ndarray, shape (n_candidates,)
        [m]

    """
    count = op.shape[-1]
    if compiled():
        rows, stages = _blocks(op, stage)
        out = np.zeros((rows.shape[0], LANES))
        _all_lanes(rows, stages, begin, commands, steps, shares, targets, out)
        return np.ascontiguousarray(out.reshape(-1)[:count])
    return _arrays(op, stage, begin, commands, steps, shares, targets)


def _arrays(op: FloatArray, stage: FloatArray, begin: FloatArray, commands: FloatArray,
            steps: IntArray, shares: FloatArray, targets: FloatArray) -> FloatArray:
    count = op.shape[-1]
    states = np.repeat(begin[:6].reshape(2, 3, 1), count, axis=2)
    x, y = np.full(count, begin[6]), np.full(count, begin[7])
    c, d = np.full(count, np.cos(begin[8])), np.full(count, np.sin(begin[8]))
    cost = np.zeros(count)
    place, speed, rate, limit = 0, stage[:, 0], stage[:, 1], stage[:, 2]
    for step in range(commands.shape[0]):
        mean, half = speed * commands[step, 0], rate * commands[step, 1]
        left = np.clip(mean - half, -limit, limit)
        right = np.clip(mean + half, -limit, limit)
        u = np.stack([0.5 * (left + right), 0.5 * (right - left)])
        new = (op[:, :, 0] * states[:, None, 0] + op[:, :, 1] * states[:, None, 1]
               + op[:, :, 2] * states[:, None, 2] + op[:, :, 3] * u[:, None])
        states = new[:, :3]
        path, half = new[0, 3], 0.5 * new[1, 3]
        q = half * half
        cosine = 1.0 - q / 2.0 * (1.0 - q / 12.0 * (1.0 - q / 30.0 * (
            1.0 - q / 56.0 * (1.0 - q / 90.0))))
        ratio = 1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (
            1.0 - q / 72.0 * (1.0 - q / 110.0))))
        sine, chord = half * ratio, path * ratio
        c1, d1 = c * cosine - d * sine, d * cosine + c * sine
        x0, y0 = x, y
        x, y = x + chord * c1, y + chord * d1
        c, d = c1 * cosine - d1 * sine, d1 * cosine + c1 * sine
        while place < steps.size and steps[place] == step:
            share = shares[place]
            cost += np.abs(x0 + share * (x - x0) - targets[place, 0])
            cost += np.abs(y0 + share * (y - y0) - targets[place, 1])
            place += 1
    return cost
