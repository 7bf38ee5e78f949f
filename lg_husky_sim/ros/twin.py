# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Models that run beside a live robot, and how far each of them is off."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
import math
import time
from typing import Any

from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.ros import api
from lg_husky_sim.ros.conversions import twist_from_msg
from lg_husky_sim.ros.settings import Settings
from lg_husky_sim.ros.tool import Tool
from lg_husky_sim.signals import BodyTwist, TimeSeries
from lg_husky_sim.simulation import Simulator, SimulatorState
from lg_husky_sim.simulation.starting import commanded_until
import numpy as np

NAME = 'lg_husky_twin'
#: Step of the models, and age from which a running error forgets [s].
PERIOD = 0.01
MEMORY = 10.0
#: Silence after which the models begin anew, from what is measured [s].
SILENCE = 1.0
#: Quantities that are compared, and their unit.
QUANTITIES = {'wheel_rate': 'rad/s', 'yaw_rate': 'rad/s'}


@dataclass
class RunningError:
    """
    Root mean square of errors: over all of them, and of the last seconds.

    Parameters
    ----------
    memory : float
        Time constant of forgetting [s].
    """

    memory: float = MEMORY
    total: float = 0.0
    count: int = 0
    recent: float = 0.0
    weight: float = 0.0
    last: float = -math.inf

    def add(self, moment: float, error: float) -> None:
        """Take in one error [unit of the quantity] at a moment [s]."""
        decay = math.exp(-max(moment - self.last, 0.0) / self.memory)
        self.last = moment
        self.recent = self.recent * decay + error * error
        self.weight = self.weight * decay + 1.0
        self.total += error * error
        self.count += 1

    @property
    def now(self) -> float:
        """Root mean square of the last seconds; NaN before the first error."""
        return math.sqrt(self.recent / self.weight) if self.weight else math.nan

    @property
    def overall(self) -> float:
        """Root mean square of all errors; NaN before the first one."""
        return math.sqrt(self.total / self.count) if self.count else math.nan


@dataclass(eq=False)
class Shadow:
    """
    A model that gets the robot's commands.

    Parameters
    ----------
    plant : Plant
        An effect with an onset in time is taken to have begun.
    timeout : float
        Time after which a command is forgotten, as the base does [s]; 0 for never.
    """

    plant: Plant
    timeout: float = 0.0
    errors: dict[str, RunningError] = field(
        default_factory=lambda: {name: RunningError() for name in QUANTITIES})

    def __post_init__(self) -> None:
        """Make the simulator."""
        onset = self.plant.onset
        if onset is not None and onset.kind.value == 'time':
            self.plant = Plant((self.plant.sets[-1],), self.plant.states)
        self._simulator = Simulator(self.plant, PERIOD)
        # Compiling takes seconds; better now than while the robot drives.
        self._simulator.step(self._simulator.initial(), BodyTwist(0.0, 0.0))
        self._state: SimulatorState | None = None
        self._command = BodyTwist(0.0, 0.0)
        self._since = 0.0

    def command(self, moment: float, command: BodyTwist) -> None:
        """Advance to a moment [s], then obey another command."""
        self._advance(moment)
        self._command, self._since = command, moment

    def _advance(self, moment: float) -> SimulatorState | None:
        state = self._state
        if state is None or moment - state.time >= SILENCE:
            self._state = None
            return None
        while state.time + PERIOD <= moment:
            old = self.timeout > 0.0 and state.time - self._since > self.timeout
            state = self._simulator.step(state, BodyTwist(0.0, 0.0) if old else self._command)
        self._state = state
        return state

    def wheels(self, moment: float, left: float, right: float) -> None:
        """Compare with measured wheel rates [rad/s]."""
        state = None if self._state is None or moment < self._state.time else (
            self._advance(moment))
        if state is None:
            # A robot that moves already rolls, and follows what it was told last.
            twist = self._simulator.rolling(left, right)
            last = TimeSeries(np.array([self._since]), np.array(
                [[self._command.forward, self._command.yaw]]), ('forward', 'yaw'))
            self._state = self._simulator.initial(
                time=moment, twist=twist, wheel_rates=(left, right), command=commanded_until(
                    moment, last, twist, (left, right), self.timeout))
            return
        sensors = self.plant.sets[0].sensors
        rates = state.wheel_rates
        for value, rate, factor in ((left, rates[0], sensors.encoder_left),
                                    (right, rates[1], sensors.encoder_right)):
            self.errors['wheel_rate'].add(moment, value - factor * rate)

    def gyro(self, moment: float, rate: float) -> None:
        """Compare with a measured yaw rate [rad/s]."""
        state = self._advance(moment)
        if state is None:
            return
        sensors = self.plant.sets[0].sensors
        expected = sensors.gyro_factor * state.twist.yaw + sensors.gyro_bias
        self.errors['yaw_rate'].add(moment, rate - expected)


#: Finds the wheels of both sides in a joint state: names and rates to left and right [rad/s].
Sides = Callable[[Sequence[str], Sequence[float]], tuple[float, float]]


class Twin:
    """
    A node that runs models beside a robot and publishes how far they are off.

    Each model's running error is a ``std_msgs/Float64`` on ``twin/<model>/<quantity>_error``.

    Parameters
    ----------
    tool : Tool
    plants : mapping of str to Plant
        By the name under which their errors are published.
    settings : Settings
        Topics and types.
    sides : callable
        See :data:`Sides`.
    """

    def __init__(self, tool: Tool, plants: Mapping[str, Plant], settings: Settings, sides: Sides
                 ) -> None:
        """Subscribe to the robot."""
        self._tool = tool
        self.node = tool.node
        self._sides = sides
        self._stamped = settings.command_type == 'TwistStamped'
        self.shadows = {name: Shadow(plant, settings.command_timeout)
                        for name, plant in plants.items()}
        for kind, topic, callback in (
                (f'geometry_msgs/msg/{settings.command_type}', settings.command_topic,
                 self._on_command),
                ('sensor_msgs/msg/JointState', settings.joint_states_topic, self._on_joints),
                ('sensor_msgs/msg/Imu', settings.imu_topic, self._on_imu)):
            self.node.create_subscription(api.message_type(kind), topic, callback,
                                          api.qos_profile_sensor_data)
        self._float: Any = api.message_type('std_msgs/msg/Float64')
        self._publishers = {
            (name, quantity): self.node.create_publisher(
                self._float, f'twin/{name}/{quantity}_error', 10)
            for name in self.shadows for quantity in QUANTITIES}

    def _on_command(self, message: Any) -> None:
        command = twist_from_msg(message.twist if self._stamped else message)
        if math.isfinite(command.forward) and math.isfinite(command.yaw):
            for shadow in self.shadows.values():
                shadow.command(time.monotonic(), command)

    def _on_joints(self, message: Any) -> None:
        left, right = self._sides(list(message.name), list(message.velocity))
        if math.isfinite(left) and math.isfinite(right):
            for shadow in self.shadows.values():
                shadow.wheels(time.monotonic(), left, right)

    def _on_imu(self, message: Any) -> None:
        rate = float(message.angular_velocity.z)
        if math.isfinite(rate):
            for shadow in self.shadows.values():
                shadow.gyro(time.monotonic(), rate)

    def spin(self, seconds: float) -> None:
        """Serve callbacks for some time [s], then publish the running errors."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._tool.serve()
        for (name, quantity), publisher in self._publishers.items():
            value = self.shadows[name].errors[quantity].now
            if math.isfinite(value):
                message = self._float()
                message.data = value
                publisher.publish(message)
