# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The Husky in a rigid-body engine: MuJoCo, four ellipsoid tyres with dry contact on a plane.

Nothing of the paper's model is in it: no creep, no yaw damping. Sliding, load transfer
and chatter come from the contact solver. Sizes and masses are Clearpath's public ones.
"""

from __future__ import annotations

import math
from typing import Any

from lg_husky_sim.errors import MissingExtraError
from lg_husky_sim.proof import world as w
from lg_husky_sim.proof.dynamics import chopper
from lg_husky_sim.proof.integrate import COLUMNS, Gate, ROUGH_PERIOD, STEP
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

PERIOD = 2e-3
SETTLING = 0.6
_EVERY = round(PERIOD / STEP)
_WHEEL_MASS = 2.6
_WHEEL_WIDTH = 0.1143
_NAMES = ('rear_left', 'rear_right', 'front_left', 'front_right')


def _model_text(p: Vector) -> str:
    """Return the MJCF of a robot; wheels of a side turn together (its belt is stiff)."""
    body_mass = p[w.MASS] - 4.0 * _WHEEL_MASS
    wheel_yaw = 4.0 * _WHEEL_MASS * (p[w.HALF_TRACK] ** 2 + p[w.HALF_BASE] ** 2)
    yaw_inertia = max(p[w.YAW_INERTIA] - wheel_yaw, 0.4)
    gear = p[w.TORQUE_CONSTANT] / p[w.RESISTANCE]
    brake = p[w.TORQUE_CONSTANT] * gear
    wheels = []
    for k, name in enumerate(_NAMES):
        left = k % 2 == 0
        radius = p[w.RADIUS_LEFT] if left else p[w.RADIUS_RIGHT]
        friction = 0.5 * (p[w.FRICTION_LEFT] if left else p[w.FRICTION_RIGHT])
        viscous = 0.5 * (p[w.VISCOUS_LEFT] if left else p[w.VISCOUS_RIGHT])
        x = math.copysign(p[w.HALF_BASE], k - 1.5)
        y = p[w.HALF_TRACK] if left else -p[w.HALF_TRACK]
        wheels.append(f"""
      <body name="{name}" pos="{x} {y} 0">
        <joint name="{name}" type="hinge" axis="0 1 0" armature="{0.5 * p[w.INERTIA_MOTOR]}"
               frictionloss="{friction}" damping="{viscous}"/>
        <geom name="{name}" type="ellipsoid" size="{radius} {radius} {0.5 * _WHEEL_WIDTH}"
              zaxis="0 1 0" mass="{_WHEEL_MASS}"/>
      </body>""")
    text = ''.join(wheels)
    height = max(p[w.RADIUS_LEFT], p[w.RADIUS_RIGHT])
    return f"""
<mujoco model="hidden_robot">
  <option timestep="{PERIOD}" integrator="implicitfast" cone="elliptic" impratio="1"/>
  <default><geom friction="{p[w.TYRE_FRICTION]} 0.01 0.002" condim="3"
    solref="0.045 1" solimp="0.7 0.95 0.005"/></default>
  <worldbody>
    <geom name="floor" type="plane" size="100 100 1"/>
    <body name="base" pos="0 0 {height}">
      <freejoint name="base"/>
      <inertial pos="{p[w.CENTRE_FORWARD]} 0 0.06" mass="{body_mass}"
                diaginertia="{0.4 * yaw_inertia} {0.8 * yaw_inertia} {yaw_inertia}"/>
      {text}
    </body>
  </worldbody>
  <equality>
    <joint joint1="front_left" joint2="rear_left" solref="0.004 1"/>
    <joint joint1="front_right" joint2="rear_right" solref="0.004 1"/>
  </equality>
  <actuator>
    <general name="left" joint="rear_left" gainprm="{gear}" biastype="affine"
             biasprm="0 0 {-brake}"/>
    <general name="right" joint="rear_right" gainprm="{gear}" biastype="affine"
             biasprm="0 0 {-brake}"/>
  </actuator>
</mujoco>"""


def _engine() -> Any:
    try:
        import mujoco
    except ImportError as error:
        message = "world 'g2' needs MuJoCo: pip install 'lg_husky_sim[engine]'"
        raise MissingExtraError(message) from error
    return mujoco


def _open(gate: Gate, time: float, x: float) -> float:
    if gate.kind == 'none':
        return 1.0
    z = ((time if gate.kind == 'time' else x) - gate.at) / gate.width
    return min(max(z + 0.5, 0.0), 1.0)


def _step_forces(p: Vector, forward: float, yaw: float, heading: float, position: Any,
                 floor: Vector) -> tuple[float, float, float]:
    """Return force ahead and to the left [N] and moment [N·m] of what the engine lacks."""
    direction = math.tanh(forward / 0.02)
    ahead = floor[2] - p[w.ROLLING] * direction - p[w.DRAG] * abs(forward) * forward
    wave = 2.0 * math.pi / p[w.UNDULATION_PITCH]
    ahead += p[w.UNDULATION] * (math.cos(heading) * math.sin(wave * position[0])
                                + math.sin(heading) * math.sin(wave * position[1]))
    moment = floor[4] - p[w.SCRUB] * math.tanh(yaw / 0.02)
    moment -= p[w.SCRUB_SPEED] * abs(forward) ** p[w.SCRUB_EXPONENT] * yaw
    rolling = forward * forward + (p[w.HALF_TRACK] * yaw) ** 2
    moment += p[w.PULL] * (1.0 - math.exp(-rolling / 0.03 ** 2))
    return ahead, floor[3], moment


def _bus(p: Vector, time: float, duties: list[float], back: list[float]) -> float:
    """
    Return the voltage of a bus that its motors load, in the same step [V].

    With the current of the step before, a source that resists more than the windings would swing
    up from step to step.
    """
    emf = p[w.EMF] * (1.0 - p[w.DROOP_DEPTH] * (1.0 - math.exp(-time / p[w.DROOP_TIME])))
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


def integrate_engine(off: Vector, on: Vector, gate: Gate, demand: Vector, rough: Vector,
                     pose: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Vector:
    """
    Return what a robot in the engine does; arguments and result as `integrate.integrate`.

    The demand must be voltages. Belt, free play, heating, cogging and run-out have no
    counterpart here.

    Raises
    ------
    MissingExtraError
        MuJoCo is not installed.
    FloatingPointError
        The motion left every physical bound.

    """
    mujoco = _engine()
    model = mujoco.MjModel.from_xml_string(_model_text(on))
    data = mujoco.MjData(model)
    data.qpos[0:2] = pose[0:2]
    data.qpos[3:7] = [math.cos(0.5 * pose[2]), 0.0, 0.0, math.sin(0.5 * pose[2])]
    joints = [model.joint(name) for name in _NAMES[:2]]
    angles = [int(joint.qposadr[0]) for joint in joints]
    rates = [int(joint.dofadr[0]) for joint in joints]
    for _ in range(round(SETTLING / PERIOD)):
        mujoco.mj_step(model, data)
    start_angles = [float(data.qpos[k]) for k in angles]
    volts_asked = demand[::_EVERY]
    per_rough = round(ROUGH_PERIOD / PERIOD)
    table = np.zeros((volts_asked.shape[0], len(COLUMNS)))
    turns = 0.0
    last = pose[2]
    frictions = model.geom_friction[:, 0].copy()
    base_force = data.xfrc_applied[model.body('base').id]
    wheel_weight = 0.25 * on[w.MASS] * w.GRAVITY
    p = on
    for row in range(table.shape[0]):
        time = row * PERIOD
        raw = _heading(data.qpos[3:7])
        turns += math.remainder(raw - last, 2.0 * math.pi)
        last = raw
        heading = pose[2] + turns
        cosine, sine = math.cos(heading), math.sin(heading)
        if gate.kind != 'none':
            p = off + _open(gate, time, float(data.qpos[0])) * (on - off)
        model.geom_friction[:, 0] = min(p[w.TYRE_FRICTION], p[w.FORCE_LIMIT] / wheel_weight) \
            * frictions / on[w.TYRE_FRICTION]
        model.opt.gravity[:] = (p[w.GRAVITY_X], p[w.GRAVITY_Y], -w.GRAVITY)
        velocity = data.qvel[0:2]
        forward = float(velocity[0] * cosine + velocity[1] * sine)
        lateral = float(-velocity[0] * sine + velocity[1] * cosine)
        yaw = float(data.qvel[5])
        floor = rough[min(row // per_rough, rough.shape[0] - 1)]
        ahead, across, moment = _step_forces(p, forward, yaw, heading, data.qpos, floor)
        base_force[:] = (ahead * cosine - across * sine, ahead * sine + across * cosine, 0.0,
                         0.0, 0.0, moment)
        duties = [chopper(float(volts), p) for volts in volts_asked[row]]
        wheel = [float(data.qvel[k]) for k in rates]
        currents = [float(torque) / p[w.TORQUE_CONSTANT] for torque in data.actuator_force]
        bus = _bus(p, time, duties, [p[w.TORQUE_CONSTANT] * rate for rate in wheel])
        for side in range(2):
            volts = duties[side] * bus
            back = p[w.TORQUE_CONSTANT] * wheel[side]
            if p[w.CURRENT_LIMIT] > 0.0:
                room = p[w.RESISTANCE] * p[w.CURRENT_LIMIT]
                volts = min(max(volts, back - room), back + room)
            data.ctrl[side] = volts
            ripple = p[w.RIPPLE_LEFT + side]
            turn = float(data.qpos[angles[side]]) + p[w.RIPPLE_PHASE] * (1.0 + side)
            data.qfrc_applied[rates[side]] = floor[side] + ripple * (
                math.tanh(abs(wheel[side]) / 0.1) * math.sin(turn))
        mujoco.mj_step(model, data)
        push = data.qacc[0:2] - model.opt.gravity[0:2]
        table[row] = (
            time, forward, lateral, yaw, float(data.qpos[0]), float(data.qpos[1]), heading,
            wheel[0], wheel[1], float(data.qpos[angles[0]]) - start_angles[0],
            float(data.qpos[angles[1]]) - start_angles[1], currents[0], currents[1],
            float(push[0] * cosine + push[1] * sine),
            float(-push[0] * sine + push[1] * cosine), bus,
            float(data.ctrl[0]), float(data.ctrl[1]))
    speeds = np.abs(table[:, [1, 7, 8]])
    if not np.isfinite(table).all() or np.any(speeds > (50.0, 500.0, 500.0)):
        raise FloatingPointError('the robot in the engine left its bounds')
    return table


def _heading(quaternion: Any) -> float:
    a, b, c, d = (float(part) for part in quaternion)
    return math.atan2(2.0 * (a * d + b * c), 1.0 - 2.0 * (c * c + d * d))
