# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Private domains and live nodes for the contract tests; both backends."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path

from lg_husky_sim import Husky
from lg_husky_sim.ros.engine import Engine
from lg_husky_sim.ros.settings import make_settings
import pytest

if find_spec('rclpy') is None and (
        find_spec('cyclonedds') is None or find_spec('rosbags') is None):
    collect_ignore_glob = ['test_contract*', 'test_conversions*', 'embedded/*', 'test_demo*',
                           'test_golden*', 'test_live*', 'test_occupancy*', 'stacks/*']
elif find_spec('rclpy') is not None:
    # Not skipped inside the files: ROS' launch_testing imports them by itself and would end the
    # collection of the whole folder there.
    collect_ignore_glob = ['embedded/*'] + (
        [] if find_spec('rosbags') else ['test_contract_demo*', 'test_demo*'])

if find_spec('rclpy') is not None or find_spec('cyclonedds') is not None:
    from lg_husky_sim.testing.live import LiveHusky, Probe, probed_domain


@pytest.fixture(scope='session', autouse=True)
def machine_code() -> None:
    """Compile once: 40 s of processor, which each node would need by itself, all at a time."""
    Engine(make_settings()).step()


@pytest.fixture(scope='module')
def probe() -> Iterator[Probe]:
    """Return a probe in a domain of this module's own."""
    with probed_domain() as one:
        yield one


@pytest.fixture
def start(probe: Probe) -> Iterator[Callable[..., LiveHusky]]:
    """Return a maker of live nodes that end with the test."""
    made: list[LiveHusky] = []

    def make(arguments: tuple[str, ...] = (), environment: dict[str, str] | None = None,
             **parameters: object) -> LiveHusky:
        made.append(LiveHusky(probe, parameters, arguments, environment))
        return made[-1]

    yield make
    for one in made:
        one.node.stop()


@pytest.fixture
def real_husky(tmp_path: Path) -> Path:
    """Write a model with what a real one has: dead time, slew limit, dry scrub, smaller wheels."""
    robot = Husky().replacing(wheel_radius=0.158)
    robot = robot.with_effect('command_latency', latency=0.1)
    robot = robot.with_effect('command_slew', shape='both', slew_forward=1.0, slew_yaw=1.0)
    robot = robot.with_effect('yaw_scrub_coulomb', yaw_coulomb_moment=8.0)
    path = tmp_path / 'real_husky.yaml'
    robot.save(str(path))
    return path
