# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The non-linear laws f(z) that a modulated source of the graph may follow.

Each effort of a plant is one row: the number of its law, up to ``WIDTH`` coefficients, and the
place where its arguments begin in ``z``. One interpreter evaluates all rows, so that a new set of
efforts needs no new machine code. ``context`` holds what is not in the graph:
[time, heading, x, y, angle_left, angle_right]. ``memory`` holds six accumulators:
[heat_left, heat_right, held_left, held_right, tyre_left, tyre_right].
"""

from __future__ import annotations

import enum
import math

from lg_husky_sim.jit import jit_part
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray

#: Coefficients that a row can hold.
WIDTH = 24
#: Where a row holds the voltage that its source cannot exceed [V]; 0 for none. A speed loop may
#: ask for more than the supply has: what acts behind the driver only sees what the driver gives.
CEILING = WIDTH - 1
#: Where the row of a law in the series to a motor holds which one: 1 or 2; 0 for one that gets
#: the commanded voltage whatever acts before it.
MOTOR = WIDTH - 2
#: Length of the context vector: time, heading, x, y, angle_left, angle_right.
CONTEXT = 6
#: Length of the memory vector: heat of both motors, what static friction gives way on both axles
#: and at the tyres of both sides.
MEMORY = 6
#: Where in it what gives way begins.
HELD = 2


class Law(enum.IntEnum):
    """
    Laws of an effort; z are its arguments, p its coefficients.

    The value is what the source adds: a through-source pushes into its node, an across-source
    adds to the source it stands in series with.
    """

    COULOMB = 0
    """f = -p0 (1 + p2 exp(-(z0/p3)^2)) tanh(z0/p1): dry friction, Stribeck share p2."""
    QUADRATIC = 1
    """f = -p0 z0 |z0|."""
    WHILE_MOVING = 2
    """f = p0 tanh(|z0|/p1): constant while z0 is not zero."""
    MODULATED_DAMPING = 3
    """f = -p0 |z1| z0."""
    HEADING = 4
    """f = p0 cos(heading) + p1 sin(heading)."""
    WHEEL_PHASE = 5
    """f = (p0 cos(angle) + p1 sin(angle) + p4 cos(2 angle) + p5 sin(2 angle) + p6 cos(3 angle)
    + p7 sin(3 angle)) (1 - exp(-(z0/p3)^2)); p2 is 0 for the left wheel, 1 for the right: what
    ripples as the motor turns does not drive a wheel that rests."""
    SLIP_SATURATION = 6
    """f = p0 tanh(p1 z0/p0) - p1 z0: turns damping p1 into a force that saturates at p0."""
    CURRENT_LIMIT = 7
    """f = clip(z0, p2 z1 - p1 p0, p2 z1 + p1 p0) - z0: voltage that holds |i| <= p0."""
    DEAD_ZONE = 8
    """f = sgn(z0) max(|z0| - p0, 0) - z0."""
    DEAD_BAND = 9
    """f = -z0 inside |z0| < p0 and 0 outside (edge of width p1)."""
    CLIP = 10
    """f = clip(z0, -p0, p0) - z0."""
    BUS_SAG = 11
    """f = -(z0/p1) p0 (z0 z2 + z1 z3)/p1: averaged bridge on a bus of resistance p0."""
    DROOP = 12
    """f = -z0 min(p0 time, p1)."""
    HEATING = 13
    """f = -p0 heat z0, heat' = z0^2 - heat/p1; p2 is 0 (left) or 1 (right)."""
    BACKLASH = 14
    """f = sgn(t) max(|t| - p0, 0) - t, t = z0 + p1 z1: of the torque t of a spring beside a
    damper, what has to take up a play first (p0 is the spring's torque across half of it)."""
    TABLE = 15
    """f = table over [p1, p2] with |p3| knots p4..., of context p0 >= 0 or of z0 if p0 < 0;
    straight between the knots, and periodic where p3 is negative."""
    FRICTION_CIRCLE = 16
    """f = ((1 + q^3)^(-1/3) - 1) p1 z0, q = sqrt((p1 z0)^2 + (p2 z1)^2)/p0: a damping p1 that
    saturates together with another one, p2; nearly as the hyperbolic tangent does."""
    STICTION = 17
    """f = -(p0/p1) (held + p4 max(E^2 - (held/p1)^2, 0) z0), E = exp(-(z1/p3)^2), held' = z0
    within |held| <= p1 E: what rests is held by a damped spring that gives way by p1 and carries
    p0 at most, until z1 moves; p2 is 0 or 1 (left or right axle), 2 or 3 (tyres there)."""
    YIELDING = 18
    """f = sgn(z0) max(|z0| - p0, 0)/p1: rate at which what holds p0 slips under a torque z0."""
    SOFT_BAND = 19
    """f = -z0 exp(-(z0/p0)^2): little passes below p0 and all well above."""
    SOFT_CLIP = 20
    """f = ((1 + |z0/p0|^3)^(-1/3) - 1) z0: comes to +-p0 little by little."""
    SOFT_CURRENT_LIMIT = 21
    """f = ((1 + |v/(p1 p0)|^3)^(-1/3) - 1) v, v = z0 - p2 z1: |i| comes to p0 little by little."""


#: The laws as expressions of the linear graph: arguments z1, z2, ..., coefficients p0, p1, ...
#: and the context by name. Those modulated by the context or a memory are never folded into A.
EXPRESSIONS = {
    Law.COULOMB: '-p0*(1+p2*exp(-(z1/p3)**2))*tanh(z1/p1)',
    Law.QUADRATIC: '-p0*z1*abs(z1)',
    Law.WHILE_MOVING: 'p0*tanh(abs(z1)/p1)',
    Law.MODULATED_DAMPING: '-p0*abs(z2)*z1',
    Law.HEADING: 'p0*cos(heading)+p1*sin(heading)',
    Law.WHEEL_PHASE: (
        '(p0*cos(angle)+p1*sin(angle)+p4*cos(2*angle)+p5*sin(2*angle)'
        '+p6*cos(3*angle)+p7*sin(3*angle)+0*p2)'
        '*(1-exp(-(z1/p3)**2))'),
    Law.SLIP_SATURATION: 'p0*tanh(p1*z1/p0)-p1*z1',
    Law.CURRENT_LIMIT: '(abs(z1-p2*z2+p1*p0)-abs(z1-p2*z2-p1*p0))/2+p2*z2-z1',
    Law.DEAD_ZONE: '-(abs(z1+p0)-abs(z1-p0))/2',
    Law.DEAD_BAND: '-z1*(1-tanh((abs(z1)-p0)/p1))/2',
    Law.CLIP: '(abs(z1+p0)-abs(z1-p0))/2-z1',
    Law.BUS_SAG: '-z1/p1*p0*(z1*z3+z2*z4)/p1',
    Law.DROOP: '-z1*((p0*time+p1)-abs(p0*time-p1))/2',
    Law.HEATING: '-p0*heat*z1+0*p1+0*p2',
    Law.BACKLASH: '-(abs(z1+p1*z2+p0)-abs(z1+p1*z2-p0))/2',
    Law.TABLE: 'table',
    Law.FRICTION_CIRCLE: (
        '(1/(1+(((p1*z1)**2+(p2*z2)**2)/p0**2)**1.5)**0.3333333333333333-1)*p1*z1'),
    Law.SOFT_BAND: '-z1*exp(-(z1/p0)**2)',
    Law.SOFT_CLIP: '(1/(1+((z1/p0)**2)**1.5)**0.3333333333333333-1)*z1',
    Law.SOFT_CURRENT_LIMIT: (
        '(1/(1+(((z1-p2*z2)/(p1*p0))**2)**1.5)**0.3333333333333333-1)*(z1-p2*z2)'),
    Law.YIELDING: '(2*z1+abs(z1-p0)-abs(z1+p0))/(2*p1)',
    Law.STICTION: (
        '-p0/p1*(held+p4*z1*(exp(-2*(z2/p3)**2)-(held/p1)**2'
        '+abs(exp(-2*(z2/p3)**2)-(held/p1)**2))/2)+0*p2'),
}
#: Laws that depend on where the robot is, and laws that advance a memory each time they are met.
CONTEXTUAL = (Law.HEADING, Law.WHEEL_PHASE, Law.TABLE)
REMEMBERING = (Law.HEATING, Law.STICTION)
#: Places of laws in the series from a command to a motor: dead band, largest duty cycle, the bus
#: whose voltage the bridge chops, limit of the current, the winding behind the driver. By the
#: law's number; 0 for a law that is not in the series.
WINDING = 5
PLACES = np.array([{
    Law.DEAD_ZONE: 1, Law.DEAD_BAND: 1, Law.SOFT_BAND: 1, Law.CLIP: 2, Law.SOFT_CLIP: 2,
    Law.DROOP: 3, Law.BUS_SAG: 3, Law.CURRENT_LIMIT: 4, Law.SOFT_CURRENT_LIMIT: 4,
    Law.HEATING: WINDING}.get(law, 0) for law in Law], dtype=np.int64)
#: Names in the expressions that are signals, not parameters.
SIGNALS = ('heading', 'angle', 'time', 'heat', 'table', 'held')


@jit_part
def _clip(value: float, lower: float, upper: float) -> float:
    return max(lower, min(upper, value))


@jit_part
def _softly(value: float, limit: float) -> float:
    # What is added to a value so that it comes to a limit little by little.
    share = abs(value) / limit
    return float(((1.0 + share * share * share) ** (-1.0 / 3.0) - 1.0) * value)


@jit_part
def _table(coefficients: FloatArray, c: int, j: int, argument: float) -> float:
    knots = int(abs(coefficients[c, j, 3]))
    lower, upper = coefficients[c, j, 1], coefficients[c, j, 2]
    if coefficients[c, j, 3] < 0.0:
        turns = (argument - lower) / (upper - lower)
        place = (turns - math.floor(turns)) * knots
        left = int(place)
        share = place - left
        return float(coefficients[c, j, 4 + left % knots] * (1.0 - share)
                     + coefficients[c, j, 4 + (left + 1) % knots] * share)
    place = (argument - lower) / (upper - lower) * (knots - 1)
    if place <= 0.0:
        return float(coefficients[c, j, 4])
    if place >= knots - 1:
        return float(coefficients[c, j, 3 + knots])
    left = int(place)
    share = place - left
    return float(coefficients[c, j, 4 + left] * (1.0 - share)
                 + coefficients[c, j, 5 + left] * share)


@jit_part
def _given(c: int, j: int, motor: float, laws: NDArray[np.int64], coefficients: FloatArray,
           out: FloatArray) -> float:
    # What the driver's laws before that of effort j add to the voltage of a motor.
    added, place = 0.0, PLACES[laws[c, j]]
    for i in range(j if motor > 0.0 else 0):
        if 0 < PLACES[laws[c, i]] < place and coefficients[c, i, MOTOR] == motor:
            added += out[i]
    return added


@jit_part
def _heated(c: int, j: int, motor: float, laws: NDArray[np.int64], coefficients: FloatArray,
            out: FloatArray) -> float:
    # What the heat of a motor's winding adds to its voltage, which a limit of its current sees.
    added = 0.0
    for i in range(j if motor > 0.0 else 0):
        if laws[c, i] == 13 and coefficients[c, i, MOTOR] == motor:
            added += out[i]
    return added


@jit_part
def _summed(c: int, laws: NDArray[np.int64], coefficients: FloatArray, out: FloatArray) -> None:
    # Move what is in series with a motor to the last of its rows. The parts of a series may cancel
    # (a limit takes back what the bus gives), and only their sum does anything.
    for j in range(out.size):
        motor = coefficients[c, j, MOTOR] if PLACES[laws[c, j]] > 0 else 0.0
        for i in range(j + 1, out.size if motor > 0.0 else 0):
            if PLACES[laws[c, i]] > 0 and coefficients[c, i, MOTOR] == motor:
                out[i] += out[j]
                out[j] = 0.0
                break


@jit_part
def _source_law(c: int, j: int, laws: NDArray[np.int64], coefficients: FloatArray, z: FloatArray,
                o: int, memory: FloatArray, time: float, out: FloatArray) -> float:
    # Laws of the electrical side: what the driver adds to the voltage that it gets.
    law, p0, p1 = laws[c, j], coefficients[c, j, 0], coefficients[c, j, 1]
    p2, ceiling = coefficients[c, j, 2], coefficients[c, j, CEILING]
    motor = coefficients[c, j, MOTOR]
    own: float = z[o]
    if ceiling > 0.0:
        own = _clip(own, -ceiling, ceiling)
    if motor > 0.0 and law != 13:
        own += _given(c, j, motor, laws, coefficients, out)
    if law == 7 or law == 21:
        back = p2 * z[o + 1] - _heated(c, j, motor, laws, coefficients, out)
        if law == 21:
            return _softly(own - back, p1 * p0)
        return _clip(own, back - p1 * p0, back + p1 * p0) - own
    if law == 8:
        return math.copysign(max(abs(own) - p0, 0.0), own) - own
    if law == 9:
        return -own * 0.5 * (1.0 - math.tanh((abs(own) - p0) / p1))
    if law == 19:
        return -own * math.exp(-(own / p0) ** 2) if p0 > 0.0 else 0.0
    if law == 10:
        return _clip(own, -p0, p0) - own
    if law == 20:
        return _softly(own, p0)
    if law == 11:
        other: float = z[o + 1]
        if ceiling > 0.0:
            other = _clip(other, -ceiling, ceiling)
        other += _given(c, j, 3.0 - motor, laws, coefficients, out)
        return float(-own / p1 * p0 * (own * z[o + 2] + other * z[o + 3]) / p1)
    if law == 12:
        return float(-own * min(p0 * max(time, 0.0), p1))
    return float(-p0 * memory[int(p2)] * own)


@jit_part
def evaluate(c: int, laws: NDArray[np.int64], coefficients: FloatArray,
             offsets: NDArray[np.int64], z: FloatArray, context: FloatArray, memory: FloatArray,
             out: FloatArray) -> None:
    """
    Evaluate every effort; what is in series with a motor stands in the order of the edits.

    Parameters
    ----------
    c : int
        Which set of laws.
    laws : numpy.ndarray of int64, shape (n_sets, n_efforts)
        Numbers of :class:`Law`.
    coefficients : numpy.ndarray, shape (n_sets, n_efforts, WIDTH)
        Numbers of each law, in the order of its formula (SI).
    offsets : numpy.ndarray of int64, shape (n_sets, n_efforts)
        Where the arguments of each effort begin in ``z``.
    z : numpy.ndarray, shape (n_arguments,)
        Arguments of all efforts, one effort after the other (SI).
    context : numpy.ndarray, shape (CONTEXT,)
        Time, heading, x, y and both wheel angles.
    memory : numpy.ndarray, shape (MEMORY,)
        Heat of the motors and what static friction gives way.
    out : numpy.ndarray, shape (n_efforts,)
        Receives the efforts; the last in series with a motor is the sum of them.

    """
    in_series = 0
    for j in range(out.size):
        law = laws[c, j]
        p0, p1 = coefficients[c, j, 0], coefficients[c, j, 1]
        p2 = coefficients[c, j, 2]
        o = offsets[c, j]
        if law == 0:
            level = p0
            if p2 != 0.0:
                level *= 1.0 + p2 * math.exp(-(z[o] / coefficients[c, j, 3]) ** 2)
            out[j] = -level * math.tanh(z[o] / p1)
        elif law == 1:
            out[j] = -p0 * z[o] * abs(z[o])
        elif law == 2:
            out[j] = p0 * math.tanh(abs(z[o]) / p1)
        elif law == 3:
            out[j] = -p0 * abs(z[o + 1]) * z[o]
        elif law == 4:
            out[j] = p0 * math.cos(context[1]) + p1 * math.sin(context[1])
        elif law == 5:
            angle = context[4 + int(p2)]
            share = z[o] / coefficients[c, j, 3]
            value = p0 * math.cos(angle) + p1 * math.sin(angle)
            for turns in range(2, 4):
                i = 2 * turns
                if coefficients[c, j, i] != 0.0 or coefficients[c, j, i + 1] != 0.0:
                    value += (coefficients[c, j, i] * math.cos(turns * angle)
                              + coefficients[c, j, i + 1] * math.sin(turns * angle))
            out[j] = value * (1.0 - math.exp(-share * share))
        elif law == 6:
            out[j] = p0 * math.tanh(p1 * z[o] / p0) - p1 * z[o]
        elif law == 16:
            own, other = p1 * z[o], p2 * z[o + 1]
            square = (own * own + other * other) / (p0 * p0)
            out[j] = ((1.0 + square * math.sqrt(square)) ** (-1.0 / 3.0) - 1.0) * own
        elif law == 17:
            held, share = memory[HELD + int(p2)], z[o + 1] / coefficients[c, j, 3]
            free = math.exp(-2.0 * share * share) - held * held / (p1 * p1)
            out[j] = -p0 / p1 * (held + coefficients[c, j, 4] * max(free, 0.0) * z[o])
        elif law == 14:
            torque = z[o] + p1 * z[o + 1]
            out[j] = math.copysign(max(abs(torque) - p0, 0.0), torque) - torque
        elif law == 18:
            out[j] = math.copysign(max(abs(z[o]) - p0, 0.0), z[o]) / p1
        elif law == 15:
            selector = int(p0)
            out[j] = _table(coefficients, c, j, z[o] if selector < 0 else context[selector])
        else:
            out[j] = _source_law(c, j, laws, coefficients, z, o, memory, context[0], out)
            if coefficients[c, j, MOTOR] > 0.0:
                in_series += 1
    if in_series > 2:  # more than one effect of both motors
        _summed(c, laws, coefficients, out)
