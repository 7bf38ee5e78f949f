# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What encoders and IMU read of the simulated truth: noise, bias, rounding, stale values."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

from lg_husky_sim.husky.plant import Plant, SensorModel
from lg_husky_sim.ros.settings import Settings
from lg_husky_sim.simulation import SimulatorState
import numpy as np

_TURN = 6.283185307179586


class Measured(NamedTuple):
    """
    Readings of one step.

    Parameters
    ----------
    wheel_rates, wheel_angles : tuple of float
        Left and right [rad/s], [rad].
    gyro : float
        Yaw rate [rad/s].
    accel : tuple of float
        Specific force along x, y, z of the IMU [m/s²] (REP-145: +g on z at rest).
    heading : float
        Of the orientation in the IMU [rad].

    """

    wheel_rates: tuple[float, float]
    wheel_angles: tuple[float, float]
    gyro: float
    accel: tuple[float, float, float]
    heading: float


def sensor_model(plant: Plant, state: SimulatorState) -> SensorModel:
    """Return the sensor model that holds at a state: late effects count from their onset on."""
    onset = plant.onset
    if len(plant.sets) == 1:
        return plant.sets[0].sensors
    if onset is None:
        return plant.sets[-1].sensors
    place = state.time if onset.kind.value == 'time' else state.pose.x
    late = place <= onset.value if onset.kind.value == 'place_below' else place >= onset.value
    return plant.sets[1 if late else 0].sensors


def _rounded(value: float, step: float) -> float:
    return round(value / step) * step if step else value


class Sensors:
    """
    Encoders and IMU of one robot.

    Parameters
    ----------
    settings : Settings

    """

    def __init__(self, settings: Settings) -> None:
        """Seed the noise."""
        self._random = np.random.default_rng(settings.seed)
        self._period = settings.period
        self._yaw: float | None = None
        self._history: deque[tuple[float, ...]] = deque(maxlen=2 + round(2.0 / self._period))

    def forget(self) -> None:
        """Start after a reset, without what was before; the noise goes on."""
        self._yaw = None
        self._history.clear()
        self._factors: tuple[float, float] | None = None
        self._turned = self._counted_before = (0.0, 0.0)

    def _counted(self, turned: tuple[float, float], factors: tuple[float, float]
                 ) -> tuple[float, float]:
        # Encoders count what is turned: another factor does not move what was counted.
        if self._factors is not None and factors != self._factors:
            left, right = ((old - new) * angle for old, new, angle in zip(
                self._factors, factors, self._turned, strict=True))
            before = self._counted_before
            self._counted_before = (before[0] + left, before[1] + right)
        self._factors, self._turned = factors, turned
        before = self._counted_before
        return factors[0] * turned[0] + before[0], factors[1] * turned[1] + before[1]

    def _stale(self, delay: float) -> tuple[float, ...]:
        # The values of ``delay`` ago, linear between steps; those of now for an early stream.
        back = min(max(delay, 0.0) / self._period, len(self._history) - 1.0)
        whole = int(back)
        near = self._history[-1 - whole]
        share = back - whole
        if share == 0.0:
            return near
        far = self._history[-2 - whole]
        return tuple((1.0 - share) * a + share * b for a, b in zip(near, far, strict=True))

    def read(self, state: SimulatorState, plant: Plant, settings: Settings) -> Measured:
        """
        Return the readings at a state; call once a step.

        Parameters
        ----------
        state : SimulatorState
            Truth.
        plant : Plant
            Whose sensor effects count.
        settings : Settings
            Noise, bias and rounding.

        """
        model = sensor_model(plant, state)
        rate_left, rate_right, forward, yaw, _, _, ahead, *_ = state.row.tolist()
        turning = 0.0 if self._yaw is None else (yaw - self._yaw) / self._period
        self._yaw = yaw
        ahead -= yaw * yaw * settings.imu_x + turning * settings.imu_y
        left = forward * yaw - yaw * yaw * settings.imu_y + turning * settings.imu_x
        now = (rate_left, rate_right, *state.wheel_angles, yaw, ahead, left)
        self._history.append(now)
        rates = self._stale(model.delay_wheels) if model.delay_wheels else now
        inertial = self._stale(model.delay_imu) if model.delay_imu else now
        gyro = model.gyro_factor * inertial[4] + model.gyro_bias + settings.gyro_bias
        accel = [inertial[5] + settings.accel_bias, inertial[6], settings.gravity]
        heading = state.pose.heading
        wheel_rates = [rates[0] * model.encoder_left, rates[1] * model.encoder_right]
        angles = self._counted((rates[2], rates[3]), (model.encoder_left, model.encoder_right))
        if settings.sensor_noise:
            noise = self._random.standard_normal(7).tolist()
            gyro += settings.gyro_stddev * noise[0]
            accel = [a + settings.accel_stddev * n for a, n in zip(accel, noise[1:4], strict=True)]
            heading += settings.orientation_stddev * noise[4]
            wheel_rates = [r + settings.encoder_stddev * n
                           for r, n in zip(wheel_rates, noise[5:], strict=True)]
        if settings.encoder_ticks:
            tick = _TURN / settings.encoder_ticks
            angles = (_rounded(angles[0], tick), _rounded(angles[1], tick))
        gyro = _rounded(gyro, settings.gyro_resolution)
        x, y, z = (_rounded(value, settings.accel_resolution) for value in accel)
        return Measured((wheel_rates[0], wheel_rates[1]), angles, gyro, (x, y, z), heading)
