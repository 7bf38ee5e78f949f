# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Bags whose streams were stamped by clocks that disagree, or by one that ran back."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lg_husky_sim.recording import read_recording, Recording
from lg_husky_sim.recording.clock import common_clock, Stamps
from lg_husky_sim.signals import FloatArray
import numpy as np
import pytest

TICKS: FloatArray = np.linspace(0.0, 60.0, 1200, endpoint=False)
"""A minute at 20 Hz [s]."""
SECONDS: FloatArray = np.linspace(0.0, 60.0, 60, endpoint=False)
MAIN = ('command', 'wheels', 'imu', 'odom>base_link')
FRONT_REAR = ('front_left_wheel', 'front_right_wheel', 'rear_left_wheel', 'rear_right_wheel')


def _apart(recording: Recording, name: str) -> float:
    """Return how far a stream is ahead of the wheels, when both were logged alike [s]."""
    return float(np.median(recording.stream(name).times - recording.stream('wheels').times))


def _stamps(logged: FloatArray, header: FloatArray | None) -> Stamps:
    """Return stamps counted from a start, without header stamps where there are none."""
    start, ns = 1_700_000_000_000_000_000, 1e9
    return Stamps(start + np.rint(logged * ns).astype(np.int64),
                  np.zeros(logged.size, dtype=np.int64) if header is None
                  else start + np.rint(header * ns).astype(np.int64))


def _jittered() -> dict[str, Stamps]:
    """Return main streams whose headers are right and whose log times come late a little."""
    random = np.random.default_rng(4)
    return {name: _stamps(TICKS + random.uniform(0.0, 0.1, TICKS.size), TICKS) for name in MAIN}


def _said(recording: Recording) -> str:
    return ' '.join(recording.notes)


@pytest.mark.parametrize('stamped', [True, False])
def test_a_simulator_that_is_reset_leaves_log_times(
    stamped: bool, bag: Any, tmp_path: Path,
) -> None:
    times = 0.1 * np.arange(1, 601)
    for t in times:
        stamp = t if t < 30.0 else t - 29.95
        bag.twist(t, 0.01 * t, 0.0, stamp=stamp if stamped else None)
        bag.joints(t, FRONT_REAR, [t] * 4, stamp=stamp)
        bag.imu(t, t, stamp=stamp)
    recording = read_recording(bag.write(tmp_path / 'bag'))
    for series in recording.streams.values():
        np.testing.assert_allclose(series.times, times - 0.1, atol=1e-9)
        assert np.all(np.diff(series.values[:, 0]) > 0.0)
    assert 'imu: header time goes backwards by 29.9 s: log times used instead' in _said(recording)


def test_a_few_messages_that_come_late_are_no_reset(bag: Any, tmp_path: Path) -> None:
    for k in range(100):
        t = 1.0 + 0.1 * k
        # Messages of 3.0 s to 6.0 s are held up and come within the next 0.1 s.
        bag.imu(6.0 + 0.001 * k if 3.0 <= t < 6.0 else t, t, stamp=t)
        bag.joints(t, FRONT_REAR, [t] * 4)
    recording = read_recording(bag.write(tmp_path / 'bag'))
    np.testing.assert_allclose(recording.stream('imu').times, 0.1 * np.arange(100), atol=1e-9)
    assert 'runs back' not in _said(recording)


def test_commands_on_the_wall_clock_and_sensors_in_slow_simulated_time(
    bag: Any, tmp_path: Path,
) -> None:
    times = 0.1 * np.arange(600)
    for t in 1.0 + times:
        bag.twist(t, 0.1, 0.0, stamp=t)
        bag.joints(t, FRONT_REAR, [1.0] * 4, stamp=0.8 * t - 1e6)
        bag.imu(t, 0.0, stamp=0.8 * t - 1e6)
    recording = read_recording(bag.write(tmp_path / 'bag'))
    for series in recording.streams.values():
        np.testing.assert_allclose(series.times, times, atol=1e-9)
    assert 'drift apart by' in _said(recording)
    assert 'log times used for all streams' in _said(recording)


def test_slow_simulated_time_of_all_streams_is_kept(bag: Any, tmp_path: Path) -> None:
    for t in 1.0 + 0.1 * np.arange(600):
        bag.twist(t, 0.1, 0.0, stamp=0.8 * t)
        bag.joints(t, FRONT_REAR, [1.0] * 4, stamp=0.8 * t)
    recording = read_recording(bag.write(tmp_path / 'bag'))
    for series in recording.streams.values():
        np.testing.assert_allclose(series.times, 0.08 * np.arange(600), atol=1e-8)
    assert recording.notes == ()


def test_an_offset_between_two_stamped_streams_is_not_shared_out(
    bag: Any, tmp_path: Path,
) -> None:
    for t in 1.0 + 0.1 * np.arange(40):
        bag.twist(t, 0.1, 0.0)
        bag.joints(t, FRONT_REAR, [1.0] * 4)
        bag.imu(t, 0.0, stamp=t + 8.0)
    recording = read_recording(bag.write(tmp_path / 'bag'))
    for name in ('command', 'imu'):
        assert _apart(recording, name) == pytest.approx(0.0, abs=1e-6)
    assert recording.start_ns == 1_700_000_001_000_000_000
    assert 'imu is on another clock: shifted by -8.000 s' in _said(recording)


@pytest.mark.parametrize(('ahead', 'read'), [
    (3.0, 0.0), (0.6, 0.0), (0.4, 0.4), (-0.4, -0.4), (-3.0, 0.0)])
def test_commands_stamped_by_a_laptop(
    ahead: float, read: float, bag: Any, tmp_path: Path,
) -> None:
    for t in 10.0 + 0.1 * np.arange(40):
        bag.twist(t, 0.1, 0.0, stamp=t + ahead)
        bag.joints(t, FRONT_REAR, [1.0] * 4)
    recording = read_recording(bag.write(tmp_path / 'bag'))
    assert _apart(recording, 'command') == pytest.approx(read, abs=1e-6)
    assert ('command is on another clock' in _said(recording)) == (read == 0.0)


def test_a_pose_that_takes_long_to_compute_keeps_its_stamps(bag: Any, tmp_path: Path) -> None:
    for k in range(100):
        t = 10.0 + 0.1 * k
        bag.joints(t, FRONT_REAR, [1.0] * 4)
        bag.transforms(t, [('odom', 'base_link', 0.0, 0.0, 0.0)], stamp=t - 0.6 - 0.01 * k)
    recording = read_recording(bag.write(tmp_path / 'bag'))
    assert _apart(recording, 'pose') == pytest.approx(-0.49 - 0.6, abs=0.1)
    assert 'odom>base_link is stamped 1.095 s earlier than wheels' in _said(recording)


def test_without_log_times_small_offsets_are_no_clocks(bag: Any, tmp_path: Path) -> None:
    for t in 1.0 + 0.1 * np.arange(100):
        bag.joints(50.0, FRONT_REAR, [1.0] * 4, stamp=t)
        if t > 5.0:
            bag.twist(50.0, 0.1, 0.0, stamp=t)
    recording = read_recording(bag.write(tmp_path / 'bag'))
    assert recording.stream('command').times[-1] == recording.stream('wheels').times[-1]
    assert recording.notes == ()


@pytest.mark.parametrize(('header', 'said'), [
    (np.full(60, 3.0), 'stamps do not advance'),
    (np.minimum(SECONDS, 20.0), 'clock drifts by 32.'), (1.1 * SECONDS, 'clock drifts by 4.5 s')])
def test_the_bad_clock_of_a_battery_costs_nothing_else(header: FloatArray, said: str) -> None:
    streams = {**_jittered(), 'voltage': _stamps(SECONDS, header)}
    times, notes = common_clock(streams)
    for name in MAIN:
        np.testing.assert_array_equal(times[name], streams[name].header)
    np.testing.assert_array_equal(times['voltage'], streams['voltage'].logged)
    assert len(notes) == 1
    assert notes[0].startswith(f'voltage: header {said}')
    assert notes[0].endswith(': log times used instead')


def test_header_stamps_of_a_battery_alone_are_held_against_log_times() -> None:
    streams = {'wheels': _stamps(TICKS, None), 'voltage': _stamps(SECONDS, 1.1 * SECONDS)}
    times, notes = common_clock(streams)
    for name, stamps in streams.items():
        np.testing.assert_array_equal(times[name], stamps.logged)
    assert len(notes) == 1
    assert notes[0].startswith('voltage: header clock drifts by 4')


@pytest.mark.parametrize('stamped', [True, False])
def test_a_battery_on_the_wall_clock_follows_slow_simulated_time(stamped: bool) -> None:
    """Its samples stay beside those that were logged with them."""
    streams = {name: _stamps(TICKS, 0.8 * TICKS) for name in MAIN}
    streams['voltage'] = _stamps(SECONDS, SECONDS if stamped else None)
    times, notes = common_clock(streams)
    for name in MAIN:
        np.testing.assert_array_equal(times[name], streams[name].header)
    np.testing.assert_array_equal(times['voltage'], times['wheels'][::20])
    assert ('voltage has no usable header stamps: log times shifted by 0.000 to -11.800 s onto '
            'the header clock') in notes


def test_a_stream_whose_stamps_stand_still_takes_log_times() -> None:
    streams = {**_jittered(), 'imu': _stamps(TICKS, np.full(TICKS.size, 7.0))}
    times, notes = common_clock(streams)
    np.testing.assert_array_equal(times['imu'], streams['imu'].logged)
    np.testing.assert_array_equal(times['wheels'], streams['wheels'].header)
    assert notes == ['imu: header stamps do not advance: log times used instead']


@pytest.mark.parametrize('unstamped', [None, 'command'])
@pytest.mark.parametrize('name', MAIN)
@pytest.mark.parametrize('congested', [(2.0, 18.0), (42.0, 58.0)])
def test_messages_that_are_logged_late_for_a_while_keep_their_stamps(
    congested: tuple[float, float], name: str, unstamped: str | None,
) -> None:
    """As over a link that is congested: the backlog grows, then all comes at once."""
    streams = _jittered()
    since = TICKS - congested[0]
    over = (since < 0.0) | (since > congested[1] - congested[0])
    late = np.where(over, 0.0, np.minimum(1.5, 2.0 * since))
    streams[name] = _stamps(np.maximum.accumulate(TICKS + late), TICKS)
    if unstamped:
        streams[unstamped] = _stamps(TICKS, None)
    times, notes = common_clock(streams)
    for stamps in times.values():
        np.testing.assert_array_equal(stamps, _stamps(TICKS, TICKS).header)
    assert notes == []


def test_a_simulator_that_pauses_while_commands_go_on_leaves_log_times() -> None:
    """Its stamps are as regular as those of messages that come late, but it stays behind."""
    logged = TICKS + 3.0 * (TICKS > 45.0)
    streams = {name: _stamps(logged, TICKS) for name in MAIN}
    streams['command'] = _stamps(TICKS, TICKS)
    times, notes = common_clock(streams)
    np.testing.assert_array_equal(times['wheels'], streams['wheels'].logged)
    assert notes == ['header clock and log clock drift apart by 3.0 s: log times used for all '
                     'streams']
