# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
A small part of rclpy over the ``cyclonedds`` wheel, for machines without ROS 2.

Names and call signatures are those of rclpy, so that a node written against them runs on either.
There are no executors but one spin loop, no actions, no lifecycle, no service clients, no
security; ``docs/ros.md`` lists what is claimed and what is not.
"""
