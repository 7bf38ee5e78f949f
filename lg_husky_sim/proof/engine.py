# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The Husky in other people's rigid-body engines: motors and drivers here, contact there.

Nothing of the paper's model is in it: no creep, no yaw damping. Sliding, load transfer
and chatter come from the engine's own contact solver.
"""

from __future__ import annotations

from dataclasses import dataclass
import math
from typing import Protocol

from lg_husky_sim.proof import world as w
from lg_husky_sim.proof.integrate import COLUMNS, Floor, Gate, ROUGH_PERIOD, ROW_PERIOD
from lg_husky_sim.proof.laws import brought_down, chopper, dry, limited, shaft_loss
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

SETTLING = 0.6
WHEEL_MASS = 2.6
WHEEL_NAMES = ('rear_left', 'rear_right', 'front_left', 'front_right')


@dataclass(frozen=True)
class BodyState:
    """Place [m, rad], velocity along the world [m/s, rad/s], driven axles [rad, rad/s]."""

    x: float
    y: float
    heading: float
    vx: float
    vy: float
    yaw: float
    angles: tuple[float, float]
    rates: tuple[float, float]


class Body(Protocol):
    """A robot in an engine, in steps of `ROW_PERIOD`."""

    def state(self) -> BodyState:
        """Return where it is and how it moves."""

    def advance(self, torques: tuple[float, float], force: tuple[float, float], moment: float,
                gravity: tuple[float, float], friction: float) -> None:
        """Take one step with torques on the driven axles and forces along the world."""


def _opening(gate: Gate, time: float, x: float) -> float:
    if gate.kind == 'none':
        return 1.0
    z = ((time if gate.kind == 'time' else x) - gate.at) / gate.width * gate.sign
    return min(max(z + 0.5, 0.0), 1.0)


def _outer_forces(p: Vector, forward: float, yaw: float, place: BodyState,
                  floor: Vector) -> tuple[float, float, float]:
    """Return force ahead and to the left [N] and moment [N·m] of what the engine lacks."""
    moving = forward * forward + (p[w.HALF_TRACK] * yaw) ** 2
    felt = 1.0 - math.exp(-moving / p[w.ROUGH_SPEED] ** 2)
    form = max(p[w.FORM_DRY], 1.0)
    ahead = felt * floor[2] - p[w.ROLLING] * dry(forward, 0.0, form)
    ahead -= math.copysign(p[w.DRAG] * abs(forward) ** p[w.DRAG_EXPONENT], forward)
    wave = 2.0 * math.pi / p[w.UNDULATION_PITCH]
    ahead += p[w.UNDULATION] * (math.cos(place.heading) * math.sin(wave * place.x)
                                + math.sin(place.heading) * math.sin(wave * place.y))
    moment = felt * floor[4] - p[w.SCRUB] * dry(yaw, 0.0, form)
    moment -= p[w.SCRUB_SPEED] * abs(forward) ** p[w.SCRUB_EXPONENT] * yaw
    moment += p[w.PULL] * (1.0 - math.exp(-moving / p[w.PULL_SPEED] ** 2))
    for soft, arm in ((p[w.ROLLING_LEFT], p[w.HALF_TRACK]),
                      (p[w.ROLLING_RIGHT], -p[w.HALF_TRACK])):
        pull = soft * math.tanh((forward - arm * yaw) / 0.02)
        ahead -= pull
        moment += arm * pull
    return ahead, felt * floor[3], moment


def _bus(p: Vector, time: float, duties: list[float], back: list[float]) -> float:
    """
    Return the voltage of a bus that its motors load, in the same step [V].

    With the current of the step before, a source that resists more than the windings would swing
    up from step to step.
    """
    emf = p[w.SUPPLY] * (1.0 - brought_down(time, 4.0 * time, p))
    source = p[w.BATTERY_RESISTANCE] + p[w.POLARISATION]
    share = source / p[w.RESISTANCE]
    bus = (emf + share * sum(d * b for d, b in zip(duties, back, strict=True))) / (
        1.0 + share * sum(d * d for d in duties))
    limit = p[w.CURRENT_LIMIT]
    if limit > 0.0:
        bus = emf - source * sum(
            d * min(max((d * bus - b) / p[w.RESISTANCE], -limit), limit)
            for d, b in zip(duties, back, strict=True))
    return float(bus)


def _motors(p: Vector, time: float, volts: Vector, now: BodyState,
            floor: Vector) -> tuple[list[float], list[float], float]:
    """Return torques of both drives [N·m], currents [A] and the bus [V]."""
    duties = [chopper(float(value), p) for value in volts]
    back = [p[w.TORQUE_CONSTANT] * rate for rate in now.rates]
    bus = _bus(p, time, duties, back)
    torques, currents = [], []
    for side in range(2):
        asked = duties[side] * bus
        if p[w.CURRENT_LIMIT] > 0.0:
            asked = limited(asked, back[side], p[w.RESISTANCE] * p[w.CURRENT_LIMIT],
                            p[w.FORM_CURRENT])
        current = (asked - back[side]) / p[w.RESISTANCE]
        rate = now.rates[side]
        ripple = p[w.RIPPLE_LEFT + side]
        turn = now.angles[side] + p[w.RIPPLE_PHASE] * (1.0 + side)
        loss = shaft_loss(rate, math.tanh(rate / 0.03), p[w.FRICTION_LEFT + side],
                          p[w.VISCOUS_LEFT + side], p)
        torques.append(p[w.TORQUE_CONSTANT] * current - loss + floor[side]
                       * math.tanh(abs(rate) / 0.3)
                       + ripple * math.tanh(abs(rate) / 0.1) * (
                           math.sin(turn) + p[w.RIPPLE_SECOND] * math.sin(2.0 * turn + 1.0)))
        currents.append(current)
    return torques, currents, bus


def _floor_at(floor: Floor, time: float, place: BodyState) -> Vector:
    felt = floor.rough[min(int(time / ROUGH_PERIOD), floor.rough.shape[0] - 1)].copy()
    for kx, ky, phase, force, moment, left, right in floor.waves:
        felt += math.sin(kx * place.x + ky * place.y + phase) * np.array(
            [left, right, force, 0.0, moment])
    return np.asarray(felt)


def drive_body(body: Body, off: Vector, on: Vector, gate: Gate, arrivals: Vector, demand: Vector,
               floor: Floor, seconds: float, heading: float) -> Vector:
    """
    Drive a robot of an engine; arguments and result as `integrate.integrate`.

    `heading` [rad] is that of the start, from which turns are counted.
    """
    table = np.zeros((math.ceil(seconds / ROW_PERIOD), len(COLUMNS)))
    start = body.state()
    turned, last, p = heading, start.heading, on
    coming, volts = 0, np.zeros(2)
    before = start
    for row in range(table.shape[0]):
        time = row * ROW_PERIOD
        while coming < arrivals.size and arrivals[coming] <= time:
            volts = demand[coming]
            coming += 1
        now = body.state()
        turned += math.remainder(now.heading - last, 2.0 * math.pi)
        last = now.heading
        cosine, sine = math.cos(turned), math.sin(turned)
        if gate.kind != 'none':
            p = off + _opening(gate, time, now.x) * (on - off)
        forward = now.vx * cosine + now.vy * sine
        felt = _floor_at(floor, time, now)
        ahead, across, moment = _outer_forces(p, forward, now.yaw, now, felt)
        torques, currents, bus = _motors(p, time, volts, now, felt)
        force = (ahead * cosine - across * sine, ahead * sine + across * cosine)
        gravity = (p[w.GRAVITY_X], p[w.GRAVITY_Y])
        friction = p[w.TYRE_FRICTION]
        if p[w.FORCE_LIMIT] < w.NEVER:
            friction = min(friction, 4.0 * p[w.FORCE_LIMIT] / (p[w.MASS] * w.GRAVITY))
        body.advance((torques[0], torques[1]), force, moment, gravity, friction)
        push = ((now.vx - before.vx) / ROW_PERIOD - gravity[0],
                (now.vy - before.vy) / ROW_PERIOD - gravity[1])
        before = now
        angles = [now.angles[k] - start.angles[k] for k in range(2)]
        table[row] = (
            time, forward, -now.vx * sine + now.vy * cosine, now.yaw, now.x, now.y, turned,
            *now.rates, *angles, *angles, *currents, push[0] * cosine + push[1] * sine,
            -push[0] * sine + push[1] * cosine, bus)
    speeds = np.abs(table[:, [1, 7, 8]])
    if not np.isfinite(table).all() or np.any(speeds > (50.0, 500.0, 500.0)):
        raise FloatingPointError('the robot in the engine left its bounds')
    return table


def integrate_engine(name: str, off: Vector, on: Vector, gate: Gate, arrivals: Vector,
                     demand: Vector, floor: Floor, seconds: float,
                     pose: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Vector:
    """
    Return what a robot does in an engine, from rest; as `integrate.integrate`.

    Parameters
    ----------
    name
        'mujoco' or 'bullet'.
    off, on, gate, arrivals, demand, floor, seconds, pose
        As `integrate.integrate`. Mass and radii are those of `on` all along.

    Raises
    ------
    MissingExtraError
        The engine is not installed.
    FloatingPointError
        The motion left every physical bound.

    """
    if name == 'mujoco':
        from lg_husky_sim.proof.mujoco_body import MujocoBody
        return drive_body(MujocoBody(on, pose), off, on, gate, arrivals, demand, floor, seconds,
                          pose[2])
    from lg_husky_sim.proof.bullet_body import BulletBody
    with BulletBody(on, pose) as body:
        return drive_body(body, off, on, gate, arrivals, demand, floor, seconds, pose[2])
