# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Bags read and written by ROS's own rosbag2_py, where the package rosbags is not installed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.recording.topics import Topic
import numpy as np

#: Storage of a file by its suffix; a folder says its own.
_STORAGES = {'.mcap': 'mcap', '.db3': 'sqlite3'}


def available() -> bool:
    """Return whether ROS is there with its bags and its messages."""
    return all(find_spec(name) is not None
               for name in ('rosbag2_py', 'rclpy', 'rosidl_runtime_py'))


class Rosbag2:
    """
    An open rosbag2.

    Parameters
    ----------
    files : sequence of pathlib.Path
        A folder with metadata, or files of one bag in their order.
    notes : sequence of str
        What had to be repaired to read it.

    Raises
    ------
    RecordingError
        If it is a bag of ROS 1.

    """

    def __init__(self, files: Sequence[Path], notes: Sequence[str] = ()) -> None:
        """Look what topics there are."""
        if any(path.suffix == '.bag' and path.is_file() for path in files):
            raise RecordingError('bags of ROS 1 need the package rosbags: pip install rosbags')
        self._rosbag2: Any = import_module('rosbag2_py')
        self._files = tuple(files)
        self.notes = tuple(notes)
        counts: dict[tuple[str, str], int] = {}
        for path in self._files:
            for entry in self._open(path).get_metadata().topics_with_message_count:
                key = (entry.topic_metadata.name, entry.topic_metadata.type)
                counts[key] = counts.get(key, 0) + entry.message_count
        self._topics = tuple(Topic(name, kind, count) for (name, kind), count in counts.items())

    def _open(self, path: Path) -> Any:
        reader = self._rosbag2.SequentialReader()
        reader.open(
            self._rosbag2.StorageOptions(uri=str(path), storage_id=_STORAGES.get(path.suffix, '')),
            self._rosbag2.ConverterOptions('cdr', 'cdr'))
        return reader

    def topics(self) -> tuple[Topic, ...]:
        """Return the topics of the bag."""
        return self._topics

    def messages(self, wanted: Sequence[Topic]) -> Iterator[tuple[int, int, Any]]:
        """
        Yield the messages of some topics; no other is decoded.

        Yields
        ------
        place : int
            Place of the topic in `wanted`.
        logged : int
            Log time [ns].
        message : object
            With the fields of its ROS type.

        """
        places = {topic.name: place for place, topic in enumerate(wanted)}
        find: Any = import_module('rosidl_runtime_py.utilities').get_message
        decode: Any = import_module('rclpy.serialization').deserialize_message
        kinds = {topic.name: find(topic.kind) for topic in wanted}
        for path in self._files:
            reader = self._open(path)
            reader.set_filter(self._rosbag2.StorageFilter(topics=list(places)))
            while reader.has_next():
                name, raw, logged = reader.read_next()
                yield places[name], logged, decode(raw, kinds[name])


class RosTypes(Mapping[str, Callable[..., Any]]):
    """ROS's message classes, made from their fields in order as those of rosbags are."""

    def __init__(self) -> None:
        """Know none yet."""
        self._classes: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Callable[..., Any]:
        """Return what makes a message of a type."""
        if name not in self._classes:
            self._classes[name] = import_module('rosidl_runtime_py.utilities').get_message(name)
        kind = self._classes[name]
        fields = tuple(kind.get_fields_and_field_types())

        def make(*values: Any) -> Any:
            # Sequences take lists and no arrays; arrays of a fixed size take both.
            plain = (one.tolist() if isinstance(one, np.ndarray) else one for one in values)
            return kind(**dict(zip(fields, plain, strict=True)))
        return make

    def __iter__(self) -> Iterator[str]:
        """Return those that were asked for."""
        return iter(self._classes)

    def __len__(self) -> int:
        """Return how many those are."""
        return len(self._classes)


class Rosbag2Output:
    """
    A rosbag2 that is written; use it as a context.

    Parameters
    ----------
    path : pathlib.Path
        Folder to make.
    storage : str
        ``mcap`` or ``sqlite3``.

    """

    def __init__(self, path: Path, storage: str) -> None:
        """Open it."""
        self._rosbag2: Any = import_module('rosbag2_py')
        self._serialise: Any = import_module('rclpy.serialization').serialize_message
        self._writer = self._rosbag2.SequentialWriter()
        self._writer.open(
            self._rosbag2.StorageOptions(
                uri=str(path), storage_id=storage,
                storage_preset_profile='zstd_fast' if storage == 'mcap' else ''),
            self._rosbag2.ConverterOptions('cdr', 'cdr'))
        self._topics: list[str] = []
        self.types = RosTypes()

    def __enter__(self) -> Rosbag2Output:
        """Return itself."""
        return self

    def __exit__(self, *problem: object) -> None:
        """Complete the bag."""
        self._writer.close()

    def add(self, topic: str, kind: str) -> None:
        """Tell of a topic before its first message."""
        self._writer.create_topic(self._rosbag2.TopicMetadata(
            id=len(self._topics), name=topic, type=kind, serialization_format='cdr'))
        self._topics.append(topic)

    def write(self, place: int, stamp: int, message: Any) -> None:
        """Append a message to the topic that was added at a place, with its log time [ns]."""
        self._writer.write(self._topics[place], bytes(self._serialise(message)), stamp)
