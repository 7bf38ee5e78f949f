# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""How far a prediction is from a recording: by channel, and as the paper's tracking errors."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
import math

from lg_husky_sim.comparison.slopes import body_rates
from lg_husky_sim.errors import RecordingError
from lg_husky_sim.recording import Segment
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np

UNITS: Mapping[str, str] = {
    'wheel_left': 'rad/s', 'wheel_right': 'rad/s', 'wheel_speed': 'rad/s', 'forward': 'm/s',
    'yaw_rate': 'rad/s', 'accel_x': 'm/s²', 'heading': 'rad', 'position': 'm',
}
"""Channels of a comparison, in the order of its table, and their units."""


@dataclass(frozen=True)
class SquareSum:
    """
    Squared errors summed up, to be pooled over segments.

    Parameters
    ----------
    total : float
        Sum of squares [unit²].
    count : int
        Number of samples.

    """

    total: float = 0.0
    count: int = 0

    def __add__(self, other: SquareSum) -> SquareSum:
        """Pool two sums."""
        return SquareSum(self.total + other.total, self.count + other.count)

    @property
    def rmse(self) -> float:
        """Root mean square error [unit]; NaN without a sample."""
        return math.sqrt(self.total / self.count) if self.count else math.nan


@dataclass(frozen=True, eq=False)
class Tracking:
    """
    Measured and predicted way, in the frame of the measured start.

    Parameters
    ----------
    times : numpy.ndarray, shape (n,)
        Stamps of the measured pose [s].
    measured, predicted : numpy.ndarray, shape (n, 2)
        x ahead and y to the left of the robot as it stood at the start [m].

    """

    times: FloatArray
    measured: FloatArray
    predicted: FloatArray

    @property
    def error(self) -> FloatArray:
        """Measured minus predicted, shape (n, 2) [m]."""
        difference: FloatArray = self.measured - self.predicted
        return difference

    @property
    def bounds(self) -> tuple[float, float]:
        """Return the paper's bounds: largest absolute error in x and y [m]; NaN without any."""
        known = self.error[np.all(np.isfinite(self.error), axis=1)]
        if not len(known):
            return math.nan, math.nan
        x, y = np.max(np.abs(known), axis=0)
        return float(x), float(y)

    @property
    def absolute_sum(self) -> float:
        """Return the paper's objective, eq. (23): sum of absolute errors in x and y [m]."""
        return float(np.nansum(np.abs(self.error)))


def measured_channels(segment: Segment) -> dict[str, TimeSeries]:
    """
    Return what was measured, one series for each channel of a prediction.

    The forward speed is the rate of change of the pose; so is the yaw rate where no gyro was
    recorded.

    Parameters
    ----------
    segment : Segment
        Its wheels, pose and imu are read, as far as it has them.

    Returns
    -------
    dict of str to TimeSeries
        Some of wheel_left, wheel_right, forward, yaw_rate, accel_x, heading, x, y; each series
        has that one channel.

    """
    streams = segment.streams
    found: dict[str, TimeSeries] = {}
    if 'wheels' in streams:
        for side in ('left', 'right'):
            found[f'wheel_{side}'] = _single(streams['wheels'], side, f'wheel_{side}')
    if 'pose' in streams:
        rates = body_rates(streams['pose'])
        found['forward'] = _single(rates, 'forward', 'forward')
        found['yaw_rate'] = _single(rates, 'yaw_rate', 'yaw_rate')
        for name in ('heading', 'x', 'y'):
            found[name] = _single(streams['pose'], name, name)
    if 'imu' in streams:
        found['yaw_rate'] = _single(streams['imu'], 'yaw_rate', 'yaw_rate')
        found['accel_x'] = _single(streams['imu'], 'accel_x', 'accel_x')
    return found


def predicted_at(prediction: TimeSeries, name: str, times: FloatArray) -> FloatArray:
    """
    Return a channel of a prediction at other times.

    Parameters
    ----------
    prediction : TimeSeries
        Columns of the simulator, in the order of time.
    name : str
        Channel; NaN everywhere if the prediction lacks it.
    times : numpy.ndarray, shape (n,)
        [s].

    Returns
    -------
    numpy.ndarray, shape (n,)
        Interpolated; NaN outside the prediction.

    """
    if name not in prediction.names or not len(prediction):
        return np.full(times.size, np.nan)
    result: FloatArray = np.interp(
        times, prediction.times, prediction.column(name), left=np.nan, right=np.nan)
    return result


def channel_pairs(segment: Segment, prediction: TimeSeries
                  ) -> dict[str, tuple[FloatArray, FloatArray, FloatArray]]:
    """
    Return each channel that was measured beside its prediction.

    Where the measured rate is a derivative of the pose, the predicted one is the same derivative
    of the predicted pose, so that a perfect model has no error.

    Parameters
    ----------
    segment : Segment
        With the streams that were measured.
    prediction : TimeSeries
        Columns of the simulator.

    Returns
    -------
    dict of str to tuple of numpy.ndarray, shape (n,)
        Times [s], measured and predicted values by channel; what is not predicted is NaN.

    """
    from_pose = pose_rates(segment, prediction)
    found = {}
    for name, series in measured_channels(segment).items():
        derived = name == 'forward' or (name == 'yaw_rate' and 'imu' not in segment.streams)
        predicted = predicted_at(from_pose if derived else prediction, name, series.times)
        found[name] = (series.times, series.values[:, 0], predicted)
    return found


def channel_errors(segment: Segment, prediction: TimeSeries) -> dict[str, SquareSum]:
    """
    Sum up the squared errors, measured minus predicted, of each channel that has both.

    Parameters
    ----------
    segment : Segment
        With the streams that were measured.
    prediction : TimeSeries
        Columns of the simulator.

    Returns
    -------
    dict of str to SquareSum
        Keys in the order of ``UNITS``; wheel_speed pools both sides, position both axes (its
        root mean square is that of the distance).

    """
    sums = {name: _square_sum(measured - predicted) for name, (_, measured, predicted)
            in channel_pairs(segment, prediction).items()}
    if 'wheel_left' in sums:
        sums['wheel_speed'] = sums['wheel_left'] + sums['wheel_right']
    if 'x' in sums:
        sums['position'] = SquareSum(sums['x'].total + sums['y'].total, sums['x'].count)
    return {name: sums[name] for name in UNITS if name in sums and sums[name].count}


def pooled(parts: Iterable[Mapping[str, SquareSum]]) -> dict[str, SquareSum]:
    """Pool the sums of several segments, channel by channel, in the order of ``UNITS``."""
    total: dict[str, SquareSum] = {}
    for part in parts:
        for name, value in part.items():
            total[name] = total.get(name, SquareSum()) + value
    return {name: total[name] for name in UNITS if name in total}


def tracking(segment: Segment, prediction: TimeSeries) -> Tracking:
    """
    Compare the way driven with the way predicted.

    Parameters
    ----------
    segment : Segment
        With a stream ``pose``.
    prediction : TimeSeries
        With columns x, y, heading, in the frame of the recording.

    Returns
    -------
    Tracking
        Both ways turned into the frame of the robot at the prediction's start, so that x is
        ahead and y to the left.

    Raises
    ------
    RecordingError
        If the segment has no pose.

    """
    if 'pose' not in segment.streams:
        raise RecordingError(
            f'recording {segment.recording} has no pose; a tracking error needs one')
    pose = segment.streams['pose']
    there = np.flatnonzero(np.isfinite(prediction.column('x')))
    first = int(there[0]) if there.size else 0
    x, y, heading = (float(prediction.column(name)[first]) for name in ('x', 'y', 'heading'))
    turn = np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]])
    origin = np.array([x, y])
    predicted = np.column_stack(
        [predicted_at(prediction, name, pose.times) for name in ('x', 'y')])
    return Tracking(pose.times, (pose.values[:, :2] - origin) @ turn,
                    (predicted - origin) @ turn)


def _single(series: TimeSeries, name: str, channel: str) -> TimeSeries:
    return TimeSeries(series.times, series.column(name)[:, None], (channel,))


def pose_rates(segment: Segment, prediction: TimeSeries) -> TimeSeries:
    """Return rates derived from the predicted pose just as the measured ones are."""
    if 'pose' not in segment.streams:
        return prediction
    times = segment.streams['pose'].times
    values = np.column_stack(
        [predicted_at(prediction, name, times) for name in ('x', 'y', 'heading')])
    known = np.all(np.isfinite(values), axis=1)
    return body_rates(TimeSeries(times[known], values[known], ('x', 'y', 'heading')))


def _square_sum(error: FloatArray) -> SquareSum:
    known = error[np.isfinite(error)]
    return SquareSum(float(known @ known), int(known.size))
