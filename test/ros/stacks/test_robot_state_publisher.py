# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""robot_state_publisher, unmodified, started by the package's own launch file."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
import math
from pathlib import Path
import sys
from typing import Any
from xml.etree import ElementTree

from lg_husky_sim.ros import api
from lg_husky_sim.testing.live import Probe
import pytest
import yaml

ROOT = Path(__file__).resolve().parent.parent.parent.parent
LATCHED = api.DurabilityPolicy.TRANSIENT_LOCAL
#: What `ros2 launch` does, where ros2launch is not installed.
LAUNCH = """\
import sys
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
service = LaunchService(argv=sys.argv[2:])
service.include_launch_description(LaunchDescription([IncludeLaunchDescription(
    PythonLaunchDescriptionSource(sys.argv[1]),
    launch_arguments=[tuple(word.split(':=', 1)) for word in sys.argv[2:]])]))
sys.exit(service.run())
"""
#: Longest wait for something live [s].
PATIENCE = 30.0


@pytest.fixture
def launched(run: Callable[..., Any], program: Callable[[str, str], Path], tmp_path: Path,
             monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Return a starter of the launch file, with this package as colcon would install it."""
    program('robot_state_publisher', 'robot_state_publisher')
    pytest.importorskip('launch_ros')
    prefix = tmp_path / 'prefix'
    marker = prefix / 'share' / 'ament_index' / 'resource_index' / 'packages' / 'lg_husky_sim'
    share, programs = (prefix / place / 'lg_husky_sim' for place in ('share', 'lib'))
    for folder in (marker.parent, share, programs):
        folder.mkdir(parents=True)
    marker.touch()
    for name in ('urdf', 'config'):
        (share / name).symlink_to(ROOT / name)
    node = programs / 'sim_node'
    node.write_text(f'#!{sys.executable}\nfrom lg_husky_sim.ros.sim_node import main\n'
                    'raise SystemExit(main())\n', encoding='utf-8')
    node.chmod(0o755)
    monkeypatch.setenv('AMENT_PREFIX_PATH', str(prefix), prepend=':')

    def start(*arguments: str) -> None:
        run(Path(sys.executable), '-c', LAUNCH, str(ROOT / 'launch' / 'sim.launch.py'),
            *arguments)

    return start


def tree(messages: list[Any], fixed: list[Any]) -> Any:
    """Return tf2's own buffer with all transforms that were heard."""
    tf2 = import_module('tf2_ros')
    buffer = tf2.Buffer(cache_time=import_module('rclpy.duration').Duration(seconds=60.0))
    for message in messages:
        for one in message.transforms:
            buffer.set_transform(one, 'test')
    for message in fixed:
        for one in message.transforms:
            buffer.set_transform_static(one, 'test')
    return buffer


def test_all_nodes_take_their_time_from_the_clock(
        probe: Probe, launched: Callable[..., None]) -> None:
    """`use_sim_time:=true`, as other launch files take it; it had no effect."""
    mouth, kind = probe.talk('rosgraph_msgs/msg/Clock', '/clock')
    heard = probe.listen('nav_msgs/msg/Odometry', '/timed/ground_truth', 500)
    launched('namespace:=timed', 'use_sim_time:=true', 'state_publisher:=true')
    now = kind()
    now.clock.sec = 1000

    def passing() -> bool:
        now.clock.nanosec = (now.clock.nanosec + 20_000_000) % 10**9
        now.clock.sec += now.clock.nanosec == 0
        mouth.publish(now)
        probe.spin(0.02)
        return len(heard) > 20
    assert probe.until(passing, PATIENCE)
    assert all(999 <= one.header.stamp.sec <= now.clock.sec for one in heard[1:])
    service = import_module('rcl_interfaces.srv').GetParameters
    asking: Any = probe.node
    for node in ('sim_node', 'robot_state_publisher'):
        client = asking.create_client(service, f'/timed/{node}/get_parameters')
        assert probe.until(client.service_is_ready, PATIENCE)
        answer = client.call_async(service.Request(names=['use_sim_time']))
        assert probe.until(answer.done, PATIENCE)
        assert answer.result().values[0].bool_value, node


@pytest.mark.realtime
def test_wheels_turn_on_tf_as_the_joints_say(probe: Probe, launched: Callable[..., None]) -> None:
    """Preset clearpath_jazzy in a namespace: one tree of frames, from odom to wheels and IMU."""
    name = '/a200_0000'
    heard = probe.listen('tf2_msgs/msg/TFMessage', f'{name}/tf', 500)
    fixed = probe.listen('tf2_msgs/msg/TFMessage', f'{name}/tf_static',
                         api.QoSProfile(depth=100, durability=LATCHED))
    joints = probe.listen('sensor_msgs/msg/JointState', f'{name}/platform/joint_states', 500)
    mouth, kind = probe.talk('geometry_msgs/msg/TwistStamped', f'{name}/platform/cmd_vel')
    launched('preset:=clearpath_jazzy', f'namespace:={name}', 'state_publisher:=true')

    def wheel(message: Any) -> set[int]:
        """Return the stamps of transforms to a wheel."""
        return {one.header.stamp.sec * 10**9 + one.header.stamp.nanosec
                for one in message.transforms if one.child_frame_id == 'front_left_wheel_link'}

    def driven() -> bool:
        command = kind()
        command.twist.linear.x, command.twist.angular.z = 0.4, 0.3
        mouth.publish(command)
        probe.spin(0.05)
        return bool(joints) and joints[-1].position[0] > 4.0 and len(
            [one for one in heard if wheel(one)]) > 20
    assert probe.until(driven, PATIENCE)
    probe.spin(0.5)
    buffer = tree(heard, fixed)
    stamps = set.union(*(wheel(one) for one in heard))
    compared = 0
    for message in joints:
        if message.header.stamp.sec * 10**9 + message.header.stamp.nanosec not in stamps:
            continue
        stamp = import_module('rclpy.time').Time.from_msg(message.header.stamp)
        for joint, angle in zip(message.name, message.position, strict=True):
            child = joint.replace('_joint', '_link')
            turn = buffer.lookup_transform('base_link', child, stamp).transform.rotation
            assert math.remainder(2.0 * math.atan2(turn.y, turn.w) - angle, math.tau) == (
                pytest.approx(0.0, abs=1e-6))
        compared += 1
    assert compared > 20
    urdf = ElementTree.parse(ROOT / 'urdf' / 'husky.urdf')
    links = {str(one.get('name')) for one in urdf.iter('link')} - {'imu_link'} | {'imu_0_link'}
    assert all(buffer.can_transform('odom', link, import_module('rclpy.time').Time())
               for link in links), buffer.all_frames_as_string()


@pytest.mark.realtime
def test_all_that_the_rviz_layout_shows_is_published(
        probe: Probe, launched: Callable[..., None]) -> None:
    """Its fixed frame, its topics with their types, and the robot for who comes later."""
    layout = yaml.safe_load((ROOT / 'config' / 'husky.rviz').read_text(encoding='utf-8'))
    manager = layout['Visualization Manager']
    fixed = probe.listen('tf2_msgs/msg/TFMessage', '/tf_static',
                         api.QoSProfile(depth=100, durability=LATCHED))
    heard = probe.listen('tf2_msgs/msg/TFMessage', '/tf', 500)
    launched('state_publisher:=true')
    said = probe.listen('std_msgs/msg/String', '/robot_description',
                        api.QoSProfile(depth=1, durability=LATCHED))
    assert probe.until(lambda: said and fixed and len(heard) > 50, PATIENCE)
    assert '<robot' in said[-1].data
    classes = {'rviz_default_plugins/Odometry': 'nav_msgs/msg/Odometry',
               'rviz_default_plugins/RobotModel': 'std_msgs/msg/String'}
    offered = dict(probe.node.get_topic_names_and_types())
    shown = 0
    for display in manager['Displays']:
        topic = display.get('Topic') or display.get('Description Topic')
        if topic:
            assert offered[f'/{topic["Value"]}'] == [classes[display['Class']]]
            node: Any = probe.node
            assert node.count_publishers(f'/{topic["Value"]}') == 1
            shown += 1
    assert shown >= 3
    frame = manager['Global Options']['Fixed Frame']
    assert tree(heard, fixed).can_transform(
        frame, 'front_left_wheel_link', import_module('rclpy.time').Time())
