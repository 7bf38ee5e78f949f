# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Damaged bags: one line of error or a reading that makes sense, never a crash or a hang."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
import shutil
import sqlite3
import time
from typing import Any

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.recording import read_recording, segments
import numpy as np
import pytest

LONGEST = 2.0
"""No damaged bag may take more computing time than this [s]; a sound one takes milliseconds."""


def _attempt(path: Path) -> str:
    """Read a damaged bag; return 'refused' or 'read', and check either."""
    before = time.process_time()
    try:
        recording = read_recording(path)
        segments(recording)
    except RecordingError as error:
        message = str(error)
    else:
        for series in recording.streams.values():
            assert np.all(np.isfinite(series.values))
            assert np.all(np.diff(series.times) > 0.0)
        message = ''
    assert time.process_time() - before < LONGEST
    if not message:
        return 'read'
    assert '\n' not in message
    assert str(path) in message
    return 'refused'


def _storage(path: Path) -> Path:
    if path.is_file():
        return path
    return next(part for part in path.iterdir() if part.suffix in ('.mcap', '.db3'))


@pytest.mark.parametrize('kind', ['mcap', 'sqlite3', 'ros1'])
def test_cut_and_flipped_bags(kind: str, bag_writer: Any, tmp_path: Path) -> None:
    writer = bag_writer(kind)
    for k in range(8):
        t = 0.1 * (k + 1)
        writer.twist(t, 0.5, 0.2)
        writer.joints(t, ('left_wheel', 'right_wheel'), (1.0, 2.0))
        writer.transforms(t, [('odom', 'base_link', t, 0.0, 0.0)])
    path = writer.write(tmp_path / ('b.bag' if kind == 'ros1' else 'b'))
    storage = _storage(path)
    sound = storage.read_bytes()
    assert _attempt(path) == 'read'
    random = np.random.default_rng(20260101)
    outcomes = []
    for _ in range(60):
        storage.write_bytes(sound[:int(random.integers(0, len(sound)))])
        outcomes.append(_attempt(path))
    for _ in range(140):
        damaged = bytearray(sound)
        for place in random.integers(0, len(sound), size=int(random.integers(1, 12))):
            damaged[place] ^= 1 << int(random.integers(0, 8))
        storage.write_bytes(bytes(damaged))
        outcomes.append(_attempt(path))
    for _ in range(40):
        start, end = np.sort(random.integers(0, len(sound), size=2))
        damaged = bytearray(sound)
        damaged[start:end] = random.bytes(int(end - start))
        storage.write_bytes(bytes(damaged))
        outcomes.append(_attempt(path))
    assert outcomes.count('refused') > 100


def test_mutated_metadata(drive: Any, tmp_path: Path) -> None:
    path = drive.write(tmp_path / 'bag')
    metadata = path / 'metadata.yaml'
    sound = metadata.read_text()
    random = np.random.default_rng(7)
    lines = sound.splitlines()
    outcomes = []
    for trial in range(60):
        damaged = list(lines)
        place = int(random.integers(0, len(lines)))
        match trial % 5:
            case 0:
                del damaged[place]
            case 1:
                damaged[place] = damaged[place].split(':')[0] + ': [1, {a: b}]'
            case 2:
                damaged[place] = damaged[place].split(':')[0] + ': -9223372036854775809'
            case 3:
                damaged[place] += ' : : {'
            case _:
                damaged = damaged[:place]
        metadata.write_text('\n'.join(damaged))
        outcomes.append(_attempt(path))
    assert outcomes.count('refused') > 20


def test_metadata_may_not_run_code(drive: Any, tmp_path: Path) -> None:
    path = drive.write(tmp_path / 'bag')
    trap = tmp_path / 'trap'
    (path / 'metadata.yaml').write_text(
        f"!!python/object/apply:os.mkdir ['{trap}']\n")
    assert _attempt(path) == 'refused'
    assert not trap.exists()


def test_a_bag_whose_file_is_missing(drive: Any, tmp_path: Path) -> None:
    path = drive.write(tmp_path / 'bag')
    _storage(path).unlink()
    assert _attempt(path) == 'refused'
    shutil.rmtree(path)
    with pytest.raises(RecordingError, match='no such file'):
        read_recording(path)


@pytest.mark.parametrize('stamp', [b'\x17', 'soon', 1.5])
def test_a_log_time_that_is_no_number_is_shown(
        bag_writer: Any, tmp_path: Path, stamp: object) -> None:
    """A database keeps texts, bytes and fractions in a column of whole numbers."""
    writer = bag_writer('sqlite3')
    for k in range(8):
        writer.twist(0.1 * (k + 1), 0.5, 0.2)
    path = writer.write(tmp_path / 'b')
    with closing(sqlite3.connect(_storage(path))) as base:
        base.execute('UPDATE messages SET timestamp = ? WHERE id = 3', (stamp,))
        base.commit()
    with pytest.raises(RecordingError) as caught:
        read_recording(path)
    assert f'the log time {stamp!r} is no number of nanoseconds' in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_log_time_beyond_64_bits_is_shown(bag_writer: Any, tmp_path: Path) -> None:
    """An .mcap file counts nanoseconds without a sign, to twice as many as a stamp has."""
    writer = bag_writer('mcap')
    writer.twist(0.1, 0.5, 0.2)
    writer.rows = [(topic, kind, 2**63, message) for topic, kind, _, message in writer.rows]
    path = writer.write(tmp_path / 'b')
    with pytest.raises(RecordingError, match='the log time 9223372036854775808 is no number'):
        read_recording(path)
