# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What a recorder writes: on disk at once, and played so that all who listen hear it."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
import shutil
import sqlite3
from typing import Any

from lg_husky_sim.ros import api, bag_writer
from lg_husky_sim.ros.recorder import Recorder
from lg_husky_sim.testing.live import Probe
import pytest
import yaml

pytestmark = pytest.mark.skipif(
    find_spec('rosbags') is None and not (api.HAVE_RCLPY and find_spec('rosbag2_py')),
    reason='nothing is installed that writes bags')


def writers() -> list[str]:
    """Return the names of those that can be had here."""
    ros = ['Rosbag2Writer'] if api.HAVE_RCLPY and find_spec('rosbag2_py') else []
    return [*ros, *(['RosbagsWriter'] if find_spec('rosbags') else [])]


@pytest.mark.parametrize('storage', bag_writer.STORAGES)
@pytest.mark.parametrize('name', writers())
def test_static_transforms_are_played_as_their_listeners_ask(
        tmp_path: Path, name: str, storage: str) -> None:
    """Played volatile, as rosbag2 plays what says nothing, no listener of tf hears them."""
    writer = getattr(bag_writer, name)(tmp_path / 'bag', storage)
    for topic in ('/tf', '/tf_static', '/a200/tf_static'):
        writer.add(topic, 'tf2_msgs/msg/TFMessage')
    writer.close()
    told = yaml.safe_load((tmp_path / 'bag' / 'metadata.yaml').read_text())
    offered = {one['topic_metadata']['name']: one['topic_metadata']['offered_qos_profiles']
               for one in told['rosbag2_bagfile_information']['topics_with_message_count']}
    assert not offered['/tf']
    for topic in ('/tf_static', '/a200/tf_static'):
        (one,) = offered[topic]
        assert (one['durability'], one['reliability'], one['history'], one['depth']) == (
            'transient_local', 'reliable', 'keep_last', 100)


@pytest.mark.parametrize('storage', bag_writer.STORAGES)
@pytest.mark.parametrize('name', writers())
def test_a_short_message_is_on_disk_after_a_flush(
        tmp_path: Path, name: str, storage: str) -> None:
    """Of topics of a few bytes a second, a file's buffer of 4096 bytes held minutes back."""
    writer = getattr(bag_writer, name)(tmp_path / 'bag', storage)
    writer.add('/said', 'std_msgs/msg/String')
    raw = b'\x00\x01\x00\x00\x0e\x00\x00\x00these are kept\x00'
    writer.write('/said', 10**18, raw)
    writer.flush()
    (path,) = (one for one in (tmp_path / 'bag').iterdir() if one.suffix in ('.mcap', '.db3'))
    if storage == 'mcap':
        assert b'these are kept' in path.read_bytes()
    else:
        with sqlite3.connect(path) as base:
            assert base.execute('SELECT COUNT(*) FROM messages').fetchone() == (1,)
    writer.close()


@pytest.mark.skipif('Rosbag2Writer' not in writers(), reason='rosbag2_py is not installed')
@pytest.mark.parametrize('full', [False, True])
def test_a_bag_by_ros_has_an_index_and_all_its_messages(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str],
        full: bool) -> None:
    """Without one, players warn and read all that lies before the time to which they jump."""
    rosbag2_py = import_module('rosbag2_py')
    if full:
        monkeypatch.setattr(shutil, 'disk_usage', lambda path: shutil._ntuple_diskusage(1, 1, 0))
    path = tmp_path / 'a bag: "1"'
    writer = bag_writer.Rosbag2Writer(path, 'mcap')
    for topic in ('/said', '/_hidden', '/never'):
        writer.add(topic, 'std_msgs/msg/String')
    raw = b'\x00\x01\x00\x00\x04\x00\x00\x00one\x00'
    wanted = [(topic, raw, 10**18 + k) for k in range(500) for topic in ('/said', '/_hidden')]
    for topic, data, moment in wanted:
        writer.write(topic, moment, data)
    writer.close()
    said = capfd.readouterr().err
    assert ('has no index: the disk is too full' in said) == full
    assert full or 'WARN' not in said
    assert sorted(one.name for one in path.iterdir()) == [f'{path.name}_0.mcap', 'metadata.yaml']
    reader = rosbag2_py.SequentialReader()
    reader.open(rosbag2_py.StorageOptions(uri=str(path), storage_id='mcap'),
                rosbag2_py.ConverterOptions('cdr', 'cdr'))
    assert [reader.read_next() for _ in wanted] == wanted
    assert not reader.has_next()
    assert {one.name for one in reader.get_all_topics_and_types()} == {
        '/said', '/_hidden', '/never'}
    assert ('no message index' in capfd.readouterr().err) == full


@pytest.mark.skipif(not api.HAVE_RCLPY, reason='the embedded backend makes objects of all')
def test_a_recorder_keeps_bytes_as_they_came(
        probe: Probe, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Objects and bytes again took two thirds of its time: at 200 Hz it fell behind the robot."""
    talker, message = probe.talk('nav_msgs/msg/Odometry', '/kept')
    wanted = message()
    wanted.pose.pose.position.x = 3.25
    wanted.child_frame_id = 'base_link'

    def never(one: Any) -> bytes:
        raise AssertionError(one)
    monkeypatch.setattr(api, 'serialised', never)
    written: list[bytes] = []
    recorder = Recorder(probe.node, tmp_path / 'bag', {'/kept': 'nav_msgs/msg/Odometry'})
    try:
        monkeypatch.setattr(recorder._writer, 'write', lambda *values: written.append(values[2]))
        assert probe.until(lambda: talker.get_subscription_count() > 0)
        talker.publish(wanted)
        assert probe.until(lambda: written)
    finally:
        recorder.close()
    # Fast DDS leaves padding as it was: equal messages may differ in bytes.
    from rclpy.serialization import deserialize_message
    assert type(written[0]) is bytes
    assert deserialize_message(written[0], message) == wanted
