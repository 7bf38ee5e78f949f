# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The Husky in MuJoCo: ellipsoid tyres on a plane, convex contact, implicit integration."""

from __future__ import annotations

import math
from typing import Any

from lg_husky_sim.errors import MissingExtraError
from lg_husky_sim.proof import world as w
from lg_husky_sim.proof.engine import BodyState, SETTLING, WHEEL_MASS, WHEEL_NAMES
from lg_husky_sim.proof.integrate import ROW_PERIOD
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

_WHEEL_WIDTH = 0.1143


def _model_text(p: Vector) -> str:
    """Return the MJCF of a robot; wheels of a side turn together (its belt is stiff)."""
    body_mass = p[w.MASS] - 4.0 * WHEEL_MASS
    wheel_yaw = 4.0 * WHEEL_MASS * (p[w.HALF_TRACK] ** 2 + p[w.HALF_BASE] ** 2)
    yaw_inertia = max(p[w.YAW_INERTIA] - wheel_yaw, 0.4)
    wheels = []
    for k, name in enumerate(WHEEL_NAMES):
        left = k % 2 == 0
        radius = p[w.RADIUS_LEFT] if left else p[w.RADIUS_RIGHT]
        x = math.copysign(p[w.HALF_BASE], k - 1.5)
        y = p[w.HALF_TRACK] if left else -p[w.HALF_TRACK]
        wheels.append(f"""
      <body name="{name}" pos="{x} {y} 0">
        <joint name="{name}" type="hinge" axis="0 1 0" armature="{0.5 * p[w.INERTIA_MOTOR]}"/>
        <geom name="{name}" type="ellipsoid" size="{radius} {radius} {0.5 * _WHEEL_WIDTH}"
              zaxis="0 1 0" mass="{WHEEL_MASS}"/>
      </body>""")
    text = ''.join(wheels)
    height = max(p[w.RADIUS_LEFT], p[w.RADIUS_RIGHT])
    return f"""
<mujoco model="hidden_robot">
  <option timestep="{ROW_PERIOD}" integrator="implicitfast" cone="elliptic" impratio="1"/>
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
</mujoco>"""


def _engine() -> Any:
    try:
        import mujoco
    except ImportError as error:
        message = "world 'g2' needs MuJoCo: pip install mujoco"
        raise MissingExtraError(message) from error
    return mujoco


class MujocoBody:
    """A robot that has come to rest on its tyres."""

    def __init__(self, p: Vector, pose: tuple[float, float, float]) -> None:
        self._mujoco = _engine()
        self._model = self._mujoco.MjModel.from_xml_string(_model_text(p))
        self._data = self._mujoco.MjData(self._model)
        self._data.qpos[0:2] = pose[0:2]
        self._data.qpos[3:7] = [math.cos(0.5 * pose[2]), 0.0, 0.0, math.sin(0.5 * pose[2])]
        joints = [self._model.joint(name) for name in WHEEL_NAMES[:2]]
        self._angles = [int(joint.qposadr[0]) for joint in joints]
        self._rates = [int(joint.dofadr[0]) for joint in joints]
        self._frictions = self._model.geom_friction[:, 0].copy() / p[w.TYRE_FRICTION]
        self._base = self._data.xfrc_applied[self._model.body('base').id]
        for _ in range(round(SETTLING / ROW_PERIOD)):
            self._mujoco.mj_step(self._model, self._data)

    def state(self) -> BodyState:
        """Return where it is and how it moves."""
        place, speed = self._data.qpos, self._data.qvel
        a, b, c, d = (float(part) for part in place[3:7])
        heading = math.atan2(2.0 * (a * d + b * c), 1.0 - 2.0 * (c * c + d * d))
        left, right = self._angles
        rate_left, rate_right = self._rates
        return BodyState(
            float(place[0]), float(place[1]), heading, float(speed[0]), float(speed[1]),
            float(speed[5]), (float(place[left]), float(place[right])),
            (float(speed[rate_left]), float(speed[rate_right])))

    def advance(self, torques: tuple[float, float], force: tuple[float, float], moment: float,
                gravity: tuple[float, float], friction: float) -> None:
        """Take one step with torques on the driven axles and forces along the world."""
        self._model.geom_friction[:, 0] = friction * self._frictions
        self._model.opt.gravity[:] = (*gravity, -w.GRAVITY)
        self._base[:] = (*force, 0.0, 0.0, 0.0, moment)
        for rate, torque in zip(self._rates, torques, strict=True):
            self._data.qfrc_applied[rate] = torque
        self._mujoco.mj_step(self._model, self._data)
