# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Reading by ROS's own rosbag2_py gives what reading by rosbags gives.

The module is stood in for by one with the signatures of rosbag2_py in Jazzy (pybind11 sources of
rosbag2, branch jazzy), so that the way there and back is tested where ROS is not installed.
"""

from __future__ import annotations

from pathlib import Path
import sys
from types import ModuleType, SimpleNamespace
from typing import Any

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.recording import bags, read_recording, write_recording
from lg_husky_sim.signals import TimeSeries
import numpy as np
import pytest

pytest.importorskip('rosbags')


class Reader:
    """As rosbag2_py.SequentialReader."""

    def open(self, storage: Any, converter: Any) -> None:  # noqa: A003
        """Open a folder or a file."""
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import get_typestore, Stores
        path = Path(storage.uri)
        assert storage.storage_id == {'.mcap': 'mcap', '.db3': 'sqlite3'}.get(path.suffix, '')
        self._reader = AnyReader([path], default_typestore=get_typestore(Stores.ROS2_JAZZY))
        self._reader.open()
        self.set_filter(SimpleNamespace(topics=[c.topic for c in self._reader.connections]))

    def get_metadata(self) -> Any:
        """Return names, types and counts."""
        return SimpleNamespace(topics_with_message_count=[SimpleNamespace(
            message_count=one.msgcount,
            topic_metadata=SimpleNamespace(name=one.topic, type=one.msgtype))
            for one in self._reader.connections])

    def set_filter(self, storage_filter: Any) -> None:
        """Begin anew with some topics only."""
        chosen = [c for c in self._reader.connections if c.topic in storage_filter.topics]
        self._rows: list[Any] = list(self._reader.messages(chosen))

    def has_next(self) -> bool:
        """Return whether a message is left."""
        return bool(self._rows)

    def read_next(self) -> tuple[str, bytes, int]:
        """Return topic, bytes and log time."""
        connection, logged, raw = self._rows.pop(0)
        return connection.topic, bytes(raw), logged


@pytest.fixture
def by_ros(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have rosbags missing and ROS there."""
    from rosbags.typesys import get_typestore, Stores
    store = get_typestore(Stores.ROS2_JAZZY)
    modules = {name: ModuleType(name) for name in (
        'rosbag2_py', 'rosidl_runtime_py', 'rosidl_runtime_py.utilities', 'rclpy',
        'rclpy.serialization')}
    modules['rosbag2_py'].__dict__.update(
        SequentialReader=Reader, ConverterOptions=lambda one, other: (one, other),
        StorageOptions=lambda uri, storage_id: SimpleNamespace(uri=uri, storage_id=storage_id),
        StorageFilter=lambda topics: SimpleNamespace(topics=topics))
    modules['rosidl_runtime_py.utilities'].__dict__['get_message'] = lambda kind: kind
    modules['rclpy.serialization'].__dict__['deserialize_message'] = store.deserialize_cdr
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setattr(bags, 'find_spec', lambda name: None)
    monkeypatch.setattr(bags, 'available', lambda: True)


def streams() -> dict[str, TimeSeries]:
    """Return a short drive."""
    times = np.arange(200) * np.float64(0.02)
    return {'imu': TimeSeries(times, np.column_stack([np.sin(times), times, times]),
                              ('yaw_rate', 'accel_x', 'accel_y')),
            'wheels': TimeSeries(times, np.column_stack([times, -times]), ('left', 'right')),
            'command': TimeSeries(times[::5], np.column_stack([times, times])[::5],
                                  ('forward', 'yaw')),
            'pose': TimeSeries(times, np.column_stack([times, times, 0.1 * times]),
                               ('x', 'y', 'heading'))}


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
@pytest.mark.parametrize('cut', [False, True])
def test_both_readers_read_the_same(
        request: pytest.FixtureRequest, tmp_path: Path, storage: str, cut: bool) -> None:
    path = write_recording(tmp_path / 'bag', streams(), storage=storage)
    if cut:
        (path / 'metadata.yaml').unlink()
    wanted = read_recording(path)
    request.getfixturevalue('by_ros')
    found = read_recording(path)
    assert (found.topics, found.notes) == (wanted.topics, wanted.notes)
    assert list(found.streams) == list(wanted.streams)
    for name, series in wanted.streams.items():
        np.testing.assert_array_equal(found.streams[name].times, series.times)
        np.testing.assert_array_equal(found.streams[name].values, series.values)


def test_a_bag_of_ros_1_names_what_reads_it(
        by_ros: None, tmp_path: Path) -> None:
    path = tmp_path / 'old.bag'
    path.write_bytes(b'#ROSBAG V2.0\n')
    with pytest.raises(RecordingError, match='bags of ROS 1 need the package rosbags'):
        read_recording(path)


def test_where_nothing_reads_bags_both_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    from lg_husky_sim import extras
    from lg_husky_sim.errors import MissingExtraError
    monkeypatch.setattr(bags, 'find_spec', lambda name: None)
    monkeypatch.setattr(extras, 'find_spec', lambda name: None)
    with pytest.raises(MissingExtraError, match=r'rosbags is needed to read recordings .*pip '
                       'install'):
        read_recording('anything.mcap')
