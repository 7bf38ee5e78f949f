# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Laws of friction, adhesion and drivers in several forms each: nature has no favourite."""

from __future__ import annotations

import math

from lg_husky_sim.proof import world as w
from lg_husky_sim.proof.jit import compiled
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

# Presliding distances of the bristles: wheel shaft [rad], yaw [rad], rolling [m].
SHAFT_BRISTLE = 0.004
YAW_BRISTLE = 0.006
ROLL_BRISTLE = 0.003


@compiled
def adhesion(force: float, limit: float, form: float) -> float:
    """
    Return the force [N] of a tyre whose linear part would give `force`, limited to `limit`.

    Forms: 0 brush (Pacejka, Tyre and Vehicle Dynamics, ch. 3), 1 tanh, 2 arctangent, 3
    magic formula with shape 1.5, which peaks and falls, 4 x/sqrt(1 + x²).
    """
    if limit >= w.NEVER:
        return force
    x = force / limit
    if form < 0.5:
        q = abs(x) / 3.0
        if q >= 1.0:
            return math.copysign(limit, force)
        return math.copysign(3.0 * limit * (q - q * q + q * q * q / 3.0), force)
    if form < 1.5:
        return limit * math.tanh(x)
    if form < 2.5:
        return limit * 2.0 / math.pi * math.atan(0.5 * math.pi * x)
    if form < 3.5:
        return limit * math.sin(1.5 * math.atan(x / 1.5))
    return limit * x / math.sqrt(1.0 + x * x)


@compiled
def chopper(volts: float, p: Vector) -> float:
    """Return the duty cycle (-1..1) of a chopper asked for `volts` of a full battery."""
    size = abs(volts)
    dead = p[w.DEADBAND]
    if dead > 0.0:
        if p[w.FORM_DEADBAND] > 0.5:
            edge = max(p[w.DEADBAND_EDGE], 1e-3) * dead
            size *= 0.5 * (1.0 + math.tanh((size - dead) / edge))
        else:
            beyond = size - dead
            round_off = p[w.DEADBAND_EDGE] * dead
            size = 0.5 * (beyond + math.sqrt(beyond * beyond + round_off * round_off))
            size -= 0.5 * (math.sqrt(dead * dead + round_off * round_off) - dead)
            size = max(size, 0.0)
    if volts < 0.0:
        size *= 1.0 + p[w.REVERSE_GAIN]
    if p[w.FORM_CLIP] > 0.5:
        size = p[w.CLIP] * math.tanh(size / p[w.CLIP])
    size = min(size, min(p[w.CLIP], p[w.SUPPLY]))
    return math.copysign(size / p[w.SUPPLY], volts)


@compiled
def limited(volts: float, back: float, room: float, form: float) -> float:
    """Return the voltage [V] of a driver that lets at most `room` [V] drive a current."""
    if form > 0.5:
        return back + room * math.tanh((volts - back) / room)
    return min(max(volts, back - room), back + room)


@compiled
def shaft_loss(speed: float, bristle: float, friction: float, viscous: float,
               p: Vector) -> float:
    """Return the torque [N·m] that friction in bearings, seals and gears takes away."""
    loss = 0.0
    if friction > 0.0:
        form = p[w.FORM_FRICTION]
        width = p[w.FRICTION_WIDTH]
        if form < 0.5:
            loss = friction * bristle
        elif form < 1.5:
            loss = friction * math.tanh(speed / width)
        elif form < 2.5:
            peak = (p[w.STRIBECK_RATIO] - 1.0) * math.exp(-(speed / p[w.STRIBECK_SPEED]) ** 2)
            loss = friction * (1.0 + peak) * math.tanh(speed / width)
        else:
            loss = friction * 2.0 / math.pi * math.atan(2.0 * speed / width)
    if viscous != 0.0:
        loss += math.copysign(viscous * abs(speed) ** p[w.VISCOUS_EXPONENT], speed)
    return loss


@compiled
def bristle_rate(speed: float, bristle: float, ratio: float, stribeck: float,
                 reach: float) -> float:
    """Return d(bristle)/dt [1/s]: a LuGre bristle, normalised to 1 in sliding."""
    level = 1.0 + (ratio - 1.0) * math.exp(-(speed / stribeck) ** 2)
    return (speed - abs(speed) * bristle / level) / reach


@compiled
def dry(speed: float, bristle: float, form: float) -> float:
    """Return dry friction of the floor, 1 in sliding, in the form that `p` asks for."""
    if form < 0.5:
        return bristle
    if form < 1.5:
        return math.tanh(speed / 0.02)
    if form < 2.5:
        return (1.0 + 0.35 * math.exp(-(speed / 0.12) ** 2)) * math.tanh(speed / 0.015)
    return speed / math.sqrt(speed * speed + 0.03 * 0.03)


@compiled
def brought_down(time: float, charge: float, p: Vector) -> float:
    """Return the share of the supply that has gone after `time` [s] and `charge` [A·s]."""
    if p[w.DROOP_DEPTH] == 0.0:
        return 0.0
    if p[w.FORM_DROOP] < 0.5:
        return float(p[w.DROOP_DEPTH] * (1.0 - math.exp(-time / p[w.DROOP_TIME])))
    if p[w.FORM_DROOP] < 1.5:
        return float(p[w.DROOP_DEPTH] * min(time / p[w.DROOP_TIME], 1.0))
    return float(min(p[w.DROOP_DEPTH] * charge / 1000.0, 0.6))
