# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""How a log was made: what each sensor means over which time, and what is late."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
import enum
import math

from lg_husky_sim.diagnosis.settings import setting


class WheelReading(enum.Enum):
    """How the rate of a wheel is made, and where in its window the stamp lies."""

    WINDOW_END = 'mean over a window that ends at the stamp'
    WINDOW_MIDDLE = 'mean over a window around the stamp'
    WINDOW_START = 'mean over a window that begins at the stamp'
    FILTERED = 'low-passed'


@dataclass(frozen=True)
class Reading:
    """
    How a log was made: what is estimated with the rest.

    Parameters
    ----------
    wheels : WheelReading
    imu : float or None
        Where in the window of its mean a yaw rate is stamped: 0 at the end, 1 at the begin; None
        for a rate of the moment, infinite for one behind a first-order low pass.
    values : mapping of str to float
        ``wheel_window`` [s] (length of the window, or time constant of the low pass),
        ``wheel_mean`` [s] (window of the mean that goes through the low pass, zero for a rate of
        the moment), ``wheel_smoothing`` [s] (time constant of a first-order filter of the means
        from message to message, zero for none),
        ``imu_window`` [s] (the same of a yaw rate; its period if not given),
        ``delay_wheels``, ``delay_imu``, ``delay_pose`` [s] (how late stamps are),
        ``command_delay`` [s] (how late the base applies commands), :attr:`Drive.late` and
        :attr:`Drive.own_lag` [s] (how much later than that in one drive, in one recording),
        ``gyro_offset`` [rad/s],
        ``gyro_gain`` [1] (relative), ``pose_turn`` [rad] (heading of the pose's frame against the
        direction of travel), ``pose_lever`` [m] (how far ahead of the middle it is).

    """

    wheels: WheelReading = WheelReading.WINDOW_END
    imu: float | None = None
    values: Mapping[str, float] = field(default_factory=dict)

    def get(self, name: str) -> float:
        """Return a value; what is not there is zero, but for the window of the encoders."""
        if name == 'wheel_window':
            return self.values.get(name, setting('wheel_window'))
        return self.values.get(name, 0.0)

    def replacing(self, values: Mapping[str, float]) -> Reading:
        """Return this with other values."""
        return replace(self, values={**self.values, **values})


def smoothing_share(reading: Reading, period: float) -> float:
    """Return what a filter of messages keeps of its last value: ``exp(-period / T)`` [1]."""
    lag = reading.get('wheel_smoothing')
    return math.exp(-period / lag) if lag > 0.0 else 0.0


def wheel_lag(reading: Reading, period: float) -> float:
    """Return how long before its stamp a wheel rate was true, on the mean [s]."""
    window = reading.get('wheel_window')
    if reading.wheels is WheelReading.FILTERED:
        return reading.get('delay_wheels') + window + 0.5 * reading.get('wheel_mean')
    share = {WheelReading.WINDOW_END: 0.5, WheelReading.WINDOW_MIDDLE: 0.0,
             WheelReading.WINDOW_START: -0.5}[reading.wheels]
    kept = smoothing_share(reading, period)
    return reading.get('delay_wheels') + share * window + kept / (1.0 - kept) * period


def imu_lag(reading: Reading, period: float) -> float:
    """Return how long before its stamp a yaw rate was true, on the mean [s]."""
    window = 0.0 if reading.imu is None else reading.values.get('imu_window', period)
    if reading.imu == math.inf:
        return reading.get('delay_imu') + window
    return reading.get('delay_imu') + (0.5 - (reading.imu or 0.0)) * window
