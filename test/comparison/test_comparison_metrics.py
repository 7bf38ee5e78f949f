# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Errors of known size come out as they were put in."""

from __future__ import annotations

import math

from lg_husky_sim.comparison.metrics import (
    channel_errors,
    measured_channels,
    pooled,
    predicted_at,
    SquareSum,
    Tracking,
    tracking,
)
from lg_husky_sim.comparison.slopes import body_rates, local_fit, without_spikes
from lg_husky_sim.errors import RecordingError
from lg_husky_sim.recording import Segment
from lg_husky_sim.recording.recording import CHANNELS
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np
import pytest

COLUMNS = ('wheel_left', 'wheel_right', 'forward', 'yaw_rate', 'accel_x', 'heading', 'x', 'y')


def _arc(times: FloatArray, speed: float = 0.5, rate: float = 0.4) -> FloatArray:
    heading = rate * times + 0.7
    return np.column_stack((speed / rate * (np.sin(heading) - np.sin(0.7)) + 3.0,
                            speed / rate * (np.cos(0.7) - np.cos(heading)) - 2.0, heading))


def _segment(*without: str) -> Segment:
    times = np.arange(0.0, 10.0, 0.1)
    ones = np.ones_like(times)
    values = {'command': [0.5 * ones, 0.4 * ones], 'wheels': [2.0 * ones, 4.0 * ones],
              'imu': [0.4 * ones, 0.1 * ones, 0.0 * ones], 'pose': list(_arc(times).T)}
    streams = {name: TimeSeries(times, np.column_stack(columns), CHANNELS[name])
               for name, columns in values.items() if name not in without}
    return Segment('made', 0, 0.0, float(times[-1]), streams)


def _prediction(**offsets: float) -> TimeSeries:
    times = np.arange(0.0, 10.05, 0.01)
    ones = np.ones_like(times)
    x, y, heading = _arc(times).T
    columns = {'wheel_left': 2.0 * ones, 'wheel_right': 4.0 * ones, 'forward': 0.5 * ones,
               'yaw_rate': 0.4 * ones, 'accel_x': 0.1 * ones, 'heading': heading, 'x': x, 'y': y}
    return TimeSeries(times, np.column_stack(
        [columns[name] + offsets.get(name, 0.0) for name in COLUMNS]), COLUMNS)


def test_no_error_where_there_is_none() -> None:
    errors = channel_errors(_segment(), _prediction())
    assert list(errors) == ['wheel_left', 'wheel_right', 'wheel_speed', 'forward', 'yaw_rate',
                            'accel_x', 'heading', 'position']
    assert all(value.rmse < 1e-5 for value in errors.values())


@pytest.mark.parametrize(('offsets', 'channel', 'expected'), [
    ({'wheel_left': 0.3}, 'wheel_left', 0.3),
    ({'wheel_left': 0.3, 'wheel_right': -0.4}, 'wheel_speed', math.sqrt(0.125)),
    ({'yaw_rate': -0.2}, 'yaw_rate', 0.2),
    ({'accel_x': 0.05}, 'accel_x', 0.05),
    ({'x': 0.3, 'y': 0.4}, 'position', 0.5),
    ({'heading': 0.1}, 'heading', 0.1),
])
def test_an_offset_is_its_root_mean_square(
    offsets: dict[str, float], channel: str, expected: float,
) -> None:
    errors = channel_errors(_segment(), _prediction(**offsets))
    assert errors[channel].rmse == pytest.approx(expected, abs=1e-5)


def test_without_a_gyro_the_yaw_rate_comes_from_the_heading() -> None:
    measured = measured_channels(_segment('imu'))
    np.testing.assert_allclose(measured['yaw_rate'].values, 0.4, atol=1e-9)
    np.testing.assert_allclose(measured['forward'].values, 0.5, rtol=0.002)
    assert 'accel_x' not in measured
    # An offset of the predicted rate is no error of the predicted pose it is compared by.
    errors = channel_errors(_segment('imu'), _prediction(yaw_rate=0.5))
    assert errors['yaw_rate'].rmse < 1e-9


def test_what_was_not_measured_or_predicted_is_not_judged() -> None:
    assert list(channel_errors(_segment('pose', 'imu'), _prediction())) == [
        'wheel_left', 'wheel_right', 'wheel_speed']
    with pytest.raises(RecordingError, match='made has no pose'):
        tracking(_segment('pose'), _prediction())
    few = TimeSeries(np.array([0.0, 9.9]), np.array([[2.0], [2.0]]), ('wheel_left',))
    times = np.array([-1.0, 5.0, 20.0])
    np.testing.assert_array_equal(predicted_at(few, 'wheel_left', times), (np.nan, 2.0, np.nan))
    assert np.all(np.isnan(predicted_at(few, 'x', times)))


def test_pooling_weighs_by_samples() -> None:
    total = pooled([{'x': SquareSum(9.0, 1)}, {'yaw_rate': SquareSum(9.0, 1)},
                    {'yaw_rate': SquareSum(3.0, 3)}])
    assert list(total) == ['yaw_rate']
    assert total['yaw_rate'].rmse == pytest.approx(math.sqrt(3.0))
    assert math.isnan(SquareSum().rmse)


def test_tracking_is_in_the_frame_of_the_start() -> None:
    # A prediction one metre further along the starting heading (0.7 rad): X error 1 m, Y none.
    shift = {'x': math.cos(0.7), 'y': math.sin(0.7)}
    track = tracking(_segment(), _prediction())
    np.testing.assert_allclose(track.predicted[0], (0.0, 0.0), atol=1e-12)
    assert track.measured[5, 0] > 0.2  # ahead
    assert track.measured[5, 1] > 0.0  # and turning to the left
    assert max(track.bounds) < 1e-4
    late = Tracking(track.times, track.measured, track.predicted + (1.0, -0.25))
    assert late.bounds == pytest.approx((1.0, 0.25), abs=1e-4)
    assert late.absolute_sum == pytest.approx(125.0, rel=1e-3)
    moved = tracking(_segment(), _prediction(**shift))
    np.testing.assert_allclose(np.abs(moved.error), [(1.0, 0.0)] * 100, atol=1e-4)


def test_local_fit_takes_noise_out_of_value_and_slope() -> None:
    times = np.array([0.0, 0.11, 0.2, 0.29, 0.4])
    series = TimeSeries(times, (3.0 - 2.0 * times)[:, None], ('a',))
    value, slope = local_fit(series, 0.0, 0.3, ahead=True)
    assert (value[0], slope[0]) == pytest.approx((3.0, -2.0))
    curve = np.arange(0.0, 0.41, 0.05)
    bent = TimeSeries(curve, (1.0 + curve**2)[:, None], ('a',))
    assert local_fit(bent, 0.0, 0.4, ahead=True)[0][0] == pytest.approx(1.0)
    assert local_fit(bent, 0.0, 0.8)[0][0] == pytest.approx(1.0 - 0.4**2 / 6.0, abs=0.01)
    single = TimeSeries(times[:1], np.array([[5.0]]), ('a',))
    value, slope = local_fit(single, 0.0, 0.3)
    assert (value[0], slope[0]) == (5.0, 0.0)


def test_body_rates_of_a_known_arc_at_uneven_stamps_far_from_zero() -> None:
    random = np.random.default_rng(1)
    times = np.sort(random.uniform(0.0, 20.0, 300))
    pose = TimeSeries(times + 5000.0, _arc(times, -0.8, 0.6), CHANNELS['pose'])
    rates = body_rates(pose)
    np.testing.assert_allclose(rates.column('yaw_rate'), 0.6, atol=1e-6)
    np.testing.assert_allclose(rates.column('forward'), -0.8, rtol=0.02)
    assert rates.times[0] >= pose.times[0] + 0.25
    assert len(body_rates(pose.slice(5000.0, 5000.1))) == 0


def test_a_jump_of_the_scan_matcher_is_left_out() -> None:
    times = np.arange(0.0, 5.0, 0.1)
    values = _arc(times)
    values[20, 0] += 1.5
    kept = without_spikes(TimeSeries(times, values, CHANNELS['pose']))
    assert len(kept) == 49
    assert times[20] not in kept.times
