# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Two robots in one bag, and joints beside the wheels in one topic."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.recording import read_recording, TopicMap
import numpy as np
import pytest

FRONT_REAR = ('front_left_wheel', 'front_right_wheel', 'rear_left_wheel', 'rear_right_wheel')
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
    assert (f'topics of several robots: those of /{taken} are read, not those of /{left}'
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


@pytest.mark.parametrize('first', ['wheels', 'gripper'])
def test_joints_of_a_gripper_are_no_wheels(first: str, bag: Any, tmp_path: Path) -> None:
    wheels = 0.0 if first == 'wheels' else 0.02
    for k in range(20):
        bag.joints(1.0 + 0.1 * k + wheels, FRONT_REAR, [3.0] * 4)
        bag.joints(1.01 + 0.1 * k, KNUCKLES, [0.0] * 2)
    recording = read_recording(bag.write(tmp_path / 'bag'))
    np.testing.assert_array_equal(recording.stream('wheels').values, [(3.0, 3.0)] * 20)


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
