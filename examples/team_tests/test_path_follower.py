# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a robot team would test: "my controller drives the circle within 5 cm".

    pytest examples/team_tests

The first tests need no ROS and no time; the last one starts a real node in a private domain.
"""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import Any

from lg_husky_sim.signals import Pose
from lg_husky_sim.testing.lockstep import LockStepHusky
import numpy as np
from path_follower import CircleFollower
import pytest

FOLLOWER = CircleFollower(x=0.0, y=2.0, radius=2.0, speed=0.5)
TURN = 2.0 * math.pi * 2.0 / 0.5  # seconds for a full circle


def test_the_circle_is_driven_within_five_centimetres(
        husky: Callable[..., LockStepHusky]) -> None:
    """With a perfect position, after the start, the robot stays within 5 cm of the circle."""
    robot = husky(preset='husky_ros1')
    drive = robot.drive(lambda now: FOLLOWER.command(now.pose), 2.0 * TURN)
    settled = drive.times > 3.0
    error = np.hypot(drive.column('x'), drive.column('y') - 2.0) - 2.0
    assert np.max(np.abs(error[settled])) < 0.05


def test_wheel_odometry_alone_drifts_away(husky: Callable[..., LockStepHusky]) -> None:
    """With the wheels' odometry the controller is content and the robot is elsewhere: slip."""
    robot = husky(preset='husky_ros1')
    drive = robot.drive(lambda now: FOLLOWER.command(now.wheel_pose), 4.0 * TURN)
    believed = np.hypot(drive.column('wheel_x'), drive.column('wheel_y') - 2.0) - 2.0
    true = np.hypot(drive.column('x'), drive.column('y') - 2.0) - 2.0
    settled = drive.times > 3.0
    assert np.max(np.abs(believed[settled])) < 0.05
    assert np.max(np.abs(true[settled])) > 0.1


@pytest.mark.parametrize('yaw_noise', [0.0, 0.05])
def test_noise_does_not_throw_it_off(husky: Callable[..., LockStepHusky], yaw_noise: float
                                     ) -> None:
    """The same drive with a noisy IMU, seeded: the same result every time."""
    def drive() -> list[float]:
        robot = husky(preset='husky_ros1', sensor_noise=True, seed=4,
                      orientation_stddev=max(yaw_noise, 1e-6))

        def by_imu(now: Any) -> Any:
            return FOLLOWER.command(Pose(now.pose.x, now.pose.y, now.measured.heading))
        return robot.drive(by_imu, TURN).values[-1].tolist()
    assert drive() == drive()
    assert abs(math.hypot(drive()[0], drive()[1] - 2.0) - 2.0) < 0.05


def test_the_real_node_obeys_over_ros(live_husky: Callable[..., Any]) -> None:
    """A live node, over real topics: half a metre of straight driving."""
    robot = live_husky(preset='husky_ros1')
    truth = robot.probe.listen('nav_msgs/msg/Odometry', '/ground_truth')
    publisher, twist = robot.probe.talk(
        'geometry_msgs/msg/Twist', '/husky_velocity_controller/cmd_vel')
    robot.ready(truth)
    message = twist()
    message.linear.x = 0.5

    def arrived() -> bool:
        publisher.publish(message)
        return bool(truth[-1].pose.pose.position.x > 0.5)

    assert robot.probe.until(arrived, 20.0)
    assert abs(truth[-1].pose.pose.position.y) < 1e-6
