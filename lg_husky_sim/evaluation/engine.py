# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The Husky in a rigid-body engine: MuJoCo, with contact and dry friction of four tyres.

The base closes a wheel-speed loop with Clearpath's kinematics, as Gazebo's and the real one's
controllers do: wheel rate = (v ∓ omega * multiplier * track / 2) / wheel radius.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
import math
from typing import Any

from lg_husky_sim.errors import SettingsError
from lg_husky_sim.extras import require
from lg_husky_sim.resources import config_path
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.simulation.simulator import hold
import numpy as np
import yaml

#: Time in which the body comes to rest on its tyres before the drive [s].
SETTLING = 1.0
_WHEELS = (('front_left', 1.0, 1.0), ('rear_left', -1.0, 1.0), ('front_right', 1.0, -1.0),
           ('rear_right', -1.0, -1.0))


@dataclass(frozen=True)
class EngineRobot:
    """
    A Husky for the engine; see ``config/engine.yaml`` for units and sources.

    Parameters
    ----------
    timestep : float
        [s]
    chassis_mass, wheel_mass : float
        [kg]
    chassis_inertia, wheel_inertia : tuple of float
        [kg·m²]; of the chassis about x, y, z; of a wheel about x, z and its axle.
    centre_of_mass : tuple of float
        Of the chassis against the middle of the wheels [m].
    wheel_radius, wheel_width, wheelbase, track : float
        [m]
    friction : float
        Sliding friction of tyre and ground.
    tyre_time : float
        Time constant of the contact [s].
    softness : float
        Impedance of the contact at first touch, 0 (soft) to 1 (rigid).
    axle_friction, axle_damping : float
        Of each wheel [N·m], [N·m·s/rad].
    multiplier : float
        By which the controller takes the track for wider than it is.
    loop_gain, loop_integral, loop_delay : float
        Speed loop of a side [N·m·s/rad], [N·m/rad], [s].
    torque_limit : float
        Of a side [N·m].

    """

    timestep: float
    chassis_mass: float
    chassis_inertia: tuple[float, ...]
    centre_of_mass: tuple[float, ...]
    wheel_mass: float
    wheel_inertia: tuple[float, ...]
    wheel_radius: float
    wheel_width: float
    wheelbase: float
    track: float
    friction: float
    tyre_time: float
    softness: float
    axle_friction: float
    axle_damping: float
    multiplier: float
    loop_gain: float
    loop_integral: float
    loop_delay: float
    torque_limit: float

    def mjcf(self) -> str:
        """Return the robot and its ground as MJCF."""
        wheels = ''.join(self._wheel(*wheel) for wheel in _WHEELS)
        size = f'{0.49 * self.wheelbase + 0.2} {0.4 * self.track} 0.1'
        belts = ''.join(f'<joint joint1="front_{side}" joint2="rear_{side}" '
                        'polycoef="0 1 0 0 0" solref="0.004 1"/>' for side in ('left', 'right'))
        half = 0.5 * self.torque_limit
        motors = ''.join(f'<velocity name="{name}" joint="{name}" kv="{0.5 * self.loop_gain}" '
                         f'forcerange="{-half} {half}"/>' for name, _, _ in _WHEELS)
        return f"""<mujoco model="husky">
<compiler angle="radian" inertiafromgeom="false"/>
<option timestep="{self.timestep}" integrator="implicitfast" cone="elliptic"/>
<default><geom friction="{self.friction} 0.005 0.0001" condim="3"
 solref="{self.tyre_time} 1" solimp="{self.softness} 0.95 0.005"/></default>
<worldbody>
<geom name="ground" type="plane" size="0 0 1"/>
<body name="base" pos="0 0 {self.wheel_radius}">
<freejoint/>
<inertial pos="{_text(self.centre_of_mass)}" mass="{self.chassis_mass}"
 diaginertia="{_text(self.chassis_inertia)}"/>
<geom type="box" size="{size}" pos="0 0 0.12" contype="0" conaffinity="0"/>
{wheels}</body>
</worldbody>
<equality>{belts}</equality>
<actuator>{motors}</actuator>
</mujoco>"""

    def _wheel(self, name: str, ahead: float, left: float) -> str:
        place = f'{0.5 * ahead * self.wheelbase} {0.5 * left * self.track} 0'
        across, upright, axle = self.wheel_inertia
        return f"""<body name="{name}" pos="{place}">
<joint name="{name}" type="hinge" axis="0 1 0" frictionloss="{self.axle_friction}"
 damping="{self.axle_damping}"/>
<inertial pos="0 0 0" mass="{self.wheel_mass}" diaginertia="{across} {axle} {upright}"/>
<geom type="cylinder" size="{self.wheel_radius} {0.5 * self.wheel_width}" zaxis="0 1 0"/>
</body>
"""


def _text(values: tuple[float, ...]) -> str:
    return ' '.join(f'{value}' for value in values)


def engine_config() -> Mapping[str, Any]:
    """
    Return the content of ``config/engine.yaml``.

    Raises
    ------
    SettingsError
        If the file is of another schema.

    """
    path = config_path('engine.yaml')
    data = yaml.safe_load(path.read_text(encoding='utf-8'))
    if not isinstance(data, dict) or data.get('schema') != 'lg_husky_sim/engine/1':
        raise SettingsError(f'{path}: schema is not lg_husky_sim/engine/1')
    return data


def engine_robot(name: str) -> EngineRobot:
    """
    Return a robot of ``config/engine.yaml``.

    Parameters
    ----------
    name : str
        ``nominal``, or ``robot``, which differs from it.

    Raises
    ------
    SettingsError
        If it is unknown, or an entry of it is.

    """
    data = engine_config()
    known = {field.name for field in fields(EngineRobot)}
    if name not in ('nominal', 'robot'):
        raise SettingsError(f'no engine robot {name!r} (there are nominal, robot)')
    entries = {**data['nominal'], **data[name]}
    given: dict[str, Any] = {
        key: tuple(map(float, value)) if isinstance(value, list) else float(value)
        for key, value in entries.items()}
    if set(given) != known:
        odd = sorted(set(given) ^ known)[0]
        raise SettingsError(f'engine.yaml: {odd!r} is unknown or missing')
    return EngineRobot(**given)


def drive(robot: EngineRobot, commands: TimeSeries, rate: float = 50.0) -> TimeSeries:
    """
    Drive a robot in the engine.

    Parameters
    ----------
    robot : EngineRobot
        Bodies, tyres and speed loop, and the time step of the engine.
    commands : TimeSeries
        Names forward [m/s], yaw [rad/s]; from rest.
    rate : float
        Samples per second [Hz].

    Returns
    -------
    TimeSeries
        wheel_left, wheel_right [rad/s] as means over a sample, forward [m/s], yaw_rate
        [rad/s], accel_x [m/s²], x, y [m], heading [rad].

    Raises
    ------
    MissingExtraError
        If MuJoCo is not installed.

    """
    require('mujoco', 'drive in the engine')
    import mujoco

    model = mujoco.MjModel.from_xml_string(robot.mjcf())
    data = mujoco.MjData(model)
    for _ in range(round(SETTLING / robot.timestep)):
        mujoco.mj_step(model, data)
    start, every = float(commands.times[0]), max(1, round(1.0 / (rate * robot.timestep)))
    count = math.floor((float(commands.times[-1]) - start) / (every * robot.timestep) + 1e-6)
    references = _references(robot, commands, start, count * every)
    data.qpos[:2] = 0.0
    integral = np.zeros(2)
    rows = [_row(data, 0.0)]
    turns, before = 0.0, rows[0][-1]
    for step in range(count * every):
        rates = np.array([0.5 * (data.qvel[6] + data.qvel[7]),
                          0.5 * (data.qvel[8] + data.qvel[9])])
        # The engine closes the proportional part inside its step; the integral shifts its target.
        error = references[step] - rates
        inside = np.abs(robot.loop_gain * error + integral) < robot.torque_limit
        integral += inside * robot.loop_integral * robot.timestep * error
        data.ctrl[:] = np.repeat(references[step] + integral / robot.loop_gain, 2)
        mujoco.mj_step(model, data)
        if (step + 1) % every == 0:
            row = _row(data, turns)
            turns += -2.0 * math.pi * round((row[-1] - before) / (2.0 * math.pi))
            row = _row(data, turns)
            before = row[-1]
            rows.append(row)
    values = np.array(rows)
    interval = every * robot.timestep
    # An encoder counts: its rate is the mean since the sample before.
    values[1:, :2] = np.diff(values[:, :2], axis=0) / interval
    values[0, :2] = 0.0
    acceleration: FloatArray = np.gradient(values[:, 2], interval)
    times: FloatArray = start + interval * np.arange(len(values), dtype=np.float64)
    return TimeSeries(
        times,
        np.column_stack([values[:, :4], acceleration, values[:, 4:]]),
        ('wheel_left', 'wheel_right', 'forward', 'yaw_rate', 'accel_x', 'x', 'y', 'heading'))


def _references(robot: EngineRobot, commands: TimeSeries, start: float, count: int
                ) -> FloatArray:
    held = hold(commands, start - robot.loop_delay, robot.timestep, count)
    arm = 0.5 * robot.multiplier * robot.track
    wheel: FloatArray = (held[:, :1] + arm * held[:, 1:] * np.array([[-1.0, 1.0]])) / (
        robot.wheel_radius)
    return wheel


def _row(data: Any, turns: float) -> list[float]:
    # Wheel angles, speed, yaw rate, position and heading.
    w, x, y, z = data.qpos[3:7]
    heading = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)) + turns
    forward = math.cos(heading) * data.qvel[0] + math.sin(heading) * data.qvel[1]
    return [0.5 * (data.qpos[7] + data.qpos[8]), 0.5 * (data.qpos[9] + data.qpos[10]), forward,
            data.qvel[5], data.qpos[0], data.qpos[1], heading]
