# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Noise: what nobody can predict, at the balances of the graph and in the sensors.

The variance of a sensor's reading is ``sigma^2 + q^2 / 12 + sigma_t^2 (dy/dt)^2``: one that is
rounded to q is off by q/sqrt(12), by the same when it repeats, and a stamp that is off by sigma_t
leaves an error of that slope. A command that comes by s later than it should leaves a step of the
speeds of s times what its voltages accelerate. Intensities are found by maximum likelihood.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
import math

from lg_husky_sim.diagnosis.evidence import student
from lg_husky_sim.diagnosis.evidence.drives import Channel, Drive
from lg_husky_sim.diagnosis.evidence.frames import Frame
from lg_husky_sim.diagnosis.evidence.whitener import (
    gains,
    MODEL,
    PROCESS,
    STATES,
    whiten,
    whiten_switched,
)
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.robot_size import HUSKY, RobotSize
from lg_husky_sim.signals import FloatArray
import numpy as np

#: What is estimated; the values are logarithms of positive numbers.
NAMES = ('force', 'moment', 'drive', 'force_time', 'moment_time', 'drive_time', 'place_walk',
         'heading_walk', 'wheel', 'wheel_jitter', 'gyro', 'imu_jitter', 'place', 'heading',
         'pose_jitter', 'command_jitter')
#: Units of those that are larger for a larger robot.
UNITS = {'force': 'N', 'moment': 'N·m', 'drive': 'N·m'}


@dataclass(frozen=True)
class Noise:
    """
    Intensities of all noise.

    Parameters
    ----------
    values : mapping of str to float
        Force [N], moment and drive [N·m] (standard deviations), their time constants [s], walks
        of place [m/sqrt(s)] and heading [rad/sqrt(s)], sensors: wheel [rad/s or rad], gyro
        [rad/s], place [m], heading [rad], and jitter of the stamps of each stream and of
        commands [s].

    """

    values: Mapping[str, float]

    def process(self) -> FloatArray:
        """Return the process vector of the whitener."""
        known = {**self.values, 'bias_walk': setting('bias_walk')}
        return np.array([known[name] for name in PROCESS])


def reach_of(noise: Noise) -> float:
    """Return how far from the mean delay that of a base at its own rate may be [s]."""
    return setting('late_by_jitter') * noise.values['command_jitter']


def sensor_variance(frame: Frame, noise: Noise) -> FloatArray:
    """Return the variance of the sensor noise of each reading of a drive."""
    values = noise.values
    size = {Channel.WHEEL_LEFT: ('wheel', 'wheel_jitter'),
            Channel.WHEEL_RIGHT: ('wheel', 'wheel_jitter'),
            Channel.ANGLE_LEFT: ('wheel', 'wheel_jitter'),
            Channel.ANGLE_RIGHT: ('wheel', 'wheel_jitter'),
            Channel.YAW_RATE: ('gyro', 'imu_jitter'), Channel.X: ('place', 'pose_jitter'),
            Channel.Y: ('place', 'pose_jitter'), Channel.HEADING: ('heading', 'pose_jitter')}
    out = np.empty(frame.times.size)
    for channel, (level, jitter) in size.items():
        part = frame.drive.slice_of(channel)
        out[part] = (frame.drive.rounding[part] + values[level] ** 2
                     + (values[jitter] * frame.slopes[part]) ** 2)
        if level == 'wheel' and not frame.drive.still:
            # They tell how the drive begins; what has been commanded until then is not known.
            out[part] += np.where(frame.times[part] < frame.drive.start + setting('start_window'),
                                  setting('start_wheels') ** 2, 0.0)
    return out


@dataclass(frozen=True, eq=False)
class Whitener:
    """
    The innovations filter of one drive, with its gains.

    Parameters
    ----------
    frame : Frame
    model, process : numpy.ndarray
    gain, scale : numpy.ndarray
        As in :func:`whitener.gains`.

    """

    frame: Frame
    model: FloatArray
    process: FloatArray
    gain: FloatArray
    scale: FloatArray

    def apply(self, residuals: FloatArray) -> FloatArray:
        """
        Whiten residuals.

        Parameters
        ----------
        residuals : numpy.ndarray, shape (n,) or (n, m)
            In the order of the readings.

        Returns
        -------
        numpy.ndarray, the same shape
            Innovations over their standard deviations, in the order of time.

        """
        columns = np.ascontiguousarray(residuals.reshape(residuals.shape[0], -1))
        out = np.empty_like(columns)
        frame = self.frame
        whiten(columns, frame.times, frame.drive.channels, frame.order, frame.cosine, frame.sine,
               self.model, self.process, setting('longest_step'), self.gain, self.scale, out)
        return out.reshape(residuals.shape)

    def switched(self, change: FloatArray, states: FloatArray, on: np.typing.NDArray[np.uint8]
                 ) -> FloatArray:
        """
        Whiten a change of readings that is switched on and off, see :func:`whiten_switched`.

        Parameters
        ----------
        change : numpy.ndarray, shape (n,)
            In the order of the readings.
        states : numpy.ndarray, shape (n, 12)
            What the change has built up at each reading, in the states of the deviation model.
        on : numpy.ndarray of uint8, shape (n, m)
            Both in the order of time.

        Returns
        -------
        numpy.ndarray, shape (n, m)

        """
        out = np.empty(on.shape)
        frame = self.frame
        whiten_switched(np.ascontiguousarray(change), states, on, frame.times,
                        frame.drive.channels, frame.order, frame.cosine, frame.sine, self.model,
                        self.process, setting('longest_step'), self.gain, self.scale, out)
        return out


def whitener_of(frame: Frame, model: FloatArray, noise: Noise) -> Whitener:
    """Run the filter's covariances over a drive."""
    n = frame.times.size
    gain, scale = np.empty((n, STATES)), np.empty(n)
    process = noise.process()
    variance = sensor_variance(frame, noise)
    initial = np.zeros(STATES)
    initial[:4] = process[[0, 1, 2, 2]] ** 2
    moving = 1.0 if frame.drive.still else setting('moving_start')
    initial[4:6] = (moving * setting('start_speed')) ** 2
    initial[7] = setting('start_heading') ** 2
    initial[8:10] = setting('start_place') ** 2
    initial[10:12] = setting('start_angle') ** 2
    kicks = np.array(frame.kicks)
    # The torque of a wheel that no torque moves is not unsure: its loop holds it.
    moved = np.array([model[MODEL.index('left_by_left')],
                      model[MODEL.index('right_by_right')]]) ** 2
    stiff = moved < setting('unmoved') ** 2
    kicks[:, 1:3] = np.where(stiff, 0.0, kicks[:, 1:3] / np.where(stiff, 1.0, moved))
    gains(frame.times, frame.drive.channels, frame.order, variance, frame.cosine, frame.sine,
          model, process, initial, setting('longest_step'), kicks, gain, scale)
    return Whitener(frame, model, process, gain, scale)


def negative_log_likelihood(whitened: FloatArray, scale: FloatArray) -> float:
    """
    Return the negative log likelihood of innovations with Student's t (up to a constant).

    Parameters
    ----------
    whitened, scale : numpy.ndarray, shape (n,)
        Innovations in standard deviations, and these in the units of the readings.

    """
    return student.cost(whitened) + float(np.sum(np.log(scale)))


def _first(name: str, robot: RobotSize) -> float:
    return robot.factor(UNITS.get(name, '1')) * setting(f'first_{name}')


def first_guess(drives: Sequence[Drive], robot: RobotSize = HUSKY) -> Noise:
    """Return where the search for the intensities begins: sensors from their differences."""
    def level(*channels: Channel) -> float:
        found = []
        for drive in drives:
            for channel in channels:
                values = drive.measured[drive.slice_of(channel)]
                if values.size > 8:
                    second = np.diff(values, 2)
                    found.append(1.4826 * float(np.median(np.abs(second))) / math.sqrt(6.0))
        return max(float(np.median(found)) if found else 0.0, 1e-4)
    wheels = level(Channel.WHEEL_LEFT, Channel.WHEEL_RIGHT, Channel.ANGLE_LEFT,
                   Channel.ANGLE_RIGHT)
    values = {name: _first(name, robot) for name in NAMES
              if name not in ('wheel', 'gyro', 'place', 'heading')}
    values |= {'wheel': 1.5 * wheels, 'gyro': 1.5 * level(Channel.YAW_RATE),
               'place': 1.5 * level(Channel.X, Channel.Y), 'heading': 1.5 * level(
                   Channel.HEADING)}
    return Noise(values)


def _bounds(longest: float, robot: RobotSize
            ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    centre = np.array([math.log(_first(n, robot)) if n not in (
        'wheel', 'gyro', 'place', 'heading') else 0.0 for n in NAMES])
    spread = np.array([setting('time_spread') if n.endswith('_time') else setting('noise_spread')
                       if n not in ('wheel', 'gyro', 'place', 'heading') else 50.0
                       for n in NAMES])
    lower = np.array([math.log(setting('least_time')) if n.endswith('_time') else -16.0
                      for n in NAMES])
    upper = np.array([math.log(longest) if n.endswith('_time') else 6.0
                      for n in NAMES])
    return centre, spread, lower, upper


def fit_noise(start: Noise, frames: Sequence[Frame], models: Sequence[FloatArray],
              residuals: Sequence[FloatArray], pool: Executor, rounds: int, longest: float,
              robot: RobotSize = HUSKY) -> Noise:
    """
    Find the intensities of all noise by maximum likelihood (Fisher scoring).

    Parameters
    ----------
    start : Noise
        Intensities to begin with.
    frames, models, residuals : sequence
        One a drive: its frame, the deviation model and the residuals of a simulation.
    pool : concurrent.futures.Executor
        Threads for the independent filters.
    rounds : int
        Largest number of scoring steps.
    longest : float
        Longest time constant of a disturbance [s].
    robot : RobotSize
        Of which the disturbances are.

    Returns
    -------
    Noise

    """
    centre, spread, lower, upper = _bounds(longest, robot)
    step = 0.05

    def run(place: FloatArray) -> tuple[float, FloatArray, FloatArray]:
        noise = Noise(dict(zip(NAMES, np.exp(place).tolist(), strict=True)))
        whitened, scales = [], []
        for frame, model, residual in zip(frames, models, residuals, strict=True):
            filtered = whitener_of(frame, model, noise)
            whitened.append(filtered.apply(residual))
            scales.append(filtered.scale)
        e, s = np.concatenate(whitened), np.concatenate(scales)
        cost = negative_log_likelihood(e, s) + 0.5 * float(np.sum(
            ((place - centre) / spread) ** 2))
        return cost, e, np.log(s)

    def weighed(e: FloatArray, moved: FloatArray, ds: FloatArray) -> tuple[FloatArray, FloatArray]:
        # Of innovations e/S^(1/2): information 2 (d ln s)^2 + (d (e s)/s)^2.
        fisher = 2.0 * ds.T @ ds + moved.T @ moved + np.diag(spread ** -2.0)
        slope = e * student.weights(e)
        gradient = (slope @ moved + (1.0 - slope * e) @ ds + (place - centre) / spread ** 2)
        # A forward difference carries half of the curvature of its own step.
        return fisher, gradient - 0.5 * step * np.diag(fisher)

    place = np.clip(np.log([start.values[n] for n in NAMES]), lower, upper)
    cost, e, logs = run(place)
    damping, least = 1e-3, setting('noise_converged')
    for _ in range(rounds):
        shifted = list(pool.map(run, [place + step * row for row in np.eye(place.size)]))
        ds = np.column_stack([(one[2] - logs) / step for one in shifted])
        moved = np.column_stack([(one[1] - e) / step for one in shifted]) + e[:, None] * ds
        gained, first = math.inf, None
        # Derivatives are kept while they foretell what a step gains.
        while gained > least:
            fisher, gradient = weighed(e, moved, ds)
            before, hoped = cost, 0.0
            for _ in range(6):
                move = np.linalg.solve(fisher + damping * np.diag(np.diag(fisher)), -gradient)
                tried = np.clip(place + np.clip(move, -1.5, 1.5), lower, upper)
                new = run(tried)
                if new[0] < cost:
                    move = tried - place
                    hoped = -float(gradient @ move + 0.5 * move @ fisher @ move)
                    place, (cost, e, logs) = tried, new
                    damping = max(damping * 0.3, 1e-4)
                    break
                damping = max(damping, 1e-3) * 8.0
                if first is not None:
                    break
            gained = before - cost
            first = gained if first is None else first
            if gained < setting('trusted_slopes') * hoped:
                break
        if first is None or first < least:
            break
    return Noise(dict(zip(NAMES, np.exp(place).tolist(), strict=True)))
