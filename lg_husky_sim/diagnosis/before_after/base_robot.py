# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A commercial base: limited commands, a wheel-speed loop, four tyres that saturate."""

from __future__ import annotations

from typing import Final

from lg_husky_sim.jit import jit
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray

#: Parameters of the robot, in the order in which the integrator reads them; units and meanings
#: stand in ``config/before_after.yaml``.
ROBOT: Final = (
    'slew_forward', 'slew_yaw', 'limit_forward', 'limit_yaw', 'speed_gain', 'turn_width',
    'loop_feedforward', 'loop_gain', 'loop_integral', 'voltage_limit', 'current_limit',
    'wheel_inertia', 'dry_left', 'dry_right', 'viscous_left', 'viscous_right',
    'grip_along', 'grip_across', 'creep_speed', 'creep_share', 'rolling', 'yaw_damping',
    'mass', 'yaw_inertia', 'com_x', 'com_y', 'com_height', 'radius_left', 'radius_right',
    'slope_x', 'slope_y', 'track', 'deflection', 'rest_leak', 'reference_lag',
    'drag', 'pull', 'scrub', 'scrub_speed', 'dead_voltage', 'bus_resistance', 'droop_rate')
#: Numbers that are not estimated, read behind them.
FIXED: Final = ('wheelbase', 'motor_resistance', 'transmission', 'wheel_radius',
                'load_time', 'dry_speed', 'rolling_speed', 'gravity', 'rest_rate', 'least_share',
                'scrub_rate', 'pull_speed')
#: Columns of what is simulated: base_link's velocity, wheel rates, specific force at the centre,
#: and what they have come to since the start: base_link's place, the angles of the wheels.
OUTPUTS: Final = ('forward', 'lateral', 'yaw', 'left', 'right', 'accel_x', 'accel_y',
                  'x', 'y', 'heading', 'angle_left', 'angle_right')


@jit
def simulate(p: FloatArray, step: float, command: FloatArray, level: FloatArray,
             wheels: FloatArray, given: bool, start: FloatArray, out: FloatArray) -> None:
    """
    Integrate the robot; stiff terms are implicit with the slope of the moment's secant.

    Parameters
    ----------
    p : numpy.ndarray, shape (n_robot + n_fixed,)
        As `ROBOT`, then `FIXED`.
    step : float
        [s].
    command : numpy.ndarray, shape (n, 2)
        Mean of the accepted command in each step [m/s, rad/s].
    level : numpy.ndarray, shape (n, 2)
        Cosine and sine of the heading; zeros where it is not known.
    wheels : numpy.ndarray, shape (n + 1, 2)
        Measured wheel rates [rad/s]; followed where `given`.
    given : bool
    start : numpy.ndarray, shape (5,)
        Forward and lateral speed, yaw rate, wheel rates.
    out : numpy.ndarray, shape (n + 1, 12)
        Filled with `OUTPUTS`.
    """
    speed_gain, turn_width = p[4], p[5]
    kff, kp, ki, v_max, i_max, inertia = p[6], p[7], p[8], p[9], p[10], p[11]
    mux, muy, creep, share, rolling, yaw_damping = p[16], p[17], p[18], p[19], p[20], p[21]
    mass, turning, xc, yc, height = p[22], p[23], p[24], p[25], p[26]
    slope_x, slope_y, track = p[29], p[30], p[31]
    build = step / p[32]
    drag, pull, scrub, scrub_speed = p[35], p[36], p[37], p[38]
    dead, bus_resistance, droop = p[39], p[40], p[41]
    wheelbase, resistance, emf, radius = p[42], p[43], p[44], p[45]
    load_time, dry_speed, rolling_speed, gravity, rest_rate = p[46], p[47], p[48], p[49], p[50]
    least_share, scrub_rate, pull_speed = p[51], p[52], p[53]
    kept = np.exp(-p[33] * step)
    follow = 1.0 - np.exp(-step / p[34])
    half, side = 0.5 * wheelbase, 0.5 * track
    radii = (p[27], p[28])
    dry = (p[12], p[13])
    viscous = (p[14], p[15])
    volt_per_amp = emf / resistance
    v, u, r = start[0] - start[2] * yc, start[1] + start[2] * xc, start[2]
    w = np.array([start[3], start[4]])
    held = np.zeros(2)
    # An integral slower than a second is not built up yet.
    built = ki / (ki + kff)
    for s in range(2):
        e = dry[s] * w[s] / np.sqrt(w[s] * w[s] + dry_speed * dry_speed) + viscous[s] * w[s]
        held[s] = built * (e / volt_per_amp + (emf - kff) * w[s])
    slow_v = 0.5 * radius * (w[0] + w[1]) / speed_gain
    slow_w = radius * (w[1] - w[0]) / turn_width
    acc_x, acc_y = 0.0, 0.0
    keep = step / (step + load_time)
    a = np.zeros(2)
    fixed = np.zeros(2)
    volts = np.zeros(2)
    wanted = np.zeros(2)
    d = np.zeros(2)
    bristle = np.zeros((4, 2))
    soft = np.zeros(4)
    nw = np.zeros(2)
    m = mass / step
    jz = turning / step
    out[0, 0] = v + r * yc
    out[0, 1] = u - r * xc
    out[0, 2] = r
    out[0, 3] = w[0]
    out[0, 4] = w[1]
    for i in range(5, 12):
        out[0, i] = 0.0
    for k in range(command.shape[0]):
        slow_v += follow * (command[k, 0] - slow_v)
        slow_w += follow * (command[k, 1] - slow_w)
        gx = -(slope_x * level[k, 0] + slope_y * level[k, 1])
        gy = -(-slope_x * level[k, 1] + slope_y * level[k, 0])
        front = 0.5 * (1.0 + (xc - height * acc_x / gravity) / half)
        left = 0.5 * (1.0 + (yc - height * acc_y / gravity) / side)
        front = min(max(front, least_share), 1.0 - least_share)
        left = min(max(left, least_share), 1.0 - least_share)
        # Chassis: [m v, m u, jz r] with the tyres' secant slopes c.
        a00 = m + rolling * mass * gravity / np.sqrt(v * v + rolling_speed * rolling_speed)
        a00 += drag * abs(v)
        a01, a02, a11, a12 = 0.0, 0.0, m, 0.0
        a22 = jz + yaw_damping + scrub_speed * abs(v) + scrub / np.sqrt(
            r * r + scrub_rate * scrub_rate)
        moving = v * v + side * side * r * r
        b0 = m * v + mass * r * u + mass * gx
        b1 = m * u - mass * r * v + mass * gy
        b2 = jz * r + pull * moving / (moving + pull_speed * pull_speed)
        bus = 1.0
        if not given:
            for s in range(2):
                turning_part = (-0.5 if s == 0 else 0.5) * turn_width * slow_w
                wanted[s] = (speed_gain * slow_v + turning_part) / radius
                volts[s] = kff * wanted[s] + kp * (wanted[s] - w[s]) + held[s]
            # Both chopped from one supply, whose voltage their currents lower.
            left_duty = min(max(volts[0] / v_max, -1.0), 1.0)
            right_duty = min(max(volts[1] / v_max, -1.0), 1.0)
            weak = bus_resistance / resistance
            bus = (1.0 - droop * step * k + weak * emf * (
                left_duty * w[0] + right_duty * w[1]) / v_max) / (
                    1.0 + weak * (left_duty * left_duty + right_duty * right_duty))
        for s in range(2):
            y = (side if s == 0 else -side) - yc
            a[s] = 0.0
            fixed[s] = 0.0
            across = left if s == 0 else 1.0 - left
            for f in range(2):
                x = (half if f == 0 else -half) - xc
                load = mass * gravity * across * (front if f == 0 else 1.0 - front)
                sx = (v - r * y - radii[s] * w[s]) / mux
                sy = (u + r * x) / muy
                edge = creep + share * abs(radii[s] * w[s])
                i = 2 * s + f
                soft[i] = 1.0 + build * (np.sqrt(sx * sx + sy * sy) + edge)
                c = load * build / soft[i]
                ox = load * bristle[i, 0] / soft[i]
                oy = load * bristle[i, 1] / soft[i]
                fixed[s] += ox
                b0 -= ox
                b1 -= oy
                b2 += ox * y - oy * x
                a[s] += c
                a11 += c
                a12 += c * x
                a22 += c * x * x
            a00 += a[s]
            a02 -= a[s] * y
            a22 += a[s] * y * y
            if given:
                # The forces with the wheel's rate known.
                push = a[s] * radii[s] * wheels[k + 1, s]
                b0 += push
                b2 -= push * y
                continue
            error = wanted[s] - w[s]
            loss = viscous[s] + dry[s] / np.sqrt(w[s] * w[s] + dry_speed * dry_speed)
            d[s] = inertia / step + loss + radii[s] * radii[s] * a[s]
            nw[s] = inertia / step * w[s] + radii[s] * fixed[s]
            clipped = min(max(volts[s], -v_max), v_max)
            lost = min(max(clipped, -dead), dead)
            amps = (bus * (clipped - lost) - emf * w[s]) / resistance
            if abs(amps) > i_max:
                nw[s] += emf * (i_max if amps > 0.0 else -i_max)
            else:
                d[s] += volt_per_amp * emf
                if clipped == volts[s]:
                    d[s] += volt_per_amp * bus * kp
                    nw[s] += volt_per_amp * bus * (
                        (kff + kp) * wanted[s] + held[s] - lost)
                else:
                    nw[s] += volt_per_amp * bus * (clipped - lost)
            if clipped == volts[s] and abs(amps) <= i_max:
                held[s] += ki * error * step
            if abs(wanted[s]) < rest_rate:
                held[s] *= kept
            # Wheel eliminated: w' = (nw + R a (v' - r' y)) / d.
            g = radii[s] * a[s]
            b0 += g * nw[s] / d[s]
            b2 -= y * g * nw[s] / d[s]
            carried = g * g / d[s]
            a00 -= carried
            a02 += carried * y
            a22 -= carried * y * y
        # Symmetric 3x3.
        k00 = a11 * a22 - a12 * a12
        k01 = a02 * a12 - a01 * a22
        k02 = a01 * a12 - a02 * a11
        det = a00 * k00 + a01 * k01 + a02 * k02
        nv = (k00 * b0 + k01 * b1 + k02 * b2) / det
        nu = (k01 * b0 + (a00 * a22 - a02 * a02) * b1 + (a01 * a02 - a00 * a12) * b2) / det
        nr = (k02 * b0 + (a01 * a02 - a00 * a12) * b1 + (a00 * a11 - a01 * a01) * b2) / det
        fx = (nv - v) / step - r * u - gx
        fy = (nu - u) / step + r * v - gy
        acc_x += keep * (fx - acc_x)
        acc_y += keep * (fy - acc_y)
        out[k + 1, 5] = fx
        out[k + 1, 6] = fy
        v, u, r = nv, nu, nr
        for s in range(2):
            y = (side if s == 0 else -side) - yc
            if given:
                w[s] = wheels[k + 1, s]
            else:
                w[s] = (nw[s] + radii[s] * a[s] * (v - r * y)) / d[s]
            for f in range(2):
                i = 2 * s + f
                x = (half if f == 0 else -half) - xc
                bristle[i, 0] = (bristle[i, 0] + build * (v - r * y - radii[s] * w[s])) / soft[i]
                bristle[i, 1] = (bristle[i, 1] + build * (u + r * x)) / soft[i]
        out[k + 1, 0] = v + r * yc
        out[k + 1, 1] = u - r * xc
        out[k + 1, 2] = r
        out[k + 1, 3] = w[0]
        out[k + 1, 4] = w[1]
        # Trapezoids, along the heading in the middle of the step.
        middle = out[k, 9] + 0.25 * step * (out[k, 2] + out[k + 1, 2])
        cos, sin = np.cos(middle), np.sin(middle)
        ahead = 0.5 * step * (out[k, 0] + out[k + 1, 0])
        aside = 0.5 * step * (out[k, 1] + out[k + 1, 1])
        out[k + 1, 7] = out[k, 7] + cos * ahead - sin * aside
        out[k + 1, 8] = out[k, 8] + sin * ahead + cos * aside
        out[k + 1, 9] = out[k, 9] + 0.5 * step * (out[k, 2] + out[k + 1, 2])
        for s in range(2):
            out[k + 1, 10 + s] = out[k, 10 + s] + 0.5 * step * (out[k, 3 + s] + out[k + 1, 3 + s])


@jit
def mean_in_bins(rows: FloatArray, start: float, step: float, times: FloatArray,
                 edges: NDArray[np.intp], later: float, out: FloatArray) -> None:
    """
    Read rows at the stamps of samples, and average these in bins.

    Parameters
    ----------
    rows : numpy.ndarray, shape (n_rows, k)
        Evenly spaced in time; between two it is linear.
    start, step : float
        Time of the first row and spacing [s].
    times : numpy.ndarray, shape (n_samples,)
        Stamps [s].
    edges : numpy.ndarray of int, shape (n_bins,)
        First sample of each bin.
    later : float
        What is added to the stamps [s].
    out : numpy.ndarray, shape (n_bins, k)
        Receives the means.
    """
    last = rows.shape[0] - 1.000001
    for b in range(edges.size):
        first = edges[b]
        end = edges[b + 1] if b + 1 < edges.size else times.size
        for c in range(rows.shape[1]):
            out[b, c] = 0.0
        for i in range(first, end):
            place = min(max((times[i] + later - start) / step, 0.0), last)
            index = int(place)
            share = place - index
            for c in range(rows.shape[1]):
                out[b, c] += rows[index, c] * (1.0 - share) + rows[index + 1, c] * share
        for c in range(rows.shape[1]):
            out[b, c] /= end - first
