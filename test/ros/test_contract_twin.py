# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What the live twin says of a robot that is silent."""

from __future__ import annotations

import math

from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.ros.settings import make_settings
from lg_husky_sim.ros.tool import Orderly, Tool
from lg_husky_sim.ros.twin import SILENCE, Twin
from lg_husky_sim.testing.live import Probe


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
