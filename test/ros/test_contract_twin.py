# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What the live twin takes from a robot, and what it says of one that is silent."""

from __future__ import annotations

import math
from typing import Any
from unittest.mock import Mock

from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.ros.settings import make_settings
from lg_husky_sim.ros.tool import Orderly, Tool
from lg_husky_sim.ros.twin import SILENCE, Twin
from lg_husky_sim.signals import BodyTwist, Pose
from lg_husky_sim.testing.live import Probe
import pytest


def test_a_silent_robot_has_no_error(probe: Probe) -> None:
    """The twin of a node that was killed went on with the last errors, as if all were well."""
    settings = make_settings(imu_topic='/silent/imu')
    imu, message = probe.talk('sensor_msgs/msg/Imu', '/silent/imu')
    errors = probe.listen('std_msgs/msg/Float64', '/twin/plain/yaw_rate_error')
    tool = Tool('lg_husky_twin', Orderly())
    try:
        plant = compile_model(Structure()).at(load_model().parameters)
        twin = Twin(tool, {'plain': plant}, settings, lambda names, rates: (0.0, 0.0))
        twin.shadows['plain'].errors['yaw_rate'].add(0.0, 0.5)
        assert math.isnan(twin.silence)
        assert probe.until(lambda: imu.get_subscription_count() > 0)
        one = message()
        one.header.stamp.sec = 5

        def told() -> bool:
            imu.publish(one)
            twin.spin(0.05)
            return bool(errors) and twin.silence < SILENCE
        assert probe.until(told)
        twin.spin(1.5 * SILENCE)
        probe.spin(0.2)
        errors.clear()
        twin.spin(0.1)
        probe.spin(0.3)
        assert errors == []
        assert twin.silence > SILENCE
    finally:
        tool.close()


def test_models_get_what_the_robot_says_at_the_time_of_its_stamps(probe: Probe) -> None:
    """Row 33: pose and wheel angles were not taken, and moments were those of the arrival."""
    settings = make_settings()
    talkers = {kind.rpartition('/')[2]: probe.talk(kind, topic) for kind, topic in (
        ('nav_msgs/msg/Odometry', settings.odometry_topic),
        ('sensor_msgs/msg/JointState', settings.joint_states_topic),
        ('sensor_msgs/msg/Imu', settings.imu_topic),
        ('geometry_msgs/msg/Twist', settings.command_topic))}
    plant = compile_model(Structure()).at(load_model().parameters)
    tool = Tool('lg_husky_twin', Orderly())

    def said(kind: str, second: int = 0) -> Any:
        message = talkers[kind][1]()
        if second:
            message.header.stamp.sec = second
        return message

    def told(kind: str, message: Any, calls: Mock) -> None:
        calls.reset_mock()
        talkers[kind][0].publish(message)

        def arrived() -> bool:
            twin.spin(0.02)
            return calls.called
        assert probe.until(arrived), kind

    try:
        twin = Twin(tool, {'plain': plant}, settings, lambda names, values: (
            values[0], values[1]) if len(values) else (math.nan, math.nan))
        shadow = Mock(readings={}, errors=twin.shadows['plain'].errors)
        twin.shadows['plain'] = shadow
        assert probe.until(lambda: all(
            talker.get_subscription_count() for talker, _ in talkers.values()))
        odometry = said('Odometry', 999)
        odometry.pose.pose.position.x, odometry.pose.pose.position.y = 1.0, -2.0
        told('Odometry', odometry, shadow.place)
        shadow.place.assert_called_once_with(Pose(1.0, -2.0, 0.0), correct=False)
        joints = said('JointState', 1000)
        joints.name, joints.velocity, joints.position = ['l', 'r'], [3.0, 4.0], [20.0, 5.0]
        told('JointState', joints, shadow.wheels)
        shadow.wheels.assert_called_once_with(
            pytest.approx(1000.0), 3.0, 4.0, (20.0, 5.0))
        imu = said('Imu', 1001)
        imu.angular_velocity.z = 0.25
        told('Imu', imu, shadow.gyro)
        shadow.gyro.assert_called_once_with(pytest.approx(1001.0), 0.25)
        # What has no stamp is placed among what has one; a robot that stands has no time to pass.
        command = said('Twist')
        command.linear.x, command.angular.z = 0.5, -0.1
        told('Twist', command, shadow.command)
        (moment, twist), _ = shadow.command.call_args
        assert moment == pytest.approx(1001.0, abs=1.1)
        assert twist == BodyTwist(0.5, -0.1)
        shadow.restart.assert_not_called()
        # A simulation that begins anew.
        told('JointState', said('JointState', 5), shadow.restart)
    finally:
        tool.close()
