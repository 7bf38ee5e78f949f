# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Bags on disk: opened, listed and read message by message, by `rosbags` or by ROS itself."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
import tempfile
from typing import Any, TYPE_CHECKING

from lg_husky_sim.errors import LgHuskyError, RecordingError
from lg_husky_sim.extras import require
from lg_husky_sim.recording.rosbag2 import available, Rosbag2
from lg_husky_sim.recording.salvage import is_cut_off, salvage
from lg_husky_sim.recording.topics import Topic
from lg_husky_sim.recording.unpacking import BeyondLimitError, bounded, refuse_large_chunks
from lg_husky_sim.yaml_files import shown

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader

REPAIRS = {'.mcap': 'mcap recover', '.db3': 'sqlite3 FILE.db3 .recover', '.bag': 'rosbag reindex'}
"""Kinds of files that can be read, and the tools that repair them."""
SUFFIXES = tuple(REPAIRS)
LONGEST_REASON = 200
#: Largest stamp of 64 bits [ns].
LATEST = 2**63 - 1


class Bag:
    """An open bag."""

    def __init__(self, reader: AnyReader, notes: Sequence[str] = ()) -> None:
        self._reader = reader
        #: What had to be repaired to read it.
        self.notes = tuple(notes)

    def topics(self) -> tuple[Topic, ...]:
        """Return the topics of the bag; one of several types is there once for each."""
        counts: dict[tuple[str, str], int] = {}
        for connection in self._reader.connections:
            key = (connection.topic, connection.msgtype)
            counts[key] = counts.get(key, 0) + connection.msgcount
        return tuple(Topic(name, kind, count) for (name, kind), count in counts.items())

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
        places = {(topic.name, topic.kind): place for place, topic in enumerate(wanted)}
        connections = [connection for connection in self._reader.connections
                       if (connection.topic, connection.msgtype) in places]
        if not connections:
            return
        deserialize = self._reader.deserialize
        for connection, logged, raw in self._reader.messages(connections=connections):
            # A database holds anything in any column, and .mcap counts to twice as much.
            if not isinstance(logged, int) or logged > LATEST:
                raise ValueError(f'the log time {shown(logged)} is no number of nanoseconds')
            kind = connection.msgtype
            yield places[connection.topic, kind], logged, deserialize(raw, kind)


@contextmanager
def open_bag(path: Path) -> Iterator[Bag | Rosbag2]:
    """
    Open a bag: a rosbag2 folder, an .mcap or .db3 file, or a ROS 1 .bag file.

    Parameters
    ----------
    path : pathlib.Path
        Folder of a rosbag2, or a single file.

    Yields
    ------
    Bag

    Raises
    ------
    RecordingError
        If it is no bag, or it is damaged; whatever the library raises on damaged bytes while
        the bag is open becomes this error.
    MissingExtraError
        If neither `rosbags` nor ROS's `rosbag2_py` is installed.

    """
    by_ros = find_spec('rosbags') is None and available()
    if not by_ros:
        require('rosbags', 'read recordings')
    files = _files(path)
    try:
        with tempfile.TemporaryDirectory(prefix='lg_husky_') as scratch:
            whole, notes = _repaired(files, Path(scratch))
            if by_ros:
                for part in _parts(whole):
                    if part.suffix == '.mcap':
                        refuse_large_chunks(part)
                yield Rosbag2(whole, notes)
                return
            from rosbags.highlevel import AnyReader
            from rosbags.typesys import get_typestore, Stores
            reader = AnyReader(whole, default_typestore=get_typestore(Stores.ROS2_JAZZY))
            with bounded(reader):
                yield Bag(reader, notes)
    except LgHuskyError:
        raise
    except BeyondLimitError as error:
        raise RecordingError(f'cannot read {path}: {error}') from error
    except Exception as error:  # damaged bytes raise anything in the decoders below
        raise RecordingError(f'cannot read {path}: {_reason(error)}{_advice(files)}') from error


def bags_in(path: Path) -> list[Path]:
    """
    Return the bags that a path stands for.

    Parameters
    ----------
    path : pathlib.Path
        A bag, or a folder of bags.

    Returns
    -------
    list of pathlib.Path
        The bag itself, whether or not it can be read; of a folder that is no bag, those in it,
        sorted by name: rosbag2 folders, and ROS 1 files where there are several.

    """
    if not path.is_dir() or _is_bag2(path):
        return [path]
    parts = sorted(path.iterdir())
    ros1 = [part for part in parts if part.suffix == '.bag' and part.is_file()]
    inside = [part for part in parts if part.is_dir() and _is_bag2(part)]
    if len(ros1) > 1:
        inside = sorted([*inside, *ros1])
    return inside or [path]


def _is_bag2(folder: Path) -> bool:
    return (folder / 'metadata.yaml').is_file() or any(
        part.suffix in ('.mcap', '.db3') and part.is_file() for part in folder.iterdir())


def _files(path: Path) -> list[Path]:
    """Return what to open for a path that the user named."""
    if not path.exists():
        raise RecordingError(f'no recording {path}: there is no such file or folder')
    if path.is_dir():
        # rosbags takes whatever ends in .bag for a ROS 1 file, a folder too: give it the parts.
        if (path / 'metadata.yaml').is_file() and path.suffix != '.bag':
            return [path]
        parts = sorted(part for part in path.iterdir() if part.suffix in SUFFIXES)
        if len({part.suffix for part in parts}) == 1:
            return parts
        raise RecordingError(
            f'{path} is not a recording: a rosbag2 folder holds metadata.yaml or files of one '
            f'kind of {", ".join(SUFFIXES)}')
    if path.suffix not in SUFFIXES:
        raise RecordingError(
            f'{path} is not a recording: it is neither a rosbag2 folder nor a file '
            f'{", ".join(SUFFIXES)}')
    return [path]


def _parts(files: list[Path]) -> list[Path]:
    """Return the files that are meant, those of a folder if one is given."""
    return sorted(files[0].glob('*.mcap')) if files[0].is_dir() else files


def _repaired(files: list[Path], scratch: Path) -> tuple[list[Path], list[str]]:
    """Return what to open, with copies in place of .mcap files that were cut off."""
    parts = _parts(files)
    cut = [part for part in parts if part.suffix == '.mcap' and is_cut_off(part)]
    if not cut:
        return files, []
    whole = [salvage(part, scratch) if part in cut else part for part in parts]
    return whole, [f'{part.name} is truncated: read as far as it is complete' for part in cut]


def _reason(error: Exception) -> str:
    """Return the text of an error on one line, its type where it has none."""
    text = ' '.join(str(error).split())
    if len(text) > LONGEST_REASON:
        text = text[:LONGEST_REASON] + '…'
    kind = type(error).__name__
    return text if text and kind.endswith('ReaderError') else f'{kind} {text}'.strip()


def _advice(files: list[Path]) -> str:
    """Return how to repair a bag of this kind, as far as there is something to repair."""
    data = sorted(files[0].iterdir()) if files[0].is_dir() else files
    data = [part for part in data if part.suffix in REPAIRS]
    empty = [part.name for part in data if not part.stat().st_size]
    if empty:
        return f' ({", ".join(empty)} is empty)'
    return f' (`{REPAIRS[data[0].suffix]}` may repair it)' if data else ''
