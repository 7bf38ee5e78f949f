# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Reading and writing by ROS's own rosbag2_py gives what rosbags gives.

Where rosbag2_py is not installed, one with its signatures in Jazzy (pybind11 sources of rosbag2,
branch jazzy) stands in for it, so that the way there and back is tested everywhere. Where rclpy
is, messages are made and serialised by it.
"""

from __future__ import annotations

from importlib.util import find_spec
import io
from pathlib import Path
import sys
from types import ModuleType, SimpleNamespace
from typing import Any

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.recording import bags, read_recording, write_recording, writer
from lg_husky_sim.recording.salvage import records
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


class Writer:
    """As rosbag2_py.SequentialWriter."""

    def open(self, storage: Any, converter: Any) -> None:  # noqa: A003
        """Make a folder."""
        from rosbags import rosbag2
        from rosbags.typesys import get_typestore, Stores
        assert (converter, storage.storage_preset_profile) == (
            ('cdr', 'cdr'), 'zstd_fast' if storage.storage_id == 'mcap' else '')
        self._store = get_typestore(Stores.ROS2_JAZZY)
        self._writer = rosbag2.Writer(storage.uri, version=9, storage_plugin=(
            rosbag2.StoragePlugin[storage.storage_id.upper()]))
        self._writer.open()
        self._topics: dict[str, Any] = {}

    def create_topic(self, topic: Any) -> None:
        """Take a rosbag2_py.TopicMetadata."""
        assert (topic.id, topic.serialization_format) == (len(self._topics), 'cdr')
        self._topics[topic.name] = self._writer.add_connection(
            topic.name, topic.type, typestore=self._store)

    def write(self, name: str, raw: bytes, stamp: int) -> None:
        """Append a message."""
        assert type(raw) is bytes
        self._writer.write(self._topics[name], stamp, raw)

    def close(self) -> None:
        """Complete the bag."""
        self._writer.close()


def _store() -> Any:
    from rosbags.typesys import get_typestore, Stores
    return get_typestore(Stores.ROS2_JAZZY)


class Kind(str):
    """A message class by its name, as ROS makes them: by the names of its fields."""

    def get_fields_and_field_types(self) -> dict[str, str]:
        """Return its fields in order, without constants."""
        return dict.fromkeys((name for name, _ in _store().fielddefs[self][1]), '')

    def __call__(self, **values: Any) -> Any:
        """Make one; sequences of numbers are lists."""
        assert not any(isinstance(value, np.ndarray) for value in values.values())
        return _store().types[self](**{name: np.array(value) if isinstance(value, list) and all(
            isinstance(one, float) for one in value) else value
            for name, value in values.items()})


@pytest.fixture
def by_ros(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have rosbags missing, and ROS there, the real one as far as it is installed."""
    store = _store()
    names = ['rosbag2_py'] if find_spec('rosbag2_py') is None else []
    if find_spec('rclpy') is None:
        names += ['rosidl_runtime_py', 'rosidl_runtime_py.utilities', 'rclpy',
                  'rclpy.serialization']
    modules = {name: ModuleType(name) for name in names}
    if 'rosbag2_py' in modules:
        modules['rosbag2_py'].__dict__.update(
            SequentialReader=Reader, SequentialWriter=Writer, TopicMetadata=SimpleNamespace,
            ConverterOptions=lambda one, other: (one, other),
            StorageOptions=lambda **values: SimpleNamespace(**values),
            StorageFilter=lambda topics: SimpleNamespace(topics=topics))
    if 'rclpy' in modules:
        modules['rosidl_runtime_py.utilities'].__dict__['get_message'] = Kind
        modules['rclpy.serialization'].__dict__.update(
            deserialize_message=store.deserialize_cdr,
            serialize_message=lambda message: store.serialize_cdr(message, message.__msgtype__))
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    for module in (bags, writer):
        monkeypatch.setattr(module, 'find_spec', lambda name: None)
        monkeypatch.setattr(module, 'available', lambda: True)


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


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_both_writers_write_the_same(
        request: pytest.FixtureRequest, tmp_path: Path, storage: str) -> None:
    """Without rosbags, which no rosdep key has, simulate and import wrote no bag at all."""
    drive = streams()
    times = drive['wheels'].times
    drive |= {'voltage': TimeSeries(times, np.full((times.size, 1), 24.5), ('bus',)),
              'currents': TimeSeries(times, np.column_stack([times, -times]), ('left', 'right')),
              'wheel_angles': drive['wheels'], 'wheel_torques': drive['wheels']}
    wanted = read_recording(write_recording(tmp_path / 'one', drive, storage=storage))
    request.getfixturevalue('by_ros')
    other = write_recording(tmp_path / 'other', drive, storage=storage)
    request.getfixturevalue('monkeypatch').undo()
    found = read_recording(other)
    assert found.topics == wanted.topics
    assert set(found.streams) == set(wanted.streams) >= set(drive) - {'wheel_torques'}
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
    monkeypatch.setattr(bags, 'available', lambda: False)
    monkeypatch.setattr(extras, 'find_spec', lambda name: None)
    with pytest.raises(MissingExtraError, match=r'rosbags is needed to read recordings .*pip '
                       'install'):
        read_recording('anything.mcap')


@pytest.mark.parametrize('folder', [False, True])
def test_a_chunk_that_is_large_by_its_header_never_comes_to_rosbag2_py(
        request: pytest.FixtureRequest, tmp_path: Path, folder: bool) -> None:
    """It makes room for what the header says."""
    path = write_recording(tmp_path / 'bag', streams())
    file = path / 'bag.mcap'
    data = bytearray(file.read_bytes())
    place = next(place for code, place, _ in records(io.BytesIO(data), len(data)) if code == 0x06)
    data[place + 16:place + 24] = (6 * 10**9).to_bytes(8, 'little')
    file.write_bytes(data)
    request.getfixturevalue('by_ros')
    with pytest.raises(RecordingError, match='a chunk unpacks to 6000000000 bytes by its header'):
        read_recording(path if folder else file)
