# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The only part that speaks ROS: rclpy where it is installed, a subset of it over DDS else."""
