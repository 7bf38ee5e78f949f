# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Stretches without a gap."""

from __future__ import annotations

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.recording import Recording, segments
from lg_husky_sim.recording.recording import CHANNELS
from lg_husky_sim.signals import TimeSeries
import numpy as np
import pytest


def _stream(name: str, times: list[float] | np.ndarray) -> TimeSeries:
    stamps = np.asarray(times, dtype=np.float64)
    values = np.repeat(stamps[:, None], len(CHANNELS[name]), axis=1)
    return TimeSeries(stamps, values, CHANNELS[name])


def _recording(**times: list[float] | np.ndarray) -> Recording:
    return Recording('r', 'r', {name: _stream(name, stamps) for name, stamps in times.items()}, 0)


def test_a_gap_in_any_stream_starts_a_segment() -> None:
    steady = np.arange(0.0, 10.01, 0.1)
    recording = _recording(
        command=steady[(steady < 2.05) | (steady > 2.95)],
        wheels=steady + 0.03,
        pose=steady[(steady < 6.05) | (steady > 7.95)])
    bounds = [(s.start, s.end) for s in segments(recording)]
    np.testing.assert_allclose(bounds, [(0.03, 2.0), (3.0, 6.0), (8.0, 10.0)])
    assert [s.index for s in segments(recording)] == [0, 1, 2]
    assert [s.recording for s in segments(recording)] == ['r'] * 3


def test_the_command_before_the_start_is_held() -> None:
    recording = _recording(command=[0.0, 0.4, 0.8, 1.2], wheels=[0.5, 0.7, 0.9, 1.1])
    (segment,) = segments(recording)
    command = segment.streams['command']
    np.testing.assert_array_equal(command.times, (0.5, 0.8))
    np.testing.assert_array_equal(command.values[:, 0], (0.4, 0.8))
    np.testing.assert_array_equal(segment.streams['wheels'].times, (0.5, 0.7, 0.9, 1.1))
    assert segment.duration == pytest.approx(0.6)


def test_a_slow_stream_is_no_row_of_gaps() -> None:
    recording = _recording(command=np.arange(0.0, 20.0, 0.05), pose=np.arange(0.0, 20.0, 1.0))
    (segment,) = segments(recording)
    assert (segment.start, segment.end) == (0.0, 19.0)


def test_a_silent_battery_does_not_cut() -> None:
    recording = _recording(command=np.arange(0.0, 5.0, 0.1), voltage=[0.0, 4.0])
    assert len(segments(recording)) == 1
    later = _recording(command=np.arange(0.0, 5.0, 0.1), voltage=[9.0])
    assert set(segments(later)[0].streams) == {'command'}  # nothing of it falls inside


def test_no_overlap_and_short_stretches_give_nothing() -> None:
    assert segments(_recording(command=[0.0, 0.1, 0.2], wheels=[5.0, 5.1, 5.2])) == ()
    assert segments(_recording(command=[0.0, 0.1, 0.2])) == ()


def test_the_gap_is_a_choice() -> None:
    recording = _recording(command=np.concatenate((np.arange(0, 2, 0.1), np.arange(3, 5, 0.1))))
    assert len(segments(recording)) == 2
    assert len(segments(recording, gap=1.5)) == 1
    with pytest.raises(RecordingError, match=r'gap = 0\.0 s must be positive'):
        segments(recording, gap=0.0)


def test_streams_are_checked() -> None:
    with pytest.raises(RecordingError, match="unknown stream 'speed'"):
        Recording('r', 'r', {'speed': _stream('pose', [0.0])}, 0)
    with pytest.raises(RecordingError, match='stream wheels has channels x, y, heading'):
        Recording('r', 'r', {'wheels': _stream('pose', [0.0])}, 0)
    recording = _recording(command=[0.0, 1.0], pose=[0.5, 2.0])
    assert recording.duration == 2.0
    with pytest.raises(TypeError):
        recording.streams['wheels'] = _stream('wheels', [0.0])  # type: ignore[index]
