# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Two robots in one bag, and joints beside the wheels in one topic."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.recording import read_recording, TopicMap
from lg_husky_sim.recording.topics import Robots, robots, Topic
import numpy as np
import pytest

FRONT_REAR = ('front_left_wheel', 'front_right_wheel', 'rear_left_wheel', 'rear_right_wheel')
KINDS = {'cmd_vel': 'geometry_msgs/msg/Twist', 'joint_states': 'sensor_msgs/msg/JointState',
         'data': 'sensor_msgs/msg/Imu', 'odom': 'nav_msgs/msg/Odometry',
         'filtered': 'nav_msgs/msg/Odometry', 'tf': 'tf2_msgs/msg/TFMessage'}
HUSKY = ('/cmd_vel', '/joint_states', '/imu/data', '/odometry/filtered', '/tf')
CAMERA = ('/zed/zed_node/imu/data', '/zed/zed_node/odom')
KNUCKLES = ('robotiq_85_left_knuckle_joint', 'robotiq_85_right_knuckle_joint')


def _add_robot(bag: Any, name: str, value: float, *, commands: int, wheels: int,
               topic: str = '/tf') -> None:
    front = f'/{name}' if name else ''
    frame = f'{name}/' if name and topic == '/tf' else ''
    for k in range(commands):
        bag.twist(1.0 + 0.1 * k, value, 0.0, topic=f'{front}/cmd_vel')
    for k in range(wheels):
        bag.joints(1.0 + 0.1 * k, FRONT_REAR, [value] * 4, topic=f'{front}/joint_states')
        bag.transforms(1.0 + 0.1 * k, [(f'{frame}odom', f'{frame}base_link', value, 0.0, 0.0)],
                       topic=topic)


@pytest.mark.parametrize(('choices', 'value'), [
    ((), 1.0), (('wheels=/b/joint_states',), 2.0), (('odom_frame=b/odom',), 2.0),
    (('command=/a/cmd_vel', 'base_frame=a/base_link'), 1.0), (('odom_frame=odom',), 1.0)])
@pytest.mark.parametrize('first', ['a', ''])
def test_of_two_robots_one_is_read(
    first: str, choices: tuple[str, ...], value: float, bag: Any, tmp_path: Path,
) -> None:
    _add_robot(bag, first, 1.0, commands=30, wheels=20)
    _add_robot(bag, 'b', 2.0, commands=20, wheels=30)
    if not first:
        choices = tuple(choice.replace('a/', '') for choice in choices)
    recording = read_recording(bag.write(tmp_path / 'bag'), TopicMap.parse(choices))
    for name in ('command', 'wheels', 'pose'):
        np.testing.assert_array_equal(recording.stream(name).values[:, 0], value)
    taken, left = (first, 'b') if value == 1.0 else ('b', first)
    assert (f'there are topics of several robots: those of /{taken} are used, not those of /{left}'
            in ' '.join(recording.notes))


def test_what_the_robot_lacks_is_not_taken_from_the_other(bag: Any, tmp_path: Path) -> None:
    _add_robot(bag, 'a', 1.0, commands=30, wheels=20, topic='/a/tf')
    _add_robot(bag, 'b', 2.0, commands=20, wheels=30, topic='/b/tf')
    for k in range(40):
        bag.twist(1.0 + 0.1 * k, 3.0, 0.0, topic='/b/platform/cmd_vel')
        bag.number(1.0 + 0.1 * k, 3.0, '/b/battery_voltage')
    recording = read_recording(
        bag.write(tmp_path / 'bag'), TopicMap.parse(['command=/a/cmd_vel']))
    assert recording.topics == {
        'command': '/a/cmd_vel', 'wheels': '/a/joint_states', 'pose': '/a/tf'}
    assert 'voltage' not in recording.streams


def test_transforms_of_two_robots_are_not_merged(bag: Any, tmp_path: Path) -> None:
    for k in range(20):
        for name, x in (('a', 1.0), ('b', 2.0)):
            bag.transforms(1.0 + 0.1 * k, [(f'{name}/odom', f'{name}/base_link', x, 0.0, 0.0)])
    path = bag.write(tmp_path / 'bag')
    recording = read_recording(path)
    np.testing.assert_array_equal(recording.stream('pose').values[:, 0], [1.0] * 20)
    assert recording.frames == ('a/odom', 'a/base_link')
    assert 'a/odom -> a/base_link is read, not b/odom -> b/base_link' in ' '.join(recording.notes)
    other = read_recording(path, TopicMap(odom_frame='/b/odom'))
    np.testing.assert_array_equal(other.stream('pose').values[:, 0], [2.0] * 20)
    with pytest.raises(RecordingError, match="no frame 'c/odom'; there are a/base_link, a/odom"):
        read_recording(path, TopicMap(odom_frame='c/odom'))


def test_the_namespaces_of_one_robot_are_not_several(bag: Any, tmp_path: Path) -> None:
    for k in range(10):
        t = 1.0 + 0.1 * k
        bag.twist(t, 1.0, 0.0, topic='/a200_0000/platform/cmd_vel')
        bag.twist(t, 2.0, 0.0, topic='/a200_0000/joy_teleop/cmd_vel')
        bag.twist(t, 3.0, 0.0, topic='/cmd_vel')
        bag.joints(t, FRONT_REAR, [1.0] * 4, topic='/a200_0000/platform/joint_states')
        bag.joints(t, ['elbow'], [1.0], topic='/arm/joint_states')
        bag.imu(t, 1.0, topic='/a200_0000/sensors/imu_0/data')
        bag.imu(t, 2.0, topic='/camera/imu')
        bag.transforms(t, [('a200_0000/odom', 'a200_0000/base_link', 1.0, 0.0, 0.0),
                           ('map', 'a200_0000/odom', 0.0, 0.0, 0.0)])
    recording = read_recording(bag.write(tmp_path / 'bag'))
    for series in recording.streams.values():
        np.testing.assert_array_equal(series.values[:, 0], [1.0] * 10)
    assert recording.frames == ('odom', 'base_link')
    assert recording.notes == ()


@pytest.mark.parametrize(('names', 'choice', 'expected'), [
    ((*HUSKY, *CAMERA), '', Robots('', (), ('zed',))),
    ((*HUSKY, *CAMERA), 'imu=/zed/zed_node/imu/data', Robots('', (), ('zed',))),
    ((*HUSKY, *CAMERA), 'pose=/zed/zed_node/odom', Robots('', (), ('zed',))),
    ((*HUSKY, '/move_base/cmd_vel'), 'command=/move_base/cmd_vel', Robots('')),
    ((*HUSKY, '/wheel_controller/cmd_vel', '/wheel_controller/odom'),
     'command=/wheel_controller/cmd_vel', Robots('', (), ('wheel_controller',))),
    # Relays without a name, the robot with one.
    (('/husky/cmd_vel', '/husky/joint_states', '/husky/odom', '/cmd_vel', '/odom', '/imu/data',
      *CAMERA), '', Robots('husky', (), ('', 'zed'))),
    # Two controllers and a robot that alone has wheels.
    ((*HUSKY, '/b/cmd_vel', '/b/odom', '/c/cmd_vel', '/c/odom'), '', Robots('', (), ('b', 'c'))),
    # Two robots, of one of which the joint states were not recorded, and somebody's relays.
    (('/a/cmd_vel', '/a/joint_states', '/a/odom', '/b/cmd_vel', '/b/odom', '/b/imu/data',
      '/cmd_vel', '/odom'), '', Robots('a', ('b', ''))),
    (('/a/cmd_vel', '/a/joint_states', '/a/odom', '/b/cmd_vel', '/b/odom', '/b/imu/data'),
     'pose=/b/odom', Robots('b', ('a',))),
    # Two robots that each have all, and a camera that may be of either.
    ((*HUSKY, *(f'/b{name}' for name in HUSKY), *CAMERA), 'imu=/zed/zed_node/imu/data',
     Robots('b', ('', 'zed'))),
    (('/a/imu/data', '/a/odom', '/b/imu/data', '/b/odom'), '', Robots('a', (), ('b',))),
    (('/imu/data', *CAMERA), '', Robots('')),
    (('/diagnostics/data',), '', Robots()),
])
def test_which_namespaces_are_robots(
    names: tuple[str, ...], choice: str, expected: Robots,
) -> None:
    topics = [Topic(name, KINDS[name.split('/')[-1]], 10) for name in names]
    chosen = TopicMap.parse([choice] if choice else [])
    assert robots(topics, chosen) == expected


def _add_camera(bag: Any, t: float) -> None:
    for late in (0.0, 0.02, 0.04):  # faster than the robot's own
        bag.imu(t + late, 2.0, topic='/zed/zed_node/imu/data')
    bag.odometry(t, 2.0, 0.0, 0.0, topic='/zed/zed_node/odom')


@pytest.mark.parametrize(('choices', 'cameras'), [
    ((), ()), (('imu=/zed/zed_node/imu/data',), ('imu',)),
    (('pose=/zed/zed_node/odom',), ('pose',)),
    (('imu=/zed/zed_node/imu/data', 'pose=/zed/zed_node/odom'), ('imu', 'pose'))])
def test_a_camera_with_imu_and_odometry_is_no_robot(
    choices: tuple[str, ...], cameras: tuple[str, ...], bag: Any, tmp_path: Path,
) -> None:
    _add_robot(bag, '', 1.0, commands=20, wheels=20)
    for k in range(20):
        bag.imu(1.0 + 0.1 * k, 1.0)
        bag.odometry(1.0 + 0.1 * k, 1.0, 0.0, 0.0, topic='/odometry/filtered')
        _add_camera(bag, 1.0 + 0.1 * k)
    recording = read_recording(bag.write(tmp_path / 'bag'), TopicMap.parse(choices))
    assert {name: set(series.values[:, 0]) for name, series in recording.streams.items()} == {
        name: {2.0 if name in cameras else 1.0} for name in ('command', 'wheels', 'imu', 'pose')}
    assert 'several robots' not in ' '.join(recording.notes)


def test_the_imu_of_the_robot_comes_before_a_faster_one(bag: Any, tmp_path: Path) -> None:
    for k in range(10):
        bag.joints(1.0 + 0.1 * k, FRONT_REAR, [1.0] * 4)
        bag.imu(1.0 + 0.1 * k, 1.0, topic='/imu/data')
        bag.imu(1.0 + 0.1 * k, 2.0, topic='/camera/imu/data')
        bag.imu(1.05 + 0.1 * k, 2.0, topic='/camera/imu/data')
    assert read_recording(bag.write(tmp_path / 'bag')).topics['imu'] == '/imu/data'


@pytest.mark.parametrize('choices', [(), ('command=/cmd_vel',)])
def test_relays_without_a_name_complete_a_robot(
    choices: tuple[str, ...], bag: Any, tmp_path: Path,
) -> None:
    for k in range(10):
        t = 1.0 + 0.1 * k
        bag.twist(t, 1.0, 0.0, topic='/husky/husky_velocity_controller/cmd_vel')
        bag.joints(t, FRONT_REAR, [1.0] * 4, topic='/husky/joint_states')
        bag.odometry(t, 1.0, 0.0, 0.0, topic='/husky/husky_velocity_controller/odom')
        bag.twist(t, 1.0, 0.0, topic='/cmd_vel')
        bag.odometry(t, 1.0, 0.0, 0.0, topic='/odom')
        bag.imu(t, 1.0, topic='/imu/data')
        _add_camera(bag, t)
    recording = read_recording(bag.write(tmp_path / 'bag'), TopicMap.parse(choices))
    for series in recording.streams.values():
        assert set(series.values[:, 0]) == {1.0}
    assert set(recording.streams) == {'command', 'wheels', 'imu', 'pose'}
    assert ('husky' in recording.topics['command']) == (not choices)
    assert 'several robots' not in ' '.join(recording.notes)


def _add_two_without_prefix(bag: Any, first: str) -> None:
    for k in range(10):
        t = 1.0 + 0.1 * k
        for name, value in ((first, 1.0), ('/a', 2.0)):
            bag.twist(t, value, 0.0, topic=f'{name}/cmd_vel')
            bag.joints(t, FRONT_REAR, [value] * 4, topic=f'{name}/joint_states')
        bag.transforms(t, [('odom', 'base_link', 1.0, 0.0, 0.0)])


@pytest.mark.parametrize('own', [None, 'odometry', 'tf'])
def test_the_pose_of_the_robot_without_a_name_is_not_given_to_another(
    own: str | None, bag: Any, tmp_path: Path,
) -> None:
    _add_two_without_prefix(bag, '')
    for k in range(10):
        if own == 'odometry':
            bag.odometry(1.0 + 0.1 * k, 2.0, 0.0, 0.0, topic='/a/odom')
        elif own == 'tf':  # in a topic of its own, frames need no name
            bag.transforms(1.0 + 0.1 * k, [('odom', 'base_link', 2.0, 0.0, 0.0)], topic='/a/tf')
    path = bag.write(tmp_path / 'bag')
    choice = TopicMap(wheels='/a/joint_states')
    recording = read_recording(path, choice)
    assert set(recording.stream('wheels').values[:, 0]) == {2.0}
    if own is None:
        assert 'pose' not in recording.streams
        assert 'no pose of /a in /tf: it holds odom -> base_link' in recording.notes
    else:
        assert set(recording.stream('pose').values[:, 0]) == {2.0}
    nameless = read_recording(path, TopicMap(wheels='/joint_states'))
    assert set(nameless.stream('pose').values[:, 0]) == {1.0}
    if own is None:
        by_hand = read_recording(path, TopicMap(wheels='/a/joint_states', odom_frame='odom'))
        assert set(by_hand.stream('pose').values[:, 0]) == {1.0}


def test_frames_that_name_neither_of_two_robots_are_noted(bag: Any, tmp_path: Path) -> None:
    _add_two_without_prefix(bag, '/b')
    recording = read_recording(bag.write(tmp_path / 'bag'))
    assert 'pose' in recording.streams
    assert 'odom -> base_link in /tf names no robot: taken for that of /a' in recording.notes


@pytest.mark.parametrize('first', ['wheels', 'gripper'])
def test_joints_of_a_gripper_are_no_wheels(first: str, bag: Any, tmp_path: Path) -> None:
    wheels = 0.0 if first == 'wheels' else 0.02
    for k in range(20):
        bag.joints(1.0 + 0.1 * k + wheels, FRONT_REAR, [3.0] * 4)
        bag.joints(1.01 + 0.1 * k, KNUCKLES, [0.0] * 2)
    recording = read_recording(bag.write(tmp_path / 'bag'))
    np.testing.assert_array_equal(recording.stream('wheels').values, [(3.0, 3.0)] * 20)
    assert recording.notes == (
        'wheels: joints that are not called wheels, or have no side, were ignored: '
        f'{KNUCKLES[0]}, '
        f'{KNUCKLES[1]}',)


@pytest.mark.parametrize(('further', 'said'), [
    ((), ''), (('pan_tilt', 'front_left_steer_joint', 'elbow'), ''),
    (('left_elbow', 'wheel_5'), 'left_elbow, wheel_5'),
    (tuple(f'right_arm{k}_joint' for k in range(9)), ''),
    (tuple(f'right_{k}' for k in range(6)), 'right_0, right_1, right_2, right_3 and 2 more')])
def test_joints_that_might_be_wheels_are_noted(
    further: tuple[str, ...], said: str, bag: Any, tmp_path: Path,
) -> None:
    bag.joints(1.0, (*FRONT_REAR, *further), [1.0] * (4 + len(further)))
    notes = ' '.join(read_recording(bag.write(tmp_path / 'bag')).notes)
    assert notes.partition('ignored: ')[2] == said


@pytest.mark.parametrize('velocities', [True, False])
def test_front_and_rear_positions_that_wrap_at_different_moments(
    velocities: bool, bag: Any, tmp_path: Path,
) -> None:
    for k in range(200):
        t = 0.05 * (k + 1)
        turned = np.array([3.0 * t, -3.0 * t, 3.0 * t + 1.0, -3.0 * t - 2.0])
        names, wrapped = list(FRONT_REAR), np.angle(np.exp(1j * turned))
        if k % 2:  # the order of the joints may change
            names, wrapped = names[::-1], wrapped[::-1]
        bag.joints(t, names, [3.0, -3.0][::(-1) ** k] * 2 if velocities else (), wrapped)
    recording = read_recording(bag.write(tmp_path / 'bag'))
    angles = recording.stream('wheel_angles').values
    np.testing.assert_allclose(np.diff(angles, axis=0), [(0.15, -0.15)] * 199)
    np.testing.assert_allclose(
        recording.stream('wheels').values, [(3.0, -3.0)] * (200 if velocities else 199))
    assert 'wrap at different moments' in ' '.join(recording.notes)
