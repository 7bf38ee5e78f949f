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

from lg_husky_sim.husky.laws import MEMORY as MEMORIES
from lg_husky_sim.jit import jit_by, jit_call, jit_part
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation.arrays import (
    ACCELERATION,
    AIMS,
    BEYOND_PLACE,
    COMMANDED,
    DRIVEN,
    DU,
    EFFORTS,
    F,
    FIRST_STEP,
    FORCE,
    FORMER,
    FROM_TIME,
    GAINS,
    GOALS,
    INPUTS,
    INTEGRALS,
    KEPT,
    KIND,
    LANES,
    LAST,
    LIMITED,
    MEMORY,
    NEW,
    ONSET,
    OUTPUTS,
    Packed,
    PAIRS,
    PARABOLA,
    RAMPS,
    REALS,
    REMEMBERING,
    SLOPES,
    TANGENT,
    U,
    Work,
    workspace,
    XI,
    YAW_ACCELERATION,
)
from lg_husky_sim.simulation.command_kernel import APART, next_event
from lg_husky_sim.simulation.effort_kernel import bend, efforts_at, solve
from lg_husky_sim.simulation.modal_kernel import rate_of
from lg_husky_sim.simulation.reading_kernel import go, go_by_arc, read, write_row
from lg_husky_sim.simulation.runaway import refuse_runaway, RUNAWAY
import numpy as np
from numpy.typing import NDArray

#: Columns of an output row.
COLUMNS = ('wheel_left', 'wheel_right', 'forward', 'yaw_rate', 'current_left', 'current_right',
           'accel_x', 'angle_left', 'angle_right', 'distance', 'heading', 'x', 'y',
           'voltage_left', 'voltage_right')
#: Where commands stand in the flat state, behind the n states of graph and controllers, and how
#: many entries there are behind those.
SHAPED = 4 + 3 + MEMORIES
WANTED, TAIL = SHAPED + 2, SHAPED + 4
#: Shortest and longest step of a plant with efforts [s].
SHORTEST, LONGEST = 1e-5, 0.05
#: Panels of the pose: the first after a jump [s], growth with the time since then, the longest
#: [s], turned in one [rad], and how much faster than at the last point a base may turn [rad/s].
PANEL_FIRST, PANEL_GROWTH, PANEL, PANEL_TURN, FASTER = 0.0005, 0.35, 0.008, 0.01, 0.5


@jit_call
def _change_set(bases: FloatArray, old: int, c: int, s: FloatArray, modes: FloatArray) -> None:
    # Modes of another set for the same states; of those in s where old is negative.
    if old >= 0:
        for i in range(bases.shape[2]):
            s[i] = 0.0
            for m in range(modes.shape[1]):
                s[i] += bases[old, 0, i, m] * modes[XI, m]
    for m in range(modes.shape[1]):
        modes[XI, m] = 0.0
    for i in range(bases.shape[2]):
        value = s[i]
        for m in range(modes.shape[1]):
            modes[XI, m] += bases[c, 1, i, m] * value


@jit_part
def _moving(plant: Packed, c: int, n: int, work: Work) -> None:
    # Speed, yaw rate and their derivatives, just after an event.
    few = work.few
    for k in range(4):
        row = 2 + k if k < 2 else (ACCELERATION if k == 2 else YAW_ACCELERATION)
        value = (plant.outputs[c, row, n] * few[U, 0] + plant.outputs[c, row, n + 1] * few[U, 1])
        for i in range(n):
            value += plant.outputs[c, row, i] * work.modes[XI, i]
        for e in range(plant.counts[c, EFFORTS]):
            value += plant.outputs[c, row, n + 2 + e] * work.efforts[F, e]
        few[LAST, k] = value


@jit_part
def _points(times: FloatArray, j: int, t: float, h: float, tau: float, turning: float,
            fine: bool, lanes: FloatArray) -> int:
    # Put the next points of a step after tau into the lanes: wanted times, panels, its end.
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
        lanes[GOALS, count] = goal
        count += 1
        last = goal
    for g in range(count, LANES):
        lanes[GOALS, g] = last
    return count


@jit_part
def _enter(s: FloatArray, n: int, few: FloatArray) -> None:
    # What a leg begins with.
    for i in range(2):
        few[LIMITED, i], few[COMMANDED, i] = s[n + SHAPED + i], s[n + WANTED + i]
        few[AIMS, i], few[SLOPES, i], few[RAMPS, i] = 0.0, 0.0, math.inf
        few[U, i], few[DU, i] = 0.0, 0.0
    for i in range(MEMORIES):
        few[MEMORY, i] = s[n + 7 + i]
    few[TANGENT, 0], few[TANGENT, 1] = math.cos(s[n + 3]), math.sin(s[n + 3])


@jit_part
def _leave(s: FloatArray, n: int, t: float, few: FloatArray) -> None:
    s[n + 6] = t
    for i in range(2):
        s[n + SHAPED + i], s[n + WANTED + i] = few[LIMITED, i], few[COMMANDED, i]
    for i in range(MEMORIES):
        s[n + 7 + i] = few[MEMORY, i]


@jit_by('lg_husky_sim.simulation.compiling')
def follow(s: FloatArray, stamps: FloatArray, values: FloatArray, times: FloatArray,
           places: NDArray[np.int64], out: FloatArray, ends: FloatArray, fine: bool,
           plant: Packed, work: Work) -> int:
    """
    Advance the flat state ``s`` from end to end, in place.

    Parameters
    ----------
    s : numpy.ndarray
        Flat state, laid out as the module says.
    stamps, values : numpy.ndarray, shapes (n_commands,), (n_commands, 2)
        Commands [m/s, rad/s] and when they are given [s], not decreasing; each holds until the
        next.
    times : numpy.ndarray, shape (n_times,)
        Where output is wanted [s], not decreasing, from the state's time to the last end.
    places : numpy.ndarray of int64, shape (n_times,)
        Row of the output that each time has.
    out : numpy.ndarray, shape (n_times, 15)
        Receives :data:`COLUMNS`; at a jump, what was before it.
    ends : numpy.ndarray, shape (n_legs,)
        Times, not decreasing, that end a leg [s]; the next one begins as if it were called anew.
    fine : bool
        Whether x and y are wanted to better than 1e-7 m; else they are arcs between the points.
    plant : Packed
        As :func:`~lg_husky_sim.simulation.modes.packed` makes it.
    work : Work
        Scratch arrays of the plant's sizes; what is in them before means nothing.

    Returns
    -------
    int
        Steps taken; -1 where the model runs away, see :mod:`lg_husky_sim.simulation.runaway`.

    """
    n, size = plant.bases.shape[2], plant.bases.shape[3]
    modes, efforts, lanes, few = work.modes, work.efforts, work.lanes, work.few
    stages, counts, modal = plant.stages, plant.counts, plant.modal
    kind, onset = stages[0, KIND], stages[0, ONSET]
    t, until, end, leg, begun = s[n + 6], s[n + 6], s[n + 6], -1, 0
    j, c, steps, count, given, beyond = 0, -1, 0, 0, 0, False
    h, before, growth = 0.0, 0.0, 1.0
    # The first step after a jump of the voltage: its length, the jump and the error.
    opening, jump, opened = 0.0, 0.0, 0.0
    while True:
        if t >= until:
            if leg < 0 or (t >= end and steps > begun):
                if leg >= 0:
                    _change_set(plant.bases, c, c, s, modes)
                    _leave(s, n, t, few)
                leg += 1
                if leg == ends.size:
                    return steps
                _enter(s, n, few)
                c, begun, end, given = -1, steps, ends[leg], 0
                # Whether the second set is in force: a place is crossed where it is found to be.
                beyond = (kind == FROM_TIME and t >= onset) or (
                    kind == BEYOND_PLACE and s[n + 4] >= onset) or (
                    kind > BEYOND_PLACE and s[n + 4] <= onset)
            if c != int(beyond):
                _change_set(plant.bases, c, int(beyond), s, modes)
                c = int(beyond)
                given, jump = 0, 0.0
                few[COMMANDED, 0], few[COMMANDED, 1] = s[n + WANTED], s[n + WANTED + 1]
            v, w = few[U, 0], few[U, 1]
            until, given = next_event(stages, c, t, end, stamps, values, given, few)
            if kind == FROM_TIME and not beyond:
                until = min(until, max(onset, t))
            count = counts[c, EFFORTS]
            size_of = abs(few[U, 0] - v) + abs(few[U, 1] - w)
            h = stages[c, FIRST_STEP]
            if jump > 0.0:
                share = 1.0
                if size_of > 0.0:
                    share = 0.5 * jump / (size_of * max(opened, 1e-3))
                h = max(h, opening * max(0.1, min(5.0, math.sqrt(math.sqrt(share)))))
            jump = size_of
            before, growth = 0.0, 1.0
            if count > 0:
                efforts_at(plant, c, s, n, t, 0.0, 0, 0, work)
                for e in range(count):
                    efforts[F, e] = efforts[NEW, e]
            _moving(plant, c, n, work)
        left = until - t
        for i in range(size):
            modes[FORCE, i] = (modal[c, INPUTS, i] * few[U, 0]
                               + modal[c, INPUTS + 1, i] * few[U, 1])
        for e in range(count):
            for i in range(size):
                modes[FORCE, i] += modal[c, GAINS + e, i] * efforts[F, e]
        rate_of(c, modal, counts[c, REALS], counts[c, PAIRS], modes, FORCE)
        if count == 0 or left <= 0.0:
            h = left
            bend(plant, c, h, work)
        else:
            h = min(h, LONGEST)
            if h >= 0.8 * left:
                h = left
            elif h > 0.5 * left:
                h = 0.5 * left
            error = solve(plant, c, s, n, t, h, before, work)
            if error < 0.0 and h > 1.5 * SHORTEST:
                h, before = max(SHORTEST, 0.3 * h), 0.0
                continue
            share = 0.85 / math.sqrt(math.sqrt(max(error, 1e-3)))
            if error > 1.0 and h > 1.5 * SHORTEST:
                h = max(SHORTEST, h * max(0.2, min(0.5, share)))
                continue
            # Nothing is known of the error of a step that found no efforts, and none is shorter.
            growth = max(0.3, min(3.0, share)) if error >= 0.0 else 1.0
            if before == 0.0:
                opening, opened = h, error
        steps += 1
        # Points inside the step: requested times, panels of the pose, its end.
        whole, tau, went, turned = h, 0.0, 0.0, 0.0
        lower, upper, searching, g = 0.0, 0.0, False, 0
        while True:
            points = LANES
            if searching:
                for i in range(LANES):
                    lanes[GOALS, i] = lower + (upper - lower) * ((i + 1) / LANES)
                lanes[GOALS, LANES - 1] = upper
            else:
                points = _points(times, j, t, h, tau, few[LAST, 1], fine, lanes)
            read(plant, c, work)
            g = 0
            while g < points:
                way, turn = lanes[DRIVEN + 2, g] - went, lanes[DRIVEN + 3, g] - turned
                if fine:
                    along, across, sine, less = go(lanes[GOALS, g] - tau, way, turn, few, lanes, g)
                else:
                    along, across, sine, less = go_by_arc(way, turn)
                x_new = s[n + 4] + few[TANGENT, 0] * along - few[TANGENT, 1] * across
                if kind > FROM_TIME:
                    there = x_new >= onset if kind == BEYOND_PLACE else x_new <= onset
                    if searching and (there != beyond or g == LANES - 1):
                        upper = lanes[GOALS, g]
                        if g > 0:
                            lower = lanes[GOALS, g - 1]
                        if upper - lower > APART and lower < 0.5 * (lower + upper) < upper:
                            break
                        beyond, h = not beyond, upper
                    elif searching:
                        g += 1
                        continue
                    elif there != beyond:
                        searching, lower, upper = True, tau, lanes[GOALS, g]
                        break
                s[n + 5] += few[TANGENT, 1] * along + few[TANGENT, 0] * across
                s[n + 4] = x_new
                cosine = few[TANGENT, 0] * (1.0 + less) - few[TANGENT, 1] * sine
                few[TANGENT, 1] = few[TANGENT, 1] * (1.0 + less) + few[TANGENT, 0] * sine
                few[TANGENT, 0] = cosine
                went, turned, tau = lanes[DRIVEN + 2, g], lanes[DRIVEN + 3, g], lanes[GOALS, g]
                few[LAST, 0], few[LAST, 1] = lanes[OUTPUTS + 2, g], lanes[OUTPUTS + 3, g]
                few[LAST, 2] = lanes[OUTPUTS + ACCELERATION, g]
                few[LAST, 3] = lanes[OUTPUTS + YAW_ACCELERATION, g]
                if j < times.size and times[j] - t <= tau:
                    while j < times.size and times[j] - t <= tau:
                        write_row(out, places[j], lanes, g, s, n)
                        j += 1
                if tau >= h:
                    break
                g += 1
            if tau >= h:
                break
        if not (abs(few[LAST, 0]) < RUNAWAY and abs(few[LAST, 1]) < RUNAWAY):
            # Ever shorter steps would never get there.
            return -1
        for i in range(n):
            modes[XI, i] = lanes[INTEGRALS + n + i, g]
        for i in range(4):
            s[n + i] += lanes[DRIVEN + i, g]
        for i in range(2):
            few[U, i] += h * few[DU, i]
            few[LIMITED, i] += h * few[SLOPES, i]
        for e in range(count):
            efforts[F, e] = lanes[INTEGRALS + 2 * n + 2 + e, g]
            efforts[FORMER, e] = efforts[PARABOLA, e]
            efforts[FORMER + 1, e] = efforts[PARABOLA + 1, e]
        if count > 0 and whole > 0.0:
            if counts[c, REMEMBERING]:
                for i in range(MEMORIES):
                    few[MEMORY, i] += h / whole * (few[KEPT + 1, i] - few[MEMORY, i])
            for i in range(work.arguments.shape[1]):
                work.arguments[0, i] = work.arguments[2, i]
        t = until if h >= left and not searching else t + h
        if searching:
            until = t
        elif kind == FROM_TIME and t >= onset:
            beyond = True
        before, h = h, h * growth


def run(s: FloatArray, stamps: FloatArray, values: FloatArray, times: FloatArray,
        places: NDArray[np.int64], out: FloatArray, end: float, fine: bool, plant: Packed) -> int:
    """Advance the flat state ``s`` to ``end`` [s], in place, as :func:`follow` does."""
    steps: int = follow(s, stamps, values, times, places, out, np.array([end]), fine, plant,
                        workspace(plant))
    refuse_runaway(steps)
    return steps
