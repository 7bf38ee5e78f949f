# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""teleop_twist_keyboard, unmodified, with keys typed at a terminal."""

from __future__ import annotations

from collections.abc import Callable
import os
from pathlib import Path
from typing import Any

from lg_husky_sim.testing.live import LiveHusky, Probe
import pytest

pty = pytest.importorskip('pty')

#: What the keys ask for at first: m/s and rad/s, as the program says itself.
SPEED, TURN = 0.5, 1.0
#: How near to it the odometry is to come [m/s, rad/s], and the longest wait for that [s]. The
#: model of a Husky answers with 1.4 % more speed and 1.8 % less yaw rate.
NEAR, PATIENCE = 0.03, 20.0


@pytest.mark.realtime
def test_keys_drive_the_robot_and_a_key_let_go_stops_it(
        probe: Probe, start: Callable[..., LiveHusky], run: Callable[..., Any],
        program: Callable[[str, str], Path]) -> None:
    """Ahead, back, left, faster, stop; and the end by Ctrl-C, which stops the robot as well."""
    keyboard = program('teleop_twist_keyboard', 'teleop_twist_keyboard')
    odometry = probe.listen('nav_msgs/msg/Odometry', '/husky_velocity_controller/odom', 200)
    commands = probe.listen('geometry_msgs/msg/Twist', '/husky_velocity_controller/cmd_vel')
    odometry.clear()
    start(preset='husky_ros1').ready(odometry)
    terminal, line = pty.openpty()
    try:
        process = run(keyboard, '--ros-args', '-r', 'cmd_vel:=husky_velocity_controller/cmd_vel',
                      stdin=line)

        def reached(speed: float, yaw: float, key: bytes = b'') -> bool:
            """Hold a key, or none, until the odometry shows these velocities."""
            def there() -> bool:
                if key:
                    os.write(terminal, key)
                probe.spin(0.04)
                twist = odometry[-1].twist.twist
                return bool(abs(twist.linear.x - speed) < NEAR
                            and abs(twist.angular.z - yaw) < NEAR)
            return probe.until(there, PATIENCE)

        # Until it is ready, it is only a terminal.
        def heard() -> bool:
            os.write(terminal, b'k')
            probe.spin(0.1)
            return bool(commands)
        assert probe.until(heard, 20.0)
        assert reached(SPEED, 0.0, b'i')
        assert reached(-SPEED, 0.0, b',')
        assert reached(0.0, TURN, b'j')
        os.write(terminal, b'ww')
        assert reached(1.21 * SPEED, 0.0, b'i')
        # The key is let go, and nothing more is sent: the command's timeout stops the robot.
        assert reached(0.0, 0.0)
        assert commands[-1].linear.x == pytest.approx(1.21 * SPEED)
        assert reached(1.21 * SPEED, 0.0, b'i')
        os.write(terminal, b'\x03')
        assert probe.until(lambda: process.poll() is not None, PATIENCE)
        assert probe.until(lambda: (commands[-1].linear.x, commands[-1].angular.z) == (0.0, 0.0))
        assert reached(0.0, 0.0)
    finally:
        os.close(terminal)
        os.close(line)
