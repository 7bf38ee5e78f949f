# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""twist_mux, unmodified, between two sources of commands and the node."""

from __future__ import annotations

from collections.abc import Callable
import math
from pathlib import Path
from typing import Any

from lg_husky_sim.testing.live import LiveHusky, Probe
import pytest

CONFIG = """\
twist_mux:
  ros__parameters:
    topics:
      navigation: {topic: nav_vel, timeout: 0.5, priority: 10}
      joystick: {topic: joy_vel, timeout: 0.5, priority: 100}
    locks:
      stop: {topic: stop, timeout: 0.0, priority: 255}
"""
#: Speeds that the two sources ask for [m/s], and how near to them the robot is to come.
NAVIGATION, JOYSTICK, NEAR = 0.3, -0.2, 0.02
#: Longest wait for a speed [s].
PATIENCE = 20.0


def seconds(stamp: Any) -> float:
    """Return a stamp in seconds."""
    return float(stamp.sec + 1e-9 * stamp.nanosec)


@pytest.mark.realtime
def test_the_robot_follows_whom_the_multiplexer_lets_through(
        probe: Probe, start: Callable[..., LiveHusky], run: Callable[..., Any],
        program: Callable[[str, str], Path], tmp_path: Path) -> None:
    """The joystick goes before navigation while it speaks; a lock stops both, and the robot."""
    mux = program('twist_mux', 'twist_mux')
    (tmp_path / 'mux.yaml').write_text(CONFIG, encoding='utf-8')
    truth = probe.listen('nav_msgs/msg/Odometry', '/ground_truth', 200)
    truth.clear()
    sources = {topic: probe.talk('geometry_msgs/msg/Twist', topic)
               for topic in ('/nav_vel', '/joy_vel')}
    lock, boolean = probe.talk('std_msgs/msg/Bool', '/stop')
    run(mux, '--ros-args', '--params-file', tmp_path / 'mux.yaml', '-r',
        'cmd_vel_out:=husky_velocity_controller/cmd_vel')
    start(preset='husky_ros1').ready(truth)
    assert probe.until(lambda: lock.get_subscription_count() and all(
        mouth.get_subscription_count() for mouth, _ in sources.values()))

    def reached(speed: float, **speeds: float) -> bool:
        """Let sources speak at 20 Hz until the robot has a speed and keeps it for a second."""
        since = math.inf

        def kept() -> bool:
            nonlocal since
            for name, value in speeds.items():
                mouth, kind = sources[f'/{name}']
                message = kind()
                message.linear.x = value
                mouth.publish(message)
            probe.spin(0.05)
            if abs(truth[-1].twist.twist.linear.x - speed) > NEAR:
                since = math.inf
            since = min(since, seconds(truth[-1].header.stamp))
            return seconds(truth[-1].header.stamp) - since > 1.0
        return probe.until(kept, PATIENCE)

    assert reached(NAVIGATION, nav_vel=NAVIGATION)
    both = {'nav_vel': NAVIGATION, 'joy_vel': JOYSTICK}
    assert reached(JOYSTICK, **both)
    # Half a second after the last word of the joystick.
    assert reached(NAVIGATION, nav_vel=NAVIGATION)
    lock.publish(boolean(data=True))
    assert reached(0.0, **both)
    lock.publish(boolean(data=False))
    assert reached(JOYSTICK, **both)
