# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Bags written are read back as they were, appear whole, and overwrite nothing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.recording import read_recording, write_recording
from lg_husky_sim.recording.recording import CHANNELS
from lg_husky_sim.signals import TimeSeries
import numpy as np
from numpy.typing import ArrayLike
import pytest

pytest.importorskip('rosbags')


def _series(times: ArrayLike, values: ArrayLike, names: tuple[str, ...]) -> TimeSeries:
    return TimeSeries(np.asarray(times, dtype=np.float64), np.asarray(values, dtype=np.float64),
                      names)


def _streams(count: int = 50) -> dict[str, TimeSeries]:
    random = np.random.default_rng(3)
    rates = {'command': 0.05, 'wheels': 0.02, 'wheel_angles': 0.02, 'wheel_torques': 0.02,
             'imu': 0.03, 'pose': 0.1, 'currents': 0.15, 'voltage': 0.15}
    made = {}
    for name, channels in CHANNELS.items():
        values = random.normal(size=(count, len(channels))).astype(np.float32)  # as Float32 sends
        if name in ('wheel_angles', 'pose'):
            values = np.cumsum(0.3 * values, axis=0)  # no jumps beyond pi
        made[name] = _series(rates[name] * np.arange(count), values, channels)
    return made


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
def test_round_trip(storage: str, tmp_path: Path) -> None:
    streams = _streams()
    path = write_recording(tmp_path / 'deep' / 'bag', streams, storage=storage)
    suffix = {'mcap': 'mcap', 'sqlite3': 'db3'}[storage]
    assert sorted(p.name for p in path.iterdir()) == [f'bag.{suffix}', 'metadata.yaml']
    assert [p.name for p in path.parent.iterdir()] == ['bag']  # no scratch folder is left
    recording = read_recording(path)
    assert recording.notes == ()
    assert list(recording.streams) == list(CHANNELS)
    for name, series in streams.items():
        np.testing.assert_allclose(recording.stream(name).times, series.times, atol=1e-9)
        np.testing.assert_allclose(recording.stream(name).values, series.values, atol=1e-12)
    assert recording.topics['imu'] == '/imu_um7/data'
    assert recording.topics['command'] == '/husky_velocity_controller/cmd_vel'


def test_the_same_streams_give_the_same_bytes(tmp_path: Path) -> None:
    first = write_recording(tmp_path / 'a' / 'bag', _streams())
    second = write_recording(tmp_path / 'b' / 'bag', _streams())
    for part in ('bag.mcap', 'metadata.yaml'):
        assert (first / part).read_bytes() == (second / part).read_bytes()


def test_angles_on_a_clock_of_their_own_are_interpolated(tmp_path: Path) -> None:
    wheels = _series([0.0, 0.1, 0.2], np.zeros((3, 2)), ('left', 'right'))
    angles = _series([0.0, 0.2], [(0.0, 0.0), (2.0, 4.0)], ('left', 'right'))
    path = write_recording(tmp_path / 'bag', {'wheels': wheels, 'wheel_angles': angles})
    np.testing.assert_allclose(
        read_recording(path).stream('wheel_angles').values, [(0, 0), (1, 2), (2, 4)])


def test_nothing_is_overwritten_unless_asked_and_a_bag(tmp_path: Path) -> None:
    path = write_recording(tmp_path / 'bag', _streams(5))
    with pytest.raises(RecordingError, match='bag exists already'):
        write_recording(path, _streams(6))
    write_recording(path, _streams(6), overwrite=True)
    assert len(read_recording(path).stream('pose')) == 6
    precious = tmp_path / 'precious'
    precious.mkdir()
    (precious / 'thesis.txt').write_text('mine')
    with pytest.raises(RecordingError, match='precious exists and is not a rosbag2'):
        write_recording(precious, _streams(5), overwrite=True)
    assert (precious / 'thesis.txt').read_text() == 'mine'


def test_a_failure_leaves_nothing_behind(tmp_path: Path, monkeypatch: Any) -> None:
    from lg_husky_sim.recording import messages

    def broken(self: Any, *values: Any) -> Any:
        raise KeyboardInterrupt
    monkeypatch.setattr(messages.Messages, '_vector', broken)
    with pytest.raises(KeyboardInterrupt):
        write_recording(tmp_path / 'bag', _streams())
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(('change', 'message'), [
    ({'storage': 'zip'}, "storage 'zip' is unknown; there are mcap, sqlite3"),
    ({'start_ns': 0}, 'gives a stamp that is not positive'),
])
def test_bad_choices(change: dict[str, Any], message: str, tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=message):
        write_recording(tmp_path / 'bag', _streams(), **change)
    assert list(tmp_path.iterdir()) == []
