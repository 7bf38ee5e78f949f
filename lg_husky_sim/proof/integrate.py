# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Fine-step integration of a hidden robot: Runge-Kutta of fourth order, exact at commands."""

from __future__ import annotations

from dataclasses import dataclass
import math

from lg_husky_sim.proof import world as w
from lg_husky_sim.proof.dynamics import derivative, N_STATES
from lg_husky_sim.proof.jit import compiled
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

STEP = 1e-4
"""Largest step [s]; steps end where a command arrives and where a row is due."""
COARSE = 2.5e-4
"""Step of the simulations that only measure how much an effect shows [s]."""
ROW_PERIOD = 1e-3
ROUGH_PERIOD = 0.005

COLUMNS = (
    'time', 'forward', 'lateral', 'yaw_rate', 'x', 'y', 'heading',
    'wheel_left', 'wheel_right', 'angle_left', 'angle_right',
    'motor_left', 'motor_right', 'current_left', 'current_right', 'accel_x', 'accel_y', 'bus',
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
        Seconds since the start, or metres of x in the odometry frame.
    width
        Seconds or metres over which it comes in.
    sign
        1: beyond `at`; -1: before it (places only).

    """

    kind: str = 'none'
    at: float = 0.0
    width: float = 0.2
    sign: float = 1.0


@dataclass(frozen=True)
class Floor:
    """
    What the floor does to a robot, drawn.

    `rough`: every `ROUGH_PERIOD`, shape (n, 5) (`dynamics.derivative`). `waves`: bound to
    places, rows of wave numbers in x and y [rad/m], phase, and amplitudes of force [N],
    moment, torque left and right [N·m].
    """

    rough: Vector
    waves: Vector


def smooth_floor() -> Floor:
    """Return a floor that does nothing."""
    return Floor(np.zeros((1, 5)), np.zeros((0, 7)))


@compiled
def _opening(kind: int, at: float, width: float, sign: float, time: float, x: float) -> float:
    z = ((time if kind == 1 else x) - at) / width * sign
    if z <= -0.5:
        return 0.0
    if z >= 0.5:
        return 1.0
    return 0.5 + 0.5 * math.sin(math.pi * z)


@compiled
def _control(s: Vector, goal: Vector, before: Vector, integral: Vector, volts: Vector,
             p: Vector) -> None:
    """One tick of a wheel-speed loop: PI with feed-forward and conditional integration."""
    period = p[w.LOOP_PERIOD]
    for side in range(2):
        error = goal[side] - (s[8 + side] - before[side]) / period
        before[side] = s[8 + side]
        volts[side] = p[w.LOOP_FORWARD] * p[w.TORQUE_CONSTANT] * goal[side] \
            + p[w.LOOP_GAIN] * error + integral[side]
        if abs(volts[side]) < p[w.SUPPLY] or volts[side] * error < 0.0:
            integral[side] += p[w.LOOP_INTEGRAL] * error * period
        if goal[side] == 0.0 and abs(error) < 0.02:
            integral[side] *= 0.9
            volts[side] *= 0.5


@compiled
def _integrate(off: Vector, on: Vector, kind: int, at: float, width: float, sign: float,
               arrivals: Vector, demand: Vector, rough: Vector, waves: Vector, s: Vector,
               start: float, step: float, row_period: float, rough_period: float,
               table: Vector) -> int:
    """Fill `table` row by row; return the number of rows that are finite."""
    n = s.size
    p = on.copy()
    extra, force, floor, middle = np.zeros(5), np.zeros(3), np.zeros(5), np.zeros(n)
    k1, k2, k3, k4 = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    goal, volts, before, integral = np.zeros(2), np.zeros(2), s[8:10].copy(), np.zeros(2)
    coming = 0
    closed = on[w.LOOP] > 0.5
    next_tick = start
    time = start
    for row in range(table.shape[0]):
        end = start + (row + 1) * row_period
        first = True
        while end - time > 1e-9:
            while coming < arrivals.size and arrivals[coming] <= time + 1e-9:
                goal[0] = demand[coming, 0]
                goal[1] = demand[coming, 1]
                coming += 1
            if kind != 0:
                opening = _opening(kind, at, width, sign, time, s[3])
                for k in range(p.size):
                    p[k] = off[k] + opening * (on[k] - off[k])
            if not closed:
                volts[0] = goal[0]
                volts[1] = goal[1]
            elif time >= next_tick - 1e-9:
                _control(s, goal, before, integral, volts, p)
                next_tick += p[w.LOOP_PERIOD]
            until = end
            if coming < arrivals.size:
                until = min(until, arrivals[coming])
            if closed:
                until = min(until, next_tick)
            h = (until - time) / max(1, math.ceil((until - time) / step - 1e-6))
            which = min(int((time - start) / rough_period), rough.shape[0] - 1)
            for k in range(5):
                floor[k] = rough[which, k]
            for k in range(waves.shape[0]):
                size = math.sin(waves[k, 0] * s[3] + waves[k, 1] * s[4] + waves[k, 2])
                floor[2] += waves[k, 3] * size
                floor[4] += waves[k, 4] * size
                floor[0] += waves[k, 5] * size
                floor[1] += waves[k, 6] * size
            derivative(time, s, p, volts[0], volts[1], floor, force, k1, extra)
            if first:
                first = False
                table[row, 0] = time
                table[row, 1:7] = s[0:6]
                table[row, 7:9] = s[10:12]
                table[row, 9:11] = s[14:16]
                table[row, 11:13] = s[8:10]
                table[row, 13:15] = s[18:20]
                table[row, 15:18] = extra[0:3]
                if not (abs(s[0]) < 50.0 and abs(s[6]) < 500.0 and abs(s[7]) < 500.0):
                    return row
            for k in range(n):
                middle[k] = s[k] + 0.5 * h * k1[k]
            derivative(time + 0.5 * h, middle, p, volts[0], volts[1], floor, force, k2, extra)
            for k in range(n):
                middle[k] = s[k] + 0.5 * h * k2[k]
            derivative(time + 0.5 * h, middle, p, volts[0], volts[1], floor, force, k3, extra)
            for k in range(n):
                middle[k] = s[k] + h * k3[k]
            derivative(time + h, middle, p, volts[0], volts[1], floor, force, k4, extra)
            for k in range(n):
                s[k] += h / 6.0 * (k1[k] + 2.0 * k2[k] + 2.0 * k3[k] + k4[k])
            time += h
        time = end
    return int(table.shape[0])


def integrate(off: Vector, on: Vector, gate: Gate, arrivals: Vector, demand: Vector,
              floor: Floor, seconds: float, pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
              step: float = STEP) -> Vector:
    """
    Return what a hidden robot does, from rest at second 0.

    Parameters
    ----------
    off, on
        The robot without and with its effect (`world.vector`).
    gate
        When or where `on` holds.
    arrivals, demand
        When [s, rising, shape (m,)] the driver is asked for which voltages [V], or its
        loop for which wheel speeds [rad/s], left and right, shape (m, 2).
    floor
        Its roughness.
    seconds
        How long.
    pose
        x, y [m] and heading [rad] at the start.
    step
        Largest step [s].

    Returns
    -------
    numpy.ndarray
        Every `ROW_PERIOD`, columns `COLUMNS`, SI units; wheel speeds and angles are those of
        the driven axles, motor angles those of the motor shafts, seen at the wheel.

    Raises
    ------
    FloatingPointError
        The motion left every physical bound.

    """
    state = np.zeros(N_STATES)
    state[3:6] = pose
    table = np.zeros((math.ceil(seconds / ROW_PERIOD), len(COLUMNS)))
    kinds = {'none': 0, 'time': 1, 'place': 2}
    rows = _integrate(off, on, kinds[gate.kind], gate.at, gate.width, gate.sign,
                      np.ascontiguousarray(arrivals), np.ascontiguousarray(demand),
                      np.ascontiguousarray(floor.rough), np.ascontiguousarray(floor.waves),
                      state, 0.0, step, ROW_PERIOD, ROUGH_PERIOD, table)
    if rows != table.shape[0] or not np.isfinite(table).all():
        raise FloatingPointError(f'the hidden robot left its bounds at {rows * ROW_PERIOD} s')
    return table
