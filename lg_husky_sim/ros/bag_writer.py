# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A rosbag2 that is on disk while it grows: by rosbag2_py where ROS has it, else by rosbags."""

from __future__ import annotations

import ctypes
from importlib import import_module
from importlib.util import find_spec
import json
import os
from pathlib import Path
import shutil
import tempfile
from typing import Any, Final, Protocol

from lg_husky_sim.errors import MissingExtraError, RecordingError
from lg_husky_sim.ros import api

STORAGES = ('mcap', 'sqlite3')
#: What rosbag2 writes of a publisher that offers what it said last, deep enough for the transforms
#: of several nodes, which a player sends by one publisher; durations are unspecified.
LATCHED = """\
- history: keep_last
  depth: 100
  reliability: reliable
  durability: transient_local
  deadline: {sec: 0, nsec: 0}
  lifespan: {sec: 0, nsec: 0}
  liveliness: automatic
  liveliness_lease_duration: {sec: 0, nsec: 0}
  avoid_ros_namespace_conventions: false
"""
#: Version of the metadata that has these as words.
_VERSION: Final = 9
#: Loggers that warn where a bag without an index is read.
_WARNING = ('rosbag2_storage_mcap', 'rosbag2_cpp')


def latched(topic: str) -> bool:
    """
    Return whether players must offer what was said before (durability transient local).

    Transforms that stand still are asked for that way by every listener of tf, and from a
    publisher that does not offer it nothing comes; all else is heard from any publisher.
    """
    return topic.rpartition('/')[2] == 'tf_static'


def _latched_of_rosbags() -> Any:
    from rosbags import interfaces as of
    never = of.QosTime(0, 0)
    return of.Qos(of.QosHistory.KEEP_LAST, 100, of.QosReliability.RELIABLE,
                  of.QosDurability.TRANSIENT_LOCAL, never, never, of.QosLiveliness.AUTOMATIC,
                  never, avoid_ros_namespace_conventions=False)


class BagWriter(Protocol):
    """What a recorder needs of a bag."""

    def add(self, topic: str, kind: str) -> None:
        """Tell of a topic before its first message."""

    def write(self, topic: str, nanoseconds: int, raw: bytes) -> None:
        """Append a message as CDR, with the time at which it arrived [ns]."""

    def flush(self) -> None:
        """Have everything written so far in the file, whatever becomes of this process."""

    def close(self) -> None:
        """Complete the bag."""


class Rosbag2Writer:
    """
    ROS's own writer.

    Parameters
    ----------
    path : Path
    storage : str

    """

    def __init__(self, path: Path, storage: str) -> None:
        """Open the bag."""
        self._module = rosbag2_py = import_module('rosbag2_py')
        self._path = path
        self._writer = rosbag2_py.SequentialWriter()
        # Neither cache nor chunks: each message is in the file within a few kilobytes. The
        # preset of that name means other things to sqlite3, whose default is safe already.
        preset = 'fastwrite' if storage == 'mcap' else ''
        self._writer.open(
            rosbag2_py.StorageOptions(uri=str(path), storage_id=storage, max_cache_size=0,
                                      storage_preset_profile=preset),
            rosbag2_py.ConverterOptions('cdr', 'cdr'))
        self._count = 0
        self._mcap = storage == 'mcap'
        self._buffered = self._mcap and os.name == 'posix'

    def add(self, topic: str, kind: str) -> None:
        """Tell of a topic before its first message."""
        offered = (self._module.to_rclcpp_qos_vector(LATCHED, _VERSION) if latched(topic)
                   else [])
        self._writer.create_topic(self._module.TopicMetadata(
            id=self._count, name=topic, type=kind, serialization_format='cdr',
            offered_qos_profiles=offered))
        self._count += 1

    def write(self, topic: str, nanoseconds: int, raw: bytes) -> None:
        """Append a message."""
        self._writer.write(topic, raw, nanoseconds)

    def flush(self) -> None:
        """Have what C keeps of a file of mcap written: 4096 bytes are minutes of a slow topic."""
        if self._buffered:
            ctypes.CDLL(None).fflush(None)

    def close(self) -> None:
        """Complete the bag; chunks and an index, which take no flush, come into it now."""
        self._writer.close()
        if self._mcap:
            indexed(self._path)


def indexed(path: Path) -> None:
    """
    Give a closed bag of mcap an index, with which players and viewers jump to any time.

    The bag is written anew beside itself, at some 400 MB/s, and takes the place of the old one
    when it is whole. Where that fails, the old one stays, which can be read as well; a warning
    says why.

    Parameters
    ----------
    path : Path
        Folder of the bag.

    """
    logging, bags = import_module('rclpy.logging'), import_module('rosbag2_py')
    # They warn of the missing index, which is what this is for.
    for name in _WARNING:
        logging.set_logger_level(name, logging.LoggingSeverity.ERROR)
    try:
        if shutil.disk_usage(path).free < 2 * sum(
                one.stat().st_size for one in path.glob('*.mcap')):
            raise RecordingError('the disk is too full')
        with tempfile.TemporaryDirectory(prefix='.index-', dir=path) as folder:
            new, wanted = Path(folder) / path.name, Path(folder) / 'wanted.yaml'
            wanted.write_text(json.dumps({'output_bags': [{
                'uri': str(new), 'storage_id': 'mcap', 'all_topics': True,
                'include_hidden_topics': True}]}), encoding='utf-8')
            bags.bag_rewrite([bags.StorageOptions(uri=str(path), storage_id='mcap')], str(wanted))
            if _messages(path) != _messages(new):
                raise RecordingError('it could not be written anew')
            for one in new.iterdir():
                one.replace(path / one.name)
    except (RecordingError, RuntimeError, OSError) as error:
        logging.get_logger('lg_husky_recorder').warning(
            f'{path} has no index: {error}')
    finally:
        for name in _WARNING:
            logging.set_logger_level(name, logging.LoggingSeverity.UNSET)


def _messages(folder: Path) -> dict[str, int]:
    # How many there are in each file, by what stands at its end.
    bags = import_module('rosbag2_py')
    counts = {}
    for one in folder.glob('*.mcap'):
        reader = bags.SequentialReader()
        reader.open(bags.StorageOptions(uri=str(one), storage_id='mcap'),
                    bags.ConverterOptions('cdr', 'cdr'))
        counts[one.name] = int(reader.get_metadata().message_count)
    return counts


class RosbagsWriter:
    """
    The writer of the package rosbags.

    Parameters
    ----------
    path : Path
    kind : str
        ``mcap`` or ``sqlite3``.

    """

    def __init__(self, path: Path, kind: str) -> None:
        """Open the bag."""
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import get_typestore, Stores
        self._store = get_typestore(Stores.ROS2_JAZZY)
        plugin = StoragePlugin.MCAP if kind == 'mcap' else StoragePlugin.SQLITE3
        self._writer: Any = Writer(path, version=_VERSION, storage_plugin=plugin)
        self._writer.open()
        self._mcap = kind == 'mcap'
        if not self._mcap:
            # Pages go into the file with a commit only: a killed process leaves a whole file.
            storage: Any = self._writer.storage
            storage.conn.execute('PRAGMA cache_spill = OFF')
        self._connections: dict[str, Any] = {}

    def add(self, topic: str, kind: str) -> None:
        """Tell of a topic before its first message."""
        self._connections[topic] = self._writer.add_connection(
            topic, kind, typestore=self._store,
            offered_qos_profiles=[_latched_of_rosbags()] if latched(topic) else [])

    def write(self, topic: str, nanoseconds: int, raw: bytes) -> None:
        """Append a message."""
        self._writer.write(self._connections[topic], nanoseconds, raw)

    def flush(self) -> None:
        """Close the chunk or the transaction."""
        storage = self._writer.storage
        if not self._mcap:
            storage.conn.commit()
        elif storage.chunk.msgs:
            storage.close_chunk()
            storage.bio.flush()

    def close(self) -> None:
        """Complete the bag."""
        self._writer.close()


def check(path: Path, storage: str) -> None:
    """
    Check whether a new bag can be opened.

    Parameters
    ----------
    path : Path
        Folder to make.
    storage : str
        ``mcap`` or ``sqlite3``.

    Raises
    ------
    RecordingError
        If something is at the path, or the storage is unknown.
    MissingExtraError
        If nothing is installed that writes bags.

    """
    if storage not in STORAGES:
        raise RecordingError(f'storage {storage!r} is unknown; there are {", ".join(STORAGES)}')
    if path.exists() or path.is_symlink():
        raise RecordingError(f'{path} exists already; choose another name or remove it')
    if not _by_ros() and find_spec('rosbags') is None:
        tail = (' or sudo apt install ros-jazzy-rosbag2-py ros-jazzy-rosbag2-storage-mcap'
                if api.HAVE_RCLPY else '')
        raise MissingExtraError(
            f'nothing is installed that writes recordings: pip install rosbags{tail}')


def _by_ros() -> bool:
    return api.HAVE_RCLPY and find_spec('rosbag2_py') is not None


def bag_writer(path: Path, storage: str) -> BagWriter:
    """Open a new bag at a path, by one of the storages, after :func:`check`."""
    check(path, storage)
    path.parent.mkdir(parents=True, exist_ok=True)
    return Rosbag2Writer(path, storage) if _by_ros() else RosbagsWriter(path, storage)
