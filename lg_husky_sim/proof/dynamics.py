# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Newton-Euler equations of a four-wheel skid-steer robot with its motors and battery.

State, shape (27,), SI units, x forward, y left, yaw counter-clockwise:

0-2 forward, lateral [m/s] and yaw speed [rad/s] of the middle of the wheels; 3-5 its x, y,
heading; 6, 7 motor shafts' speed left, right [rad/s at the wheel]; 8, 9 their angle; 10, 11
driven axles' speed; 12, 13 belt-driven axles' speed; 14, 15 driven axles' angle; 16, 17
belt-driven axles' angle; 18, 19 winding currents [A]; 20, 21 rise of the winding resistance
[ohm]; 22, 23 bristles of the drivetrains, 24 of the scrub, 25 of the rolling (all in
-1.5..1.5); 26 the battery's slow voltage loss [V].
"""

from __future__ import annotations

import math

from lg_husky_sim.proof import world as w
from lg_husky_sim.proof.jit import compiled
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

N_STATES = 27
# Presliding distances of the bristles: wheel shaft [rad], yaw [rad], rolling [m].
SHAFT_BRISTLE = 0.004
YAW_BRISTLE = 0.006
ROLL_BRISTLE = 0.003


@compiled
def brush(force: float, limit: float) -> float:
    """
    Return the force of a brush tyre whose linear part would give `force`, both [N].

    The contact patch slides from its rear end on: a cubic up to `limit`, constant
    beyond three times the linear force (Pacejka, Tyre and Vehicle Dynamics, ch. 3).
    """
    if limit >= 1e8:
        return force
    q = abs(force) / (3.0 * limit)
    if q >= 1.0:
        return math.copysign(limit, force)
    return math.copysign(3.0 * limit * (q - q * q + q * q * q / 3.0), force)


@compiled
def chopper(volts: float, p: Vector) -> float:
    """Return the duty cycle (-1..1) of a chopper asked for `volts` of a full battery."""
    size = abs(volts)
    dead = p[w.DEADBAND]
    if dead > 0.0:
        # The dead time eats a fixed voltage; its edge is rounded by the current ripple.
        beyond = size - dead
        size = 0.5 * (beyond + math.sqrt(beyond * beyond + (0.08 * dead) ** 2))
        size -= 0.5 * (math.sqrt(dead * dead + (0.08 * dead) ** 2) - dead)
        size = max(size, 0.0)
    if volts < 0.0:
        size *= 1.0 + p[w.REVERSE_GAIN]
    size = min(size, p[w.CLIP], w.NOMINAL_SUPPLY)
    return math.copysign(size / w.NOMINAL_SUPPLY, volts)


@compiled
def shaft_loss(speed: float, bristle: float, friction: float, viscous: float,
               p: Vector) -> float:
    """Return the torque [N·m] that friction in bearings, seals and gears takes away."""
    loss = friction * bristle
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
def wheel_force(index: int, speed: float, angle: float, s: Vector,
                p: Vector, force: Vector) -> None:
    """
    Write forward and lateral ground force [N] and the radius [m] of one wheel.

    `index` counts rear left, rear right, front left, front right.
    """
    side = index % 2
    left = side == 0
    radius = p[w.RADIUS_LEFT] if left else p[w.RADIUS_RIGHT]
    if p[w.ECCENTRICITY] != 0.0:
        radius *= 1.0 + p[w.ECCENTRICITY] * math.sin(
            angle + p[w.ECCENTRICITY_PHASE] * (1.0 + 0.6 * index))
    arm = p[w.HALF_TRACK] if left else -p[w.HALF_TRACK]
    slip = radius * speed - (s[0] - arm * s[2])
    if p[w.TYRE] > 0.5:
        ahead = -p[w.HALF_BASE] if index < 2 else p[w.HALF_BASE]
        share = 0.25 * (1.0 + math.copysign(1.0, ahead)
                        * p[w.CENTRE_FORWARD] / p[w.HALF_BASE])
        limit = p[w.TYRE_FRICTION] * p[w.MASS] * w.GRAVITY * share
        across = -(s[1] + ahead * s[2])
        total = math.sqrt(slip * slip + across * across) + 1e-12
        size = brush(p[w.CREEP] * total, min(limit, p[w.FORCE_LIMIT]))
        force[0] = size * slip / total
        force[1] = size * across / total
    else:
        force[0] = brush(p[w.CREEP] * slip, p[w.FORCE_LIMIT])
        force[1] = 0.0
    force[2] = radius


@compiled
def derivative(time: float, s: Vector, p: Vector, volts_left: float, volts_right: float,
               rough: Vector, ds: Vector, extra: Vector) -> None:
    """
    Write the time derivative of the state, and what sensors see of it.

    Parameters
    ----------
    time
        Seconds since the start of the recording.
    s
        State, shape (27,).
    p
        The hidden robot, shape (66,).
    volts_left, volts_right
        Voltages that the driver is asked for [V], of a full battery.
    rough
        Disturbances, shape (5,): torques on the left and right drivetrain [N·m], force
        ahead and to the left [N], moment [N·m].
    ds
        Written: shape (27,).
    extra
        Written, shape (5,): specific force ahead and to the left [m/s²], bus voltage,
        motor voltages [V].

    """
    # Battery and choppers: mean currents of a bus that both sides share.
    duty_left = chopper(volts_left, p)
    duty_right = chopper(volts_right, p)
    drawn = duty_left * s[18] + duty_right * s[19]
    age = time + p[w.DROOP_START]
    emf = p[w.EMF] * (1.0 - p[w.DROOP_DEPTH] * (1.0 - math.exp(-age / p[w.DROOP_TIME])))
    bus = emf - p[w.BATTERY_RESISTANCE] * drawn - s[26]
    ds[26] = (p[w.POLARISATION] * drawn - s[26]) / p[w.POLARISATION_TIME]
    extra[2] = bus

    force = np.zeros(3)
    total_x = 0.0
    total_y = 0.0
    moment = 0.0
    for side in range(2):
        duty = duty_left if side == 0 else duty_right
        motor = s[6 + side]
        current = s[18 + side]
        ohms = p[w.RESISTANCE] + s[20 + side]
        volts = duty * bus
        back = p[w.TORQUE_CONSTANT] * motor
        if p[w.CURRENT_LIMIT] > 0.0:
            room = ohms * p[w.CURRENT_LIMIT]
            volts = min(max(volts, back - room), back + room)
        extra[3 + side] = volts
        ds[18 + side] = (volts - ohms * current - back) / p[w.INDUCTANCE]
        ds[20 + side] = p[w.HEATING] * current * current - s[20 + side] / p[w.COOLING_TIME]

        # Ground forces of the two wheels of this side.
        arm = p[w.HALF_TRACK] if side == 0 else -p[w.HALF_TRACK]
        wheel_force(side, s[10 + side], s[14 + side], s, p, force)
        load_rear = force[0] * force[2]
        total_x += force[0]
        total_y += force[1]
        moment -= arm * force[0] + p[w.HALF_BASE] * force[1]
        wheel_force(2 + side, s[12 + side], s[16 + side], s, p, force)
        load_front = force[0] * force[2]
        total_x += force[0]
        total_y += force[1]
        moment += p[w.HALF_BASE] * force[1] - arm * force[0]

        # Losses at the driven axle.
        friction = p[w.FRICTION_LEFT] if side == 0 else p[w.FRICTION_RIGHT]
        viscous = p[w.VISCOUS_LEFT] if side == 0 else p[w.VISCOUS_RIGHT]
        ripple = p[w.RIPPLE_LEFT] if side == 0 else p[w.RIPPLE_RIGHT]
        rear_torque = rough[side] - load_rear - shaft_loss(
            s[10 + side], s[22 + side], friction, viscous, p)
        if ripple != 0.0:
            turn = s[14 + side] + p[w.RIPPLE_PHASE] * (1.0 + side)
            # Eccentric gears: nothing while they stand.
            moving = 1.0 - math.exp(-(s[10 + side] / 0.08) ** 2)
            rear_torque += moving * ripple * (
                math.sin(turn) + 0.25 * math.sin(2.0 * turn + 1.0))
        motor_torque = p[w.TORQUE_CONSTANT] * current
        if p[w.COGGING] != 0.0:
            motor_torque += p[w.COGGING] * math.sin(
                p[w.COGGING_COUNT] * s[8 + side] + 2.0 * side)
        front_torque = -load_front
        ds[22 + side] = bristle_rate(s[10 + side], s[22 + side], p[w.STRIBECK_RATIO],
                                     p[w.STRIBECK_SPEED], SHAFT_BRISTLE)

        # Motor shaft - (free play) - driven axle - (belt) - front axle.
        slack = p[w.GAP] > 0.0
        elastic = p[w.BELT_STIFFNESS] > 0.0
        inertia_rear = p[w.INERTIA_REAR]
        gear = 0.0
        if slack:
            twist = s[8 + side] - s[14 + side]
            half = 0.5 * p[w.GAP]
            if twist > half:
                gear = max(0.0, p[w.GEAR_STIFFNESS] * (twist - half)
                           + p[w.GEAR_DAMPING] * (motor - s[10 + side]))
            elif twist < -half:
                gear = min(0.0, p[w.GEAR_STIFFNESS] * (twist + half)
                           + p[w.GEAR_DAMPING] * (motor - s[10 + side]))
            rear_torque += gear
        else:
            rear_torque += motor_torque
            inertia_rear += p[w.INERTIA_MOTOR]
        if elastic:
            belt = (p[w.BELT_STIFFNESS] * (s[14 + side] - s[16 + side])
                    + p[w.BELT_DAMPING] * (s[10 + side] - s[12 + side]))
            rear = (rear_torque - belt) / inertia_rear
            front = (front_torque + belt) / p[w.INERTIA_FRONT]
        else:
            rear = (rear_torque + front_torque) / (inertia_rear + p[w.INERTIA_FRONT])
            front = rear
        ds[6 + side] = (motor_torque - gear) / p[w.INERTIA_MOTOR] if slack else rear
        ds[10 + side] = rear
        ds[12 + side] = front
        ds[8 + side] = motor
        ds[14 + side] = s[10 + side]
        ds[16 + side] = s[12 + side]

    # Chassis.
    ahead, across, yaw, heading = s[0], s[1], s[2], s[5]
    cosine, sine = math.cos(heading), math.sin(heading)
    pull_x = p[w.GRAVITY_X] * cosine + p[w.GRAVITY_Y] * sine
    pull_y = -p[w.GRAVITY_X] * sine + p[w.GRAVITY_Y] * cosine
    total_x += rough[2] - p[w.ROLLING] * s[25] - p[w.DRAG] * abs(ahead) * ahead
    total_y += rough[3]
    if p[w.TYRE] < 0.5:
        total_y -= p[w.LATERAL] * across
    if p[w.UNDULATION] != 0.0:
        wave = 2.0 * math.pi / p[w.UNDULATION_PITCH]
        total_x += p[w.UNDULATION] * (cosine * math.sin(wave * s[3])
                                      + sine * math.sin(wave * s[4]))
    moment += rough[4] - p[w.YAW_DAMPING] * yaw - p[w.SCRUB] * s[24]
    if p[w.SCRUB_SPEED] != 0.0:
        moment -= p[w.SCRUB_SPEED] * abs(ahead) ** p[w.SCRUB_EXPONENT] * yaw
    if p[w.PULL] != 0.0:
        rolling_speed = ahead * ahead + (p[w.HALF_TRACK] * yaw) ** 2
        moment += p[w.PULL] * (1.0 - math.exp(-rolling_speed / 0.03 ** 2))
    ds[24] = bristle_rate(yaw, s[24], 1.0, 1.0, YAW_BRISTLE)
    ds[25] = bristle_rate(ahead, s[25], 1.0, 1.0, ROLL_BRISTLE)
    # About the middle of the wheels, with the centre of mass `forward` of it.
    forward = p[w.CENTRE_FORWARD]
    extra[0] = total_x / p[w.MASS] + forward * yaw * yaw
    ds[2] = (moment - forward * total_y) / p[w.YAW_INERTIA]
    extra[1] = total_y / p[w.MASS] - forward * ds[2]
    ds[0] = extra[0] + pull_x + across * yaw
    ds[1] = extra[1] + pull_y - ahead * yaw
    ds[3] = ahead * cosine - across * sine
    ds[4] = ahead * sine + across * cosine
    ds[5] = yaw
