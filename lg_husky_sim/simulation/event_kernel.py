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
    S[n+7:...]   memories (laws.MEMORY)
    S[n+SHAPED:] shaped command (forward, yaw)
    S[n+WANTED:] command in force before the first one that takes effect (forward, yaw)
"""

from __future__ import annotations

import math

from lg_husky_sim.husky.laws import CONTEXT, evaluate, MEMORY
from lg_husky_sim.jit import jit, jit_call, jit_part
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation.command_kernel import APART, Drive, next_event
from lg_husky_sim.simulation.effort_kernel import arguments, bend, solve, Step, surroundings
from lg_husky_sim.simulation.modal_kernel import Packed, rate_of
from lg_husky_sim.simulation.reading_kernel import (
    ACCELERATION,
    Block,
    go,
    go_by_arc,
    LANES,
    read,
    ROWS,
    write_row,
    YAW_ACCELERATION,
)
import numpy as np
from numpy.typing import NDArray

#: Columns of an output row.
COLUMNS = ('wheel_left', 'wheel_right', 'forward', 'yaw_rate', 'current_left', 'current_right',
           'accel_x', 'angle_left', 'angle_right', 'distance', 'heading', 'x', 'y',
           'voltage_left', 'voltage_right')
#: Where commands stand in the flat state, behind the n states of graph and controllers, and how
#: many entries there are behind those.
SHAPED = 4 + 3 + MEMORY
WANTED, TAIL = SHAPED + 2, SHAPED + 4
#: Shortest and longest step of a plant with efforts [s].
SHORTEST, LONGEST = 1e-5, 0.05
#: Panels of the pose: the first after a jump [s], growth with the time since then, the longest
#: [s], turned in one [rad], and how much faster than at the last point a base may turn [rad/s].
PANEL_FIRST, PANEL_GROWTH, PANEL, PANEL_TURN, FASTER = 0.0005, 0.35, 0.008, 0.01, 0.5


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
def _play_at(step: Step, memory: FloatArray, goal: float, whole: float, play: FloatArray
             ) -> None:
    # Play of both gears and its rates: a parabola through the places where it is known.
    for i in range(2, 4):
        middle, finish = step.kept[0, i], step.kept[1, i]
        slope = (4.0 * middle - 3.0 * memory[i] - finish) / whole
        bend_by = 2.0 * (memory[i] - 2.0 * middle + finish) / (whole * whole)
        play[i - 2] = memory[i] + goal * (slope + goal * bend_by)
        play[i] = slope + 2.0 * goal * bend_by


@jit_part
def _moving(plant: Packed, c: int, efforts: int, step: Step, last: FloatArray) -> None:
    # Speed, yaw rate and their derivatives, just after an event.
    n = plant.out_of.shape[1]
    for k in range(4):
        row = 2 + k if k < 2 else (ACCELERATION if k == 2 else YAW_ACCELERATION)
        last[k] = (plant.cy[c, row, n] * step.u[0] + plant.cy[c, row, n + 1] * step.u[1])
        for i in range(n):
            last[k] += plant.cy[c, row, i] * step.xi[i]
        for e in range(efforts):
            last[k] += plant.cy[c, row, n + 2 + e] * step.f[0, e]


@jit_part
def _points(times: FloatArray, j: int, t: float, h: float, tau: float, turning: float,
            fine: bool, goals: FloatArray) -> int:
    # Put the next points of a step after tau into goals: wanted times, panels, its end.
    count, k, last = 0, j, tau
    while count < LANES and (last < h or count == 0):
        goal = h
        if k < times.size and times[k] - t <= h:
            goal = times[k] - t
        if fine:
            limit = min(min(PANEL, max(PANEL_FIRST, PANEL_GROWTH * last)),
                        PANEL_TURN / (abs(turning) + FASTER))
            if goal - last > limit:
                goal = last + min(limit, 0.5 * (goal - last))
        while k < times.size and times[k] - t <= goal:
            k += 1
        goals[count] = goal
        count += 1
        last = goal
    for g in range(count, LANES):
        goals[g] = last
    return count


@jit_call
def _follow(s: FloatArray, stamps: FloatArray, values: FloatArray, times: FloatArray,
            places: NDArray[np.int64], out: FloatArray, end: float, fine: bool, plant: Packed,
            step: Step, block: Block, drive: Drive, last: FloatArray, moved: FloatArray,
            play: FloatArray, states: FloatArray, memory: FloatArray) -> int:
    # What run does, with its arrays: here none is counted.
    n, size = plant.out_of.shape[1], plant.rates.shape[1]
    xi, r, u, du = step.xi, step.r, step.u, step.du
    goals, tangent, work = block.goals, step.tangent, step.work
    for i in range(2):
        drive.shaped[i], drive.wanted[i] = s[n + SHAPED + i], s[n + WANTED + i]
        play[i] = memory[2 + i]
    t, until, onset, kind = s[n + 6], s[n + 6], plant.onset[1], plant.onset[0]
    # Whether the second set is in force: a place is crossed where it is found to be.
    beyond = (kind == 1.0 and t >= onset) or (kind == 2.0 and s[n + 4] >= onset) or (
        kind == 3.0 and s[n + 4] <= onset)
    j, c, steps, efforts = 0, -1, 0, 0
    h, before, growth = 0.0, 0.0, 1.0
    # The first step after a jump of the voltage: its length, the jump and the error.
    opening, jump, opened = 0.0, 0.0, 0.0
    tangent[0], tangent[1] = math.cos(s[n + 3]), math.sin(s[n + 3])
    while True:
        if t >= until:
            if c != int(beyond):
                _change_set(plant, c, int(beyond), states, xi)
                c = int(beyond)
                drive.given[0] = 0
                drive.wanted[0], drive.wanted[1] = s[n + WANTED], s[n + WANTED + 1]
                jump = 0.0
            if t >= end and steps > 0:
                break
            v, w = u[0], u[1]
            until = next_event(plant, c, t, end, stamps, values, drive, u, du)
            if kind == 1.0 and not beyond:
                until = min(until, max(onset, t))
            efforts = plant.counts[c, 2]
            size_of = abs(u[0] - v) + abs(u[1] - w)
            h = plant.first_step[c, 0]
            if jump > 0.0:
                share = 1.0
                if size_of > 0.0:
                    share = 0.5 * jump / (size_of * max(opened, 1e-3))
                h = max(h, opening * max(0.1, min(5.0, math.sqrt(math.sqrt(share)))))
            jump = size_of
            before, growth = 0.0, 1.0
            if efforts > 0:
                for i in range(4):
                    step.four[i] = 0.0
                arguments(plant, c, 0, xi, u, step.z, step.line)
                surroundings(step.context, t, s, n, step.four, tangent)
                evaluate(c, plant.laws, plant.coefficients, plant.offsets, step.line,
                         step.context, memory, step.new)
                for e in range(efforts):
                    step.f[0, e] = step.new[e]
            _moving(plant, c, efforts, step, last)
        left = until - t
        for i in range(size):
            work[i] = plant.bm[c, 0, i] * u[0] + plant.bm[c, 1, i] * u[1]
            for e in range(efforts):
                work[i] += plant.gm[c, e, i] * step.f[0, e]
        rate_of(c, plant.rates, plant.counts[c, 0], plant.counts[c, 1], xi, work, r)
        if efforts == 0 or left <= 0.0:
            h = left
            if h > 0.0:
                bend(plant, c, h, step)
            else:
                step.parabola[:] = 0.0
                step.q[:] = 0.0
        else:
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
            if before == 0.0:
                opening, opened = h, error
        steps += 1
        # Points inside the step: requested times, panels of the pose, its end.
        whole, tau, went, turned = h, 0.0, 0.0, 0.0
        lower, upper, searching, g = 0.0, 0.0, False, 0
        while True:
            count = LANES
            if searching:
                for i in range(LANES):
                    goals[i] = lower + (upper - lower) * ((i + 1) / LANES)
                goals[LANES - 1] = upper
            else:
                count = _points(times, j, t, h, tau, last[1], fine, goals)
            read(plant, c, efforts, xi, r, step.q, u, du, step.f, step.parabola, block)
            g = 0
            while g < count:
                if fine:
                    go(goals[g] - tau, block.driven[2, g] - went, block.driven[3, g] - turned,
                       last, block, g, moved)
                else:
                    go_by_arc(block.driven[2, g] - went, block.driven[3, g] - turned, moved)
                x_new = s[n + 4] + tangent[0] * moved[0] - tangent[1] * moved[1]
                if kind >= 2.0:
                    there = x_new >= onset if kind == 2.0 else x_new <= onset
                    if searching and (there != beyond or g == LANES - 1):
                        upper = goals[g]
                        if g > 0:
                            lower = goals[g - 1]
                        if upper - lower > APART and lower < 0.5 * (lower + upper) < upper:
                            break
                        beyond, h = not beyond, upper
                    elif searching:
                        g += 1
                        continue
                    elif there != beyond:
                        searching, lower, upper = True, tau, goals[g]
                        break
                s[n + 5] += tangent[1] * moved[0] + tangent[0] * moved[1]
                s[n + 4] = x_new
                cosine = tangent[0] * (1.0 + moved[3]) - tangent[1] * moved[2]
                tangent[1] = tangent[1] * (1.0 + moved[3]) + tangent[0] * moved[2]
                tangent[0] = cosine
                went, turned, tau = block.driven[2, g], block.driven[3, g], goals[g]
                last[0], last[1] = block.outputs[2, g], block.outputs[3, g]
                last[2], last[3] = block.outputs[ACCELERATION, g], block.outputs[
                    YAW_ACCELERATION, g]
                if j < times.size and times[j] - t <= tau:
                    if plant.counts[c, 4] and whole > 0.0:
                        _play_at(step, memory, tau, whole, play)
                    while j < times.size and times[j] - t <= tau:
                        write_row(out, places[j], block, g, s, n, play)
                        j += 1
                if tau >= h:
                    break
                g += 1
            if tau >= h:
                break
        for i in range(n):
            xi[i] = block.values[i, g]
        for i in range(4):
            s[n + i] += block.driven[i, g]
        for i in range(2):
            u[i] += h * du[i]
            drive.shaped[i] += h * drive.slopes[i]
        for e in range(efforts):
            step.f[0, e] = block.values[n + 2 + e, g]
            step.former[0, e], step.former[1, e] = step.parabola[0, e], step.parabola[1, e]
        if efforts > 0 and whole > 0.0:
            if plant.counts[c, 4]:
                for i in range(MEMORY):
                    memory[i] += h / whole * (step.kept[1, i] - memory[i])
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
        s[n + SHAPED + i], s[n + WANTED + i] = drive.shaped[i], drive.wanted[i]
    return steps


@jit
def run(s: FloatArray, stamps: FloatArray, values: FloatArray, times: FloatArray,
        places: NDArray[np.int64], out: FloatArray, end: float, fine: bool, plant: Packed) -> int:
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
    places : numpy.ndarray of int64, shape (n_times,)
        Row of the output that each time has.
    out : numpy.ndarray, shape (n_times, 15)
        Receives :data:`COLUMNS`; at a jump, what was before it.
    end : float
    fine : bool
        Whether x and y are wanted to better than 1e-7 m; else they are arcs between the points.
    plant : Packed

    Returns
    -------
    int
        Steps taken.
    """
    n, size, most = plant.out_of.shape[1], plant.rates.shape[1], plant.laws.shape[1]
    count = plant.hm.shape[2]
    step = Step(
        np.zeros(size), np.zeros(size), np.zeros((2, size)), np.zeros(2), np.zeros(2),
        np.zeros((3, most)), np.zeros((2, most)), np.zeros((2, most)), np.zeros((4, count)),
        np.zeros(count), np.zeros(count), np.zeros(CONTEXT), np.zeros(MEMORY),
        np.zeros((2, MEMORY)), np.zeros(2), np.zeros((3, 4, size)), np.zeros(size),
        np.zeros(size), np.zeros(2), np.zeros(4), np.zeros((3, most)), np.zeros((3, most)),
        np.zeros(most))
    block = Block(
        np.zeros(LANES), np.zeros((n + 2 + most, LANES)), np.zeros((n, LANES)),
        np.zeros((2, LANES)), np.zeros((ROWS, LANES)), np.zeros((4, LANES)))
    drive = Drive(np.zeros(2), np.zeros(2), np.zeros(2), np.full(2, np.inf), np.zeros(2),
                  np.zeros(1, dtype=np.int64))
    return _follow(s, stamps, values, times, places, out, end, fine, plant, step, block, drive,
                   np.zeros(4), np.zeros(4), np.zeros(4), s[:n], s[n + 7:n + SHAPED])
