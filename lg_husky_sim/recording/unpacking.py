# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Limits on what a bag unpacks to: `rosbags` itself has none.

A few bytes of zstd, lz4 or bz2 can be gigabytes of zeros, and a message definition is compiled.
While a bag is open, the functions of `rosbags` that unpack are replaced by ones that stop.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache, lru_cache, partial
from importlib import import_module
from pathlib import Path
import re
import struct
import sys
from threading import Lock
from types import SimpleNamespace
from typing import Any, TYPE_CHECKING

from lg_husky_sim.errors import SettingsError
from lg_husky_sim.recording.salvage import records
from lg_husky_sim.resources import config_path
from lg_husky_sim.yaml_files import LARGEST, read_yaml, refuse_bombs
import yaml

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader

#: Code of a chunk's record in MCAP, and its first and last time and its size when unpacked.
_CHUNK, _CHUNK_SIZE = 0x06, struct.Struct('<QQQ')
#: What is compiled as a block of numbers, whatever its size.
_NUMBERS = re.compile(
    r'(bool|boolean|byte|char|octet|short|long|unsigned|float|double|u?int(8|16|32|64)'
    r'|float(32|64))$')
#: A field of a fixed number of values, in .msg and in IDL.
_ARRAYS = (re.compile(r'^\s*([\w/]+)\[(\d+)\]', re.MULTILINE),
           re.compile(r'([\w:]+)\s+\w+\s*\[(\d+)\]'))
#: Lines of .msg that make no field.
_NO_FIELD = ('#', '=', 'MSG:')


class BeyondLimitError(Exception):
    """A part of a bag unpacks to more than is allowed; one line that says to how much."""


@cache
def reading_limits() -> Mapping[str, int]:
    """Return the limits of ``config/reading.yaml`` by name."""
    entries = read_yaml(config_path('reading.yaml'), SettingsError)['limits']
    return {name: int(entry['value']) for name, entry in entries.items()}


def _unpack(data: Any, opener: Callable[[], Any], most: int, what: str) -> bytes:
    """Unpack frames, one after the other, to a number of bytes at most."""
    parts: list[bytes] = []
    left = most
    rest = bytes(data)
    while rest:
        one = opener()
        parts.append(one.decompress(rest, left + 1))
        left -= len(parts[-1])
        if left < 0:
            raise BeyondLimitError(
                f'{what} of {len(data)} bytes unpacks to more than {most} bytes')
        if not one.eof:
            raise EOFError(f'{what} ends in the middle of its compressed data')
        rest = one.unused_data or b''
    return parts[0] if len(parts) == 1 else b''.join(parts)


def _chunk(opener: Callable[[], Any], data: bytes, size: int) -> bytes:
    """Unpack a chunk of MCAP, which says its size."""
    most = reading_limits()['unpacked_chunk']
    if size > most:
        raise BeyondLimitError(
            f'a chunk unpacks to {size} bytes by its header; {most} are allowed')
    return _unpack(data, opener, size, 'a chunk')


def _whole(opener: Callable[[], Any], what: str, data: bytes) -> bytes:
    return _unpack(data, opener, reading_limits()['unpacked_chunk'], what)


def refuse_large_chunks(path: Path) -> None:
    """
    Look at the sizes that the chunks of an .mcap file say to have, before anything is unpacked.

    For readers that make room for as much as a header says, such as ROS's own.

    Parameters
    ----------
    path : pathlib.Path
        The .mcap file; it is read, not changed.

    Raises
    ------
    BeyondLimitError
        If one is too large.

    """
    most = reading_limits()['unpacked_chunk']
    with path.open('rb') as file:
        for code, place, _ in records(file, file.seek(0, 2)):
            if code != _CHUNK:
                continue
            file.seek(place)
            head = file.read(_CHUNK_SIZE.size)
            if len(head) == _CHUNK_SIZE.size and (size := _CHUNK_SIZE.unpack(head)[2]) > most:
                raise BeyondLimitError(
                    f'a chunk unpacks to {size} bytes by its header; {most} are allowed')


class _File:
    """A compressed file that is read up to a limit."""

    def __init__(self, file: Any, size: int) -> None:
        limits = reading_limits()
        self._file, self._size = file, size
        self._most = max(limits['unpacked_file'], limits['unpacked_file_ratio'] * size)
        self._left = self._most

    def __enter__(self) -> _File:
        return self

    def __exit__(self, *problem: object) -> None:
        self._file.close()

    def read(self, count: int) -> bytes:
        """Return the next bytes."""
        data: bytes = self._file.read(count)
        self._left -= len(data)
        if self._left < 0:
            raise BeyondLimitError(
                f'a file of {self._size} bytes unpacks to more than {self._most} bytes')
        return data


def _opened(zstd: Any, file: Any, mode: str) -> _File:
    size = file.seek(0, 2)
    file.seek(0)
    return _File(zstd.open(file, mode), size)


def fields_of(text: str, *, idl: bool = False) -> int:
    """
    Return how many fields a message definition makes a reader compile.

    Parameters
    ----------
    text : str
        With all that it refers to.
    idl : bool
        Whether it is IDL and no .msg.

    """
    lines = (line.strip() for line in text.splitlines())
    count = text.count(';') if idl else sum(
        1 for line in lines if line and not line.startswith(_NO_FIELD))
    return count + sum(int(size) for kind, size in _ARRAYS[idl].findall(text)
                       if not _NUMBERS.match(kind))


class _Descriptions:
    """Parses what one bag says of its topics, within limits; each message definition once."""

    def __init__(self) -> None:
        self._fields = self._values = 0
        self._known: dict[tuple[str, ...], Any] = {}

    def yaml(self, read: Callable[[str], Any], text: str) -> Any:
        """Return what a text of YAML says."""
        most = reading_limits()['yaml_values']
        try:
            self._values += refuse_bombs(text, most)
        except yaml.YAMLError as error:
            reason = ' '.join(str(error).split())[:200]
            raise BeyondLimitError(f'the YAML of its topics is refused: {reason}') from error
        if self._values > most:
            raise BeyondLimitError(f'the YAML of its topics has more than {most} values')
        return read(text)

    def definition(self, parse: Callable[..., Any], idl: bool, text: str, *name: str) -> Any:
        """Return what a definition says."""
        if (text, *name) not in self._known:
            limits = reading_limits()
            count = fields_of(text, idl=idl)
            self._fields += count
            what = f'the definition of {name[0][:100]}' if name else 'a message definition'
            if count > limits['definition_fields']:
                raise BeyondLimitError(
                    f'{what} has {count} fields; {limits["definition_fields"]} are allowed')
            if self._fields > limits['definitions_fields']:
                raise BeyondLimitError(
                    f'the message definitions have more than {limits["definitions_fields"]} '
                    'fields together')
            self._known[text, *name] = parse(text, *name)
        return self._known[text, *name]


def _sqlite(apsw: Any) -> SimpleNamespace:
    """Return SQLite for bags: values as large as a chunk at most, and none that is computed."""

    class Connection(apsw.Connection):  # type: ignore[misc]
        def __init__(self, *words: Any, **names: Any) -> None:
            super().__init__(*words, **names)
            self.limit(apsw.SQLITE_LIMIT_LENGTH, reading_limits()['unpacked_chunk'])
            for table, kind, text in self.execute('SELECT name, type, sql FROM sqlite_master'):
                if kind == 'table' and ' '.join(str(text).split()).upper().startswith(
                        'CREATE VIRTUAL'):
                    raise BeyondLimitError(f'the table {table[:100]!r} is virtual')
                # 2 and 3: generated, virtual or stored.
                if any(row[0] in (2, 3) for row in self.execute(
                        'SELECT hidden FROM pragma_table_xinfo(?)', (table,))):
                    raise BeyondLimitError(f'the table {table[:100]!r} has a computed column')

    return SimpleNamespace(**{**vars(apsw), 'Connection': Connection})


@lru_cache(maxsize=1)
def _replacements() -> tuple[tuple[Any, str, Any], ...]:
    """Return mappings or modules of rosbags, names in them, and what to put there."""
    import bz2
    lz4: Any = import_module('lz4.frame')
    zstd: Any = import_module('compression.zstd' if sys.version_info >= (3, 14)
                              else 'backports.zstd')
    found: list[tuple[Any, str, Any]] = []
    chunks = getattr(import_module('rosbags.rosbag2.storage_mcap'), 'DECOMPRESSORS', {})
    found += [(chunks, 'zstd', partial(_chunk, zstd.ZstdDecompressor)),
              (chunks, 'lz4', partial(_chunk, lz4.LZ4FrameDecompressor))]
    old = getattr(import_module('rosbags.rosbag1.reader'), 'decompressors', {})
    found += [(old, 'bz2', partial(_whole, bz2.BZ2Decompressor, 'a chunk')),
              (old, 'lz4', partial(_whole, lz4.LZ4FrameDecompressor, 'a chunk'))]
    found.append((vars(import_module('rosbags.rosbag2.reader')), 'zstd', SimpleNamespace(
        decompress=partial(_whole, zstd.ZstdDecompressor, 'a message'),
        open=partial(_opened, zstd))))
    base = vars(import_module('rosbags.rosbag2.storage_sqlite3'))
    if 'apsw' in base:
        found.append((base, 'apsw', _sqlite(base['apsw'])))
    # What another version of rosbags does not have cannot be replaced.
    return tuple(entry for entry in found if entry[1] in entry[0])


class _Replaced:
    """Keeps the functions replaced as long as anybody reads."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._readers = 0
        self._before: list[tuple[Any, str, Any]] = []

    def __enter__(self) -> None:
        with self._lock:
            self._readers += 1
            if self._readers == 1:
                for where, name, function in _replacements():
                    self._before.append((where, name, where[name]))
                    where[name] = function

    def __exit__(self, *problem: object) -> None:
        with self._lock:
            self._readers -= 1
            if self._readers == 0:
                while self._before:
                    where, name, function = self._before.pop()
                    where[name] = function


_REPLACED = _Replaced()
_OPENING = Lock()


def _parsers() -> list[tuple[dict[str, Any], str, Any]]:
    """Return what parses texts of a bag: modules of rosbags, names in them, and functions."""
    names = {'rosbags.highlevel.anyreader': ('get_types_from_msg', 'get_types_from_idl'),
             'rosbags.rosbag2.storage_mcap': ('parse_qos',),
             'rosbags.rosbag2.storage_sqlite3': ('parse_qos',)}
    return [(vars(import_module(module)), name, vars(import_module(module))[name])
            for module, wanted in names.items() for name in wanted
            if name in vars(import_module(module))]


def _refuse_metadata(path: Any, said: _Descriptions) -> None:
    """Look at a bag's metadata.yaml before the reader of rosbags, which takes long."""
    file = path / 'metadata.yaml'
    if not file.is_file():
        return
    size = file.stat().st_size
    if size > LARGEST:
        raise BeyondLimitError(f'metadata.yaml has {size} bytes; {LARGEST} are allowed')
    said.yaml(str, file.read_text(encoding='utf-8'))


@contextmanager
def bounded(reader: AnyReader) -> Iterator[None]:
    """
    Open a reader of rosbags and keep what it unpacks within limits.

    Parameters
    ----------
    reader : rosbags.highlevel.AnyReader
        Not open yet; closed at the end.

    Raises
    ------
    BeyondLimitError
        When it is opened, or later while it is read.

    """
    with _REPLACED:
        said = _Descriptions()
        with _OPENING:
            before = _parsers()
            try:
                for where, name, parse in before:
                    where[name] = partial(said.yaml, parse) if name == 'parse_qos' else partial(
                        said.definition, parse, name.endswith('idl'))
                for path in reader.paths:
                    _refuse_metadata(path, said)
                reader.open()
            finally:
                for where, name, parse in before:
                    where[name] = parse
        try:
            _refuse_overlap(reader)
            yield
        finally:
            reader.close()


def _refuse_overlap(reader: AnyReader) -> None:
    """Refuse .mcap files with too much in chunks that have to be open at a time."""
    most = reading_limits()['overlapping_chunks']
    for one in reader.readers:
        storage: Any = getattr(one, 'storage', None)
        for part in getattr(storage, 'storages', [storage]):
            # As the reader does: a chunk is open from its first message to its last.
            events = sorted(event for chunk in getattr(part, 'chunks', ()) for event in (
                (chunk.message_start_time, 0, chunk.uncompressed_size),
                (max(chunk.message_start_time, chunk.message_end_time), 1,
                 -chunk.uncompressed_size)))
            together = 0
            for _, _, size in events:
                together += size
                if together > most:
                    raise BeyondLimitError(
                        'chunks that overlap in time unpack to more than '
                        f'{most} bytes together')
