# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Noise that grows with the motion is estimated as it was drawn."""

from __future__ import annotations

from lg_husky_sim.diagnosis.before_after.drives import _binned, _vigour, drives
from lg_husky_sim.diagnosis.before_after.settings import settings
from lg_husky_sim.diagnosis.before_after.whitening import noise_of, surprise
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np
import pytest

KNOWN = settings()
FILTER, SD = np.array([1.0, -0.6]), 0.02
ROWS = 4000


def drawn(growth: FloatArray) -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
    """Return residuals of a gyro, coloured and of a variance that grows, and the motion."""
    rng = np.random.default_rng(1)
    vigour = np.repeat(rng.uniform(0.0, 1.0, (ROWS // 20, 2)) ** 2, 20, axis=0)
    vigour[: ROWS // 4] = 0.0
    white = SD * np.sqrt(1.0 + vigour @ growth) * rng.standard_normal(ROWS)
    rows = np.zeros((ROWS, 3))
    for k in range(ROWS):
        rows[k, 0] = white[k] - FILTER[1] * rows[k - 1, 0]
    return {'imu': rows}, {'imu': vigour}


@pytest.mark.parametrize('growth', [(0.0, 0.0), (40.0, 0.0), (5.0, 60.0)])
def test_filter_and_variances_are_those_that_were_drawn(growth: tuple[float, float]) -> None:
    residuals, vigour = drawn(np.array(growth))
    found = noise_of([residuals], [vigour], KNOWN, True)
    # A gyro that reads one value has no noise to estimate.
    assert set(found.sd) == {'yaw'}
    assert found.filters['yaw'][:2] == pytest.approx(FILTER, abs=0.05)
    for motion in np.array([(0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5)]):
        variance = found.sd['yaw'] ** 2 * (1.0 + motion @ found.growth['yaw'])
        assert variance == pytest.approx(SD ** 2 * (1.0 + motion @ growth), rel=0.25)
    white = found.by_channel(residuals, vigour)['yaw']
    lively = vigour['imu'][-white.size:].sum(axis=1) > 0.5
    assert np.std(white[lively]) == pytest.approx(1.0, abs=0.06)
    assert np.std(white[~lively]) == pytest.approx(1.0, abs=0.06)


def test_a_variance_that_grows_is_likelier_where_it_does() -> None:
    residuals, vigour = drawn(np.array([40.0, 0.0]))
    found = noise_of([residuals], [vigour], KNOWN, True)
    even = noise_of([residuals], [vigour], KNOWN, False)
    assert even.growth == {}
    assert np.std(even.white(residuals, vigour)) == pytest.approx(1.0, abs=0.02)
    assert surprise(found, [residuals], [vigour]) < surprise(even, [residuals], [vigour]) - 100.0
    assert found.wider({'yaw': 2.0}).white(residuals, vigour) == pytest.approx(
        0.5 * found.white(residuals, vigour))
    assert found.among({'left'}).sd == {}


def test_the_motion_is_that_which_was_measured() -> None:
    """The square of an even yaw rate, and where wheels speed up; no number before a command."""
    def stream(hertz: float, names: tuple[str, ...], *columns: FloatArray) -> TimeSeries:
        return TimeSeries(np.arange(0.0, 12.0, 1.0 / hertz), np.column_stack(columns), names)
    at, often = np.arange(0.0, 12.0, 0.02), np.arange(0.0, 12.0, 0.01)
    speeds = np.clip(at - 8.0, 0.0, 2.0) * 1.5
    turning = np.where((often > 4.0) & (often < 6.0), -0.8, 0.0)
    streams = {
        'command': stream(10.0, ('forward', 'yaw'), np.where(np.arange(120) < 40, 0.0, 0.3),
                          np.zeros(120)),
        'wheels': stream(50.0, ('left', 'right'), speeds, -speeds),
        'imu': stream(100.0, ('yaw_rate', 'accel_x', 'accel_y'), turning, 0.0 * often,
                      0.0 * often)}
    (one,) = drives(Recording('rec1', '', streams, 0), KNOWN.simulation['step'], KNOWN.bins,
                    0.5, 3.0)
    for name in ('wheels', 'imu'):
        times = one.bins[name].centres()
        for column, (first, last, value) in enumerate(((4.6, 5.4, 0.64), (8.6, 9.4, 2.25))):
            inside, outside = (times > first) & (times < last), (times > 6.7) & (times < 7.3)
            assert one.vigour[name][inside, column] == pytest.approx(value, rel=0.05)
            assert one.vigour[name][outside, column] == pytest.approx(0.0, abs=1e-9)
            assert np.all(np.isnan(one.vigour[name][:, column]) == (times < 4.0))


def test_a_stream_of_a_single_bin_is_no_error() -> None:
    """It does not change, and another one says how the robot moves."""
    at = np.arange(0.0, 6.0, 0.05)
    streams = {
        'command': TimeSeries(at, np.ones((at.size, 2)), ('forward', 'yaw')),
        'wheels': TimeSeries(np.array([0.0, 4.0]), np.ones((2, 2)), ('left', 'right')),
        'pose': TimeSeries(np.array([0.0, 4.0]), np.ones((2, 3)), ('x', 'y', 'heading'))}
    found = _vigour({name: _binned(one.times[1:], one.values[1:], 0.0, 0.1)
                     for name, one in streams.items() if name != 'command'}, 0.25,
                    streams['command'], 1.0)
    assert found['wheels'].tolist() == [[0.0, 0.0]]
    assert found['pose'].shape == (0, 2)
