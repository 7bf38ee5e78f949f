# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A recorder that was killed: its whole chunks are read."""

from __future__ import annotations

from pathlib import Path

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.recording import read_recording, write_recording
from lg_husky_sim.recording.salvage import is_cut_off
from lg_husky_sim.signals import TimeSeries
import numpy as np
import pytest

pytest.importorskip('rosbags')

SAMPLES = 40_000


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
    assert read.notes[0] == 'bag.mcap was cut off: read up to its last whole chunk'
    assert (cut / 'bag.mcap').read_bytes() == before
    np.testing.assert_array_equal(
        read_recording(cut / 'bag.mcap').streams['imu'].values, read.streams['imu'].values)


def test_a_whole_bag_is_read_as_it_is(sound: Path) -> None:
    assert not is_cut_off(sound / 'bag.mcap')
    assert len(read_recording(sound).streams['imu']) == SAMPLES
    assert not any('cut off' in note for note in read_recording(sound).notes)


def test_a_bag_cut_before_its_first_chunk_is_refused_in_a_line(
        sound: Path, tmp_path: Path) -> None:
    cut = tmp_path / 'bag.mcap'
    for length in (8, 20, 60):
        cut.write_bytes((sound / 'bag.mcap').read_bytes()[:length])
        with pytest.raises(RecordingError, match=r'cannot (read|use) ') as caught:
            read_recording(cut)
        assert '\n' not in str(caught.value)
