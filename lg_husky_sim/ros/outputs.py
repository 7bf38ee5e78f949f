# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The node's publishers: which there are, and when each speaks."""

from __future__ import annotations

from collections import deque
from typing import Any

from lg_husky_sim.ros import conversions
from lg_husky_sim.ros.api import message_type, Node
from lg_husky_sim.ros.engine import Reading
from lg_husky_sim.ros.settings import Settings

#: Samples kept for reliable readers; deep enough for a burst of late steps.
DEPTH = 10
CLOCK = 'rosgraph_msgs/msg/Clock'


class Outputs:
    """
    Publishes the readings of an engine.

    Parameters
    ----------
    node : Node
    settings : Settings

    """

    def __init__(self, node: Node, settings: Settings) -> None:
        """Make publishers and the messages that they send again and again."""
        self._node = node
        self._imu_late: deque[tuple[int, int, Reading]] = deque()
        self._wheels_late: deque[tuple[int, int, Reading]] = deque()
        self._said = -1
        self._tf: Any = None
        self._clock: Any = None
        self._clock_message: Any = message_type(CLOCK)() if settings.publish_clock else None
        self._battery: Any = None
        self._battery_every = max(1, round(settings.rate))
        publish = self._publisher
        self._odometry = publish('nav_msgs/msg/Odometry', settings.odometry_topic)
        self._truth = publish('nav_msgs/msg/Odometry', settings.ground_truth_topic)
        self._wheels = publish('sensor_msgs/msg/JointState', settings.joint_states_topic)
        self._imu = publish('sensor_msgs/msg/Imu', settings.imu_topic)
        if settings.publish_battery:
            self._battery = publish('sensor_msgs/msg/BatteryState', settings.battery_topic)
        if settings.publish_tf:
            self._tf = publish('tf2_msgs/msg/TFMessage', 'tf', 100)
        if settings.publish_clock:
            self._clock = publish(CLOCK, '/clock')
        self.configure(settings)

    def _publisher(self, kind: str, topic: str, depth: int = DEPTH) -> Any:
        message = message_type(kind)
        if message is None:
            self._node.get_logger().warning(
                f'{topic} is not published: message package {kind.split("/")[0]} is missing')
            return None
        return self._node.create_publisher(message, topic, depth)

    def configure(self, settings: Settings) -> None:
        """Take live settings: covariances may have changed."""
        self._settings = settings
        self._odometry_message = conversions.odometry_message(settings, truth=False)
        self._truth_message = conversions.odometry_message(settings, truth=True)
        self._wheels_message = conversions.joint_state_message(settings)
        self._imu_message = conversions.imu_message(settings)
        self._battery_message = conversions.battery_message(settings)
        self._tf_message = conversions.transform_message(
            settings.odom_frame, settings.base_frame) if self._tf else None
        self._imu_every = settings.every('imu_rate')
        self._wheels_every = settings.every('joint_states_rate')
        self._imu_delay = round(settings.imu_latency * settings.rate)
        self._wheels_delay = round(settings.encoder_latency * settings.rate)

    def clock(self, nanoseconds: int) -> None:
        """Publish /clock, if asked to."""
        if self._clock is not None and nanoseconds != self._said:
            self._said = nanoseconds
            conversions.set_stamp(self._clock_message.clock, nanoseconds)
            self._clock.publish(self._clock_message)

    def remind(self) -> None:
        """Say the time on /clock once more, for who has joined since."""
        if self._clock is not None and self._said >= 0:
            self._clock.publish(self._clock_message)

    def publish(self, reading: Reading, nanoseconds: int) -> None:
        """
        Publish what is due after a step, all with one stamp.

        Parameters
        ----------
        reading : Reading
            Of the step.
        nanoseconds : int
            Stamp of the step.

        """
        step = reading.step
        self.clock(nanoseconds)
        conversions.fill_odometry(
            self._odometry_message, nanoseconds, reading.wheel_pose, reading.wheel_twist)
        self._odometry.publish(self._odometry_message)
        conversions.fill_odometry(self._truth_message, nanoseconds, reading.pose, reading.twist)
        self._truth.publish(self._truth_message)
        if step % self._wheels_every == 0:
            self._wheels_late.append((step + self._wheels_delay, nanoseconds, reading))
        while self._wheels_late and self._wheels_late[0][0] <= step:
            _, stamp, late = self._wheels_late.popleft()
            conversions.fill_joint_state(self._wheels_message, stamp, late)
            self._wheels.publish(self._wheels_message)
        if step % self._imu_every == 0:
            self._imu_late.append((step + self._imu_delay, nanoseconds, reading))
        while self._imu_late and self._imu_late[0][0] <= step:
            _, stamp, late = self._imu_late.popleft()
            conversions.fill_imu(self._imu_message, stamp, late)
            self._imu.publish(self._imu_message)
        if self._tf is not None:
            pose = reading.pose if self._settings.tf_source == 'ground_truth' else (
                reading.wheel_pose)
            conversions.fill_transform(self._tf_message, nanoseconds, pose)
            self._tf.publish(self._tf_message)
        if self._battery is not None and step % self._battery_every == 0:
            conversions.fill_battery(self._battery_message, nanoseconds, reading)
            self._battery.publish(self._battery_message)

    def forget(self) -> None:
        """Drop what is held back by a latency, after a reset."""
        self._imu_late.clear()
        self._wheels_late.clear()
