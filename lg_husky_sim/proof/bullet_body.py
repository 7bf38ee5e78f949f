# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The Husky in Bullet: spherical tyres on a plane, sequential impulses, dry friction."""

from __future__ import annotations

import math
from typing import Any

from lg_husky_sim.errors import MissingExtraError
from lg_husky_sim.proof import world as w
from lg_husky_sim.proof.engine import BodyState, SETTLING, WHEEL_MASS
from lg_husky_sim.proof.integrate import ROW_PERIOD
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

# Belts between the axles of a side: stiffness [N·m/rad] and damping [N·m·s/rad].
_BELT = (300.0, 3.0)


def _engine() -> Any:
    try:
        import pybullet
    except ImportError as error:
        message = "world 'g4' needs Bullet: pip install pybullet"
        raise MissingExtraError(message) from error
    return pybullet


class BulletBody:
    """A robot that has come to rest on its tyres; ends its engine when left."""

    def __init__(self, p: Vector, pose: tuple[float, float, float]) -> None:
        self._bullet = _engine()
        self._client = self._bullet.connect(self._bullet.DIRECT)
        self._gravity: tuple[float, float] = (0.0, 0.0)
        self._friction = -1.0
        try:
            self._build(p, pose)
        except BaseException:
            self._bullet.disconnect(self._client)
            raise

    def _build(self, p: Vector, pose: tuple[float, float, float]) -> None:
        b, client = self._bullet, self._client
        b.setTimeStep(ROW_PERIOD, physicsClientId=client)
        b.setGravity(0.0, 0.0, -w.GRAVITY, physicsClientId=client)
        ground = b.createCollisionShape(b.GEOM_PLANE, physicsClientId=client)
        self._ground = b.createMultiBody(0.0, ground, physicsClientId=client)
        radii = [p[w.RADIUS_LEFT], p[w.RADIUS_RIGHT]] * 2
        shapes = [b.createCollisionShape(b.GEOM_SPHERE, radius=radius, physicsClientId=client)
                  for radius in radii]
        # Rear left, rear right, front left, front right.
        places = [[side_x * p[w.HALF_BASE], side_y * p[w.HALF_TRACK], 0.0]
                  for side_x in (-1.0, 1.0) for side_y in (1.0, -1.0)]
        turn = b.getQuaternionFromEuler([0.0, 0.0, pose[2]])
        level = [0.0, 0.0, 0.0, 1.0]
        self._robot = b.createMultiBody(
            baseMass=p[w.MASS] - 4.0 * WHEEL_MASS, basePosition=[pose[0], pose[1], max(radii)],
            baseOrientation=turn, baseInertialFramePosition=[p[w.CENTRE_FORWARD], 0.0, 0.06],
            linkMasses=[WHEEL_MASS] * 4, linkCollisionShapeIndices=shapes,
            linkVisualShapeIndices=[-1] * 4, linkPositions=places, linkOrientations=[level] * 4,
            linkInertialFramePositions=[[0.0] * 3] * 4, linkInertialFrameOrientations=[level] * 4,
            linkParentIndices=[0] * 4, linkJointTypes=[b.JOINT_REVOLUTE] * 4,
            linkJointAxis=[[0.0, 1.0, 0.0]] * 4, physicsClientId=client)
        self._centre = p[w.CENTRE_FORWARD]
        wheel_yaw = 4.0 * WHEEL_MASS * (p[w.HALF_TRACK] ** 2 + p[w.HALF_BASE] ** 2)
        yaw = max(p[w.YAW_INERTIA] - wheel_yaw, 0.4)
        spin = 0.5 * (p[w.INERTIA_MOTOR] + p[w.INERTIA_REAR] + p[w.INERTIA_FRONT])
        free = {'linearDamping': 0.0, 'angularDamping': 0.0, 'physicsClientId': client}
        b.changeDynamics(self._robot, -1, localInertiaDiagonal=[0.4 * yaw, 0.8 * yaw, yaw], **free)
        for wheel in range(4):
            b.changeDynamics(self._robot, wheel, jointDamping=0.0, rollingFriction=0.0,
                             spinningFriction=0.0,
                             localInertiaDiagonal=[0.6 * spin, spin, 0.6 * spin], **free)
            b.setJointMotorControl2(self._robot, wheel, b.VELOCITY_CONTROL, force=0.0,
                                    physicsClientId=client)
        for _ in range(round(SETTLING / ROW_PERIOD)):
            self.advance((0.0, 0.0), (0.0, 0.0), 0.0, (0.0, 0.0), p[w.TYRE_FRICTION])

    def __enter__(self) -> BulletBody:
        return self

    def __exit__(self, *problem: object) -> None:
        self._bullet.disconnect(self._client)

    def state(self) -> BodyState:
        """Return where it is and how it moves."""
        b = self._bullet
        (x, y, _), turn = b.getBasePositionAndOrientation(self._robot,
                                                          physicsClientId=self._client)
        (vx, vy, _), (_, _, yaw) = b.getBaseVelocity(self._robot, physicsClientId=self._client)
        heading = float(b.getEulerFromQuaternion(turn)[2])
        # Bullet tells of the centre of mass, everybody else of the middle of the wheels.
        ahead = (self._centre * math.cos(heading), self._centre * math.sin(heading))
        left, right = (b.getJointState(self._robot, k, physicsClientId=self._client)[:2]
                       for k in (0, 1))
        return BodyState(x - ahead[0], y - ahead[1], heading, vx + yaw * ahead[1],
                         vy - yaw * ahead[0], yaw, (left[0], right[0]), (left[1], right[1]))

    def advance(self, torques: tuple[float, float], force: tuple[float, float], moment: float,
                gravity: tuple[float, float], friction: float) -> None:
        """Take one step with torques on the driven axles and forces along the world."""
        b, client = self._bullet, self._client
        if friction != self._friction:
            # Bullet multiplies the frictions of both bodies.
            b.changeDynamics(self._ground, -1, lateralFriction=1.0, physicsClientId=client)
            for wheel in range(4):
                b.changeDynamics(self._robot, wheel, lateralFriction=friction,
                                 physicsClientId=client)
            self._friction = friction
        if gravity != self._gravity:
            b.setGravity(*gravity, -w.GRAVITY, physicsClientId=client)
            self._gravity = gravity
        states = [b.getJointState(self._robot, k, physicsClientId=client)[:2] for k in range(4)]
        for side in range(2):
            rear, front = states[side], states[2 + side]
            belt = _BELT[0] * (rear[0] - front[0]) + _BELT[1] * (rear[1] - front[1])
            for wheel, torque in ((side, torques[side] - belt), (2 + side, belt)):
                b.setJointMotorControl2(self._robot, wheel, b.TORQUE_CONTROL, force=torque,
                                        physicsClientId=client)
        if force != (0.0, 0.0) or moment != 0.0:
            place = b.getBasePositionAndOrientation(self._robot, physicsClientId=client)[0]
            b.applyExternalForce(self._robot, -1, [*force, 0.0], place, b.WORLD_FRAME,
                                 physicsClientId=client)
            b.applyExternalTorque(self._robot, -1, [0.0, 0.0, moment], b.WORLD_FRAME,
                                  physicsClientId=client)
        b.stepSimulation(physicsClientId=client)
