# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A rosbag2 with the Husky's topics, written whole or not at all."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
import heapq
from importlib.util import find_spec
from os import PathLike, replace
from pathlib import Path
from typing import Any, TYPE_CHECKING

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.extras import require
from lg_husky_sim.folders import scratch_beside
from lg_husky_sim.recording.messages import Maker, Messages
from lg_husky_sim.recording.recording import check_stream
from lg_husky_sim.recording.rosbag2 import available, Rosbag2Output
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np

if TYPE_CHECKING:
    from rosbags.interfaces import Connection

Types = Mapping[str, Callable[..., Any]]
STORAGES = ('mcap', 'sqlite3')
START_NS = 1_700_000_000_000_000_000
"""Time zero of a recording that was never made on a clock; not 0, for a zero stamp means none."""


def write_recording(
    path: str | PathLike[str],
    streams: Mapping[str, TimeSeries],
    *,
    storage: str = 'mcap',
    start_ns: int = START_NS,
    frames: tuple[str, str] = ('odom', 'base_link'),
    overwrite: bool = False,
) -> Path:
    """
    Write a rosbag2.

    Streams go to ``/husky_velocity_controller/cmd_vel`` (TwistStamped), ``/joint_states`` (four
    wheels), ``/imu_um7/data``, ``/tf``, ``/left_driver_current``, ``/right_driver_current`` and
    ``/battery_state``. The bag appears at `path` complete, or not at all.

    Parameters
    ----------
    path : path-like
        Folder to make.
    streams : mapping of str to TimeSeries
        Some of ``recording.CHANNELS``, times [s] since `start_ns`. Angles and torques of the
        wheels are interpolated at the stamps of ``wheels``.
    storage : str
        ``mcap`` or ``sqlite3``.
    start_ns : int
        Time zero [ns].
    frames : tuple of str
        Parent and child frame of the pose.
    overwrite : bool
        Replace a rosbag2 that is at `path`; anything else there is never touched.

    Returns
    -------
    pathlib.Path
        The folder.

    Raises
    ------
    RecordingError
        If something is at `path` already, a stream is unknown or the storage is.
    MissingExtraError
        If neither `rosbags` nor ROS's `rosbag2_py` is installed.

    """
    for name, series in streams.items():
        check_stream(name, series)
    return _whole(Path(path), lambda types: Messages(types, frames).makers(streams), storage,
                  start_ns, overwrite)


def write_signals(
    path: str | PathLike[str],
    signals: Mapping[str, TimeSeries],
    poses: Mapping[str, TimeSeries],
    *,
    storage: str = 'mcap',
    start_ns: int = START_NS,
    frame: str = 'odom',
    overwrite: bool = False,
) -> Path:
    """
    Write a rosbag2 of plain signals, for tools that plot.

    Parameters
    ----------
    path : path-like
        Folder to make.
    signals : mapping of str to TimeSeries
        By topic (std_msgs/Float64), one channel each; times [s] since `start_ns`.
    poses : mapping of str to TimeSeries
        By topic (geometry_msgs/PoseStamped); names x, y [m], heading [rad].
    storage : str
        ``mcap`` or ``sqlite3``.
    start_ns : int
        Time zero [ns].
    frame : str
        Of the poses.
    overwrite : bool
        Replace a rosbag2 that is at `path`; anything else there is never touched.

    Returns
    -------
    pathlib.Path
        The folder.

    Raises
    ------
    RecordingError
        If something is at `path` already, or the storage is unknown.
    MissingExtraError
        If neither `rosbags` nor ROS's `rosbag2_py` is installed.

    """
    def makers(types: Types) -> list[Maker]:
        messages = Messages(types, (frame, ''))
        return [*(messages.number(topic, series) for topic, series in signals.items()),
                *(messages.posed(topic, series) for topic, series in poses.items())]
    return _whole(Path(path), makers, storage, start_ns, overwrite)


def _by_ros() -> bool:
    """Return whether ROS has to write, because the package rosbags is not there."""
    return find_spec('rosbags') is None and available()


def _whole(target: Path, makers: Callable[[Types], list[Maker]], storage: str,
           start_ns: int, overwrite: bool) -> Path:
    """Write a bag under another name first, so that it appears whole or not at all."""
    if storage not in STORAGES:
        raise RecordingError(f'storage {storage!r} is unknown; there are {", ".join(STORAGES)}')
    check_target(target, overwrite=overwrite)
    if not _by_ros():
        require('rosbags', 'write recordings')
    with scratch_beside(target) as scratch:
        made = scratch / target.name  # files inside a bag carry the bag's name
        _write(made, makers, storage, start_ns)
        if target.exists():
            check_target(target, overwrite=overwrite)
            replace(target, scratch / 'previous')
        replace(made, target)
    return target


def check_target(path: Path, *, overwrite: bool = False) -> None:
    """
    Check that a bag may be written at a path.

    Raises
    ------
    RecordingError
        If something is there, unless it is a rosbag2 and `overwrite` is set.

    """
    if not path.exists() and not path.is_symlink():
        return
    if not overwrite:
        raise RecordingError(f'{path} exists already; choose another name, or allow it to '
                             'be replaced (--overwrite, overwrite=True)')
    if not (path.is_dir() and (path / 'metadata.yaml').is_file()):
        raise RecordingError(f'{path} exists and is not a rosbag2, so it is not overwritten')


class _RosbagsOutput:
    # As Rosbag2Output, by the package rosbags.

    def __init__(self, path: Path, storage: str) -> None:
        from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
        from rosbags.typesys import get_typestore, Stores
        self._store = get_typestore(Stores.ROS2_JAZZY)
        self._writer = Writer(path, version=9, storage_plugin=StoragePlugin.MCAP
                              if storage == 'mcap' else StoragePlugin.SQLITE3)
        if storage == 'mcap':  # a fifth of the size; rosbag2 reads it as it is
            self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        self._connections: list[Connection] = []
        self.types: Types = self._store.types

    def __enter__(self) -> _RosbagsOutput:
        self._writer.open()
        return self

    def __exit__(self, *problem: object) -> None:
        self._writer.close()

    def add(self, topic: str, kind: str) -> None:
        self._connections.append(
            self._writer.add_connection(topic, kind, typestore=self._store))

    def write(self, place: int, stamp: int, message: Any) -> None:
        one = self._connections[place]
        self._writer.write(one, stamp, self._store.serialize_cdr(message, one.msgtype))


def _write(path: Path, makers: Callable[[Types], list[Maker]], storage: str, start_ns: int
           ) -> None:
    kind = Rosbag2Output if _by_ros() else _RosbagsOutput
    with kind(path, storage) as bag:
        made = makers(bag.types)
        for topic, name, _, _ in made:
            bag.add(topic, name)
        rows = [_rows(place, times, start_ns) for place, (_, _, times, _) in enumerate(made)]
        for stamp, place, index in heapq.merge(*rows):
            bag.write(place, stamp, made[place][3](index, stamp))


def _rows(place: int, times: FloatArray, start_ns: int) -> Iterator[tuple[int, int, int]]:
    """Yield (stamp [ns], place of the topic, place of the sample) in order of time."""
    stamps = start_ns + np.round(times * 1e9).astype(np.int64)
    if stamps.size and stamps[0] <= 0:
        raise RecordingError(
            f'time {times[0]:g} s before a start of {start_ns} ns gives a stamp that is not '
            'positive')
    for index, stamp in enumerate(stamps.tolist()):
        yield stamp, place, index
