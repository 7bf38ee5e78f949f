# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
How far a residual may be off: scale of each value and its correlation in time.

The scale of a value has two parts: the channel's own noise, and the slope of the signal times an
uncertainty of its stamp, since a late stamp on a jump is no physics. The correlation is an
autoregression for each channel; applied as a filter it makes the residual white, so that a sum of
squares is a log-likelihood (in half nats).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from lg_husky_sim.identification.problem import Observations
from lg_husky_sim.identification.relations import apart, coefficients
from lg_husky_sim.identification.settings import least_noise, setting
from lg_husky_sim.signals import FloatArray
import numpy as np
from scipy.ndimage import maximum_filter1d

#: Order of the autoregression.
ORDER = 8


@dataclass(frozen=True, eq=False)
class Shared:
    """
    Directions of common errors, whitened.

    With the errors' coefficients drawn from a unit normal, the residual's covariance is
    I + U diag(s^2) U'. Its inverse root, which this applies, is I - U diag(t) U' with
    t = 1 - 1/sqrt(1 + s^2).

    Parameters
    ----------
    observations : Observations
        Kept, so that nothing else takes its identity.
    directions : numpy.ndarray, shape (n_values, n)
        U, orthonormal columns.
    taken : numpy.ndarray, shape (n,)
        Part of each direction that is taken away.

    """

    observations: Observations
    directions: FloatArray
    taken: FloatArray

    def without(self, white: FloatArray) -> FloatArray:
        """Return whitened values less their common part, shape as given."""
        along = self.directions.T @ white
        along *= self.taken if white.ndim == 1 else self.taken[:, None]
        left: FloatArray = white - self.directions @ along
        return left


def shared_of(observations: Observations, columns: FloatArray) -> Shared:
    """
    Return the directions of whitened columns.

    Parameters
    ----------
    observations : Observations
        Whose values the rows are.
    columns : numpy.ndarray, shape (n_values, n_common)
        Errors that all values have in common, whitened.

    Returns
    -------
    Shared

    """
    squares, rotation = np.linalg.eigh(columns.T @ columns)
    kept = squares > 1e-11 * max(float(squares.max(initial=0.0)), 1e-12)
    sizes = np.sqrt(squares[kept])
    directions = columns @ (rotation[:, kept] / sizes)
    return Shared(observations, directions, 1.0 - 1.0 / np.sqrt(1.0 + squares[kept]))


@dataclass(frozen=True, eq=False)
class Metric:
    """
    Scale and correlation of the measurement vector.

    Parameters
    ----------
    scale : numpy.ndarray, shape (n_values,)
        One over the standard deviation; zero for values that are left out.
    filters : mapping of str to numpy.ndarray
        For each channel the taps [1, -a1, ...] divided by the innovations' deviation.
    parts : mapping of str to mapping of str to float
        What is taken off a channel of others that see the same motion.

    """

    scale: FloatArray
    filters: Mapping[str, FloatArray]
    parts: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    _shared: dict[int, Shared] = field(default_factory=dict, init=False, repr=False)

    def __reduce__(self) -> tuple[type[Metric], tuple[Any, ...]]:
        """Leave out what was worked out for observations of this process."""
        return Metric, (self.scale, dict(self.filters), dict(self.parts))

    def whiten(self, observations: Observations, values: FloatArray) -> FloatArray:
        """
        Return values scaled, filtered and freed of common errors.

        Parameters
        ----------
        observations : Observations
            Whose values these are; with their common errors, if any.
        values : numpy.ndarray, shape (n_values,) or (n_values, k)
            Residuals, or columns of derivatives.

        Returns
        -------
        numpy.ndarray
            Shape as given.

        """
        white = self.filtered(observations, values)
        if observations.common is None:
            return white
        return self.shared(observations).without(white)

    def shared(self, observations: Observations) -> Shared:
        """
        Return what whitening does to the observations' common errors.

        Parameters
        ----------
        observations : Observations
            With the columns of their common errors, if any.

        Returns
        -------
        Shared

        """
        key = id(observations)
        if key not in self._shared:
            columns = observations.common
            self._shared[key] = shared_of(observations, np.zeros((
                observations.measured.size, 0)) if columns is None else self.filtered(
                    observations, columns))
        return self._shared[key]

    def filtered(self, observations: Observations, values: FloatArray) -> FloatArray:
        """
        Return values scaled and filtered, common errors left in.

        Parameters
        ----------
        observations : Observations
            Whose values these are.
        values : numpy.ndarray, shape (n_values,) or (n_values, k)
            Residuals, or columns of derivatives.

        Returns
        -------
        numpy.ndarray
            Shape as given.

        """
        scaled = apart(observations, self.parts, values) * (
            self.scale if values.ndim == 1 else self.scale[:, None])
        white = np.empty_like(scaled)
        for one in observations.slices:
            part, taps = scaled[one.first:one.last], self.filters[one.channel]
            filtered = white[one.first:one.last]
            np.multiply(part, taps[0], out=filtered)
            for lag in range(1, min(taps.size, part.shape[0])):
                filtered[lag:] += taps[lag] * part[:-lag]
        return white


def spread(values: FloatArray) -> float:
    """Return a robust standard deviation: 1.4826 times the median absolute deviation."""
    if values.size == 0:
        return 0.0
    return float(1.4826 * np.median(np.abs(values - np.median(values))))


def stepwise(values: FloatArray) -> float:
    """
    Return the standard deviation of values that mostly do not change, else 0.

    A counted encoder's reading stays on one step most of the time, so that the median tells
    nothing; the root mean square without the largest tenth does.

    Parameters
    ----------
    values : numpy.ndarray, shape (n,)
        Differences between neighbours.

    Returns
    -------
    float
        Standard deviation, if it were normal; 0 where the median can be believed.

    """
    sizes = np.sort(np.abs(values[np.abs(values) > 0.0]))
    inner = sizes[:int(0.9 * sizes.size)]
    if not inner.size:
        return 0.0
    size = float(np.sqrt(np.mean(inner ** 2))) / setting('trimmed_size')
    near = float(np.mean(np.abs(values) < 0.1 * size))
    return size if near > setting('stepped_share') else 0.0


def scales(observations: Observations, residual: FloatArray, predicted: FloatArray
           ) -> FloatArray:
    """
    Return one over the standard deviation of every value.

    Parameters
    ----------
    observations : Observations
        Channels and times of the values.
    residual, predicted : numpy.ndarray, shape (n_values,)
        Of a fit.

    Returns
    -------
    numpy.ndarray, shape (n_values,)

    """
    scale = np.zeros(residual.size)
    for name in observations.channels:
        slices = [s for s in observations.slices if s.channel == name]
        steps = np.concatenate([np.diff(residual[s.first:s.last]) for s in slices])
        level = max(spread(steps), stepwise(steps)) / np.sqrt(2.0)
        level = max(level, least_noise(name))
        whole = np.concatenate([residual[s.first:s.last] for s in slices])
        wide = spread(whole)
        for s in slices:
            part = slice(s.first, s.last)
            times = observations.times[part]
            slope = np.abs(np.gradient(predicted[part], np.maximum(times, times[0])
                                       + 1e-9 * np.arange(times.size)))
            slope = np.maximum(slope, np.maximum(np.roll(slope, 1), np.roll(slope, -1)))
            scale[part] = 1.0 / np.sqrt(level ** 2 + (slope * setting('stamp_uncertainty')) ** 2)
            if name in ('advance', 'turn'):
                far = setting('pose_jump') * max(wide, level)
                off = np.abs(residual[part] - np.median(whole)) > far
                scale[part][off] = 0.0
    return scale


def robust(observations: Observations, left: FloatArray, scale: FloatArray, limit: float
           ) -> FloatArray:
    """
    Return a scale that takes weight from single events that nothing explains.

    A lost command or a slipping wheel leaves a few values far off; they must not decide between
    hypotheses about all the others.

    Parameters
    ----------
    observations : Observations
        Whose values these are.
    left : numpy.ndarray, shape (n_values,)
        Residual that neither a fit nor any candidate explains.
    scale : numpy.ndarray, shape (n_values,)
        One over the standard deviation, as :func:`scales` gives it.
    limit : float
        Robust deviations from which a value loses weight.

    Returns
    -------
    numpy.ndarray, shape (n_values,)

    """
    weighted = np.array(scale)
    for name in observations.channels:
        slices = [s for s in observations.slices if s.channel == name]
        wide = max(spread(np.concatenate([(left * scale)[s.first:s.last] for s in slices])), 1.0)
        for s in slices:
            size = np.abs((left * scale)[s.first:s.last]) / wide
            near = maximum_filter1d(size, 7)
            weighted[s.first:s.last] *= np.minimum(1.0, limit / np.maximum(near, 1e-9))
    return weighted


def metric(observations: Observations, residual: FloatArray, scale: FloatArray,
           order: int = ORDER, related: bool = False) -> Metric:
    """
    Estimate the correlation of a residual.

    Parameters
    ----------
    observations : Observations
        Whose values these are.
    residual : numpy.ndarray, shape (n_values,)
        With everything projected out that could be physics, so that none of it passes for noise.
    scale : numpy.ndarray, shape (n_values,)
        As :func:`scales` gives it.
    order : int
        Of the autoregression.
    related : bool
        Whether errors of the motion that stand in several channels are taken off.

    Returns
    -------
    Metric

    """
    parts = coefficients(observations, residual, scale) if related else {}
    residual = apart(observations, parts, residual)
    filters = {}
    for name in observations.channels:
        scaled = [(residual * scale)[s.first:s.last] for s in observations.slices
                  if s.channel == name]
        filters[name] = _taps(scaled, order)
    return Metric(scale, filters, parts)


def believable(observations: Observations, one: Metric) -> Metric:
    """
    Return a metric whose noise is nowhere below the smallest that is believed.

    The residual of a perfect fit is rounding; no sensor could tell two such fits apart.
    """
    filters = {}
    for name in observations.channels:
        sharpest = max(float(np.max(one.scale[s.first:s.last], initial=0.0))
                       for s in observations.slices if s.channel == name)
        filters[name] = one.filters[name] / max(
            1.0, float(one.filters[name][0]) * sharpest * least_noise(name))
    return Metric(one.scale, filters, one.parts)


def _taps(parts: list[FloatArray], order: int) -> FloatArray:
    # Yule-Walker on values clipped at four deviations, pooled over the segments.
    deviation = max(float(np.sqrt(np.mean(np.concatenate(parts) ** 2))), 1e-12)
    robust = max(spread(np.concatenate(parts)), 0.2 * deviation)
    clipped = [np.clip(part, -4.0 * robust, 4.0 * robust) for part in parts]
    longest = max(part.size for part in clipped)
    order = max(0, min(order, longest // 10))
    total = sum(part.size for part in clipped)
    covariance = np.array([
        sum(float(part[lag:] @ part[:part.size - lag]) for part in clipped if part.size > lag)
        for lag in range(order + 1)]) / total
    covariance[0] = covariance[0] * (1.0 + 1e-6) + 1e-12
    index = np.abs(np.subtract.outer(np.arange(order), np.arange(order)))
    taps = np.concatenate([[1.0], -np.linalg.solve(covariance[index], covariance[1:])]) if (
        order) else np.ones(1)
    innovations = np.concatenate([np.convolve(taps, part)[:part.size] for part in parts])
    level = max(float(np.sqrt(np.mean(np.clip(
        innovations, -5.0 * max(spread(innovations), 1e-9),
        5.0 * max(spread(innovations), 1e-9)) ** 2))), 1e-9)
    filtered: FloatArray = taps / level
    return filtered
