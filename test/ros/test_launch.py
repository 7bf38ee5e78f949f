# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
What sim.launch.py would start, and what it refuses before anything runs.

The parts of launch that it uses are stood in for, so that this is tested without ROS;
test/ros/stacks runs the file itself.
"""

from __future__ import annotations

from collections.abc import Callable
import importlib.util
from pathlib import Path
import sys
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
#: What would be started: each node with what it is given.
Started = list[dict[str, Any]]
Starter = Callable[..., Started]


class PackageNotFoundError(KeyError):
    """As ament_index_python raises it."""


def standing_in(installed: set[str], words: dict[str, str], started: Started
                ) -> dict[str, ModuleType]:
    """Return stand-ins of the modules that the launch file imports."""
    def share(package: str) -> str:
        if package not in installed | {'lg_husky_sim'}:
            raise PackageNotFoundError(package)
        return str(ROOT)

    def node(**given: Any) -> SimpleNamespace:
        started.append(given)
        return SimpleNamespace(**given)

    class LaunchConfiguration:
        def __init__(self, name: str) -> None:
            self._name = name

        def perform(self, context: object) -> str:
            return words[self._name]

    parts: dict[str, dict[str, Any]] = {
        'ament_index_python': {},
        'ament_index_python.packages': {
            'get_package_share_directory': share, 'PackageNotFoundError': PackageNotFoundError},
        'launch': {'LaunchContext': object, 'LaunchDescription': list},
        'launch.actions': {
            'DeclareLaunchArgument': lambda name, **given: (name, given['default_value']),
            'LogInfo': lambda msg: started.append({'said': msg}),
            'OpaqueFunction': lambda function: function},
        'launch.substitutions': {'LaunchConfiguration': LaunchConfiguration},
        'launch_ros': {},
        'launch_ros.actions': {'Node': node}}
    made = {}
    for name, values in parts.items():
        made[name] = ModuleType(name)
        vars(made[name]).update(values)
    return made


@pytest.fixture
def starting(monkeypatch: pytest.MonkeyPatch) -> Starter:
    """Return a function that says what would be started with some packages and arguments."""
    def start(installed: set[str], **arguments: str) -> Started:
        started: Started = []
        words: dict[str, str] = {}
        for name, module in standing_in(installed, words, started).items():
            monkeypatch.setitem(sys.modules, name, module)
        spec = importlib.util.spec_from_file_location('sim_launch', ROOT / 'launch/sim.launch.py')
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        *declared, run = module.generate_launch_description()
        words.update(dict(declared) | arguments)
        assert set(words) == {name for name, _ in declared}
        run(None)
        return started
    return start


@pytest.mark.parametrize(('arguments', 'message'), [
    ({'rviz': 'true'}, r'^rviz:=true needs the package rviz2: sudo apt install ros-jazzy-rviz2$'),
    ({'state_publisher': 'true'}, '^state_publisher:=true needs the package robot_state_publisher'
     ': sudo apt install ros-jazzy-robot-state-publisher$'),
    ({'rviz': 'yes'}, '^rviz:=yes is not allowed: true, false$'),
    ({'parameters': 'no/file.yaml'}, '^parameters:=no/file.yaml: no such file$'),
])
def test_what_cannot_run_is_refused_before_anything_runs(
        starting: Starter, arguments: dict[str, str], message: str) -> None:
    """Row 56: launch leaves running what it has started when the next program is not there."""
    with pytest.raises(RuntimeError, match=message):
        starting(set(), **arguments)


def test_without_a_state_publisher_the_robot_runs(starting: Starter) -> None:
    """Row 56: the arguments' defaults need nothing but this package."""
    node, said = starting(set())
    assert (node['package'], node['executable']) == ('lg_husky_sim', 'sim_node')
    assert said == {'said': 'robot_state_publisher is not installed: no wheels on tf'}


def test_each_robot_has_transforms_of_its_own(starting: Starter) -> None:
    """Row 55: two launches published one odom to base_link on one /tf."""
    sim, publisher, rviz = starting({'robot_state_publisher', 'rviz2'}, namespace='a200',
                                    preset='clearpath_jazzy', rviz='true', use_sim_time='true')
    assert [one['package'] for one in (sim, publisher, rviz)] == [
        'lg_husky_sim', 'robot_state_publisher', 'rviz2']
    own = {('/tf', 'tf'), ('/tf_static', 'tf_static')}
    for one in (sim, publisher, rviz):
        assert one['namespace'] == 'a200'
        assert one['parameters'][0]['use_sim_time'] is True
    # Names of the node's own topics are relative as they are.
    assert 'remappings' not in sim
    assert set(publisher['remappings']) == own | {('joint_states', 'platform/joint_states')}
    assert set(rviz['remappings']) == own
    assert 'front_left_wheel_joint"' in publisher['parameters'][0]['robot_description']
