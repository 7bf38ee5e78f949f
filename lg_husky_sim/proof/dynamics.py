# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Newton-Euler equations of a four-wheel skid-steer robot with its motors and battery.

State, shape (30,), SI units, x forward, y left, yaw counter-clockwise:

0-2 forward, lateral [m/s] and yaw speed [rad/s] of the middle of the wheels; 3-5 its x, y,
heading; 6, 7 motor shafts' speed left, right [rad/s at the wheel]; 8, 9 their angle; 10, 11
driven axles' speed; 12, 13 belt-driven axles' speed; 14, 15 driven axles' angle; 16, 17
belt-driven axles' angle; 18, 19 winding currents [A]; 20, 21 rise of the winding resistance
[ohm]; 22, 23 bristles of the drivetrains, 24 of the scrub, 25 of the rolling (all in
-1.5..1.5); 26 the battery's slow voltage loss [V]; 27 charge drawn [A·s]; 28, 29 filtered
|current| of the drivers' fold-back [A].
"""

from __future__ import annotations

import math

from lg_husky_sim.proof import world as w
from lg_husky_sim.proof.jit import compiled
from lg_husky_sim.proof.laws import (
    adhesion,
    bristle_rate,
    brought_down,
    chopper,
    dry,
    limited,
    ROLL_BRISTLE,
    SHAFT_BRISTLE,
    shaft_loss,
    YAW_BRISTLE,
)
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

N_STATES = 30


@compiled
def wheel_force(index: int, speed: float, angle: float, s: Vector,
                p: Vector, force: Vector) -> None:
    """
    Write forward and lateral ground force [N] and the radius [m] of one wheel.

    `index` counts rear left, rear right, front left, front right.
    """
    left = index % 2 == 0
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
        size = adhesion(p[w.TYRE_STIFFNESS] * total, min(limit, p[w.FORCE_LIMIT]),
                        p[w.FORM_FORCE])
        force[0] = size * slip / total
        force[1] = size * across / total
    else:
        force[0] = adhesion(p[w.CREEP] * slip, p[w.FORCE_LIMIT], p[w.FORM_FORCE])
        force[1] = 0.0
    force[2] = radius


@compiled
def belt_torque(twist: float, rate: float, p: Vector) -> float:
    """Return the torque [N·m] of a belt that is twisted by `twist` [rad]."""
    torque = p[w.BELT_STIFFNESS] * (twist + p[w.BELT_CUBIC] * twist ** 3) \
        + p[w.BELT_DAMPING] * rate
    if p[w.BELT_LIMIT] < w.NEVER:
        torque = p[w.BELT_LIMIT] * math.tanh(torque / p[w.BELT_LIMIT])
    return float(torque)


@compiled
def gear_torque(twist: float, rate: float, p: Vector) -> float:
    """Return the torque [N·m] of teeth with free play."""
    half = 0.5 * p[w.GAP]
    if twist > half:
        return float(max(
            0.0, p[w.GEAR_STIFFNESS] * (twist - half) + p[w.GEAR_DAMPING] * rate))
    if twist < -half:
        return float(min(
            0.0, p[w.GEAR_STIFFNESS] * (twist + half) + p[w.GEAR_DAMPING] * rate))
    return 0.0


@compiled
def derivative(time: float, s: Vector, p: Vector, volts_left: float, volts_right: float,
               rough: Vector, force: Vector, ds: Vector, extra: Vector) -> None:
    """
    Write the time derivative of the state, and what sensors see of it.

    Parameters
    ----------
    time
        Seconds since the start.
    s, p
        State and hidden robot.
    volts_left, volts_right
        Voltages that the driver is asked for [V], of a full battery.
    rough
        Disturbances, shape (5,): torques on the left and right drivetrain [N·m], force
        ahead and to the left [N], moment [N·m].
    force
        Room for three numbers.
    ds
        Written, as `s`.
    extra
        Written, shape (5,): specific force ahead and to the left [m/s²], bus voltage,
        motor voltages [V].

    """
    # Battery and choppers: mean currents of a bus that both sides share.
    duty_left = chopper(volts_left, p)
    duty_right = chopper(volts_right, p)
    drawn = duty_left * s[18] + duty_right * s[19]
    bus = p[w.SUPPLY] * (1.0 - brought_down(time, s[27], p)) \
        - p[w.BATTERY_RESISTANCE] * drawn - s[26]
    ds[26] = (p[w.POLARISATION] * drawn - s[26]) / p[w.POLARISATION_TIME]
    ds[27] = drawn
    extra[2] = bus

    # A rough floor is felt while the robot moves.
    motion = s[0] * s[0] + (p[w.HALF_TRACK] * s[2]) ** 2
    felt = 1.0 - math.exp(-motion / (p[w.ROUGH_SPEED] * p[w.ROUGH_SPEED]))
    total_x = felt * rough[2]
    total_y = felt * rough[3]
    moment = felt * rough[4]
    for side in range(2):
        duty = duty_left if side == 0 else duty_right
        motor = s[6 + side]
        current = s[18 + side]
        ohms = p[w.RESISTANCE] + s[20 + side]
        constant = p[w.TORQUE_CONSTANT] * (1.0 - p[w.MAGNET_LOSS] * s[20 + side]
                                           / p[w.RESISTANCE])
        volts = duty * bus
        back = constant * motor
        if p[w.CURRENT_LIMIT] > 0.0:
            most = p[w.CURRENT_LIMIT]
            if p[w.CURRENT_CONTINUOUS] > 0.0:
                # Folds back as the filtered current nears what it may carry for long.
                over = (s[28 + side] / p[w.CURRENT_CONTINUOUS] - 0.8) / 0.2
                most -= (most - p[w.CURRENT_CONTINUOUS]) * min(max(over, 0.0), 1.0)
            volts = limited(volts, back, ohms * most, p[w.FORM_CURRENT])
        ds[28 + side] = (abs(current) - s[28 + side]) / p[w.CURRENT_TIME]
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
        soft = p[w.ROLLING_LEFT] if side == 0 else p[w.ROLLING_RIGHT]
        if soft != 0.0:
            pull = soft * math.tanh((s[0] - arm * s[2]) / 0.02)
            total_x -= pull
            moment += arm * pull

        # Losses at the driven axle.
        friction = p[w.FRICTION_LEFT] if side == 0 else p[w.FRICTION_RIGHT]
        viscous = p[w.VISCOUS_LEFT] if side == 0 else p[w.VISCOUS_RIGHT]
        ripple = p[w.RIPPLE_LEFT] if side == 0 else p[w.RIPPLE_RIGHT]
        rear_torque = felt * rough[side] - load_rear - shaft_loss(
            s[10 + side], s[22 + side], friction, viscous, p)
        if ripple != 0.0:
            turn = s[14 + side] + p[w.RIPPLE_PHASE] * (1.0 + side)
            moving = 1.0 - math.exp(-(s[10 + side] / 0.08) ** 2)
            rear_torque += moving * ripple * (
                math.sin(turn) + p[w.RIPPLE_SECOND] * math.sin(2.0 * turn + 1.0))
        motor_torque = constant * current
        if p[w.COGGING] != 0.0:
            motor_torque += p[w.COGGING] * math.sin(
                p[w.COGGING_COUNT] * s[8 + side] + 2.0 * side)
        ds[22 + side] = 0.0
        if friction > 0.0 and p[w.FORM_FRICTION] < 0.5:
            ds[22 + side] = bristle_rate(s[10 + side], s[22 + side], p[w.STRIBECK_RATIO],
                                         p[w.STRIBECK_SPEED], SHAFT_BRISTLE)

        # Motor shaft - (free play) - driven axle - (belt) - front axle.
        slack = p[w.GAP] > 0.0
        inertia_rear = p[w.INERTIA_REAR]
        gear = 0.0
        if slack:
            gear = gear_torque(s[8 + side] - s[14 + side], motor - s[10 + side], p)
            rear_torque += gear
        else:
            rear_torque += motor_torque
            inertia_rear += p[w.INERTIA_MOTOR]
        if p[w.BELT_STIFFNESS] > 0.0:
            belt = belt_torque(s[14 + side] - s[16 + side], s[10 + side] - s[12 + side], p)
            rear = (rear_torque - belt) / inertia_rear
            front = (belt - load_front) / p[w.INERTIA_FRONT]
        else:
            rear = (rear_torque - load_front) / (inertia_rear + p[w.INERTIA_FRONT])
            front = rear
        ds[6 + side] = (motor_torque - gear) / p[w.INERTIA_MOTOR] if slack else rear
        ds[10 + side] = rear
        ds[12 + side] = front
        ds[8 + side] = motor
        ds[14 + side] = s[10 + side]
        ds[16 + side] = s[12 + side]
    _chassis(s, p, total_x, total_y, moment, ds, extra)


@compiled
def _chassis(s: Vector, p: Vector, total_x: float, total_y: float, moment: float, ds: Vector,
             extra: Vector) -> None:
    """Write what the ground's forces, those of the drives added up, do to the body."""
    ahead, across, yaw, heading = s[0], s[1], s[2], s[5]
    cosine, sine = math.cos(heading), math.sin(heading)
    pull_x = p[w.GRAVITY_X] * cosine + p[w.GRAVITY_Y] * sine
    pull_y = -p[w.GRAVITY_X] * sine + p[w.GRAVITY_Y] * cosine
    if p[w.ROLLING] != 0.0:
        total_x -= p[w.ROLLING] * dry(ahead, s[25], p[w.FORM_DRY])
    if p[w.DRAG] != 0.0:
        total_x -= math.copysign(p[w.DRAG] * abs(ahead) ** p[w.DRAG_EXPONENT], ahead)
    if p[w.UNDULATION] != 0.0:
        wave = 2.0 * math.pi / p[w.UNDULATION_PITCH]
        total_x += p[w.UNDULATION] * (cosine * math.sin(wave * s[3])
                                      + sine * math.sin(wave * s[4]))
    moment -= p[w.YAW_DAMPING] * yaw
    if p[w.SCRUB] != 0.0:
        moment -= p[w.SCRUB] * dry(yaw, s[24], p[w.FORM_DRY])
    if p[w.SCRUB_SPEED] != 0.0:
        moment -= p[w.SCRUB_SPEED] * abs(ahead) ** p[w.SCRUB_EXPONENT] * yaw
    if p[w.PULL] != 0.0:
        rolling_speed = ahead * ahead + (p[w.HALF_TRACK] * yaw) ** 2
        moment += p[w.PULL] * (1.0 - math.exp(-rolling_speed / p[w.PULL_SPEED] ** 2))
    ds[24] = bristle_rate(yaw, s[24], 1.0, 1.0, YAW_BRISTLE)
    ds[25] = bristle_rate(ahead, s[25], 1.0, 1.0, ROLL_BRISTLE)
    # About the middle of the wheels, with the centre of mass `forward` of it.
    forward = p[w.CENTRE_FORWARD]
    slides = p[w.LATERAL] < w.NEVER or p[w.TYRE] > 0.5
    if slides:
        if p[w.TYRE] < 0.5:
            total_y -= p[w.LATERAL] * across
    else:
        # The floor's reaction that keeps the middle of the wheels from slipping sideways.
        total_y = p[w.MASS] * (ahead * yaw - pull_y + forward * moment / p[w.YAW_INERTIA]) \
            / (1.0 + p[w.MASS] * forward * forward / p[w.YAW_INERTIA])
    extra[0] = total_x / p[w.MASS] + forward * yaw * yaw
    ds[2] = (moment - forward * total_y) / p[w.YAW_INERTIA]
    extra[1] = total_y / p[w.MASS] - forward * ds[2]
    ds[0] = extra[0] + pull_x + across * yaw
    ds[1] = extra[1] + pull_y - ahead * yaw if slides else 0.0
    ds[3] = ahead * cosine - across * sine
    ds[4] = ahead * sine + across * cosine
    ds[5] = yaw
