# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The smallest node that publishes what sim_node publishes, with constants; to compare with."""

from __future__ import annotations

import sys
from typing import Any

from lg_husky_sim.ros import api
from lg_husky_sim.ros.conversions import (
    battery_message,
    imu_message,
    joint_state_message,
    odometry_message,
    set_stamp,
    transform_message,
)
from lg_husky_sim.ros.settings import make_settings


def main() -> None:
    """Publish constants at the rate given; the command's speed goes into the effort."""
    rate = float(sys.argv[1])
    settings = make_settings()
    api.init(args=[])
    node = api.Node('sim_node')
    odometry, truth = (odometry_message(settings, truth=flag) for flag in (False, True))
    joints = joint_state_message(settings)
    joints.position = joints.velocity = joints.effort = [0.0] * 4
    imu, battery = imu_message(settings), battery_message(settings)
    tf = transform_message(settings.odom_frame, settings.base_frame)
    stamps = [m.header.stamp for m in (odometry, truth, joints, imu, battery)]
    stamps.append(tf.transforms[0].header.stamp)
    rows: list[tuple[Any, Any]] = [
        (node.create_publisher(type(message), topic, 10), message) for message, topic in (
            (odometry, settings.odometry_topic), (truth, settings.ground_truth_topic),
            (joints, settings.joint_states_topic), (imu, settings.imu_topic), (tf, '/tf'))]
    slow = node.create_publisher(type(battery), settings.battery_topic, 10)
    count = 0

    def tick() -> None:
        nonlocal count
        now = node.get_clock().now().nanoseconds
        for stamp in stamps:
            set_stamp(stamp, now)
        for publisher, message in rows:
            publisher.publish(message)
        if count % round(rate) == 0:
            slow.publish(battery)
        count += 1

    def on_twist(msg: Any) -> None:
        joints.effort = [msg.linear.x] * 4

    node.create_subscription(
        api.message_type('geometry_msgs/msg/Twist'), settings.command_topic, on_twist, 10)
    node.create_timer(1.0 / rate, tick)
    try:
        api.spin(node)
    except (KeyboardInterrupt, api.ExternalShutdownException):
        node.destroy_node()
    finally:
        api.try_shutdown()


if __name__ == '__main__':
    main()
