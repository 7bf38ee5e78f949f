# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Models that run beside a live robot, and how far each of them is off."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import math
import time
from typing import Any

from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.ros import api
from lg_husky_sim.ros.conversions import pose_from_msg, stamp_nanoseconds, twist_from_msg
from lg_husky_sim.ros.settings import Settings
from lg_husky_sim.ros.shadow import QUANTITIES, RunningError, Shadow, SILENCE
from lg_husky_sim.ros.stamp_clock import StampClock
from lg_husky_sim.ros.tool import Elapsed, Tool
from lg_husky_sim.signals import BodyTwist

NAME = 'lg_husky_twin'
__all__ = ['NAME', 'QUANTITIES', 'SILENCE', 'RunningError', 'Shadow', 'Sides', 'Twin']

#: Finds the wheels of both sides in a joint state: names and values to left and right.
Sides = Callable[[Sequence[str], Sequence[float]], tuple[float, float]]
#: A command's own stamp that is further off than this belongs to another clock [s].
_FOREIGN = 0.5


class Twin:
    """
    A node that runs models beside a robot and publishes how far they are off.

    Time is that of the robot's stamps, so that simulated time, its speed and its pauses are
    followed; what has no stamp is placed among what has one.

    Each model's running error is a ``std_msgs/Float64`` on ``twin/<model>/<quantity>_error``;
    what was measured, and what each model reads at the same stamp, are
    ``geometry_msgs/Vector3Stamped`` on ``twin/measured`` and ``twin/<model>/reading``:
    x left and y right wheel rate [rad/s], z yaw rate [rad/s].

    Parameters
    ----------
    tool : Tool
    plants : mapping of str to Plant
        By the name under which their errors are published.
    settings : Settings
        Topics and types.
    sides : callable
        See :data:`Sides`.
    pose_topic : str, optional
        Odometry that tells where the robot really is (filtered, or ground truth): the models are
        kept there. Without it they begin at the pose of the wheel odometry and go by themselves.

    """

    def __init__(self, tool: Tool, plants: Mapping[str, Plant], settings: Settings, sides: Sides,
                 pose_topic: str | None = None) -> None:
        """Subscribe to the robot."""
        self._tool = tool
        self.node = tool.node
        self._sides = sides
        self._stamped = settings.command_type == 'TwistStamped'
        self._clock = StampClock()
        self._true_pose = pose_topic is not None
        self._posed = False
        self._first = math.nan
        self._arrived = math.nan
        self._measured: dict[str, tuple[float, ...]] = {}
        self.shadows = {name: Shadow(plant, settings)
                        for name, plant in plants.items()}
        quality = api.QoSProfile(depth=100, reliability=api.ReliabilityPolicy.BEST_EFFORT)
        for kind, topic, callback in (
                (f'geometry_msgs/msg/{settings.command_type}', settings.command_topic,
                 self._on_command),
                ('nav_msgs/msg/Odometry', pose_topic or settings.odometry_topic, self._on_pose),
                ('sensor_msgs/msg/JointState', settings.joint_states_topic, self._on_joints),
                ('sensor_msgs/msg/Imu', settings.imu_topic, self._on_imu)):
            self.node.create_subscription(api.message_type(kind), topic, callback, quality)
        self._float: Any = api.message_type('std_msgs/msg/Float64')
        self._vector: Any = api.message_type('geometry_msgs/msg/Vector3Stamped')
        self._publishers = {
            (name, quantity): self.node.create_publisher(
                self._float, f'twin/{name}/{quantity}_error', 10)
            for name in self.shadows for quantity in QUANTITIES}
        self._readings = {
            name: self.node.create_publisher(self._vector, topic, 10) for name, topic in (
                ('', 'twin/measured'), *((name, f'twin/{name}/reading') for name in self.shadows))}

    def _stamp(self, header: Any) -> float:
        # The robot's time [s] of a message; that of its arrival where it has no stamp.
        self._arrived = arrival = time.monotonic()
        stamp = stamp_nanoseconds(header.stamp) * 1e-9
        if stamp == 0.0 and not self._clock.now(arrival) >= 0.0:
            stamp = arrival
        if not self._clock.observe(arrival, stamp):
            self._posed = False
            for shadow in self.shadows.values():
                shadow.restart()
        return stamp

    def _on_command(self, message: Any) -> None:
        command = twist_from_msg(message.twist if self._stamped else message)
        moment = self._clock.now(time.monotonic())
        if not (math.isfinite(command.forward) and math.isfinite(command.yaw)
                and math.isfinite(moment)):
            return
        if self._stamped:
            stamp = stamp_nanoseconds(message.header.stamp) * 1e-9
            moment = stamp if abs(stamp - moment) < _FOREIGN else moment
        for shadow in self.shadows.values():
            shadow.command(moment, BodyTwist(command.forward, command.yaw))

    def _on_pose(self, message: Any) -> None:
        pose = pose_from_msg(message.pose.pose)
        if all(map(math.isfinite, (pose.x, pose.y, pose.heading))):
            self._posed = True
            for shadow in self.shadows.values():
                shadow.place(pose, correct=self._true_pose)

    def _on_joints(self, message: Any) -> None:
        moment, names = self._stamp(message.header), list(message.name)
        left, right = self._sides(names, list(message.velocity))
        if not (math.isfinite(left) and math.isfinite(right)):
            return
        if not self._posed:
            # A slope needs the heading; but not every robot says it.
            self._first = moment if math.isnan(self._first) else self._first
            if 0.0 <= moment - self._first < SILENCE:
                return
        angles = self._sides(names, list(message.position))
        self._measured['wheel_rate'] = (left, right)
        for shadow in self.shadows.values():
            shadow.wheels(moment, left, right, angles)
        self._show(message.header.stamp)

    def _show(self, stamp: Any) -> None:
        # What was measured and what each model reads, at one stamp, for plots.
        for name, publisher in self._readings.items():
            values = self.shadows[name].readings if name else self._measured
            if len(values) == len(QUANTITIES):
                message = self._vector()
                message.header.stamp = stamp
                message.vector.x, message.vector.y = values['wheel_rate']
                (message.vector.z,) = values['yaw_rate']
                publisher.publish(message)

    def _on_imu(self, message: Any) -> None:
        moment, rate = self._stamp(message.header), float(message.angular_velocity.z)
        if math.isfinite(rate):
            self._measured['yaw_rate'] = (rate,)
            for shadow in self.shadows.values():
                shadow.gyro(moment, rate)

    @property
    def silence(self) -> float:
        """Time since the robot's last joint states or IMU [s]; NaN before the first."""
        return time.monotonic() - self._arrived

    def spin(self, seconds: float) -> None:
        """
        Serve callbacks for some time [s], then publish the running errors if there are new.

        With ``use_sim_time`` it is that of /clock, unless the robot is silent for as long: a
        robot that was killed may have been the one that published it.
        """
        passed, begun, quiet = Elapsed(self._tool.now), time.monotonic(), max(SILENCE, seconds)
        while passed() < seconds:
            self._tool.serve()
            if self._tool.simulated and time.monotonic() - begun > quiet and not (
                    self.silence < quiet):
                break
        if self.silence > quiet:
            return
        for (name, quantity), publisher in self._publishers.items():
            value = self.shadows[name].errors[quantity].now
            if math.isfinite(value):
                message = self._float()
                message.data = value
                publisher.publish(message)

    def run(self, seconds: float | None, every: float, show: Callable[[float, bool], object]
            ) -> None:
        """
        Go on until the time is over.

        Parameters
        ----------
        seconds : float, optional
            How long [s], by the ROS clock; until the tool is asked to end if not given.
        every : float
            Time between two publications [s], likewise.
        show : callable
            Is told at each of them how long it has run [s], and whether the robot is silent.

        Raises
        ------
        Ended
            If the tool was asked to end.

        """
        passed = Elapsed(self._tool.now)
        while seconds is None or passed() < seconds:
            self.spin(every if seconds is None else min(every, seconds - passed()))
            show(passed(), self.silence > max(SILENCE, every))
