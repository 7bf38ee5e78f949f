# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Bags of some kB that unpack to gigabytes, or compile for minutes, are refused in one line."""

from __future__ import annotations

from contextlib import closing
from importlib import import_module
from pathlib import Path
import re
import sqlite3
import struct
import time
from typing import Any

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.recording import read_recording, unpacking
from lg_husky_sim.recording.bags import open_bag
from lg_husky_sim.recording.unpacking import fields_of, reading_limits
import numpy as np
import pytest

pytest.importorskip('rosbags')

MAGIC = b'\x89MCAP0\r\n'
HEADER, FOOTER, SCHEMA, CHANNEL, CHUNK, CHUNK_INDEX, STATISTICS, DATA_END = (
    0x01, 0x02, 0x03, 0x04, 0x06, 0x08, 0x0B, 0x0F)
#: Quality of service as rosbag2 describes it.
QOS = ('history: 1, depth: 1, reliability: 1, durability: 2, deadline: {sec: 0, nsec: 0}, '
       'lifespan: {sec: 0, nsec: 0}, liveliness: 1, liveliness_lease_duration: {sec: 0, nsec: 0}, '
       'avoid_ros_namespace_conventions: false')
#: Longest that a refusal may take [s of processor].
LONGEST = 10.0


def text(value: str) -> bytes:
    """Return a string as MCAP writes it."""
    return struct.pack('<I', len(value)) + value.encode()


def record(code: int, content: bytes) -> bytes:
    """Return a record of MCAP."""
    return struct.pack('<BQ', code, len(content)) + content


def packed(kind: str, data: bytes) -> bytes:
    """Compress."""
    if kind == 'lz4':
        return bytes(import_module('lz4.frame').compress(data))
    zstd = pytest.importorskip('backports.zstd')
    return bytes(zstd.compress(data))


def chunk(kind: str, data: bytes, size: int) -> bytes:
    """Return a chunk that says to have a size [bytes]."""
    content = packed(kind, data)
    return record(CHUNK, struct.pack('<QQQI', 0, 9, size, 0) + text(kind)
                  + struct.pack('<Q', len(content)) + content)


def mcap(path: Path, body: bytes, summary: bytes = b'') -> Path:
    """Write an .mcap file."""
    begin = MAGIC + record(HEADER, text('ros2') + text('')) + body + record(DATA_END, bytes(4))
    start = len(begin) if summary else 0
    path.write_bytes(begin + summary + record(FOOTER, struct.pack('<QQI', start, 0, 0)) + MAGIC)
    return path


def refusal(path: Path) -> str:
    """Return why a bag is refused, once it was in time."""
    begun = time.process_time()
    with pytest.raises(RecordingError) as caught:
        read_recording(path)
    assert time.process_time() - begun < LONGEST
    said = str(caught.value)
    assert said.startswith(f'cannot read {path}: ')
    assert '\n' not in said
    return said.removeprefix(f'cannot read {path}: ')


@pytest.mark.parametrize('kind', ['zstd', 'lz4'])
def test_a_chunk_that_is_large_by_its_header_is_not_unpacked(tmp_path: Path, kind: str) -> None:
    most = reading_limits()['unpacked_chunk']
    path = mcap(tmp_path / 'b.mcap', chunk(kind, bytes(1000), 6 * 10**9))
    assert refusal(path) == (
        f'a chunk unpacks to 6000000000 bytes by its header; {most} are allowed')
    path = mcap(tmp_path / 'b.mcap', chunk(kind, bytes(1000), most + 1))
    assert f'a chunk unpacks to {most + 1} bytes by its header' in refusal(path)


@pytest.mark.parametrize('kind', ['zstd', 'lz4'])
def test_a_chunk_that_is_larger_than_its_header_says_is_left(tmp_path: Path, kind: str) -> None:
    path = mcap(tmp_path / 'b.mcap', chunk(kind, bytes(10**9), 5000))
    assert path.stat().st_size < 5_000_000
    assert re.fullmatch(r'a chunk of \d+ bytes unpacks to more than 5000 bytes', refusal(path))


def test_chunks_that_overlap_are_counted_together(tmp_path: Path) -> None:
    """The reader opens all that begin before the first ends; one after the other may be any."""
    most = reading_limits()['unpacked_chunk']
    whole = chunk('zstd', b'', 0)
    topics = record(SCHEMA, struct.pack('<H', 1) + text('std_msgs/msg/Bool') + text('ros2msg')
                    + text('bool data\n')) + record(
        CHANNEL, struct.pack('<HH', 1, 1) + text('/x') + text('cdr') + struct.pack('<I', 0))
    statistics = record(STATISTICS, struct.pack('<QHIIIIQQI', 0, 1, 1, 0, 0, 9, 0, 9, 0))

    def index(first: int, last: int) -> bytes:
        return record(CHUNK_INDEX, struct.pack('<QQQQIQ', first, last, 30, len(whole), 0, 0)
                      + text('zstd') + struct.pack('<QQ', 9, most))
    together = b''.join(index(0, 9) for _ in range(5))
    path = mcap(tmp_path / 'b.mcap', whole, topics + together + statistics)
    assert refusal(path) == ('chunks that overlap in time unpack to more than '
                             f'{reading_limits()["overlapping_chunks"]} bytes together')
    # Who says that it ends before it begins takes nothing off the others.
    backwards = b''.join(index(9, 0) for _ in range(5))
    assert refusal(mcap(path, whole, topics + backwards + statistics)).startswith('chunks that')
    later = b''.join(index(10 * k, 10 * k + 9) for k in range(5))
    with pytest.raises(RecordingError, match='no usable messages'):
        read_recording(mcap(path, whole, topics + later + statistics))


def squeeze(monkeypatch: pytest.MonkeyPatch, **limits: int) -> None:
    """Set limits that a small bag reaches."""
    values = {**reading_limits(), **limits}
    monkeypatch.setattr(unpacking, 'reading_limits', lambda: values)


def driven(writer: Any) -> Any:
    """Add two seconds of commands and wheels; the first command has a long text."""
    for place in range(40):
        moment = 0.05 * (place + 1)
        writer.twist(moment, 0.5, 0.2, stamp=moment)
        writer.joints(moment, ('left_wheel', 'right_wheel'), (2.0, 3.0), (moment, moment))
    writer.rows[0][3].header.frame_id = 'x' * 20_000
    return writer


def written(drive: Any, path: Path, mode: str, storage: str) -> Path:
    """Write a bag that rosbags compresses."""
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
    writer: Any
    if storage == 'ros1':
        writer = Writer1(path)
        writer.set_compression(Writer1.CompressionFormat[mode])
        serialise = drive.store.serialize_ros1
    else:
        writer = Writer(path, version=9, storage_plugin=StoragePlugin[storage])
        writer.set_compression(CompressionMode[mode], CompressionFormat.ZSTD)
        serialise = drive.store.serialize_cdr
    topics: dict[str, Any] = {}
    with writer:
        for topic, kind, logged, message in drive.rows:
            if topic not in topics:
                topics[topic] = writer.add_connection(topic, kind, typestore=drive.store)
            writer.write(topics[topic], logged, serialise(message, kind))
    return path


@pytest.mark.parametrize(('storage', 'mode', 'limits', 'said'), [
    ('MCAP', 'STORAGE', {'unpacked_chunk': 900},
     r'a chunk unpacks to \d+ bytes by its header; 900 are allowed$'),
    ('MCAP', 'MESSAGE', {'unpacked_chunk': 10_000},
     r'a message of \d+ bytes unpacks to more than 10000 bytes$'),
    ('SQLITE3', 'MESSAGE', {'unpacked_chunk': 10_000},
     r'a message of \d+ bytes unpacks to more than 10000 bytes$'),
    ('SQLITE3', 'FILE', {'unpacked_file': 1000, 'unpacked_file_ratio': 1},
     r'a file of (\d+) bytes unpacks to more than \1 bytes$'),
    ('MCAP', 'FILE', {'unpacked_file': 1000, 'unpacked_file_ratio': 1},
     r'a file of (\d+) bytes unpacks to more than \1 bytes$'),
    ('ros1', 'BZ2', {'unpacked_chunk': 900},
     r'a chunk of \d+ bytes unpacks to more than 900 bytes$'),
    ('ros1', 'LZ4', {'unpacked_chunk': 900},
     r'a chunk of \d+ bytes unpacks to more than 900 bytes$'),
])
def test_every_way_to_compress_is_read_and_has_a_limit(
        bag_writer: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
        storage: str, mode: str, limits: dict[str, int], said: str) -> None:
    drive = driven(bag_writer('ros1' if storage == 'ros1' else 'mcap'))
    plain = read_recording(drive.write(
        tmp_path / ('plain.bag' if storage == 'ros1' else 'plain')))
    path = written(drive, tmp_path / ('b.bag' if storage == 'ros1' else 'b'), mode, storage)
    read = read_recording(path)
    assert set(read.streams) >= {'command', 'wheels'}
    for name, series in plain.streams.items():
        np.testing.assert_array_equal(read.streams[name].values, series.values)
    squeeze(monkeypatch, **limits)
    assert re.match(said, refusal(path))


def test_a_frame_that_is_cut_off_is_no_shorter_message() -> None:
    """What ends in the middle is an error, and two frames are one text."""
    frame = packed('lz4', b'abc' * 1000)
    opener = import_module('lz4.frame').LZ4FrameDecompressor
    assert unpacking._unpack(frame + frame, opener, 6000, 'x') == b'abc' * 2000
    with pytest.raises(EOFError, match='x ends in the middle of its compressed data'):
        unpacking._unpack(frame[:-8], opener, 6000, 'x')
    with pytest.raises(unpacking.BeyondLimitError, match='unpacks to more than 5999 bytes'):
        unpacking._unpack(frame + frame, opener, 5999, 'x')


def test_rosbags_is_left_as_it_was(bag_writer: Any, tmp_path: Path) -> None:
    """Whoever uses it for something else in this process has its own functions again."""
    anyreader, reader1, reader2, mcaps, bases = (import_module(f'rosbags.{name}') for name in (
        'highlevel.anyreader', 'rosbag1.reader', 'rosbag2.reader', 'rosbag2.storage_mcap',
        'rosbag2.storage_sqlite3'))

    def functions() -> list[object]:
        return [dict(mcaps.DECOMPRESSORS), dict(reader1.decompressors), reader2.zstd,
                anyreader.get_types_from_msg, anyreader.get_types_from_idl, mcaps.parse_qos,
                bases.parse_qos, bases.apsw]
    before = functions()
    path = driven(bag_writer()).write(tmp_path / 'b')
    with open_bag(path) as outer, open_bag(path) as inner:
        assert functions() != before
        assert inner.topics() == outer.topics()
    assert functions() == before
    with pytest.raises(RecordingError):
        read_recording(mcap(tmp_path / 'c.mcap', chunk('zstd', bytes(10), 10**10)))
    assert functions() == before


def defined(path: Path, *definitions: str) -> Path:
    """Write an .mcap file with a topic for each message definition."""
    body = b''.join(
        record(SCHEMA, struct.pack('<H', k) + text(f'p/msg/T{k}') + text('ros2msg')
               + text(definition))
        + record(CHANNEL, struct.pack('<HH', k, k) + text(f'/x{k}') + text('cdr')
                 + struct.pack('<I', 0))
        for k, definition in enumerate(definitions, 1))
    return mcap(path, body)


PART = f'{"=" * 80}\nMSG: p/E\nint8 y\n'


@pytest.mark.parametrize(('definition', 'fields'), [
    (''.join(f'int8 a{k}\n' for k in range(300_000)), 300_000),
    (''.join(f'int8 a{k}\n' for k in range(2001)), 2001),
    ('string[1000000] x\n', 1_000_001), (f'E[1000000] x\n{PART}', 1_000_002),
    (f'p/E[2000] x\n{PART}', 2002),
])
def test_a_definition_of_too_many_fields_is_refused(
        tmp_path: Path, definition: str, fields: int) -> None:
    assert refusal(defined(tmp_path / 'b.mcap', definition)) == (
        f'the definition of p/msg/T1 has {fields} fields; 2000 are allowed')


def test_definitions_are_counted_together_and_each_once(tmp_path: Path) -> None:
    def fields(name: str, count: int) -> str:
        return ''.join(f'int8 {name}{k}\n' for k in range(count))
    many = [fields(f'n{k}_', 1900) for k in range(11)]
    assert refusal(defined(tmp_path / 'b.mcap', *many)) == (
        'the message definitions have more than 20000 fields together')


def test_what_makes_a_field() -> None:
    said = '# none\n\nfloat64[36] covariance\nint8 X=1\nE[3] e # three\nstring<=5[<=9] names\n'
    assert fields_of(said + PART) == 4 + 3 + 2 - 1
    idl = 'module p { struct E { double y; }; typedef double v[36]; struct T { E e[3]; }; };'
    assert fields_of(idl, idl=True) == idl.count(';') + 3


def test_the_types_of_jazzy_are_far_from_the_limits() -> None:
    from rosbags.typesys import get_typestore, Stores
    store = get_typestore(Stores.ROS2_JAZZY)
    counts = [fields_of(store.generate_msgdef(name, ros_version=2)[0])
              for name in store.fielddefs]
    assert (len(counts), max(counts), sum(counts)) == (162, 112, 2403)


def test_yaml_of_many_values_is_refused_before_it_is_read(
        bag_writer: Any, tmp_path: Path) -> None:
    """The reader that rosbags uses takes 5 s for 150,000 values."""
    path = driven(bag_writer()).write(tmp_path / 'b')
    metadata = path / 'metadata.yaml'
    sound = metadata.read_text('utf-8')
    metadata.write_text(sound + 'x: [' + '1, ' * 150_000 + '1]\n', 'utf-8')
    assert refusal(path) == 'the YAML of its topics is refused: more than 100000 values'
    metadata.write_text(sound + '#' * 4_000_000, 'utf-8')
    assert re.fullmatch(r'metadata.yaml has 400\d{4} bytes; 4000000 are allowed', refusal(path))
    # Of two texts, each within the limit.
    metadata.write_text(sound + 'x: [' + '1, ' * 60_000 + '1]\n', 'utf-8')
    assert 'wheels' in read_recording(path).streams
    qos = text('offered_qos_profiles') + text(f'- {{{QOS}, x: [{"1, " * 60_000}1]}}')
    body = b''.join(
        record(SCHEMA, struct.pack('<H', k) + text('p/msg/T') + text('ros2msg') + text('int8 x\n'))
        + record(CHANNEL, struct.pack('<HH', k, k) + text(f'/x{k}') + text('cdr')
                 + struct.pack('<I', len(qos)) + qos) for k in (1, 2))
    assert refusal(mcap(tmp_path / 'c.mcap', body)) == (
        'the YAML of its topics has more than 100000 values')


@pytest.mark.parametrize(('change', 'said'), [
    ('ALTER TABLE topics ADD COLUMN x TEXT AS (name||name||name) VIRTUAL',
     "the table 'topics' has a computed column"),
    ('CREATE TABLE more(x INTEGER, y INTEGER AS (x+1) STORED)',
     "the table 'more' has a computed column"),
    ('CREATE VIRTUAL TABLE more USING fts5(x)', "the table 'more' is virtual"),
])
def test_a_database_that_computes_is_refused(
        bag_writer: Any, tmp_path: Path, change: str, said: str) -> None:
    """A column may be x||x of one before, which is x||x of another: rows of gigabytes."""
    path = driven(bag_writer('sqlite3')).write(tmp_path / 'b')
    with closing(sqlite3.connect(path / 'b.db3')) as base:
        base.execute(change)
        base.commit()
    assert refusal(path) == said


def test_a_value_of_a_database_is_as_large_as_a_chunk_at_most(
        bag_writer: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = driven(bag_writer('sqlite3')).write(tmp_path / 'b')
    squeeze(monkeypatch, unpacked_chunk=10_000)
    assert 'string or blob too big' in refusal(path)
