# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Measured channels against a model's prediction: gain, delay, and how large motions fare."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from lg_husky_sim.diagnosis.sensors.regression import (
    Number,
    Pair,
    Regression,
    regression,
    Way,
)
from lg_husky_sim.diagnosis.sensors.ways import advance, gyro, heading, integral, wheel_angles
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.recording import Segment
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np

#: Segments with a model's prediction of each.
Predicted = Sequence[tuple[Segment, TimeSeries]]


@dataclass(frozen=True)
class ChannelFit:
    """
    How a measured channel follows its prediction.

    Parameters
    ----------
    gain : Number
        Measured over predicted.
    delay : Number
        How much later the measured channel is [s].
    explained : float
        Share of the measured motion that gain and delay explain, 0 to 1.
    interval : float
        Usual interval of the samples [s].
    small, large : Number
        Gains of the part of the predicted rate up to its median and of the part beyond it; NaN
        where there is no such part.
    reached : float
        Largest measured rate but for outliers [unit of the channel].

    """

    gain: Number
    delay: Number
    explained: float
    interval: float
    small: Number
    large: Number
    reached: float


@dataclass(frozen=True)
class WheelFit:
    """
    How the wheels follow their prediction.

    Parameters
    ----------
    left, right : Number
        Gains of the mean predicted rate, with the difference between the sides allowed for.
    turning : Number
        Gain of the predicted difference between the sides; NaN where there is none.
    delay : Number
        How much later the measured rates are [s].
    explained : float
        Of the side that is explained less.
    interval : float
        Usual interval of the samples [s].

    """

    left: Number
    right: Number
    turning: Number
    delay: Number
    explained: float
    interval: float


def body_fits(parts: Predicted) -> Mapping[str, ChannelFit]:
    """
    Compare speed and yaw rate with their prediction.

    Parameters
    ----------
    parts : sequence of (Segment, TimeSeries)
        Measured stretches, each with its prediction.

    Returns
    -------
    mapping of str to ChannelFit
        By ``forward`` (of the pose), ``yaw_rate`` (gyro) and ``turn`` (heading of the pose);
        those that were recorded, moved enough and for long enough.

    """
    found = {}
    for name, measure, column, least in (
            ('forward', advance, 'forward', setting('least_speed')),
            ('yaw_rate', gyro, 'yaw_rate', setting('least_yaw_rate')),
            ('turn', heading, 'yaw_rate', setting('least_yaw_rate'))):
        one = _channel(parts, measure, column, least)
        if one is not None:
            found[name] = one
    return MappingProxyType(found)


def _channel(parts: Predicted, measure: Callable[[Segment], Way | None], column: str,
             least: float) -> ChannelFit | None:
    measured = [(way, series) for part, series in parts if (way := measure(part)) is not None]
    found = regression([(way, (integral(series.times, series.column(column)),))
                        for way, series in measured], (least,), offset=False)
    if found is None or not measured:
        return None
    rates = np.concatenate([np.abs(series.column(column)) for _, series in measured])
    median = float(np.median(rates[rates > least]))

    def divided(series: TimeSeries) -> tuple[Way, Way]:
        rate = series.column(column)
        low = np.clip(rate, -median, median)
        return integral(series.times, low), integral(series.times, rate - low)
    both = regression([(way, divided(series)) for way, series in measured], (least, 0.1 * least),
                      offset=False)
    unknown = Number(np.nan, np.nan, np.nan)
    small, large = both.factors if both is not None else (unknown, unknown)
    return ChannelFit(found.factors[0], _negative(found.late), found.explained, found.interval,
                      small, large, _reached([way for way, _ in measured]))


def _reached(ways: Sequence[Way]) -> float:
    # The 98th percentile of the rates over half a second.
    rates: list[FloatArray] = []
    for times, way in ways:
        edges = np.arange(times[0], times[-1], setting('relation_window'))
        rates.append(np.abs(np.diff(np.interp(edges, times, way))) / setting('relation_window'))
    return float(np.quantile(np.concatenate(rates), setting('reached')))


def wheel_fits(parts: Predicted) -> WheelFit | None:
    """
    Compare the wheel rates with their prediction.

    Parameters
    ----------
    parts : sequence of (Segment, TimeSeries)
        Measured stretches, each with its prediction.

    Returns
    -------
    WheelFit or None
        None without wheels, or where they turn too little.

    """
    pairs: tuple[list[Pair], list[Pair]] = ([], [])
    for part, series in parts:
        wheels = wheel_angles(part)
        if wheels is None:
            continue
        left, right = series.column('wheel_left'), series.column('wheel_right')
        sources = (integral(series.times, 0.5 * (left + right)),
                   integral(series.times, 0.5 * (right - left)))
        for side in range(2):
            pairs[side].append(((wheels[0], wheels[1][:, side]), sources))
    least = setting('least_wheel_motion')
    fits = [regression(one, (least, least), offset=False) for one in pairs]
    left_fit, right_fit = fits
    if left_fit is None or right_fit is None:
        return None
    return _wheels(left_fit, right_fit)


def _wheels(left: Regression, right: Regression) -> WheelFit:
    return WheelFit(left.factors[0], right.factors[0],
                    mean(_negative(left.factors[1]), right.factors[1]),
                    _negative(mean(left.late, right.late)), min(left.explained, right.explained),
                    left.interval)


def mean(one: Number, other: Number) -> Number:
    """Return the mean of two independent estimates."""
    value = 0.5 * (one.value + other.value)
    half = 0.25 * float(np.hypot(one.high - one.low, other.high - other.low))
    return Number(value, value - half, value + half)


def ratio(one: Number, other: Number) -> Number:
    """Return the ratio of two independent estimates, neither of which is near zero."""
    value = one.value / other.value
    half = 0.5 * abs(value) * float(np.hypot((one.high - one.low) / one.value,
                                             (other.high - other.low) / other.value))
    return Number(value, value - half, value + half)


def _negative(one: Number) -> Number:
    return Number(-one.value, -one.high, -one.low)
