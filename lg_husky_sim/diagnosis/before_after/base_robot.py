# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
A commercial base: limited commands, a wheel-speed loop, four tyres that saturate.

Robots with other parameters are simulated side by side, in lanes of loops that become vector
instructions; each has the bits that it would have alone.
"""

from __future__ import annotations

from typing import Final

from lg_husky_sim.diagnosis.before_after.base_names import ROBOT
from lg_husky_sim.jit import jit, jit_part
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Rows of what the integrator works on.
ROWS: Final = len(ROBOT) + 72
# Their places, each with a lane for each robot: parameters, as in `ROBOT`; state; what is worked
# out within a step, with reciprocals, for divisions take most of its time; and `OUTPUTS`. Two one
# after the other are left and right, four the tyres: front left, rear left, front right, rear
# right.
(_SLEW_FORWARD, _SLEW_YAW, _LIMIT_FORWARD, _LIMIT_YAW, _SPEED_GAIN, _TURN_WIDTH, _KFF, _KP, _KI,
 _V_MAX, _I_MAX, _INERTIA, _DRY, _, _VISCOUS, _, _MU_ALONG, _MU_ACROSS, _CREEP, _SHARE, _ROLLING,
 _YAW_DAMPING, _MASS, _TURNING, _COM_X, _COM_Y, _HEIGHT, _RADIUS, _, _SLOPE_X, _SLOPE_Y, _TRACK,
 _DEFLECTION, _LEAK, _LAG, _DRAG, _PULL, _SCRUB, _SCRUB_SPEED, _DEAD, _BUS_RESISTANCE, _DROOP,
 _WINDUP, _RATIO, _ENCODER, _, _REST, _SHAPE,
 _V, _U, _R, _WHEEL, _, _SLOW_V, _SLOW_W, _ACC_X, _ACC_Y, _HELD, _,
 _ALONG, _, _, _, _ACROSS, _, _, _,
 _A00, _A02, _A11, _A12, _A22, _B0, _B1, _B2, _FRONT, _LEFT, _GX, _GY, _BUS,
 _SOFTER, _, _, _, _A, _, _FIXED, _, _VOLTS, _, _WANTED, _, _PER_D, _, _NW, _,
 _FOLLOW, _BUILD, _KEPT, _STIFF_ALONG, _STIFF_ACROSS, _PER_ALONG, _PER_ACROSS, _PER_SIDE,
 _PER_V_MAX, _PER_REST, _COSINE, _SINE, _OUT, _, _, _, _, _OUT_ACC, _, _OUT_PLACE, _, _OUT_ANGLES,
 _, _) = range(ROWS)


@jit_part
def _within(value: float, lower: float, upper: float) -> float:
    least = lower if value < lower else value
    return upper if least > upper else least


@jit_part
def _begin(z: FloatArray, p: FloatArray, start: FloatArray, fixed: FloatArray, step: float
           ) -> None:
    resistance, emf, radius, dry_speed = fixed[1], fixed[2], fixed[3], fixed[5]
    for j in range(z.shape[1]):
        for i in range(p.shape[0]):
            z[i, j] = p[i, j]
        z[_BUILD, j] = step / z[_DEFLECTION, j]
        z[_KEPT, j] = np.exp(-z[_LEAK, j] * step)
        z[_STIFF_ALONG, j] = np.sqrt(z[_RATIO, j])
        z[_STIFF_ACROSS, j] = 1.0 / z[_STIFF_ALONG, j]
        z[_FOLLOW, j] = 1.0 - np.exp(-step / z[_LAG, j])
        z[_PER_ALONG, j] = z[_STIFF_ALONG, j] / z[_MU_ALONG, j]
        z[_PER_ACROSS, j] = z[_STIFF_ACROSS, j] / z[_MU_ACROSS, j]
        z[_PER_SIDE, j] = 2.0 / z[_TRACK, j]
        z[_PER_V_MAX, j] = 1.0 / z[_V_MAX, j]
        z[_PER_REST, j] = 1.0 / z[_REST, j]
        z[_V, j] = start[0, j] - start[2, j] * z[_COM_Y, j]
        z[_U, j] = start[1, j] + start[2, j] * z[_COM_X, j]
        z[_R, j] = start[2, j]
        # An integral slower than a second is not built up yet.
        built = z[_KI, j] / (z[_KI, j] + z[_KFF, j])
        for s in range(2):
            read = start[3 + s, j]
            w = read / z[_ENCODER + s, j]
            e = (z[_DRY + s, j] * w / np.sqrt(w * w + dry_speed * dry_speed)
                 + z[_VISCOUS + s, j] * w)
            z[_WHEEL + s, j] = w
            z[_HELD + s, j] = built * (e / (emf / resistance) + emf * w - z[_KFF, j] * read)
        z[_SLOW_V, j] = 0.5 * radius * (start[3, j] + start[4, j]) / z[_SPEED_GAIN, j]
        z[_SLOW_W, j] = radius * (start[4, j] - start[3, j]) / z[_TURN_WIDTH, j]
        z[_COSINE, j] = 1.0
        for i in range(start.shape[0]):
            z[_OUT + i, j] = start[i, j]


@jit_part
def _chassis(z: FloatArray, cosine: float, sine: float, step: float, fixed: FloatArray) -> None:
    # [m v, m u, jz r] before the tyres, whose secant slopes are added to the matrix.
    half, rolling_speed, gravity = 0.5 * fixed[0], fixed[6], fixed[7]
    least, scrub_rate, pull_speed = fixed[9], fixed[10], fixed[11]
    per_step, per_half, per_gravity = 1.0 / step, 1.0 / half, 1.0 / gravity
    for j in range(z.shape[1]):
        gx = -(z[_SLOPE_X, j] * cosine + z[_SLOPE_Y, j] * sine)
        gy = -(-z[_SLOPE_X, j] * sine + z[_SLOPE_Y, j] * cosine)
        side = 0.5 * z[_TRACK, j]
        height = z[_HEIGHT, j]
        front = 0.5 * (1.0 + (z[_COM_X, j] - height * z[_ACC_X, j] * per_gravity) * per_half)
        left = 0.5 * (1.0 + (z[_COM_Y, j] - height * z[_ACC_Y, j] * per_gravity) * z[
            _PER_SIDE, j])
        v, u, r, mass = z[_V, j], z[_U, j], z[_R, j], z[_MASS, j]
        m, jz = mass * per_step, z[_TURNING, j] * per_step
        moving = v * v + side * side * r * r
        z[_A00, j] = m + z[_ROLLING, j] * mass * gravity / np.sqrt(
            v * v + rolling_speed * rolling_speed) + z[_DRAG, j] * abs(v)
        z[_A02, j] = 0.0
        z[_A11, j] = m
        z[_A12, j] = 0.0
        z[_A22, j] = jz + z[_YAW_DAMPING, j] + z[_SCRUB_SPEED, j] * abs(v) + z[
            _SCRUB, j] / np.sqrt(r * r + scrub_rate * scrub_rate)
        z[_B0, j] = m * v + mass * r * u + mass * gx
        z[_B1, j] = m * u - mass * r * v + mass * gy
        z[_B2, j] = jz * r + z[_PULL, j] * moving / (moving + pull_speed * pull_speed)
        z[_FRONT, j] = _within(front, least, 1.0 - least)
        z[_LEFT, j] = _within(left, least, 1.0 - least)
        z[_GX, j] = gx
        z[_GY, j] = gy


@jit_part
def _supply(z: FloatArray, command: FloatArray, k: int, step: float, fixed: FloatArray) -> None:
    # What the loops ask for, both chopped from one supply, whose voltage their currents lower.
    emf, per_resistance, per_radius = fixed[2], 1.0 / fixed[1], 1.0 / fixed[3]
    for j in range(z.shape[1]):
        z[_SLOW_V, j] += z[_FOLLOW, j] * (command[k, 0, j] - z[_SLOW_V, j])
        z[_SLOW_W, j] += z[_FOLLOW, j] * (command[k, 1, j] - z[_SLOW_W, j])
        turn_width, slow_w, kff, kp = z[_TURN_WIDTH, j], z[_SLOW_W, j], z[_KFF, j], z[_KP, j]
        ahead, per_v_max = z[_SPEED_GAIN, j] * z[_SLOW_V, j], z[_PER_V_MAX, j]
        w_left, w_right = z[_WHEEL, j], z[_WHEEL + 1, j]
        read_left, read_right = z[_ENCODER, j] * w_left, z[_ENCODER + 1, j] * w_right
        wanted_left = (ahead + -0.5 * turn_width * slow_w) * per_radius
        wanted_right = (ahead + 0.5 * turn_width * slow_w) * per_radius
        left = kff * wanted_left + kp * (wanted_left - read_left) + z[_HELD, j]
        right = kff * wanted_right + kp * (wanted_right - read_right) + z[_HELD + 1, j]
        left_duty = _within(left * per_v_max, -1.0, 1.0)
        right_duty = _within(right * per_v_max, -1.0, 1.0)
        weak = z[_BUS_RESISTANCE, j] * per_resistance
        z[_BUS, j] = (1.0 - z[_DROOP, j] * step * k + weak * emf * (
            left_duty * w_left + right_duty * w_right) * per_v_max) / (
                1.0 + weak * (left_duty * left_duty + right_duty * right_duty))
        z[_WANTED, j], z[_WANTED + 1, j] = wanted_left, wanted_right
        z[_VOLTS, j], z[_VOLTS + 1, j] = left, right


@jit_part
def _tyre(z: FloatArray, s: int, f: int, fixed: FloatArray) -> None:
    half, gravity, i = 0.5 * fixed[0], fixed[7], 2 * s + f
    for j in range(z.shape[1]):
        side, left, front = 0.5 * z[_TRACK, j], z[_LEFT, j], z[_FRONT, j]
        y = (side if s == 0 else -side) - z[_COM_Y, j]
        x = (half if f == 0 else -half) - z[_COM_X, j]
        load = z[_MASS, j] * gravity * (left if s == 0 else 1.0 - left) * (
            front if f == 0 else 1.0 - front)
        rolled, r, build = z[_RADIUS + s, j] * z[_WHEEL + s, j], z[_R, j], z[_BUILD, j]
        stiff_x, stiff_y = z[_STIFF_ALONG, j], z[_STIFF_ACROSS, j]
        sx = (z[_V, j] - r * y - rolled) * z[_PER_ALONG, j]
        sy = (z[_U, j] + r * x) * z[_PER_ACROSS, j]
        edge = z[_CREEP, j] + z[_SHARE, j] * abs(rolled)
        slid = np.sqrt(sx * sx + sy * sy)
        both = slid + edge
        # It settles at slid / (slid + edge - shape * slid * edge / (slid + edge)) of its most.
        softer = 1.0 / (1.0 + build * (both - z[_SHAPE, j] * slid * edge / both))
        carried = load * softer
        c = stiff_y * build * carried
        a = stiff_x * build * carried
        ox = z[_ALONG + i, j] * carried
        oy = z[_ACROSS + i, j] * carried
        z[_SOFTER + i, j] = softer
        z[_FIXED + s, j] = ox if f == 0 else z[_FIXED + s, j] + ox
        z[_A + s, j] = a if f == 0 else z[_A + s, j] + a
        z[_B0, j] -= ox
        z[_B1, j] -= oy
        z[_B2, j] += ox * y - oy * x
        z[_A11, j] += c
        z[_A12, j] += c * x
        z[_A22, j] += c * x * x


@jit_part
def _two_tyres(z: FloatArray, s: int, fixed: FloatArray) -> None:
    # Of one side. Sides and axles are written out: rows are known when code is compiled then, and
    # the loops over lanes become vector instructions.
    _tyre(z, s, 0, fixed)
    _tyre(z, s, 1, fixed)
    for j in range(z.shape[1]):
        y = (0.5 if s == 0 else -0.5) * z[_TRACK, j] - z[_COM_Y, j]
        a = z[_A + s, j]
        z[_A00, j] += a
        z[_A02, j] -= a * y
        z[_A22, j] += a * y * y


@jit_part
def _measured_wheel(z: FloatArray, s: int, wheels: FloatArray, k: int) -> None:
    # The forces with the wheel's rate known.
    for j in range(z.shape[1]):
        y = (0.5 if s == 0 else -0.5) * z[_TRACK, j] - z[_COM_Y, j]
        push = z[_A + s, j] * z[_RADIUS + s, j] * wheels[k + 1, s, j] / z[_ENCODER + s, j]
        z[_B0, j] += push
        z[_B2, j] -= push * y


@jit_part
def _driven_wheel(z: FloatArray, s: int, step: float, fixed: FloatArray, wheels: FloatArray,
                  k: int) -> None:
    emf, dry_speed, rest_rate = fixed[2], fixed[5], fixed[8]
    per_step, per_resistance = 1.0 / step, 1.0 / fixed[1]
    volt_per_amp = emf * per_resistance
    for j in range(z.shape[1]):
        y = (0.5 if s == 0 else -0.5) * z[_TRACK, j] - z[_COM_Y, j]
        w, wanted, volts, bus = z[_WHEEL + s, j], z[_WANTED + s, j], z[_VOLTS + s, j], z[_BUS, j]
        radius, a, dead, i_max = z[_RADIUS + s, j], z[_A + s, j], z[_DEAD, j], z[_I_MAX, j]
        kp, held, inertia = z[_KP, j], z[_HELD + s, j], z[_INERTIA, j]
        encoder = z[_ENCODER + s, j]
        loss = z[_VISCOUS + s, j] + z[_DRY + s, j] / np.sqrt(w * w + dry_speed * dry_speed)
        clipped = _within(volts, -z[_V_MAX, j], z[_V_MAX, j])
        lost = _within(clipped, -dead, dead)
        amps = (bus * (clipped - lost) - emf * w) * per_resistance
        limited, free = abs(amps) > i_max, clipped == volts
        # The torque, and its slope by the wheel's rate, are implicit.
        slope = inertia * per_step + loss + radius * radius * a
        carried = slope + volt_per_amp * emf
        regulated = carried + volt_per_amp * bus * kp * encoder
        per_d = 1.0 / (slope if limited else (regulated if free else carried))
        most = emf * (i_max if amps > 0.0 else -i_max)
        asked = volt_per_amp * bus * ((z[_KFF, j] + kp) * wanted + held - lost)
        given = volt_per_amp * bus * (clipped - lost)
        nw = (inertia * per_step * w + radius * z[_FIXED + s, j]) + (
            most if limited else (asked if free else given))
        # A loop does not integrate further into a limit of the voltage; of one of the current, it
        # may not know.
        share = z[_WINDUP, j] if limited else 1.0
        grown = held + share * z[_KI, j] * (wanted - encoder * w) * step
        held = grown if free or volts * (wanted - encoder * w) < 0.0 else held
        # Whether the wheel stands is as it was measured: a loop that is reset, or is not, by a
        # hair's breadth goes two ways, which no fit of a simulation finds.
        square = (wheels[k, s, j] * z[_PER_REST, j]) ** 2
        fourth = square * square
        faded = held * (1.0 - (1.0 - z[_KEPT, j]) / (1.0 + fourth * fourth))
        z[_HELD + s, j] = faded if abs(wanted) < rest_rate else held
        # Wheel eliminated: w' = (nw + R a (v' - r' y)) / d.
        g = radius * a
        pushed = g * nw * per_d
        z[_B0, j] += pushed
        z[_B2, j] -= y * pushed
        less = g * g * per_d
        z[_A00, j] -= less
        z[_A02, j] += less * y
        z[_A22, j] -= less * y * y
        z[_PER_D + s, j] = per_d
        z[_NW + s, j] = nw


@jit_part
def _solved(z: FloatArray, step: float, keep: float) -> None:
    # Symmetric 3x3, without a coupling of forward and lateral.
    per_step = 1.0 / step
    for j in range(z.shape[1]):
        a00, a02, a11, a12, a22 = z[_A00, j], z[_A02, j], z[_A11, j], z[_A12, j], z[_A22, j]
        b0, b1, b2 = z[_B0, j], z[_B1, j], z[_B2, j]
        k00 = a11 * a22 - a12 * a12
        k01 = a02 * a12
        k02 = -(a02 * a11)
        per_det = 1.0 / (a00 * k00 + a02 * k02)
        v, u, r = z[_V, j], z[_U, j], z[_R, j]
        nv = (k00 * b0 + k01 * b1 + k02 * b2) * per_det
        nu = (k01 * b0 + (a00 * a22 - a02 * a02) * b1 - a00 * a12 * b2) * per_det
        fx = (nv - v) * per_step - r * u - z[_GX, j]
        fy = (nu - u) * per_step + r * v - z[_GY, j]
        z[_ACC_X, j] += keep * (fx - z[_ACC_X, j])
        z[_ACC_Y, j] += keep * (fy - z[_ACC_Y, j])
        z[_OUT_ACC, j] = fx
        z[_OUT_ACC + 1, j] = fy
        z[_V, j] = nv
        z[_U, j] = nu
        z[_R, j] = (k02 * b0 - a00 * a12 * b1 + a00 * a11 * b2) * per_det


@jit_part
def _turned(z: FloatArray, s: int) -> None:
    for j in range(z.shape[1]):
        y = (0.5 if s == 0 else -0.5) * z[_TRACK, j] - z[_COM_Y, j]
        z[_WHEEL + s, j] = (z[_NW + s, j] + z[_RADIUS + s, j] * z[_A + s, j] * (
            z[_V, j] - z[_R, j] * y)) * z[_PER_D + s, j]


@jit_part
def _followed(z: FloatArray, s: int, wheels: FloatArray, k: int) -> None:
    for j in range(z.shape[1]):
        z[_WHEEL + s, j] = wheels[k + 1, s, j] / z[_ENCODER + s, j]


@jit_part
def _bent(z: FloatArray, s: int, f: int, half: float) -> None:
    # The deflections of a tyre.
    i = 2 * s + f
    for j in range(z.shape[1]):
        y = (0.5 if s == 0 else -0.5) * z[_TRACK, j] - z[_COM_Y, j]
        x = (half if f == 0 else -half) - z[_COM_X, j]
        build, softer, r = z[_BUILD, j], z[_SOFTER + i, j], z[_R, j]
        z[_ALONG + i, j] = (z[_ALONG + i, j] + build * z[_STIFF_ALONG, j] * (
            z[_V, j] - r * y - z[_RADIUS + s, j] * z[_WHEEL + s, j])) * softer
        z[_ACROSS + i, j] = (z[_ACROSS + i, j] + build * z[_STIFF_ACROSS, j] * (
            z[_U, j] + r * x)) * softer


@jit_part
def _turn(z: FloatArray, step: float) -> None:
    # Trapezoids, along the heading in the middle of the step. Cosine and sine of half of what a
    # robot turns are series, exact to 1e-13 up to 4 rad/s: calls are no vector instructions.
    for j in range(z.shape[1]):
        v, u, r = z[_V, j] + z[_R, j] * z[_COM_Y, j], z[_U, j] - z[_R, j] * z[_COM_X, j], z[_R, j]
        turned = 0.5 * step * (z[_OUT + 2, j] + r)
        ahead, aside = 0.5 * step * (z[_OUT, j] + v), 0.5 * step * (z[_OUT + 1, j] + u)
        half = 0.5 * turned
        square = half * half
        cos = 1.0 - square * (0.5 - square * (1.0 / 24.0 - square * (1.0 / 720.0)))
        sin = half * (1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0)))
        cosine = z[_COSINE, j] * cos - z[_SINE, j] * sin
        sine = z[_SINE, j] * cos + z[_COSINE, j] * sin
        z[_OUT_PLACE, j] += cosine * ahead - sine * aside
        z[_OUT_PLACE + 1, j] += sine * ahead + cosine * aside
        z[_COSINE, j] = cosine * cos - sine * sin
        z[_SINE, j] = sine * cos + cosine * sin
        z[_OUT_ANGLES, j] += turned
        z[_OUT, j], z[_OUT + 1, j], z[_OUT + 2, j] = v, u, r


@jit_part
def _roll(z: FloatArray, s: int, step: float) -> None:
    for j in range(z.shape[1]):
        read = z[_ENCODER + s, j] * z[_WHEEL + s, j]
        z[_OUT_ANGLES + 1 + s, j] += 0.5 * step * (z[_OUT + 3 + s, j] + read)
        z[_OUT + 3 + s, j] = read


@jit_part
def _noted(z: FloatArray, out: FloatArray, k: int) -> None:
    for i in range(out.shape[1]):
        for j in range(z.shape[1]):
            out[k, i, j] = z[_OUT + i, j]


@jit
def simulate(p: FloatArray, fixed: FloatArray, step: float, command: FloatArray,
             level: FloatArray, wheels: FloatArray, given: bool, start: FloatArray,
             lanes: tuple[int, ...], out: FloatArray) -> None:
    """
    Integrate robots; stiff terms are implicit with the slope of the moment's secant.

    Parameters
    ----------
    p : numpy.ndarray, shape (n_robot, n_lanes)
        As `ROBOT`, for each robot.
    fixed : numpy.ndarray, shape (n_fixed,)
        As `FIXED`.
    step : float
        [s].
    command : numpy.ndarray, shape (n, 2, n_lanes)
        Mean of the accepted command in each step [m/s, rad/s]; not read where `given`.
    level : numpy.ndarray, shape (n, 2)
        Cosine and sine of the heading; zeros where it is not known.
    wheels : numpy.ndarray, shape (n + 1, 2, n_lanes)
        Measured wheel rates [rad/s]: followed where `given`; else they tell a wheel at rest.
    given : bool
        Whether the wheels turn as measured; else they are driven by the commands.
    start : numpy.ndarray, shape (5, n_lanes)
        Forward and lateral speed, yaw rate, wheel rates.
    lanes : tuple of int
        An entry of any value for each robot: the length of a tuple is known to the compiler.
    out : numpy.ndarray, shape (n + 1, 12, n_lanes)
        Filled with `OUTPUTS`.

    """
    z = np.zeros((ROWS, len(lanes)))
    half, keep = 0.5 * fixed[0], step / (step + fixed[4])
    _begin(z, p, start, fixed, step)
    _noted(z, out, 0)
    for k in range(level.shape[0]):
        _chassis(z, level[k, 0], level[k, 1], step, fixed)
        if given:
            _two_tyres(z, 0, fixed)
            _measured_wheel(z, 0, wheels, k)
            _two_tyres(z, 1, fixed)
            _measured_wheel(z, 1, wheels, k)
        else:
            _supply(z, command, k, step, fixed)
            _two_tyres(z, 0, fixed)
            _driven_wheel(z, 0, step, fixed, wheels, k)
            _two_tyres(z, 1, fixed)
            _driven_wheel(z, 1, step, fixed, wheels, k)
        _solved(z, step, keep)
        if given:
            _followed(z, 0, wheels, k)
            _followed(z, 1, wheels, k)
        else:
            _turned(z, 0)
            _turned(z, 1)
        _bent(z, 0, 0, half)
        _bent(z, 0, 1, half)
        _bent(z, 1, 0, half)
        _bent(z, 1, 1, half)
        _turn(z, step)
        _roll(z, 0, step)
        _roll(z, 1, step)
        _noted(z, out, k + 1)
