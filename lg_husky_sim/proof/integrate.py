# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Fine-step integration of a hidden robot: Runge-Kutta of fourth order, compiled."""

from __future__ import annotations

from dataclasses import dataclass
import math

from lg_husky_sim.proof import world as w
from lg_husky_sim.proof.dynamics import derivative, N_STATES
from lg_husky_sim.proof.jit import compiled
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

STEP = 0.5e-3
STEPS_PER_ROW = 4
ROUGH_PERIOD = 0.01

COLUMNS = (
    'time', 'forward', 'lateral', 'yaw_rate', 'x', 'y', 'heading',
    'wheel_left', 'wheel_right', 'angle_left', 'angle_right',
    'current_left', 'current_right', 'accel_x', 'accel_y', 'bus',
    'volts_left', 'volts_right',
)


@dataclass(frozen=True)
class Gate:
    """
    When or where an effect is on.

    Attributes
    ----------
    kind
        'none' (always on), 'time' or 'place'.
    at
        Seconds since the start of the recording, or metres of x in the odometry frame.
    width
        Seconds or metres over which it comes in.

    """

    kind: str = 'none'
    at: float = 0.0
    width: float = 0.2


@compiled
def _opening(kind: int, at: float, width: float, time: float, x: float) -> float:
    if kind == 0:
        return 1.0
    z = ((time if kind == 1 else x) - at) / width
    if z <= -0.5:
        return 0.0
    if z >= 0.5:
        return 1.0
    return 0.5 + 0.5 * math.sin(math.pi * z)


@compiled
def _mix(off: Vector, on: Vector, opening: float, p: Vector) -> None:
    for k in range(p.size):
        p[k] = off[k] + opening * (on[k] - off[k])


@compiled
def _integrate(off: Vector, on: Vector, kind: int, at: float, width: float, demand: Vector,
               rough: Vector, s: Vector, step: float, every: int, table: Vector) -> int:
    """Fill `table` row by row; return the number of rows that are finite."""
    n = s.size
    p = on.copy()
    extra = np.zeros(5)
    k1, k2, k3, k4 = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    volts_left = 0.0
    volts_right = 0.0
    integral_left = 0.0
    integral_right = 0.0
    before_left = s[8]
    before_right = s[9]
    ticks = max(1, round(on[w.LOOP_PERIOD] / step))
    per_rough = max(1, round(ROUGH_PERIOD / step))
    row = 0
    for j in range(demand.shape[0]):
        time = j * step
        if kind != 0:
            _mix(off, on, _opening(kind, at, width, time, s[3]), p)
        if p[w.LOOP] > 0.5:
            if j % ticks == 0:
                period = ticks * step
                forward = p[w.LOOP_FORWARD] * p[w.TORQUE_CONSTANT]
                error_left = demand[j, 0] - (s[8] - before_left) / period
                error_right = demand[j, 1] - (s[9] - before_right) / period
                before_left = s[8]
                before_right = s[9]
                volts_left = (forward * demand[j, 0] + p[w.LOOP_GAIN] * error_left
                              + integral_left)
                volts_right = (forward * demand[j, 1] + p[w.LOOP_GAIN] * error_right
                               + integral_right)
                # Conditional integration: hold while the chopper is at its end.
                if abs(volts_left) < w.NOMINAL_SUPPLY or volts_left * error_left < 0.0:
                    integral_left += p[w.LOOP_INTEGRAL] * error_left * period
                if abs(volts_right) < w.NOMINAL_SUPPLY or volts_right * error_right < 0.0:
                    integral_right += p[w.LOOP_INTEGRAL] * error_right * period
                if demand[j, 0] == 0.0 and abs(error_left) < 0.02:
                    integral_left *= 0.9
                    volts_left *= 0.5
                if demand[j, 1] == 0.0 and abs(error_right) < 0.02:
                    integral_right *= 0.9
                    volts_right *= 0.5
        else:
            volts_left = demand[j, 0]
            volts_right = demand[j, 1]
        floor = rough[min(j // per_rough, rough.shape[0] - 1)]
        derivative(time, s, p, volts_left, volts_right, floor, k1, extra)
        if j % every == 0:
            table[row, 0] = time
            table[row, 1:4] = s[0:3]
            table[row, 4:7] = s[3:6]
            table[row, 7:9] = s[6:8]
            table[row, 9:11] = s[8:10]
            table[row, 11:13] = s[18:20]
            table[row, 13:15] = extra[0:2]
            table[row, 15:18] = extra[2:5]
            if not (abs(s[0]) < 50.0 and abs(s[6]) < 500.0 and abs(s[7]) < 500.0):
                return row
            row += 1
        middle = time + 0.5 * step
        derivative(middle, s + 0.5 * step * k1, p, volts_left, volts_right, floor, k2, extra)
        derivative(middle, s + 0.5 * step * k2, p, volts_left, volts_right, floor, k3, extra)
        derivative(time + step, s + step * k3, p, volts_left, volts_right, floor, k4, extra)
        for i in range(n):
            s[i] += step / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i])
    return row


def integrate(off: Vector, on: Vector, gate: Gate, demand: Vector, rough: Vector,
              pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
              step: float = STEP, every: int = STEPS_PER_ROW) -> Vector:
    """
    Return what a hidden robot does, from rest.

    Parameters
    ----------
    off, on
        The robot without and with its effect (`world.vector`), shape (66,).
    gate
        When or where `on` holds.
    demand
        Voltages asked of the driver [V], or wheel speeds asked of its loop [rad/s], left
        and right, shape (n_steps, 2).
    rough
        Disturbances every 10 ms, shape (n, 5) (`dynamics.derivative`).
    pose
        x, y [m] and heading [rad] at the start.
    step, every
        Step [s], and steps per row of the result.

    Returns
    -------
    numpy.ndarray
        Shape (n_rows, 18), columns `COLUMNS`, SI units.

    Raises
    ------
    FloatingPointError
        The motion left every physical bound.

    """
    state = np.zeros(N_STATES)
    state[3:6] = pose
    table = np.zeros((math.ceil(demand.shape[0] / every), len(COLUMNS)))
    kinds = {'none': 0, 'time': 1, 'place': 2}
    rows = _integrate(off, on, kinds[gate.kind], gate.at, gate.width,
                      np.ascontiguousarray(demand), np.ascontiguousarray(rough),
                      state, step, every, table)
    if rows != table.shape[0] or not np.isfinite(table).all():
        raise FloatingPointError(f'the hidden robot left its bounds at {rows * every * step} s')
    return table
