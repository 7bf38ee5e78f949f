# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Bags as robots leave them, read back into known numbers."""

from __future__ import annotations

from itertools import permutations
from pathlib import Path
from typing import Any

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.recording import read_recording, TopicMap
from lg_husky_sim.recording.topics import candidates, Topic
import numpy as np
import pytest

FRONT_REAR = ('front_left_wheel', 'front_right_wheel', 'rear_left_wheel', 'rear_right_wheel')


@pytest.mark.parametrize('kind', ['mcap', 'sqlite3', 'ros1'])
def test_each_kind_of_bag_gives_the_same_streams(
    kind: str, bag_writer: Any, tmp_path: Path,
) -> None:
    writer = bag_writer(kind)
    for k in range(20):
        t = 0.1 * (k + 1)
        writer.twist(t, 0.5, -0.2)
        writer.joints(t, FRONT_REAR, (1.0, 3.0, 2.0, 5.0))
        writer.imu(t, 0.25, 0.5)
        writer.transforms(t, [('odom', 'base_link', t, 2 * t, 0.3 * t)])
    name = 'drive.bag' if kind == 'ros1' else 'drive'
    recording = read_recording(writer.write(tmp_path / name))
    assert recording.name == 'drive'
    assert set(recording.streams) == {'command', 'wheels', 'imu', 'pose'}
    times = 0.1 * np.arange(20)
    for series in recording.streams.values():
        np.testing.assert_allclose(series.times, times, atol=1e-9)
    np.testing.assert_array_equal(recording.stream('command').values[3], (0.5, -0.2))
    np.testing.assert_array_equal(recording.stream('wheels').values[3], (1.5, 4.0))
    np.testing.assert_array_equal(recording.stream('imu').values[3], (0.25, 0.5, 0.0))
    np.testing.assert_allclose(recording.stream('pose').values[:, 2], 0.3 * (times + 0.1))
    assert recording.frames == ('odom', 'base_link')
    assert recording.start_ns == 1_700_000_000_100_000_000


@pytest.mark.parametrize('style', [
    '{}', '{}_joint', 'husky/{}', 'A200_{}_JOINT'])
@pytest.mark.parametrize('order', list(permutations(range(4)))[::5])
def test_wheels_are_found_in_any_order_and_spelling(
    order: tuple[int, ...], style: str, bag: Any, tmp_path: Path,
) -> None:
    rates = (1.0, 10.0, 3.0, 30.0)
    names = [style.format(FRONT_REAR[place]) for place in order]
    if 'A200' in style:
        names = [name.upper() for name in names]
    bag.joints(1.0, ['pan_tilt', *names], [99.0, *(rates[place] for place in order)])
    bag.joints(1.1, ['pan_tilt', *names], [99.0, *(rates[place] for place in order)])
    wheels = read_recording(bag.write(tmp_path / 'bag')).stream('wheels')
    np.testing.assert_array_equal(wheels.values, [(2.0, 20.0)] * 2)


@pytest.mark.parametrize(('names', 'values', 'expected'), [
    (('left_wheel', 'right_wheel'), (1.0, 2.0), (1.0, 2.0)),
    (('wheel_fr', 'wheel_fl', 'wheel_rr', 'wheel_rl'), (4.0, 1.0, 6.0, 3.0), (2.0, 5.0)),
    ((), (1.0, 2.0, 3.0, 6.0), (2.0, 4.0)),
    ((), (1.0, 2.0), (1.0, 2.0)),
    (FRONT_REAR, (np.nan, 2.0, 3.0, 4.0), (3.0, 3.0)),
    (('wheel_left', 'wheel_right', 'left_caster_wheel'), (1.0, 2.0, 9.0), (1.0, 2.0)),
])
def test_two_wheels_no_names_and_nan(
    names: tuple[str, ...], values: tuple[float, ...], expected: tuple[float, float],
    bag: Any, tmp_path: Path,
) -> None:
    bag.joints(1.0, names, values)
    wheels = read_recording(bag.write(tmp_path / 'bag')).stream('wheels')
    np.testing.assert_array_equal(wheels.values, [expected])


def test_rates_are_derived_from_positions_that_wrap(bag: Any, tmp_path: Path) -> None:
    for k in range(60):
        t = 0.1 * (k + 1)
        angles = np.array([2.0 * t, -3.0 * t, 2.0 * t, -3.0 * t])
        bag.joints(t, FRONT_REAR, [np.nan] * 4, np.angle(np.exp(1j * angles)))
    recording = read_recording(bag.write(tmp_path / 'bag'))
    wheels = recording.stream('wheels')
    np.testing.assert_allclose(wheels.values, [(2.0, -3.0)] * 59)
    np.testing.assert_allclose(wheels.times, 0.05 + 0.1 * np.arange(59), atol=1e-9)
    assert 'derived from the positions' in ' '.join(recording.notes)
    np.testing.assert_allclose(np.ptp(recording.stream('wheel_angles').values, axis=0),
                               (11.8, 17.7))


def test_joint_states_of_an_arm_are_passed_over(bag: Any, tmp_path: Path) -> None:
    for k in range(3):
        bag.joints(1.0 + k, ['shoulder', 'elbow'], [9.0, 9.0], topic='/joint_states')
        bag.joints(1.0 + k, FRONT_REAR, [1.0] * 4, topic='/base/wheel_states')
    recording = read_recording(bag.write(tmp_path / 'bag'))
    assert recording.topics['wheels'] == '/base/wheel_states'
    np.testing.assert_array_equal(recording.stream('wheels').values, [(1.0, 1.0)] * 3)


def test_stamps_out_of_order_zero_and_twice(bag: Any, tmp_path: Path) -> None:
    order = [0, 2, 1, 3, 4, 4, 5, 6, 7, 8, 9]
    for place, k in enumerate(order):
        t = 1.0 + 0.1 * k
        bag.imu(1.0 + 0.1 * place + 0.02, float(place), stamp=0.0 if k == 7 else t)
    recording = read_recording(bag.write(tmp_path / 'bag'))
    imu = recording.stream('imu')
    assert np.all(np.diff(imu.times) > 0)
    assert len(imu) == 10  # of the two samples with one stamp the later one is kept
    np.testing.assert_array_equal(imu.column('yaw_rate'), (0, 2, 1, 3, 5, 6, 7, 8, 9, 10))
    notes = ' '.join(recording.notes)
    assert 'sorted' in notes
    assert 'share a stamp' in notes
    assert '1 of 11 header stamps' in notes


def test_all_header_stamps_zero_means_log_times(bag: Any, tmp_path: Path) -> None:
    for k in range(5):
        bag.imu(1.0 + 0.1 * k, 0.0, stamp=0.0)
        bag.twist(1.05 + 0.1 * k, 0.1 * k, 0.0)
    recording = read_recording(bag.write(tmp_path / 'bag'))
    np.testing.assert_allclose(recording.stream('imu').times, 0.1 * np.arange(5), atol=1e-9)
    np.testing.assert_allclose(
        recording.stream('command').times, 0.05 + 0.1 * np.arange(5), atol=1e-9)


def test_unstamped_commands_follow_a_header_clock_of_its_own(bag: Any, tmp_path: Path) -> None:
    for k in range(20):
        t = 100.0 + 0.1 * k
        bag.imu(t, 0.0, stamp=t - 60.0)
        bag.twist(t + 0.05, 0.3, 0.0)
    recording = read_recording(bag.write(tmp_path / 'bag'))
    np.testing.assert_allclose(recording.stream('imu').times, 0.1 * np.arange(20), atol=1e-9)
    np.testing.assert_allclose(
        recording.stream('command').times, 0.05 + 0.1 * np.arange(20), atol=1e-9)
    assert 'shifted' in ' '.join(recording.notes)


def test_a_sensor_that_counts_from_its_own_start_is_shifted(bag: Any, tmp_path: Path) -> None:
    for k in range(20):
        t = 1.0 + 0.1 * k
        bag.twist(t, 0.3, 0.0, stamp=t)
        bag.joints(t, FRONT_REAR, [1.0] * 4)
        bag.imu(t, 0.0, stamp=t - 1000.0)
    recording = read_recording(bag.write(tmp_path / 'bag'))
    np.testing.assert_allclose(
        recording.stream('imu').times, recording.stream('command').times, atol=1e-6)
    assert 'imu is on another clock' in ' '.join(recording.notes)


def test_the_right_transform_is_taken(bag: Any, tmp_path: Path) -> None:
    for k in range(4):
        bag.transforms(1.0 + k, [
            ('base_link', 'imu_link', 7.0, 7.0, 0.0), ('map', 'odom', 50.0, 0.0, 0.0),
            ('a200_0000/odom', '/base_link', float(k), 2.0 * k, 1.0)], scale=3.0)
        bag.odometry(1.0 + k, 99.0, 99.0, 0.0)
    path = bag.write(tmp_path / 'bag')
    recording = read_recording(path)
    np.testing.assert_allclose(
        recording.stream('pose').values, [(k, 2.0 * k, 1.0) for k in range(4)])
    world = read_recording(path, TopicMap(odom_frame='map', base_frame='base_link'))
    np.testing.assert_allclose(world.stream('pose').values[:, 0], 50.0 + np.arange(4))
    assert world.frames == ('map', 'base_link')
    with pytest.raises(RecordingError, match=r"no frame 'moon'; there are base_link, imu_link"):
        read_recording(path, TopicMap(odom_frame='moon'))


def test_odometry_stands_in_for_tf(bag: Any, tmp_path: Path) -> None:
    for k in range(40):
        bag.transforms(1.0 + 0.1 * k, [('base_link', 'imu_link', 7.0, 7.0, 0.0)])
        bag.odometry(1.0 + 0.1 * k, float(k), -float(k), 0.2 * k)
    recording = read_recording(bag.write(tmp_path / 'bag'))
    pose = recording.stream('pose').values
    np.testing.assert_allclose(pose[:, 0], np.arange(40))
    np.testing.assert_allclose(pose[:, 2], 0.2 * np.arange(40))  # unwrapped beyond pi
    assert recording.topics['pose'] == '/odom'
    assert 'pose taken from odometry (/odom)' in ' '.join(recording.notes)


def test_the_velocity_controllers_command_wins(bag: Any, tmp_path: Path) -> None:
    for k in range(3):
        bag.twist(1.0 + k, 1.0, 0.0, topic='/joy_teleop/cmd_vel')
        bag.twist(1.0 + k, 2.0, 0.0, topic='/husky_velocity_controller/cmd_vel')
        bag.twist(1.0 + k, 3.0, 0.0, topic='/cmd_vel')
    bag.twist(4.0, 4.0, 0.0, topic='/husky/cmd_vel')  # fewer messages, but no input of a mux
    path = bag.write(tmp_path / 'bag')
    assert read_recording(path).stream('command').values[0, 0] == 2.0
    picked = read_recording(path, TopicMap.parse(['command=joy_teleop/cmd_vel']))
    assert picked.stream('command').values[0, 0] == 1.0


def test_currents_and_samples_that_are_not_finite(bag: Any, tmp_path: Path) -> None:
    for k in range(10):
        t = 1.0 + 0.1 * k
        bag.number(t, 1.0 * k, '/left_driver_current')
        bag.number(t + 0.05, 2.0 * k, '/right_driver_current')
        bag.number(t, 5.0, '/some_temperature')
        bag.twist(t, np.inf if k == 4 else 0.1, 0.0)
    recording = read_recording(bag.write(tmp_path / 'bag'))
    currents = recording.stream('currents')
    np.testing.assert_allclose(currents.values[:, 1], 2.0 * currents.values[:, 0] - 1.0,
                               atol=1e-6)
    assert len(recording.stream('command')) == 9
    assert 'command: 1 of 10 samples were dropped' in ' '.join(recording.notes)
    assert 'voltage' not in recording.streams


@pytest.mark.parametrize(('choice', 'message'), [
    ('command=/nope', r'no topic /nope for command; there are /cmd_vel \(geometry_msgs/msg/Twist'),
    ('imu=/cmd_vel', r'topic /cmd_vel is a geometry_msgs/msg/Twist; imu is read from sensor_msgs'),
])
def test_a_topic_chosen_wrongly_lists_what_is_there(
    choice: str, message: str, bag: Any, tmp_path: Path,
) -> None:
    bag.twist(1.0, 0.1, 0.0)
    with pytest.raises(RecordingError, match=message):
        read_recording(bag.write(tmp_path / 'bag'), TopicMap.parse([choice]))


@pytest.mark.parametrize('choice', ['command', 'command=', 'speed=/x'])
def test_a_topic_choice_of_the_wrong_form(choice: str) -> None:
    with pytest.raises(RecordingError, match='must be ROLE=NAME with ROLE one of command'):
        TopicMap.parse([choice])


def test_a_missing_stream_lists_streams_and_topics(bag: Any, tmp_path: Path) -> None:
    bag.twist(1.0, 0.1, 0.0)
    bag.number(1.0, 0.1, '/temperature')
    recording = read_recording(bag.write(tmp_path / 'bag'))
    with pytest.raises(RecordingError, match=r'has no wheels; streams: command; topics: '
                                             r'/cmd_vel \(.*Twist\), /temperature'):
        recording.stream('wheels')


def test_bags_without_anything_of_use(bag: Any, bag_writer: Any, tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match='no usable messages'):
        read_recording(bag_writer().write(tmp_path / 'empty'))
    bag.joints(1.0, ['shoulder', 'elbow'], [1.0, 2.0])
    with pytest.raises(RecordingError, match=r'no wheels in /joint_states: it holds elbow'):
        read_recording(bag.write(tmp_path / 'arm'))


def test_what_is_no_bag(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match='no such file or folder'):
        read_recording(tmp_path / 'nowhere')
    (tmp_path / 'notes.txt').write_text('hello')
    with pytest.raises(RecordingError, match=r'notes.txt is not a recording'):
        read_recording(tmp_path / 'notes.txt')
    with pytest.raises(RecordingError, match='is not a recording: a rosbag2 folder holds'):
        read_recording(tmp_path)
    (tmp_path / 'bad.mcap').write_bytes(b'')
    with pytest.raises(RecordingError, match=r'cannot read .*bad.mcap: .*empty'):
        read_recording(tmp_path / 'bad.mcap')


def test_a_folder_without_metadata_and_a_path_to_it(drive: Any, tmp_path: Path) -> None:
    path = drive.write(tmp_path / 'bag')
    whole = read_recording(path / 'metadata.yaml')
    (path / 'metadata.yaml').unlink()
    np.testing.assert_array_equal(
        read_recording(path).stream('wheels').values, whole.stream('wheels').values)
    assert whole.name == 'bag'


def test_a_rosbag2_folder_may_be_called_bag(drive: Any, tmp_path: Path) -> None:
    path = drive.write(tmp_path / 'yard')
    whole = read_recording(path).stream('wheels').values
    named = read_recording(path.rename(tmp_path / 'yard.bag'))
    np.testing.assert_array_equal(named.stream('wheels').values, whole)
    assert named.name == 'yard'


@pytest.mark.parametrize(('names', 'best'), [
    (('/a200_0000/joy_teleop/cmd_vel', '/a200_0000/platform/cmd_vel', '/a200_0000/cmd_vel'),
     '/a200_0000/platform/cmd_vel'),
    (('/joy_teleop/cmd_vel', '/twist_marker_server/cmd_vel', '/cmd_vel'), '/cmd_vel'),
    (('/nav/cmd_vel', '/husky_velocity_controller/cmd_vel_unstamped'),
     '/husky_velocity_controller/cmd_vel_unstamped'),
    (('/something', '/drive/twist'), '/drive/twist'),
])
def test_the_likeliest_command(names: tuple[str, ...], best: str) -> None:
    kind = 'geometry_msgs/msg/Twist'
    topics = [Topic(name, kind, 10 if name == '/something' else 100) for name in names]
    assert candidates('command', [*topics, Topic('/cmd_vel', 'std_msgs/msg/String', 9)])[0] == (
        Topic(best, kind, 100))


def test_the_status_of_a_ros1_husky(bag_writer: Any, tmp_path: Path) -> None:
    from rosbags.typesys import get_types_from_msg
    writer = bag_writer('ros1')
    kind = 'husky_msgs/msg/HuskyStatus'
    writer.store.register(get_types_from_msg(
        'std_msgs/Header header\nfloat64 left_driver_current\nfloat64 right_driver_current\n'
        'float64 battery_voltage\n', kind))
    for k in range(3):
        stamp = 1.0 + 0.1 * k
        header = writer.header(writer._stamp(stamp))
        writer.add('/status', kind, stamp, writer.new(kind, header, 1.5, 2.5, 24.0 + k))
    recording = read_recording(writer.write(tmp_path / 'old.bag'))
    np.testing.assert_array_equal(recording.stream('currents').values, [(1.5, 2.5)] * 3)
    np.testing.assert_array_equal(recording.stream('voltage').values[:, 0], (24.0, 25.0, 26.0))
    assert recording.topics == {'currents': '/status', 'voltage': '/status'}


@pytest.mark.parametrize('mode', ['FILE', 'MESSAGE'])
@pytest.mark.parametrize('storage', ['MCAP', 'SQLITE3'])
def test_compressed_bags(mode: str, storage: str, drive: Any, tmp_path: Path) -> None:
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
    whole = read_recording(drive.write(tmp_path / 'plain'))
    path = tmp_path / 'packed'
    writer = Writer(path, version=9, storage_plugin=StoragePlugin[storage])
    writer.set_compression(CompressionMode[mode], CompressionFormat.ZSTD)
    with writer:
        connections = {}
        for topic, kind, logged, message in drive.rows:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=drive.store)
            writer.write(connections[topic], logged, drive.store.serialize_cdr(message, kind))
    packed = read_recording(path)
    for name, series in whole.streams.items():
        np.testing.assert_array_equal(packed.stream(name).values, series.values)


def test_the_parts_of_a_split_bag_without_metadata(bag_writer: Any, tmp_path: Path) -> None:
    (tmp_path / 'crashed').mkdir()
    for part in range(2):
        writer = bag_writer()
        for k in range(5):
            writer.twist(1.0 + part + 0.1 * k, float(part), 0.0)
        made = writer.write(tmp_path / f'crashed_{part}')
        (made / f'crashed_{part}.mcap').rename(tmp_path / 'crashed' / f'crashed_{part}.mcap')
    command = read_recording(tmp_path / 'crashed').stream('command')
    np.testing.assert_array_equal(command.column('forward'), [0.0] * 5 + [1.0] * 5)
