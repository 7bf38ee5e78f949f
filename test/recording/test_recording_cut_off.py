# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A recorder that was killed: its whole chunks are read."""

from __future__ import annotations

from pathlib import Path
import struct

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.recording import read_recording, write_recording
from lg_husky_sim.recording.salvage import is_cut_off, MAGIC
from lg_husky_sim.signals import TimeSeries
import numpy as np
import pytest

pytest.importorskip('rosbags')

SAMPLES = 40_000
#: Records of MCAP by their code, and what begins each.
MESSAGE, CHUNK, MESSAGE_INDEX, DATA_END = 0x05, 0x06, 0x07, 0x0F
HEAD = struct.Struct('<BQ')


@pytest.fixture(scope='module')
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a bag of several chunks."""
    times = np.arange(SAMPLES) * np.float64(0.01)
    values = np.column_stack([np.arange(SAMPLES), times, times])
    return write_recording(tmp_path_factory.mktemp('cut') / 'bag', {
        'imu': TimeSeries(times, values, ('yaw_rate', 'accel_x', 'accel_y'))})


@pytest.mark.parametrize('share', [0.5, 0.8, 0.97])
@pytest.mark.parametrize('metadata', [True, False])
def test_a_cut_bag_is_read_up_to_its_last_whole_chunk(
        sound: Path, tmp_path: Path, share: float, metadata: bool) -> None:
    whole = (sound / 'bag.mcap').read_bytes()
    cut = tmp_path / 'bag'
    cut.mkdir()
    (cut / 'bag.mcap').write_bytes(whole[:round(share * len(whole))])
    if metadata:
        (cut / 'metadata.yaml').write_bytes((sound / 'metadata.yaml').read_bytes())
    before = (cut / 'bag.mcap').read_bytes()
    read = read_recording(cut)
    rates = read.streams['imu'].column('yaw_rate')
    np.testing.assert_array_equal(rates, np.arange(len(rates)))
    assert share - 0.35 < len(rates) / SAMPLES <= share + 0.1
    assert read.notes[0] == 'bag.mcap is truncated: read as far as it is complete'
    assert (cut / 'bag.mcap').read_bytes() == before
    np.testing.assert_array_equal(
        read_recording(cut / 'bag.mcap').streams['imu'].values, read.streams['imu'].values)


def test_a_whole_bag_is_read_as_it_is(sound: Path) -> None:
    assert not is_cut_off(sound / 'bag.mcap')
    assert len(read_recording(sound).streams['imu']) == SAMPLES
    assert not any('cut off' in note for note in read_recording(sound).notes)


@pytest.mark.parametrize('share', [0.02, 0.5])
def test_a_chunk_that_is_not_compressed_is_read_up_to_its_last_whole_message(
        sound: Path, tmp_path: Path, share: float) -> None:
    """As rosbag2 has them by default."""
    cut = tmp_path / 'bag.mcap'
    whole = uncompressed((sound / 'bag.mcap').read_bytes(), chunks=True)
    cut.write_bytes(whole[:round(share * len(whole))])
    rates = read_recording(cut).streams['imu'].column('yaw_rate')
    np.testing.assert_array_equal(rates, np.arange(len(rates)))
    assert share - 0.005 < len(rates) / SAMPLES < share + 0.005


def test_a_bag_that_is_cut_in_its_first_compressed_chunk_is_called_truncated(
        sound: Path, tmp_path: Path) -> None:
    cut = tmp_path / 'bag.mcap'
    cut.write_bytes((sound / 'bag.mcap').read_bytes()[:40_000])
    with pytest.raises(RecordingError, match=r'bag\.mcap is truncated: read as far as it is comp'):
        read_recording(cut)


def test_a_tool_for_repair_is_named_where_there_is_something_to_repair(
        sound: Path, tmp_path: Path) -> None:
    bag = tmp_path / 'bag'
    bag.mkdir()
    (bag / 'metadata.yaml').write_bytes((sound / 'metadata.yaml').read_bytes())
    with pytest.raises(RecordingError) as caught:
        read_recording(bag)
    assert 'may repair' not in str(caught.value)
    base = tmp_path / 'bag.db3'
    for content, words in ((b'', r'\(bag\.db3 is empty\)'),
                           (b'SQLite format 3\0' + bytes(5000), '`sqlite3 FILE.db3 .recover`')):
        base.write_bytes(content)
        with pytest.raises(RecordingError, match=words) as caught:
            read_recording(base)
        assert 'mcap' not in str(caught.value)


def test_a_bag_cut_before_its_first_chunk_is_refused_in_a_line(
        sound: Path, tmp_path: Path) -> None:
    cut = tmp_path / 'bag.mcap'
    for length in (8, 20, 60):
        cut.write_bytes((sound / 'bag.mcap').read_bytes()[:length])
        with pytest.raises(RecordingError, match=r'cannot (read|use) ') as caught:
            read_recording(cut)
        assert '\n' not in str(caught.value)


def uncompressed(data: bytes, *, chunks: bool) -> bytes:
    """Return an MCAP file without compression; without chunks, as rosbag2's `fastwrite` has it."""
    from rosbags.rosbag2.storage_mcap import decompress
    records = [MAGIC]
    place = len(MAGIC)
    while data[place] != DATA_END:
        code, length = HEAD.unpack_from(data, place)
        end = place + HEAD.size + length
        if code == CHUNK:
            body = data[place + HEAD.size:end]
            size, checksum, name = struct.unpack_from('<QII', body, 16)
            inner = decompress(body[40 + name:], body[32:32 + name].decode(), size, checksum)
            if chunks:
                records.append(HEAD.pack(CHUNK, 40 + len(inner)) + body[:28]
                               + struct.pack('<IQ', 0, len(inner)))
            records.append(inner)
        elif code != MESSAGE_INDEX:
            records.append(data[place:end])
        place = end
    return b''.join(records)


@pytest.mark.parametrize('left_over', [0, 1, 9, 40])
def test_messages_outside_of_chunks_are_read_up_to_the_last_whole_one(
        sound: Path, tmp_path: Path, left_over: int) -> None:
    """What a killed recorder leaves where rosbag2_py writes: no chunks, no index, no metadata."""
    whole = uncompressed((sound / 'bag.mcap').read_bytes(), chunks=False)
    cut = tmp_path / 'bag'
    cut.mkdir()
    # The rest of a message that did not get into the file.
    (cut / 'bag_0.mcap').write_bytes(
        whole + HEAD.pack(MESSAGE, 300)[:left_over] + bytes(max(0, left_over - HEAD.size)))
    rates = read_recording(cut).streams['imu'].column('yaw_rate')
    np.testing.assert_array_equal(rates, np.arange(SAMPLES))
