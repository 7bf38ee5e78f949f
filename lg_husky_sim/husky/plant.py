# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A robot with numbers: continuous matrices, laws, command stage and sensors."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
import math

from lg_husky_sim.husky.effects import Onset, OnsetKind
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np

#: Time over which an encoder counts its ticks to make a rate of them [s]: one period of the
#: Husky's joint states (50 Hz).
ENCODER_WINDOW = 0.02
#: Rows of the output matrices.
OUTPUTS = ('wheel_left', 'wheel_right', 'forward', 'yaw_rate', 'current_left', 'current_right',
           'accel_x', 'voltage_left', 'voltage_right')


@dataclass(frozen=True)
class CommandStage:
    """
    What happens to a commanded twist before it is a voltage.

    Parameters
    ----------
    latency : float
        Dead time [s].
    slew_forward, slew_yaw : float
        Acceleration limits [m/s², rad/s²]; infinite where there are none.
    limit_forward, limit_yaw : float
        Speed limits [m/s, rad/s]; infinite where there are none.
    volts_per_speed, volts_per_rate : float
        Eqs. (24), (25): left = speed − rate, right = speed + rate [V·s/m, V·s/rad].
    clamp : float
        Largest voltage [V]; 0 where a controller clamps instead.

    """

    volts_per_speed: float
    volts_per_rate: float
    clamp: float
    latency: float = 0.0
    slew_forward: float = np.inf
    slew_yaw: float = np.inf
    limit_forward: float = np.inf
    limit_yaw: float = np.inf


@dataclass(frozen=True)
class SensorModel:
    """
    How the sensors read the truth.

    Parameters
    ----------
    gyro_bias : float
        Added to the yaw rate [rad/s].
    gyro_factor, encoder_left, encoder_right : float
        Factors on the yaw rate and the wheel rates.
    delay_wheels, delay_imu, delay_pose : float
        How late the stamps of a stream are [s].
    bus_resistance : float
        Of the pack and its wires [Ω].
    droop_rate, droop_floor : float
        Share of the voltage that is lost per second [1/s], and the most that is lost.

    """

    gyro_bias: float = 0.0
    gyro_factor: float = 1.0
    encoder_left: float = 1.0
    encoder_right: float = 1.0
    delay_wheels: float = 0.0
    delay_imu: float = 0.0
    delay_pose: float = 0.0
    bus_resistance: float = 0.0
    droop_rate: float = 0.0
    droop_floor: float = 0.0

    def battery_voltage(self, supply: float, power: float, time: float) -> float:
        """
        Return the voltage of the pack, as the motors' drivers get it.

        Parameters
        ----------
        supply : float
            Without load, at the start [V].
        power : float
            That the motors take [W].
        time : float
            Since the start [s].

        """
        idle = supply * (1.0 - min(self.droop_rate * time, self.droop_floor))
        # V = idle - R I with V I = power.
        return 0.5 * (idle + math.sqrt(max(
            idle * idle - 4.0 * self.bus_resistance * power, 0.0)))


@dataclass(frozen=True, eq=False)
class PlantSet:
    """
    Continuous matrices of one regime, x the states of graph and controllers, u two voltages.

    Parameters
    ----------
    a, b, g : numpy.ndarray, shapes (n, n), (n, 2), (n, n_efforts)
        dx/dt = a x + b u + g f(z).
    h, k : numpy.ndarray, shapes (n_arguments, n), (n_arguments, 2)
        z = h x + k u.
    rows, rows_u, rows_f : numpy.ndarray, shapes (9, n), (9, 2), (9, n_efforts)
        Outputs, in the order of :data:`OUTPUTS`; accel_x is the specific force that an
        accelerometer gives (REP-145): on a slope it does not feel gravity's pull.
    laws, offsets : numpy.ndarray of int64, shape (n_efforts,)
    coefficients : numpy.ndarray, shape (n_efforts, laws.WIDTH)
    command : CommandStage
    sensors : SensorModel

    """

    a: FloatArray
    b: FloatArray
    g: FloatArray
    h: FloatArray
    k: FloatArray
    rows: FloatArray
    rows_u: FloatArray
    rows_f: FloatArray
    laws: np.typing.NDArray[np.int64]
    offsets: np.typing.NDArray[np.int64]
    coefficients: FloatArray
    command: CommandStage
    sensors: SensorModel


@dataclass(frozen=True, eq=False)
class Plant:
    """
    A robot with numbers.

    Parameters
    ----------
    sets : tuple of PlantSet
        One, or two where an effect begins at ``onset``.
    states : tuple of str
        Names of the n states.
    onset : Onset or None

    """

    sets: tuple[PlantSet, ...]
    states: tuple[str, ...]
    onset: Onset | None = field(default=None)

    @property
    def linear(self) -> bool:
        """Whether there are no efforts: the hold is then exact."""
        return all(s.laws.size == 0 for s in self.sets)

    def in_recording(self, name: str, earlier: Collection[str] = ()) -> Plant:
        """
        Return the plant as it is in one recording.

        An effect that begins at a time in a named recording is absent in earlier recordings and
        stays in all others; one that begins at a place is absent in earlier recordings only.

        Parameters
        ----------
        name : str
            Name of the recording.
        earlier : collection of str
            Names of further recordings made before that of the onset.

        Returns
        -------
        Plant
            With the onset where it falls into this recording, else with one set only.

        """
        onset = self.onset
        if onset is None or len(self.sets) < 2 or onset.recording in ('', name):
            return self
        before = name in (*earlier, *onset.earlier)
        if onset.kind.value != 'time' and not before:
            return self
        return Plant((self.sets[0 if before else 1],), self.states)

    def late(self, times: FloatArray, x: FloatArray) -> np.typing.NDArray[np.bool_]:
        """
        Return when the effects of the second set are on.

        Parameters
        ----------
        times, x : numpy.ndarray, shape (n,)
            On the recording's clock [s], and where the robot is then [m]; NaN if not known.

        Returns
        -------
        numpy.ndarray of bool, shape (n,)

        """
        if self.onset is None:
            return np.zeros(times.size, dtype=bool)
        return acts(self.onset, times, x)

    def observe(self, truth: TimeSeries) -> TimeSeries:
        """
        Return what the sensors read of a simulated truth, on the same stamps.

        Parameters
        ----------
        truth : TimeSeries
            Columns of the simulator.

        Returns
        -------
        TimeSeries
            The same columns; wheel rates as means over :data:`ENCODER_WINDOW` (an encoder counts
            ticks), wheel rates and angles by the encoders' factors, yaw rate by the gyro's factor
            and bias, every stream by its delay. Speed, distance, currents and voltages are left
            as they are.

        """
        late = self.late(truth.times, truth.column('x'))
        seen = [_observed(truth, one.sensors) for one in self.sets]
        values = np.where(late[:, None], seen[-1], seen[0])
        for side in ('angle_left', 'angle_right') if len(seen) > 1 else ():
            # Encoders count what is turned: another factor does not move what was counted.
            place = truth.names.index(side)
            early, later = (np.diff(one[:, place], prepend=one[0, place]) for one in seen)
            values[:, place] = seen[0][0, place] + np.cumsum(np.where(late, later, early))
        return TimeSeries(truth.times, values, truth.names)


def acts(onset: Onset, times: FloatArray, x: FloatArray) -> np.typing.NDArray[np.bool_]:
    """
    Return when effects with an onset act.

    Parameters
    ----------
    onset : Onset
        A time in the recording, or a place.
    times, x : numpy.ndarray, shape (n,)
        On the recording's clock [s], and where the robot is then [m]; NaN if not known.

    Returns
    -------
    numpy.ndarray of bool, shape (n,)

    """
    match onset.kind:
        case OnsetKind.TIME:
            return times >= onset.value
        case OnsetKind.PLACE_ABOVE:
            return x >= onset.value
        case OnsetKind.PLACE_BELOW:
            return x <= onset.value


def _observed(truth: TimeSeries, sensors: SensorModel) -> FloatArray:
    values = np.array(truth.values)
    column = {name: i for i, name in enumerate(truth.names)}
    before = truth.times - ENCODER_WINDOW
    counted = before >= truth.times[0] - 1e-9
    for side in ('left', 'right'):
        angle = truth.values[:, column[f'angle_{side}']]
        mean = (angle - np.interp(before, truth.times, angle)) / ENCODER_WINDOW
        values[:, column[f'wheel_{side}']] = np.where(
            counted, mean, truth.values[:, column[f'wheel_{side}']])
    truth = TimeSeries(truth.times, values, truth.names)
    for streams, delay in ((('wheel_left', 'wheel_right', 'angle_left', 'angle_right'),
                            sensors.delay_wheels),
                           (('yaw_rate', 'accel_x'), sensors.delay_imu),
                           (('x', 'y', 'heading'), sensors.delay_pose)):
        if delay != 0.0:
            for name in streams:
                values[:, column[name]] = np.interp(
                    truth.times - delay, truth.times, truth.values[:, column[name]])
    for side, factor in (('left', sensors.encoder_left), ('right', sensors.encoder_right)):
        values[:, column[f'wheel_{side}']] *= factor
        values[:, column[f'angle_{side}']] *= factor
    rate = values[:, column['yaw_rate']]
    values[:, column['yaw_rate']] = sensors.gyro_factor * rate + sensors.gyro_bias
    return values
