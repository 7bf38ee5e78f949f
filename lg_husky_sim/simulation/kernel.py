# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The one stepping function: exact hold for the linear part, ETDRK2 for the efforts.

For ``dx/dt = A x + B u + G f(z)``, ``z = H x + K u`` with u held over a sub-step h::

    a  = Phi x + Gamma_u u + Gamma_1 f(z(x))
    x+ = a + Gamma_2 (f(z(a)) - f(z(x)))

with ``Phi = exp(hA)``, ``Gamma_1 = h phi_1(hA) G``, ``Gamma_2 = h phi_2(hA) G`` (Cox and
Matthews, 2002). Where f is zero this is the exact zero-order hold. Distance, heading and wheel
angles are states of the hold; x and y are their quadrature at graded nodes inside the sub-step,
or the exact arc of the sub-step's distance and heading change where no nodes are given.

The flat state vector S is laid out as (n = states of the graph and of its controllers)::

    S[0:n]      states
    S[n:n+4]    angle_left, angle_right, distance, heading
    S[n+4:n+7]  x, y, time
    S[n+7:n+11] memories (laws.MEMORY)
    S[n+11:+13] shaped command (forward, yaw) of the step before
    S[n+13]     place of the next entry in the delay line
    S[n+14:]    delay line: forward and yaw, DELAY entries each
"""

from __future__ import annotations

import math

from lg_husky_sim.husky.laws import CONTEXT, evaluate, remember
from lg_husky_sim.jit import jit, jit_part
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Columns of an output row.
COLUMNS = ('wheel_left', 'wheel_right', 'forward', 'yaw_rate', 'current_left', 'current_right',
           'accel_x', 'angle_left', 'angle_right', 'distance', 'heading', 'x', 'y',
           'voltage_left', 'voltage_right')
#: Taylor coefficients of cosine and sine: factors, since divisions would cost most of a step.
C_2, C_4, C_6 = -1.0 / 2.0, 1.0 / 24.0, -1.0 / 720.0
C_8, C_10, C_12 = 1.0 / 40320.0, -1.0 / 3628800.0, 1.0 / 479001600.0
S_3, S_5, S_7 = -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0
S_9, S_11, S_13 = 1.0 / 362880.0, -1.0 / 39916800.0, 1.0 / 6227020800.0
#: Steps that the delay line can hold back.
DELAY = 128
#: Numbers of the command stage: latency [steps], slew forward and yaw [per step],
#: limit forward and yaw, gains that make reference voltages of (forward, yaw) for left and
#: right, clamp of the voltage (0: none).
COMMAND = 10


@jit_part
def _shaped(s: FloatArray, base: int, forward: float, yaw: float, stages: FloatArray,
            chosen: int) -> tuple[float, float]:
    # Latency (linear between steps), then limits, then slew.
    place = int(s[base + 2])
    line = base + 3
    s[line + place] = forward
    s[line + DELAY + place] = yaw
    s[base + 2] = (place + 1) % DELAY
    whole = int(stages[chosen, 0])
    share = stages[chosen, 0] - whole
    near = (place - whole) % DELAY
    far = (place - whole - 1) % DELAY
    forward = (1.0 - share) * s[line + near] + share * s[line + far]
    yaw = (1.0 - share) * s[line + DELAY + near] + share * s[line + DELAY + far]
    forward = max(-stages[chosen, 3], min(stages[chosen, 3], forward))
    yaw = max(-stages[chosen, 4], min(stages[chosen, 4], yaw))
    forward = s[base] + max(-stages[chosen, 1], min(stages[chosen, 1], forward - s[base]))
    yaw = s[base + 1] + max(-stages[chosen, 2], min(stages[chosen, 2], yaw - s[base + 1]))
    s[base] = forward
    s[base + 1] = yaw
    return forward, yaw


@jit_part
def _multiply(matrices: FloatArray, c: int, first: int, vector: FloatArray, count: int,
              out: FloatArray) -> None:
    # out += operator @ vector[:count]; row first + j of the stored matrix is column j of it.
    for j in range(count):
        value = vector[j]
        for i in range(out.size):
            out[i] += matrices[c, first + j, i] * value


@jit_part
def _pose(s: FloatArray, n: int, start: FloatArray, end: FloatArray, nodes: FloatArray,
          weights: FloatArray) -> None:
    # Advance x and y over one sub-step; nodes hold v and heading change at the nodes.
    heading = start[n + 3]
    c, d = math.cos(heading), math.sin(heading)
    along, across = 0.0, 0.0
    count = weights.size
    if count == 0:
        turn = end[n + 3] - start[n + 3]
        path = end[n + 2] - start[n + 2]
        half = 0.5 * turn
        chord = path * (1.0 - half * half / 6.0 * (1.0 - half * half / 20.0 * (
            1.0 - half * half / 42.0)))
        if abs(half) > 0.5:
            chord = path * math.sin(half) / half
        along, across = chord * math.cos(half), chord * math.sin(half)
    else:
        for k in range(count):
            angle = nodes[count + k] - heading
            q = angle * angle
            if q < 0.25:
                cosine = 1.0 + q * (C_2 + q * (C_4 + q * (C_6 + q * (C_8 + q * (
                    C_10 + q * C_12)))))
                sine = angle * (1.0 + q * (S_3 + q * (S_5 + q * (S_7 + q * (S_9 + q * (
                    S_11 + q * S_13))))))
            else:
                cosine, sine = math.cos(angle), math.sin(angle)
            way = weights[k] * nodes[k]
            along += way * cosine
            across += way * sine
    s[n + 4] += c * along - d * across
    s[n + 5] += d * along + c * across


@jit
def run(s: FloatArray, commands: FloatArray, out: FloatArray, period: float, substeps: int,
        onset: FloatArray, stages: FloatArray, phi: FloatArray, gamma_u: FloatArray,
        gamma_1: FloatArray, gamma_2: FloatArray, h: FloatArray, k: FloatArray,
        laws: FloatArray, coefficients: FloatArray, offsets: FloatArray, rows: FloatArray,
        rows_u: FloatArray, rows_f: FloatArray, nodes: FloatArray, weights: FloatArray) -> None:
    """
    Advance the flat state ``s`` by ``len(commands)`` periods, in place.

    Parameters
    ----------
    s : numpy.ndarray
        Flat state, laid out as the module says.
    commands : numpy.ndarray, shape (n_steps, 2)
        Forward speed [m/s] and yaw rate [rad/s] commanded in each step.
    out : numpy.ndarray, shape (n_steps, 15)
        Receives :data:`COLUMNS` at the end of each step.
    period : float
        Length of a step [s].
    substeps : int
        Sub-steps of a step; the matrices belong to a sub-step.
    onset : numpy.ndarray, shape (2,)
        Kind (0: first set of matrices always; 1: second set from time [s] on; 2: second set
        where x is at or beyond a place [m]; 3: before it) and the value.
    stages : numpy.ndarray, shape (n_sets, COMMAND)
        The command stages.
    phi, gamma_u, gamma_1, gamma_2 : numpy.ndarray, shape (n_sets, n_columns, n + 4)
        Transposed operators of one sub-step.
    h, k : numpy.ndarray, shape (n_sets, n or 2, n_arguments)
        Transposed rows of the efforts' arguments.
    laws, coefficients, offsets : numpy.ndarray, shapes (n_sets, n_efforts[, WIDTH])
        The efforts.
    rows, rows_u, rows_f : numpy.ndarray, shape (n_sets, n or 2 or n_efforts, 9)
        Transposed outputs: wheel rates, speed, yaw rate, currents, acceleration, voltages.
    nodes : numpy.ndarray, shape (n_sets, n + 4 + 2 + 2 n_efforts, 2 n_nodes)
        Transposed map to speed and heading at the nodes.
    weights : numpy.ndarray, shape (n_nodes,)
        Quadrature weights [s].
    """
    n4 = phi.shape[1]
    n = n4 - 4
    efforts = laws.shape[1]
    u = np.zeros(2)
    z = np.zeros(h.shape[2])
    f0 = np.zeros(efforts)
    f1 = np.zeros(efforts)
    context = np.zeros(CONTEXT)
    context[6] = period / substeps
    start = np.zeros(n4)
    end = np.zeros(n4)
    inside = np.zeros(nodes.shape[2])
    row = np.zeros(9)
    memory = s[n + 7:n + 11]
    count = weights.size
    direct = bool(np.any(k != 0.0))
    for step in range(commands.shape[0]):
        chosen = 0
        if onset[0] == 1.0 and s[n + 6] >= onset[1] - 0.5 * period:
            chosen = 1
        elif onset[0] == 2.0 and s[n + 4] >= onset[1]:
            chosen = 1
        elif onset[0] == 3.0 and s[n + 4] <= onset[1]:
            chosen = 1
        forward, yaw = _shaped(s, n + 11, commands[step, 0], commands[step, 1], stages, chosen)
        u[0] = stages[chosen, 5] * forward + stages[chosen, 6] * yaw
        u[1] = stages[chosen, 7] * forward + stages[chosen, 8] * yaw
        clamp = stages[chosen, 9]
        if clamp > 0.0:
            u[0] = max(-clamp, min(clamp, u[0]))
            u[1] = max(-clamp, min(clamp, u[1]))
        play_left, play_right = memory[2], memory[3]
        angle_left, angle_right = s[n], s[n + 1]
        for _ in range(substeps):
            for i in range(n4):
                start[i] = s[i]
                end[i] = 0.0
            # Angles, distance and heading are integrals: nothing else depends on them.
            _multiply(phi, chosen, 0, start, n, end)
            for i in range(n, n4):
                end[i] += start[i]
            _multiply(gamma_u, chosen, 0, u, 2, end)
            if efforts > 0:
                context[0] = s[n + 6]
                context[1] = s[n + 3]
                context[2] = s[n + 4]
                context[3] = s[n + 5]
                context[4] = s[n]
                context[5] = s[n + 1]
                for i in range(z.size):
                    z[i] = 0.0
                _multiply(h, chosen, 0, start, n, z)
                if direct:
                    _multiply(k, chosen, 0, u, 2, z)
                evaluate(chosen, laws, coefficients, offsets, z, context, memory, f0)
                _multiply(gamma_1, chosen, 0, f0, efforts, end)
                for i in range(z.size):
                    z[i] = 0.0
                _multiply(h, chosen, 0, end, n, z)
                if direct:
                    _multiply(k, chosen, 0, u, 2, z)
                context[0] += period / substeps
                context[1] = end[n + 3]
                context[4] = end[n]
                context[5] = end[n + 1]
                evaluate(chosen, laws, coefficients, offsets, z, context, memory, f1)
                for j in range(efforts):
                    f1[j] -= f0[j]
                _multiply(gamma_2, chosen, 0, f1, efforts, end)
                remember(chosen, laws, coefficients, offsets, z, memory, period / substeps)
            if count > 0:
                for i in range(inside.size):
                    inside[i] = 0.0
                _multiply(nodes, chosen, 0, start, n4, inside)
                _multiply(nodes, chosen, n4, u, 2, inside)
                if efforts > 0:
                    _multiply(nodes, chosen, n4 + 2, f0, efforts, inside)
                    _multiply(nodes, chosen, n4 + 2 + efforts, f1, efforts, inside)
            _pose(s, n, start, end, inside, weights)
            for i in range(n4):
                s[i] = end[i]
            s[n + 6] += period / substeps
        for j in range(efforts):
            f0[j] += f1[j]
        for i in range(9):
            row[i] = 0.0
        _multiply(rows, chosen, 0, s, n, row)
        _multiply(rows_u, chosen, 0, u, 2, row)
        if efforts > 0:
            _multiply(rows_f, chosen, 0, f0, efforts, row)
        for i in range(7):
            out[step, i] = row[i]
        for i in range(6):
            out[step, 7 + i] = s[n + i]
        # Encoders turn with the motors, which run ahead of the wheels within the gears' play.
        if memory[2] != play_left:
            out[step, 0] = (s[n] - angle_left + memory[2] - play_left) / period
        if memory[3] != play_right:
            out[step, 1] = (s[n + 1] - angle_right + memory[3] - play_right) / period
        out[step, 7] += memory[2]
        out[step, 8] += memory[3]
        out[step, 13] = row[7]
        out[step, 14] = row[8]
