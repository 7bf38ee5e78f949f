# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Simple models to be better than, fitted channel by channel to the same values.

The first-order lag with delay is what NorLab's DRIVE fits to a skid-steer's wheels; the kinematic
model is a differential drive with an effective track.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.identification.problem import Channel, FitSegment, Observations, PERIOD
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.simulation.simulator import hold
from lg_husky_sim.simulation.starting import commanded_until
import numpy as np
from scipy.optimize import minimize
from scipy.signal import lfilter

Predictor = Callable[[Observations], FloatArray]
#: Start values of the lag's time constant and delay [s].
STARTS = ((0.1, 0.05), (0.3, 0.1), (0.2, 0.3))
LARGEST_DELAY = 1.0
#: Which commands drive a channel: columns of (forward, yaw).
_INPUTS = {'wheel_left': (0, 1), 'wheel_right': (0, 1), 'yaw_rate': (1,), 'advance': (0,),
           'turn': (1,)}


@dataclass(frozen=True)
class Lag:
    """
    A first-order lag with delay of one channel.

    Parameters
    ----------
    gains : tuple of float
        On the commands that drive the channel.
    time_constant, delay : float
        [s]

    """

    gains: tuple[float, ...]
    time_constant: float
    delay: float


def driven(segment: FitSegment, channel: Channel, time_constant: float, delay: float
           ) -> FloatArray:
    """
    Return a channel's commands after a unit lag and a delay, as the channel would see them.

    Parameters
    ----------
    segment : FitSegment
        With its commands and the state at its start.
    channel : Channel
        Says which commands matter, and whether values are increments over a window.
    time_constant, delay : float
        [s]; a time constant of 0 is no lag.

    Returns
    -------
    numpy.ndarray, shape (n_values, n_inputs)
        Averages over the window for increments.

    """
    commands = segment.commands
    late = TimeSeries(commands.times + delay, commands.values, commands.names)
    held = hold(late, segment.start, PERIOD, segment.count)
    last = commanded_until(segment.start, commands, segment.twist, segment.initial_wheel_rates)
    before = np.array([[last.forward, last.yaw]])
    held[:max(0, round(delay / PERIOD))] = before
    states: FloatArray = held
    if time_constant > 0.0:
        pole = np.exp(-PERIOD / time_constant)
        states = lfilter([1.0 - pole], [1.0, -pole], held, axis=0,
                         zi=before * pole)[0]
    grid = np.vstack([held[:1] if time_constant <= 0.0 else before, states])
    way = np.vstack([np.zeros((1, 2)), np.cumsum(0.5 * (grid[1:] + grid[:-1]), axis=0)]) * PERIOD
    columns = []
    for column in _INPUTS[channel.name]:
        if channel.name in ('advance', 'turn'):
            span = channel.times - channel.begins
            columns.append((_at(way[:, column], segment.start, channel.times)
                            - _at(way[:, column], segment.start, channel.begins)) / span)
        else:
            columns.append(_at(grid[:, column], segment.start, channel.times))
    return np.column_stack(columns)


def _at(column: FloatArray, start: float, times: FloatArray) -> FloatArray:
    grid = start + PERIOD * np.arange(column.size)
    sampled: FloatArray = np.interp(times, grid, column)
    return sampled


def _stacked(data: Observations, name: str, time_constant: float, delay: float
             ) -> tuple[FloatArray, FloatArray]:
    inputs, values = [], []
    for segment in data.segments:
        for channel in segment.channels:
            if channel.name == name:
                inputs.append(driven(segment, channel, time_constant, delay))
                values.append(channel.values)
    return np.concatenate(inputs), np.concatenate(values)


def _robust_gains(inputs: FloatArray, values: FloatArray) -> tuple[FloatArray, float]:
    # Least squares, twice more with values beyond four robust deviations left out.
    use = np.ones(values.size, dtype=bool)
    gains: FloatArray = np.zeros(inputs.shape[1])
    for _ in range(3):
        solved = np.linalg.lstsq(inputs[use], values[use], rcond=None)[0]
        gains = np.asarray(solved, dtype=np.float64)
        error = values - inputs @ gains
        limit = 4.0 * 1.4826 * float(np.median(np.abs(error))) + 1e-9
        use = np.abs(error) <= limit
    cost = float(np.mean(np.minimum(np.abs(error), limit) ** 2))
    return gains, cost


def fit_lags(data: Observations) -> dict[str, Lag]:
    """
    Fit a first-order lag with delay to each channel.

    Parameters
    ----------
    data : Observations
        Measured channels of all segments, with their commands.

    Returns
    -------
    dict of str to Lag
        By channel.

    """
    fitted = {}
    for name in data.channels:
        def cost(point: FloatArray, channel: str = name) -> float:
            constant, delay = abs(float(point[0])), min(abs(float(point[1])), LARGEST_DELAY)
            return _robust_gains(*_stacked(data, channel, constant, delay))[1]
        best = min((minimize(cost, start, method='Nelder-Mead',
                             options={'xatol': 1e-3, 'fatol': 1e-9, 'maxiter': 80})
                    for start in STARTS), key=lambda found: float(found.fun))
        constant, delay = abs(float(best.x[0])), min(abs(float(best.x[1])), LARGEST_DELAY)
        gains, _ = _robust_gains(*_stacked(data, name, constant, delay))
        fitted[name] = Lag(tuple(map(float, gains)), constant, delay)
    return fitted


def lag_predictor(lags: dict[str, Lag]) -> Predictor:
    """Return the prediction of fitted lags."""
    def predict(data: Observations) -> FloatArray:
        return np.concatenate([
            driven(segment, channel, lags[channel.name].time_constant, lags[channel.name].delay)
            @ np.array(lags[channel.name].gains)
            for segment in data.segments for channel in segment.channels])
    return predict


@dataclass(frozen=True)
class Kinematics:
    """
    A differential drive without dynamics.

    Parameters
    ----------
    radius : float
        Effective wheel radius [m].
    arm : float
        Half the track by which the base turns a yaw command into wheel rates [m].
    track : float
        Effective track by which wheel rates turn the robot [m].

    """

    radius: float
    arm: float
    track: float


def fit_kinematics(data: Observations, parameters: Parameters) -> Kinematics:
    """
    Fit the kinematic skid-steer model.

    Parameters
    ----------
    data : Observations
        Measured channels of all segments, with their commands.
    parameters : Parameters
        For what cannot be fitted: radius and track where no wheel rates were recorded.

    Returns
    -------
    Kinematics

    """
    radius, arm = parameters['wheel_radius'], 0.5 * parameters['track']
    if 'wheel_left' in data.channels:
        inputs, values = zip(*(_stacked(data, name, 0.0, 0.0)
                               for name in ('wheel_left', 'wheel_right')), strict=True)
        mirrored = np.vstack([inputs[0] * np.array([1.0, -1.0]), inputs[1]])
        gains, _ = _robust_gains(mirrored, np.concatenate(values))
        if gains[0] > 0.0:
            radius = 1.0 / float(gains[0])
            # A drive without turns does not show the arm.
            arm = radius * float(gains[1]) if gains[1] > 0.0 else arm
    name = 'yaw_rate' if 'yaw_rate' in data.channels else 'turn'
    track = 2.0 * arm
    if name in data.channels:
        gains, _ = _robust_gains(*_stacked(data, name, 0.0, 0.0))
        track = 2.0 * arm / float(gains[0]) if gains[0] > 0.0 else track
    return Kinematics(radius, arm, track)


def kinematic_predictor(model: Kinematics) -> Predictor:
    """Return the prediction of the kinematic model."""
    ratio = 2.0 * model.arm / model.track
    gains = {'wheel_left': (1.0 / model.radius, -model.arm / model.radius),
             'wheel_right': (1.0 / model.radius, model.arm / model.radius),
             'yaw_rate': (ratio,), 'turn': (ratio,), 'advance': (1.0,)}

    def predict(data: Observations) -> FloatArray:
        return np.concatenate([
            driven(segment, channel, 0.0, 0.0) @ np.array(gains[channel.name])
            for segment in data.segments for channel in segment.channels])
    return predict
