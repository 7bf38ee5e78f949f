# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Whiten residuals of an open-loop simulation: innovations of the deviation model.

What nobody can predict enters at the graph's balances: force and moment on the chassis and torque
on the wheels of each side, each first-order coloured. With the linear model's slow states (forward
speed v, yaw rate w; wheels follow quasi-statically) their deviation z from a simulation is::

    d_i' = -d_i / tau_i + noise                       force, moment, torque left, torque right
    (v, w)' = A_s (v, w) + E_s d,     bias' = noise
    heading' = w,  x' = v cos(heading_m) + noise,  y' = v sin(heading_m) + noise
    angle_side' = wheel_side = W (v, w) + W_d d

and a residual is ``r = H z + sensor noise``. The Kalman filter of this model gives innovations
``e = r - H z^-`` with variances S; ``e / sqrt(S)`` is white with unit variance when the simulation
is right, and linear in r, so that simulated differences are whitened by the same gains.
"""

from __future__ import annotations

from lg_husky_sim.jit import jit, jit_part
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.int64]

#: Columns that machine code takes in one go; a few that are missing are cheaper filled up.
TOGETHER = 32
#: States of the deviation model: four disturbances, v, w, gyro bias, heading, x, y, two angles.
STATES = 12
#: Entries of the model vector, in the order in which the functions below read them.
MODEL = ('speed_by_speed', 'speed_by_turn', 'turn_by_speed', 'turn_by_turn',
         'speed_by_force', 'speed_by_moment', 'speed_by_left', 'speed_by_right',
         'turn_by_force', 'turn_by_moment', 'turn_by_left', 'turn_by_right',
         'left_by_speed', 'left_by_turn', 'left_by_left', 'left_by_right',
         'right_by_speed', 'right_by_turn', 'right_by_left', 'right_by_right',
         'speed_by_voltage_left', 'speed_by_voltage_right', 'turn_by_voltage_left',
         'turn_by_voltage_right', 'left_by_voltage_left', 'left_by_voltage_right',
         'right_by_voltage_left', 'right_by_voltage_right')
#: Entries of the process vector: standard deviations of the disturbances [N, N·m, N·m], their
#: time constants [s], root intensities of bias [rad/s/sqrt(s)], place [m/sqrt(s)] and heading
#: [rad/sqrt(s)], and the jitter of commands [s].
PROCESS = ('force', 'moment', 'drive', 'force_time', 'moment_time', 'drive_time', 'bias_walk',
           'place_walk', 'heading_walk', 'command_jitter')


@jit_part
def _advance(z: FloatArray, width: int, dt: float, cosine: float, sine: float, fade_f: float,
             fade_m: float, fade_d: float, m: FloatArray) -> None:
    # All columns of z over a short dt: the disturbances decay, the rest by Euler's rule. Numbers
    # of the model are taken out first: they cannot change with z then, and columns go in vectors.
    vv, vw, wv, ww = m[0], m[1], m[2], m[3]
    vf, vm, vl, vr, wf, wm, wl, wr = m[4], m[5], m[6], m[7], m[8], m[9], m[10], m[11]
    lv, lw, ll, lr, rv, rw, rl, rr = m[12], m[13], m[14], m[15], m[16], m[17], m[18], m[19]
    for j in range(width):
        force, moment, left, right = z[0, j], z[1, j], z[2, j], z[3, j]
        v, w = z[4, j], z[5, j]
        z[7, j] += dt * w
        z[8, j] += dt * cosine * v
        z[9, j] += dt * sine * v
        z[10, j] += dt * (lv * v + lw * w + ll * left + lr * right)
        z[11, j] += dt * (rv * v + rw * w + rl * left + rr * right)
        z[4, j] = v + dt * (vv * v + vw * w + vf * force + vm * moment + vl * left + vr * right)
        z[5, j] = w + dt * (wv * v + ww * w + wf * force + wm * moment + wl * left + wr * right)
        z[0, j] = fade_f * force
        z[1, j] = fade_m * moment
        z[2, j] = fade_d * left
        z[3, j] = fade_d * right


@jit_part
def _propagate(z: FloatArray, width: int, left: float, longest: float, cosine: float, sine: float,
               process: FloatArray, m: FloatArray) -> None:
    # All columns of z over a time, by steps that are short enough.
    while left > 1e-9:
        dt = min(left, longest)
        left -= dt
        fade_f = np.exp(-dt / process[3])
        fade_m = np.exp(-dt / process[4])
        fade_d = np.exp(-dt / process[5])
        _advance(z, width, dt, cosine, sine, fade_f, fade_m, fade_d, m)


@jit_part
def state_of(channel: int) -> int:
    """Return the state that a channel beyond the rates reads."""
    if channel == 3:
        return 8
    if channel == 4:
        return 9
    if channel == 6:
        return 10
    return 11 if channel == 7 else 7


@jit_part
def _read_all(z: FloatArray, width: int, channel: int, m: FloatArray, seen: FloatArray) -> None:
    # H z of one channel for all columns.
    if channel < 2:
        v, w = m[12 + 4 * channel], m[13 + 4 * channel]
        left, right = m[14 + 4 * channel], m[15 + 4 * channel]
        for j in range(width):
            seen[j] = v * z[4, j] + w * z[5, j] + left * z[2, j] + right * z[3, j]
    elif channel == 2:
        for j in range(width):
            seen[j] = z[5, j] + z[6, j]
    else:
        state = state_of(channel)
        for j in range(width):
            seen[j] = z[state, j]


@jit_part
def _correct(z: FloatArray, width: int, gain: FloatArray, k: int, seen: FloatArray) -> None:
    # Add gains times innovations.
    for i in range(12):
        by = gain[k, i]
        for j in range(width):
            z[i, j] += by * seen[j]


@jit_part
def _width(count: int) -> int:
    # Columns with those that fill them up, where that is faster.
    if count <= 16:
        return 1 if count == 1 else (4 if count <= 4 else 16)
    rest = count % TOGETHER
    return count + TOGETHER - rest if 2 * rest >= TOGETHER else count


@jit_part
def _transpose(p: FloatArray) -> None:
    for i in range(12):
        for j in range(i):
            p[i, j], p[j, i] = p[j, i], p[i, j]


@jit_part
def _read(z: FloatArray, j: int, channel: int, m: FloatArray) -> float:
    # H z of one channel for column j.
    if channel == 0:
        return float(m[12] * z[4, j] + m[13] * z[5, j] + m[14] * z[2, j] + m[15] * z[3, j])
    if channel == 1:
        return float(m[16] * z[4, j] + m[17] * z[5, j] + m[18] * z[2, j] + m[19] * z[3, j])
    if channel == 2:
        return float(z[5, j] + z[6, j])
    if channel == 3:
        return float(z[8, j])
    if channel == 4:
        return float(z[9, j])
    if channel == 5:
        return float(z[7, j])
    if channel == 6:
        return float(z[10, j])
    return float(z[11, j])


@jit
def gains(times: FloatArray, channels: Integers, order: Integers, noise: FloatArray,
          cosine: FloatArray, sine: FloatArray, model: FloatArray, process: FloatArray,
          initial: FloatArray, longest: float, kicks: FloatArray, gain: FloatArray,
          scale: FloatArray) -> None:
    """
    Run the covariances of the filter over the readings of one drive.

    Parameters
    ----------
    times, channels, noise, cosine, sine : numpy.ndarray, shape (n,)
        Of each reading: when it was true [s], its channel, variance of its sensor noise, and the
        direction of the base's x axis in the world then.
    order : numpy.ndarray of int, shape (n,)
        Readings in the order of time.
    model, process : numpy.ndarray
        In the order of :data:`MODEL` and :data:`PROCESS`.
    initial : numpy.ndarray, shape (12,)
        Variances of the deviation at the first time.
    longest : float
        Longest step of a propagation [s].
    kicks : numpy.ndarray, shape (n_kicks, 6)
        Times [s] at which the torques on the left and right wheels become uncertain by so much
        more [(N·m)²], and steps of the voltages there [V]: a step that comes by s later leaves s
        times what the voltages accelerate and how fast they turn the wheels. Last how far from
        its time it may come [s], their sum in order: readings in this time tell nothing of it.
    gain, scale : numpy.ndarray, shapes (n, 12), (n,)
        Receive the gains and the standard deviations of the innovations, in the order of time.

    """
    p = np.zeros((12, 12))
    for i in range(12):
        p[i, i] = initial[i]
    seen = np.zeros(12)
    column = seen.reshape(12, 1)
    late, moved, of_late = np.zeros(4), (4, 5, 10, 11), (-1, 2, 6, 7)
    force_time, moment_time, drive_time = process[3], process[4], process[5]
    now, kick = times[order[0]], 0
    furthest = np.max(kicks[:, 5]) if kicks.shape[0] else 0.0
    while kick < kicks.shape[0] and kicks[kick, 0] < now:
        kick += 1
    for k in range(order.size):
        reading = order[k]
        left = times[reading] - now
        while left > 1e-9:
            dt = min(left, longest)
            while kick < kicks.shape[0] and kicks[kick, 0] + kicks[kick, 5] <= now + dt:
                p[2, 2] += kicks[kick, 1]
                p[3, 3] += kicks[kick, 2]
                for i in range(4):
                    late[i] = process[9] * (model[20 + 2 * i] * kicks[kick, 3]
                                            + model[21 + 2 * i] * kicks[kick, 4])
                for i in range(4):
                    for j in range(4):
                        p[moved[i], moved[j]] += late[i] * late[j]
                kick += 1
            left -= dt
            now += dt
            fade_f = np.exp(-dt / force_time)
            fade_m = np.exp(-dt / moment_time)
            fade_d = np.exp(-dt / drive_time)
            _advance(p, 12, dt, cosine[reading], sine[reading], fade_f, fade_m, fade_d, model)
            _transpose(p)
            _advance(p, 12, dt, cosine[reading], sine[reading], fade_f, fade_m, fade_d, model)
            p[0, 0] += process[0] ** 2 * (1.0 - fade_f * fade_f)
            p[1, 1] += process[1] ** 2 * (1.0 - fade_m * fade_m)
            p[2, 2] += process[2] ** 2 * (1.0 - fade_d * fade_d)
            p[3, 3] += process[2] ** 2 * (1.0 - fade_d * fade_d)
            p[6, 6] += process[6] ** 2 * dt
            p[7, 7] += process[8] ** 2 * dt
            p[8, 8] += process[7] ** 2 * dt
            p[9, 9] += process[7] ** 2 * dt
        now = times[reading]
        channel = int(channels[reading])
        # p is symmetric: H p by columns is p H'.
        _read_all(p, 12, channel, model, seen)
        unsure = noise[reading]
        near = kick
        while near < kicks.shape[0] and kicks[near, 0] + kicks[near, 5] - 2.0 * furthest <= now:
            # Of times that are evenly spread over the reach, what one of them has done by now
            # has 4 r^3 - 3 r^4 of the variance that it leaves at the end, r of the reach over.
            over = 0.0
            if kicks[near, 5] > 0.0:
                over = max(0.0, now - kicks[near, 0] + kicks[near, 5]) / (2.0 * kicks[near, 5])
            spread = 4.0 * over ** 3 - 3.0 * over ** 4
            for i in range(4):
                if channel == of_late[i]:
                    step = process[9] * (model[20 + 2 * i] * kicks[near, 3]
                                         + model[21 + 2 * i] * kicks[near, 4])
                    unsure += spread * step * step
            near += 1
        variance = _read(column, 0, channel, model) + unsure
        for i in range(12):
            by = seen[i] / variance
            gain[k, i] = by
            for j in range(12):
                p[i, j] -= by * seen[j]
        scale[k] = np.sqrt(variance)


@jit_part
def _whiten(width: int, residuals: FloatArray, times: FloatArray, channels: Integers,
            order: Integers, cosine: FloatArray, sine: FloatArray, model: FloatArray,
            process: FloatArray, longest: float, gain: FloatArray, scale: FloatArray,
            out: FloatArray, z: FloatArray, seen: FloatArray) -> None:
    # Columns filled up to a width; for one that the compiler knows it makes faster code.
    now = times[order[0]]
    for k in range(order.size):
        reading = order[k]
        _propagate(z, width, times[reading] - now, longest, cosine[reading], sine[reading],
                   process, model)
        now = times[reading]
        _read_all(z, width, int(channels[reading]), model, seen)
        deviation = scale[k]
        for j in range(residuals.shape[1]):
            seen[j] = residuals[reading, j] - seen[j]
            out[k, j] = seen[j] / deviation
        _correct(z, width, gain, k, seen)


@jit
def whiten(residuals: FloatArray, times: FloatArray, channels: Integers, order: Integers,
           cosine: FloatArray, sine: FloatArray, model: FloatArray, process: FloatArray,
           longest: float, gain: FloatArray, scale: FloatArray, out: FloatArray) -> None:
    """
    Whiten columns of residuals by gains made before.

    Parameters
    ----------
    residuals : numpy.ndarray, shape (n, m)
        In the order of the readings.
    times, channels, order, cosine, sine, model, process, longest, gain, scale
        As in :func:`gains`.
    out : numpy.ndarray, shape (n, m)
        Receives the whitened innovations, in the order of time.

    """
    count = residuals.shape[1]
    width = _width(count)
    if width == 1:
        _whiten(1, residuals, times, channels, order, cosine, sine, model, process, longest,
                gain, scale, out, np.zeros((12, 1)), np.zeros(1))
    elif width == 4:
        _whiten(4, residuals, times, channels, order, cosine, sine, model, process, longest,
                gain, scale, out, np.zeros((12, 4)), np.zeros(4))
    else:
        _whiten(width, residuals, times, channels, order, cosine, sine, model, process, longest,
                gain, scale, out, np.zeros((12, width)), np.zeros(width))


@jit
def respond(efforts: FloatArray, grid: FloatArray, times: FloatArray, channels: Integers,
            order: Integers, cosine: FloatArray, sine: FloatArray, model: FloatArray,
            longest: float, out: FloatArray) -> None:
    """
    Return how the readings of a drive deviate under given efforts at the balances.

    Parameters
    ----------
    efforts : numpy.ndarray, shape (n_grid, 4, m)
        Force [N], moment [N·m], torque of the left and of the right wheels [N·m], m at a time,
        held from each grid time to the next.
    grid : numpy.ndarray, shape (n_grid,)
        Evenly spaced times [s].
    times, channels, order, cosine, sine, model, longest
        As in :func:`gains`.
    out : numpy.ndarray, shape (n, m)
        Receives the deviations, in the order of the readings.

    """
    count = efforts.shape[2]
    z = np.zeros((12, count))
    spacing = grid[1] - grid[0]
    now = times[order[0]]
    last = grid.size - 1
    for k in range(order.size):
        reading = order[k]
        left = times[reading] - now
        while left > 1e-9:
            dt = min(left, longest)
            at = int((now - grid[0]) / spacing)
            at = max(0, min(last, at))
            left -= dt
            now += dt
            for i in range(4):
                for j in range(count):
                    z[i, j] = efforts[at, i, j]
            _advance(z, count, dt, cosine[reading], sine[reading], 1.0, 1.0, 1.0, model)
        now = times[reading]
        at = max(0, min(last, int((now - grid[0]) / spacing)))
        channel = int(channels[reading])
        for j in range(count):
            for i in range(4):
                z[i, j] = efforts[at, i, j]
            out[reading, j] = _read(z, j, channel, model)


@jit
def whiten_switched(change: FloatArray, states: FloatArray, on: NDArray[np.uint8],
                    times: FloatArray, channels: Integers, order: Integers, cosine: FloatArray,
                    sine: FloatArray, model: FloatArray, process: FloatArray, longest: float,
                    gain: FloatArray, scale: FloatArray, out: FloatArray) -> None:
    """
    Whiten a change of readings that is switched on and off.

    What a change has built up when it is switched on was not there, so that the filter begins
    with the opposite of it: r - H (z - z(t)) instead of r - H z; at its end the reverse.

    Parameters
    ----------
    change : numpy.ndarray, shape (n,)
        Of the readings, when it acts always.
    states, on : numpy.ndarray, shapes (n, 12), (n, m); on of uint8
        In the order of time: the deviation that it has built up at each reading, and whether it
        acts there; m patterns.
    times, channels, order, cosine, sine, model, process, longest, gain, scale
        As in :func:`whiten`.
    out : numpy.ndarray, shape (n, m)
        Receives the whitened innovations, in the order of time.

    """
    count = on.shape[1]
    width = _width(count)
    z, seen = np.zeros((12, width)), np.zeros(width)
    now = times[order[0]]
    for k in range(order.size):
        reading = order[k]
        _propagate(z, width, times[reading] - now, longest, cosine[reading], sine[reading],
                   process, model)
        now = times[reading]
        for j in range(count):
            if k > 0 and on[k, j] != on[k - 1, j]:
                sign = 1.0 if on[k, j] else -1.0
                for i in range(4, 12):
                    z[i, j] += sign * states[k, i]
        _read_all(z, width, int(channels[reading]), model, seen)
        moved, deviation = change[reading], scale[k]
        for j in range(count):
            seen[j] = (moved if on[k, j] else 0.0) - seen[j]
            out[k, j] = seen[j] / deviation
        _correct(z, width, gain, k, seen)
