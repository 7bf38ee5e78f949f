# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""How live tools look for the robot that they serve."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
import time

from lg_husky_sim.errors import CommandError, SettingsError
from lg_husky_sim.manoeuvres import Manoeuvre, Step
from lg_husky_sim.ros import api, commands
from lg_husky_sim.ros.driver import drive
from lg_husky_sim.ros.graph import Endpoint, find_robots, Robot, the_one
from lg_husky_sim.ros.recorder import NAME, record
from lg_husky_sim.ros.settings import make_settings
from lg_husky_sim.ros.tool import choose, Orderly, Tool
from lg_husky_sim.testing.live import Probe
import pytest

TOPICS = {
    '/a200_0000/platform/cmd_vel': ['geometry_msgs/msg/TwistStamped'],
    '/a200_0000/platform/odom': ['nav_msgs/msg/Odometry'],
    '/a200_0000/sensors/imu_0/data': ['sensor_msgs/msg/Imu'],
    '/turtle/joint_states': ['sensor_msgs/msg/JointState'],
    '/turtle/imu/data': ['sensor_msgs/msg/Imu'],
    '/odd/platform/cmd_vel': ['geometry_msgs/msg/Twist'],
}


def test_huskies_are_found_by_names_and_types_together() -> None:
    """Row 17: another robot, or another type of the same name, is no Husky."""
    robot = the_one(find_robots(TOPICS))
    assert robot is not None
    assert robot.words() == '--preset clearpath_jazzy --namespace /a200_0000'
    assert find_robots(TOPICS, preset='paper') == ()
    assert find_robots(TOPICS, namespace='a200_0000') == (robot,)
    assert the_one(find_robots({})) is None
    fleet = {f'/{name}/platform/odom': ['nav_msgs/msg/Odometry'] for name in 'cab'}
    assert [one.namespace for one in find_robots(fleet)] == ['/a', '/b', '/c']
    both = TOPICS | {f'/{make_settings(preset="husky_ros1").odometry_topic}': [
        'nav_msgs/msg/Odometry'], '/imu/data': ['sensor_msgs/msg/Imu']}
    with pytest.raises(SettingsError, match='2 Huskies are in the graph, choose one: --preset '
                       'husky_ros1; --preset clearpath_jazzy --namespace /a200_0000'):
        the_one(find_robots(both))


def test_a_robot_is_found_by_topics_that_are_named() -> None:
    topics = {'/scout/drive/command': ['geometry_msgs/msg/TwistStamped'],
              '/scout/wheel_odom': ['nav_msgs/msg/Odometry'],
              '/scout/imu/raw': ['sensor_msgs/msg/Imu']}
    named = {'odometry_topic': 'wheel_odom', 'imu_topic': 'imu/raw',
             'command_topic': 'drive/command', 'command_type': 'TwistStamped'}
    assert find_robots(topics) == ()
    robot = the_one(find_robots(topics, named=named))
    assert robot == Robot('/scout', 'paper', 3)
    assert find_robots(topics, namespace='scout', named=named) == (robot,)
    absolute = {'odometry_topic': '/scout/wheel_odom'}
    for place in (None, '/scout'):
        found, = find_robots(topics, namespace=place, named=absolute)
        assert found.namespace == (place or '/')


def test_the_names_of_ros_arguments_are_looked_for(
        probe: Probe, monkeypatch: pytest.MonkeyPatch) -> None:
    words = ['-p', 'odometry_topic:=wheel_odom', '-p', 'rate:=20.0', '-p', 'imu_topic:=imu/raw']
    asked = []

    def find(topics: object, *, named: Mapping[str, object], **only: object) -> tuple[Robot, ...]:
        asked.append(named)
        return ()
    monkeypatch.setattr('lg_husky_sim.ros.tool.find_robots', find)
    with Orderly() as orderly, pytest.raises(CommandError, match=(
            r'^no robot with odometry_topic wheel_odom, imu_topic imu/raw is below /scout in the '
            'graph')):
        choose(orderly, words, namespace='/scout', wait=0.1)
    assert asked[0] == {'odometry_topic': 'wheel_odom', 'imu_topic': 'imu/raw'}


@pytest.mark.parametrize('preset', [None, 'clearpath_jazzy'])
def test_a_second_robot_that_is_told_of_later_is_waited_for(
        probe: Probe, monkeypatch: pytest.MonkeyPatch, preset: str | None) -> None:
    """Fast DDS told of one of three robots 2 s before the others: a tool took or listed fewer."""
    robots = [Robot(f'/a200_000{one}', 'clearpath_jazzy', 4) for one in range(3)]
    begun = time.monotonic()
    monkeypatch.setattr('lg_husky_sim.ros.tool.find_robots', lambda topics, **only: tuple(
        robots[:1 + sum(time.monotonic() > begun + later for later in (2.5, 2.8))]))
    with Orderly() as orderly, pytest.raises(SettingsError, match='3 Huskies are in the graph'):
        choose(orderly, (), preset=preset)


@pytest.mark.skipif(not any(map(find_spec, ('rosbags', 'rosbag2_py'))),
                    reason='nothing is installed that writes bags')
def test_a_recorder_says_at_once_what_it_does(
        probe: Probe, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """It was silent for 3.5 s of looking, and for 5 s more until the first counts."""
    monkeypatch.setattr('lg_husky_sim.ros.tool.OTHERS', 0.3)
    mouth, odometry = probe.talk('nav_msgs/msg/Odometry', '/early/platform/odom')
    probe.talk('geometry_msgs/msg/TwistStamped', '/early/platform/cmd_vel')
    said: list[str] = []
    with Orderly() as orderly:
        chosen = choose(orderly, [], namespace='/early', wait=20.0, say=said.append)
        assert chosen == ('clearpath_jazzy', '/early')
        assert said == [
            'looking for the robot (up to 20 s), then for others (0.3 s)',
            'found --preset clearpath_jazzy --namespace /early']
        del said[:]
        one = Tool(NAME, orderly, '/early')

        def say(text: str) -> None:
            said.append(text)
            if len(said) == 1:
                api.steady_timer(one.node, 0.05, lambda: mouth.publish(odometry()))
        try:
            record(one, tmp_path / 'bag', make_settings(preset='clearpath_jazzy'), seconds=1.0,
                   say=say)
        finally:
            one.close()
    assert said[0].startswith('listening to /early/platform/cmd_vel, /early/platform/odom, ')
    assert said[1] == 'recording for 1 s; nothing has been received yet'


def test_the_graph_is_not_left_between_looking_and_serving(
        probe: Probe, monkeypatch: pytest.MonkeyPatch) -> None:
    """Fast DDS left it with the last node: a recorder of 1.5 s heard nothing every other time."""
    left: list[str] = []
    close = Tool.close

    def closed(tool: Tool) -> None:
        left.append(tool.node.get_name())
        close(tool)
    monkeypatch.setattr(Tool, 'close', closed)
    with Orderly() as orderly:
        choose(orderly, (), preset='paper', wait=0.0)
        assert left == []
        tool = Tool('lg_husky_recorder', orderly)
        assert left == ['lg_husky_look']
        tool.close()


@pytest.mark.parametrize(('count', 'words'), [(1, ''), (2, ' ×2')])
def test_two_robots_of_one_name_are_two_that_move(
        probe: Probe, monkeypatch: pytest.MonkeyPatch, count: int, words: str) -> None:
    """Both of two nodes `/sim_node` were moved, and one was announced."""
    probe.listen('geometry_msgs/msg/Twist', '/same/cmd_vel')
    monkeypatch.setattr(commands, 'listeners', lambda node, topic: count * (
        Endpoint('/sim_node', 'geometry_msgs/msg/Twist', True, False),))
    said: list[str] = []
    tool = Tool('lg_husky_driver', Orderly())
    try:
        commands.Commands(tool, make_settings(command_topic='/same/cmd_vel')).wait(
            5.0, said.append)
    finally:
        tool.close()
    assert said == [f'/same/cmd_vel moves /sim_node (Twist){words}; no limit in this preset']


def test_a_drive_ends_when_nobody_listens_any_more(
        probe: Probe, monkeypatch: pytest.MonkeyPatch) -> None:
    """It went on for 19 s after its node was killed, and ended with exit code 0."""
    heard = probe.listen('geometry_msgs/msg/Twist', '/gone/cmd_vel')
    passed = [0.0]
    monkeypatch.setattr(commands, 'listeners', lambda node, topic: () if passed[-1] > 0.5 else (
        Endpoint('/a', 'geometry_msgs/msg/Twist', True, False),))
    tool = Tool('lg_husky_driver', Orderly())
    try:
        with pytest.raises(CommandError, match='/gone/cmd_vel: nobody listens any more, after '):
            drive(tool, Manoeuvre('long', (Step(20.0, 0.5, 0.0),)),
                  make_settings(command_topic='/gone/cmd_vel'), progress=passed.append)
    finally:
        tool.close()
    assert passed[-1] < 5.0
    assert probe.until(lambda: len(heard) == len(passed) + commands.ZEROS)
    assert [one.linear.x for one in heard[-commands.ZEROS:]] == [0.0] * commands.ZEROS
