# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The event-driven stepping function: exact between events for the linear part, for any spacing.

Between two events (a command that takes effect, the end of a ramp, a voltage at its clamp, an
onset) the voltages are straight lines of time. Efforts are followed by steps of adaptive length:
a parabola through the efforts at the start, the middle and the end of a step, found by iteration,
forces the modes, which are exact under it (exponential collocation; Hochbruck and Ostermann,
2010, sec. 2.2). Requested times are read off that solution and make no steps.

The flat state vector S is laid out as (n = states of the graph and of its controllers)::

    S[0:n]       states
    S[n:n+4]     angle_left, angle_right, distance, heading
    S[n+4:n+7]   x, y, time
    S[n+7:n+11]  memories (laws.MEMORY)
    S[n+11:n+13] shaped command (forward, yaw)
    S[n+13:n+15] command in force before the first one that takes effect
"""

from __future__ import annotations

import math
from typing import NamedTuple

from lg_husky_sim.husky.laws import CONTEXT, evaluate, MEMORY
from lg_husky_sim.jit import jit, jit_call, jit_part
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation.effort_kernel import arguments, bend, solve, Step, surroundings
from lg_husky_sim.simulation.modal_kernel import add_product, advance, Packed, phis, rate_of
import numpy as np
from numpy.typing import NDArray

#: Columns of an output row.
COLUMNS = ('wheel_left', 'wheel_right', 'forward', 'yaw_rate', 'current_left', 'current_right',
           'accel_x', 'angle_left', 'angle_right', 'distance', 'heading', 'x', 'y',
           'voltage_left', 'voltage_right')
#: Entries of the flat state behind those of graph and controllers.
TAIL = 4 + 3 + MEMORY + 2 + 2
#: Shortest and longest step of a plant with efforts [s].
SHORTEST, LONGEST = 1e-5, 0.025
#: Panels of the pose: the first after a jump [s], growth with the time since then, the longest
#: [s], and turned in one [rad].
PANEL_FIRST, PANEL_GROWTH, PANEL, PANEL_TURN = 0.0005, 0.35, 0.008, 0.01
#: Relative room in which a voltage is at its clamp; time that tells two events apart [s].
ROOM, APART = 1e-9, 1e-12


class Drive(NamedTuple):
    """
    What the command does at an event, for forward speed and yaw rate.

    ``wanted`` is in force, ``shaped`` behind limits and ramps, ``slopes`` are those of the ramps,
    ``ramps`` the times at which they end, ``goals`` where; ``given`` counts the commands that
    have taken effect.
    """

    wanted: FloatArray
    shaped: FloatArray
    slopes: FloatArray
    ramps: FloatArray
    goals: FloatArray
    given: NDArray[np.int64]


@jit_part
def _clamped(u: FloatArray, du: FloatArray, clamp: float, t: float, until: float) -> float:
    # Hold voltages at the clamp, and return when the next one meets or leaves it.
    for i in range(2):
        over = abs(u[i]) - clamp
        outward = du[i] * u[i]
        if over >= -ROOM * clamp and (outward >= 0.0 or over > ROOM * clamp):
            if outward < 0.0:
                until = min(until, t + over / abs(du[i]))
            u[i] = math.copysign(clamp, u[i])
            du[i] = 0.0
        elif outward > 0.0 or (du[i] != 0.0 and u[i] == 0.0):
            until = min(until, t - over / abs(du[i]))
        elif outward < 0.0:
            until = min(until, t + (abs(u[i]) + clamp) / abs(du[i]))
    return until


@jit_part
def _event(plant: Packed, c: int, t: float, end: float, stamps: FloatArray, values: FloatArray,
           drive: Drive, u: FloatArray, du: FloatArray) -> float:
    # Set the voltages and their slopes from t on, and return until when they are straight.
    latency = plant.stages[c, 0]
    given = drive.given[0]
    while given < stamps.size and stamps[given] + latency <= t:
        drive.wanted[0], drive.wanted[1] = values[given, 0], values[given, 1]
        given += 1
    drive.given[0] = given
    until = end
    while given < stamps.size and stamps[given] + latency < until:
        if values[given, 0] != drive.wanted[0] or values[given, 1] != drive.wanted[1]:
            until = stamps[given] + latency
        given += 1
    for i in range(2):
        limit, slew = plant.stages[c, 3 + i], plant.stages[c, 1 + i]
        if t >= drive.ramps[i]:
            drive.shaped[i] = drive.goals[i]
        drive.goals[i] = max(-limit, min(limit, drive.wanted[i]))
        if slew == np.inf:
            drive.shaped[i] = drive.goals[i]
        drive.slopes[i], drive.ramps[i] = 0.0, np.inf
        if drive.shaped[i] != drive.goals[i]:
            drive.slopes[i] = math.copysign(slew, drive.goals[i] - drive.shaped[i])
            drive.ramps[i] = t + (drive.goals[i] - drive.shaped[i]) / drive.slopes[i]
            until = min(until, drive.ramps[i])
    speed, turn = plant.stages[c, 5], plant.stages[c, 6]
    u[0] = speed * drive.shaped[0] - turn * drive.shaped[1]
    u[1] = speed * drive.shaped[0] + turn * drive.shaped[1]
    du[0] = speed * drive.slopes[0] - turn * drive.slopes[1]
    du[1] = speed * drive.slopes[0] + turn * drive.slopes[1]
    clamp = plant.stages[c, 7]
    if clamp > 0.0:
        until = _clamped(u, du, clamp, t, until)
    if until <= t < end:
        until = min(end, t + APART * max(1.0, abs(t)))
    return until


@jit_part
def _change_set(plant: Packed, old: int, c: int, states: FloatArray, xi: FloatArray) -> None:
    # Modes of another set for the same states; those of the start where old is negative.
    if old >= 0:
        for i in range(states.size):
            states[i] = 0.0
            for m in range(xi.size):
                states[i] += plant.out_of[old, i, m] * xi[m]
    for m in range(xi.size):
        xi[m] = 0.0
        for i in range(states.size):
            xi[m] += plant.into[c, m, i] * states[i]


@jit_part
def _row(out: FloatArray, j: int, y: FloatArray, s: FloatArray, n: int, four: FloatArray,
         x: float, y_place: float, play: FloatArray) -> None:
    # Encoders turn with the motors, which run ahead of the wheels within the gears' play.
    for i in range(7):
        out[j, i] = y[i]
    out[j, 0] += play[2]
    out[j, 1] += play[3]
    for i in range(4):
        out[j, 7 + i] = s[n + i] + four[i]
    out[j, 7] += play[0]
    out[j, 8] += play[1]
    out[j, 11], out[j, 12] = x, y_place
    out[j, 13], out[j, 14] = y[7], y[8]


@jit_part
def _play_at(step: Step, memory: FloatArray, goal: float, whole: float, play: FloatArray
             ) -> None:
    # Play of both gears and its rates: a parabola through the places where it is known.
    for i in range(2, 4):
        slope = (4.0 * step.middle[i] - 3.0 * memory[i] - step.finish[i]) / whole
        bend_by = 2.0 * (memory[i] - 2.0 * step.middle[i] + step.finish[i]) / (whole * whole)
        play[i - 2] = memory[i] + goal * (slope + goal * bend_by)
        play[i] = slope + 2.0 * goal * bend_by


@jit_part
def _outputs(plant: Packed, c: int, xi: FloatArray, u: FloatArray, f: FloatArray, y: FloatArray
             ) -> None:
    for i in range(y.size):
        y[i] = 0.0
    add_product(plant.cy, c, xi, xi.size, y)
    add_product(plant.cu, c, u, 2, y)
    add_product(plant.cf, c, f, f.size, y)


@jit_call
def _follow(s: FloatArray, stamps: FloatArray, values: FloatArray, times: FloatArray,
            out: FloatArray, end: float, fine: bool, plant: Packed, step: Step, drive: Drive,
            p: FloatArray, y: FloatArray, play: FloatArray, states: FloatArray,
            memory: FloatArray) -> int:
    # What run does, with its arrays: here none is counted.
    n, size, most = plant.out_of.shape[1], plant.rates.shape[1], plant.laws.shape[1]
    xi, r, q, u, du, f0, xt = step.xi, step.r, step.q, step.u, step.du, step.f0, step.xt
    four, tangent, ut, new, work = step.four, step.tangent, step.ut, step.new, step.work
    for i in range(2):
        drive.shaped[i], drive.wanted[i] = s[n + 11 + i], s[n + 13 + i]
    t, until, onset, kind = s[n + 6], s[n + 6], plant.onset[1], plant.onset[0]
    # Whether the second set is in force: a place is crossed where it is found to be.
    beyond = (kind == 1.0 and t >= onset) or (kind == 2.0 and s[n + 4] >= onset) or (
        kind == 3.0 and s[n + 4] <= onset)
    j, c, steps, started = 0, -1, 0, False
    h, before, growth = 0.0, 0.0, 1.0
    tangent[0], tangent[1] = math.cos(s[n + 3]), math.sin(s[n + 3])
    while True:
        if t >= until:
            if c != int(beyond):
                _change_set(plant, c, int(beyond), states, xi)
                c = int(beyond)
                drive.given[0] = 0
                drive.wanted[0], drive.wanted[1] = s[n + 13], s[n + 14]
            if t >= end and started:
                break
            until = _event(plant, c, t, end, stamps, values, drive, u, du)
            if kind == 1.0 and not beyond:
                until = min(until, max(onset, t))
            n_real, n_pairs, efforts = plant.counts[c, 0], plant.counts[c, 1], plant.counts[c, 2]
            before, growth, h = 0.0, 1.0, plant.first_step[c, 0]
            for i in range(4):
                four[i] = 0.0
            if efforts > 0:
                arguments(plant, c, 0, xi, u, step.z, step.line)
                surroundings(step.context, t, s, n, four, tangent)
                evaluate(c, plant.laws, plant.coefficients, plant.offsets, step.line,
                         step.context, memory, f0)
            _outputs(plant, c, xi, u, f0, y)
            if not started:
                started = True
                play[0], play[1] = memory[2], memory[3]
                while j < times.size and times[j] <= t:
                    _row(out, j, y, s, n, four, s[n + 4], s[n + 5], play)
                    j += 1
                if until <= t:
                    continue
        left = until - t
        degree = 1 if du[0] != 0.0 or du[1] != 0.0 else 0
        for i in range(size):
            work[i] = plant.bm[c, 0, i] * u[0] + plant.bm[c, 1, i] * u[1]
        add_product(plant.gm, c, f0, efforts, work)
        rate_of(c, plant.rates, n_real, n_pairs, xi, work, r)
        if efforts == 0:
            h = left
            bend(plant, c, h, step)
        else:
            degree = 2
            h = min(h, LONGEST)
            if h >= 0.8 * left:
                h = left
            elif h > 0.5 * left:
                h = 0.5 * left
            error = solve(plant, c, s, n, t, h, before, step, memory)
            if error < 0.0 and h > 1.5 * SHORTEST:
                h, before = max(SHORTEST, 0.3 * h), 0.0
                continue
            share = 0.85 / math.sqrt(math.sqrt(max(error, 1e-3)))
            if error > 1.0 and h > 1.5 * SHORTEST:
                h = max(SHORTEST, h * max(0.2, min(0.5, share)))
                continue
            growth = max(0.3, min(3.0, share))
        steps += 1
        # Points inside the step: requested times, panels of the pose, its end.
        whole, tau, gone, turned_before = h, 0.0, 0.0, 0.0
        lower, upper, searching = 0.0, 0.0, False
        while True:
            asked = False
            if searching:
                goal = 0.5 * (lower + upper)
                if upper - lower <= APART or goal <= lower or goal >= upper:
                    goal = upper
                    h = upper
            else:
                goal = h
                if j < times.size and times[j] - t <= h:
                    goal = times[j] - t
                    asked = True
                if fine:
                    limit = min(min(PANEL, max(PANEL_FIRST, PANEL_GROWTH * tau)),
                                PANEL_TURN / max(abs(y[3]), 1e-9))
                    if goal - tau > limit:
                        goal = tau + min(limit, 0.5 * (goal - tau))
                        asked = False
            phis(goal, plant.rates, c, n_real, n_pairs, p)
            advance(goal, 0, xi, r, q, p, n_real, n_pairs, degree, xt)
            advance(goal, 1, xi, r, q, p, n_real, n_pairs, degree, work)
            v, w, a, b = y[2], y[3], y[10], y[9]
            for i in range(4):
                four[i] = 0.0
            add_product(plant.ci, c, work, size, four)
            ut[0], ut[1] = u[0] + goal * du[0], u[1] + goal * du[1]
            for e in range(most):
                new[e] = f0[e] + goal * (step.a1[e] + goal * step.a2[e])
            _outputs(plant, c, xt, ut, new, y)
            # Corrected trapezoid of the sine and of the missing part of the cosine.
            turned, went, width = four[3] - turned_before, four[2] - gone, goal - tau
            sine, less = math.sin(turned), math.sin(0.5 * turned)
            less = -2.0 * less * less
            across = 0.5 * width * y[2] * sine + width * width / 12.0 * (
                v * w - y[10] * sine - y[2] * y[3] * (1.0 + less))
            along = went + 0.5 * width * y[2] * less - width * width / 12.0 * (
                y[10] * less - y[2] * y[3] * sine)
            x_new = s[n + 4] + tangent[0] * along - tangent[1] * across
            y_new = s[n + 5] + tangent[1] * along + tangent[0] * across
            if kind >= 2.0:
                there = x_new >= onset if kind == 2.0 else x_new <= onset
                if searching and goal < upper:
                    if there != beyond:
                        upper = goal
                    else:
                        lower = goal
                elif not searching and there != beyond:
                    searching, lower, upper, h = True, tau, goal, whole
                    goal = -1.0
                elif searching:
                    beyond = not beyond
                if searching and goal < h:
                    y[2], y[3], y[10], y[9] = v, w, a, b
                    continue
            s[n + 4], s[n + 5] = x_new, y_new
            cosine = tangent[0] * (1.0 + less) - tangent[1] * sine
            tangent[1] = tangent[1] * (1.0 + less) + tangent[0] * sine
            tangent[0] = cosine
            turned_before, gone, tau = four[3], four[2], goal
            if asked:
                if plant.counts[c, 4]:
                    _play_at(step, memory, goal, whole, play)
                while j < times.size and times[j] - t <= goal:
                    _row(out, j, y, s, n, four, x_new, y_new, play)
                    j += 1
            if goal >= h:
                break
        for i in range(size):
            xi[i] = xt[i]
        for i in range(4):
            s[n + i] += four[i]
        u[0], u[1] = ut[0], ut[1]
        for i in range(2):
            drive.shaped[i] += h * drive.slopes[i]
        for e in range(most):
            f0[e], step.b1[e], step.b2[e] = new[e], step.a1[e], step.a2[e]
        if efforts > 0:
            for i in range(MEMORY):
                memory[i] += h / whole * (step.finish[i] - memory[i])
            for i in range(step.line.size):
                step.z[0, i] = step.z[2, i]
        t = until if h >= left and not searching else t + h
        if searching:
            until = t
        elif kind == 1.0 and t >= onset:
            beyond = True
        before, h = h, h * growth
    _change_set(plant, c, c, states, xi)
    s[n + 6] = t
    for i in range(2):
        s[n + 11 + i], s[n + 13 + i] = drive.shaped[i], drive.wanted[i]
    return steps


@jit
def run(s: FloatArray, stamps: FloatArray, values: FloatArray, times: FloatArray,
        out: FloatArray, end: float, fine: bool, plant: Packed) -> int:
    """
    Advance the flat state ``s`` to ``end`` [s], in place.

    Parameters
    ----------
    s : numpy.ndarray
        Flat state, laid out as the module says.
    stamps, values : numpy.ndarray, shapes (n_commands,), (n_commands, 2)
        Commands [m/s, rad/s] and when they are given [s], not decreasing; each holds until the
        next.
    times : numpy.ndarray, shape (n_times,)
        Where output is wanted [s], not decreasing, from the state's time to ``end``.
    out : numpy.ndarray, shape (n_times, 15)
        Receives :data:`COLUMNS`; at a jump, what was before it.
    end : float
    fine : bool
        Whether x and y are wanted to better than 1e-7 m; else they are chords between the times.
    plant : Packed

    Returns
    -------
    int
        Steps taken.
    """
    n, size, most = plant.out_of.shape[1], plant.rates.shape[1], plant.laws.shape[1]
    step = Step(
        np.zeros(size), np.zeros(size), np.zeros((2, size)), np.zeros(2), np.zeros(2),
        np.zeros(most), np.zeros(most), np.zeros(most), np.zeros(most), np.zeros(most),
        np.zeros(most), np.zeros(most), np.zeros((3, plant.hm.shape[2])),
        np.zeros(plant.hm.shape[2]), np.zeros(CONTEXT), np.zeros(MEMORY), np.zeros(MEMORY),
        np.zeros(2), np.zeros((4, size)), np.zeros((4, size)), np.zeros(size), np.zeros(size),
        np.zeros(2), np.zeros(4), np.zeros(most), np.zeros(most), np.zeros(most),
        np.zeros(most), np.zeros(most))
    drive = Drive(np.zeros(2), np.zeros(2), np.zeros(2), np.full(2, np.inf), np.zeros(2),
                  np.zeros(1, dtype=np.int64))
    return _follow(s, stamps, values, times, out, end, fine, plant, step, drive,
                   np.zeros((4, size)), np.zeros(plant.cy.shape[2]), np.zeros(4), s[:n],
                   s[n + 7:n + 11])
