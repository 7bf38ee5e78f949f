# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Drives in simulated time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
import signal
import subprocess
import sys
from typing import Any

from lg_husky_sim.ros.commands import ZEROS
from lg_husky_sim.testing.live import Probe, probed_domain
import pytest

COMMAND = '/husky_velocity_controller/cmd_vel'


@pytest.fixture
def probe() -> Iterator[Probe]:
    """Return a probe in a domain of the test's own: nobody else's clock is there."""
    with probed_domain() as one:
        yield one


def start_drive() -> subprocess.Popen[str]:
    """Start a drive that waits for /clock, in a process of its own."""
    return subprocess.Popen(
        [sys.executable, '-u', '-m', 'lg_husky_sim.cli.main', 'drive', 'circle', '--preset',
         'paper', '--namespace', '/', '--wait', '30', '--ros-args', '-p', 'use_sim_time:=true'],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def speeds(heard: Sequence[Any]) -> list[tuple[float, float]]:
    """Return forward speed and yaw rate of each command."""
    return [(message.linear.x, message.angular.z) for message in heard]


def test_simulated_time_paces_a_drive_and_is_waited_for(probe: Probe) -> None:
    """A drive that begins at time zero sends all at once what lies before the first /clock."""
    heard = probe.listen('geometry_msgs/msg/Twist', COMMAND)
    clock, kind = probe.talk('rosgraph_msgs/msg/Clock', '/clock')
    driver = start_drive()
    message = kind()

    def say(second: int, nanosecond: int = 0) -> None:
        message.clock.sec, message.clock.nanosec = second, nanosecond
        clock.publish(message)
        probe.spin(0.05)
    try:
        assert probe.until(lambda: clock.get_subscription_count() > 0, 30.0)
        for _ in range(100):
            say(50)
            if heard:
                break
        assert len(heard) == 1
        for _ in range(5):
            say(50)
        assert len(heard) == 1
        for tenth in range(1, 10):
            say(50, tenth * 10**8)
        assert len(heard) == pytest.approx(19, abs=1)
        driver.send_signal(signal.SIGINT)
        driver.communicate(timeout=10.0)
    finally:
        driver.kill()
        driver.wait()
    assert driver.returncode == 130
    assert probe.until(lambda: speeds(heard)[-ZEROS:] == [(0.0, 0.0)] * ZEROS)


def test_a_clock_that_is_set_back_ends_a_drive(probe: Probe) -> None:
    """It said nothing, and sent nothing until /clock had come that far again."""
    heard = probe.listen('geometry_msgs/msg/Twist', COMMAND)
    clock, kind = probe.talk('rosgraph_msgs/msg/Clock', '/clock')
    driver = start_drive()
    message = kind()
    message.clock.sec = 50

    def moved() -> bool:
        clock.publish(message)
        return bool(heard)
    try:
        assert probe.until(lambda: clock.get_subscription_count() > 0, 30.0)
        assert probe.until(moved, 30.0)
        message.clock.sec = 3
        clock.publish(message)
        _, said = driver.communicate(timeout=10.0)
    finally:
        driver.kill()
        driver.wait()
    assert driver.returncode == 1
    assert '/clock went back by 47.000 s' in said
    assert probe.until(lambda: speeds(heard)[-ZEROS:] == [(0.0, 0.0)] * ZEROS)
