# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
What the readings of a drive say of when each step of its commands came.

With the change c_i of the readings for each second that a step of the commands comes later, the
residuals r of a simulation that applies all as they come are those of delays d_i, which vary by
s, by::

    |r - C d|^2 = |r|^2 - 2 b'd + d'G d,   b = C'r,   G = C'C,   d = (G + I/s^2)^-1 b
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix, identity
from scipy.sparse.linalg import spsolve

#: Residuals of rates, each with its times [s].
Rates = Sequence[tuple[FloatArray, FloatArray]]


@dataclass(frozen=True, eq=False)
class Steps:
    """
    What the readings of a drive say of when each step of its commands came.

    Parameters
    ----------
    stamps : numpy.ndarray, shape (n,)
        [s]
    slope : numpy.ndarray, shape (n,)
        The b of the module's formula [1/s].
    curvature : scipy.sparse.csc_matrix, shape (n, n)
        Its G [1/s^2].
    delays : numpy.ndarray, shape (n,)
        Its d, against the delay of the log [s].
    weights : numpy.ndarray, shape (n,)
        How much of each delay comes from the readings, and not from the prior (0 to 1).
    scales : list of float
        One over the standard deviation of the residuals of each rate.

    """

    stamps: FloatArray
    slope: FloatArray
    curvature: csc_matrix
    delays: FloatArray
    weights: FloatArray
    scales: list[float]

    @property
    def late(self) -> float:
        """Return the mean delay [s]."""
        return float(self.weights @ self.delays / np.sum(self.weights))

    @property
    def scatter(self) -> float:
        """Return the standard deviation of the delays [s]."""
        return float(np.sqrt(self.weights @ (self.delays - self.late) ** 2
                             / np.sum(self.weights)))

    def clock_costs(self, periods: FloatArray, origin: float, count: int) -> ClockCosts:
        """
        Return how well clocks of some periods and of so many phases fit, by the linear problem.

        Parameters
        ----------
        periods : numpy.ndarray, shape (n,)
            [s]
        origin : float
            Phases are counted from here [s].
        count : int
            Phases of each period, evenly spaced.

        Returns
        -------
        ClockCosts

        """
        one = np.ones(self.stamps.size)
        whole = self.curvature @ one
        stiffness = float(one @ whole)
        phases = origin + periods[:, None] * np.arange(count) / count
        ticks = np.mod(phases.ravel() - self.stamps[:, None], np.repeat(periods, count))
        late = (one @ self.slope - whole @ ticks) / stiffness
        cost = (0.5 * np.sum(ticks * (self.curvature @ ticks), axis=0) - self.slope @ ticks
                - 0.5 * stiffness * late ** 2)
        return ClockCosts(cost.reshape(phases.shape), late.reshape(phases.shape), stiffness)


@dataclass(frozen=True, eq=False)
class ClockCosts:
    """
    How well clocks fit: what they cost where commands are late by l beside, K/2 (l - late)^2 more.

    Parameters
    ----------
    cost, late : numpy.ndarray, shape (periods, phases)
        At the likeliest lateness, and that [s].
    stiffness : float
        K [1/s^2].

    """

    cost: FloatArray
    late: FloatArray
    stiffness: float

    def __add__(self, other: ClockCosts) -> ClockCosts:
        """Return how well the same clocks fit both, as late."""
        whole = self.stiffness + other.stiffness
        late = (self.stiffness * self.late + other.stiffness * other.late) / whole
        apart = self.stiffness * other.stiffness / whole * (self.late - other.late) ** 2
        return ClockCosts(self.cost + other.cost + 0.5 * apart, late, whole)

    def phases(self, late: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
        """Return the likeliest phase of each period, as late as given for it, and its cost."""
        cost = self.cost + 0.5 * self.stiffness * (late[:, None] - self.late) ** 2
        best = np.argmin(cost, axis=1)
        return best, np.take_along_axis(cost, best[:, None], axis=1)[:, 0]


def scaled(rates: Rates, scales: Sequence[float]) -> FloatArray:
    """Return all of them in one, each over its scale."""
    return np.concatenate([own * scale for (own, _), scale in zip(rates, scales, strict=True)])


def _late(commands: TimeSeries, chosen: NDArray[np.intp], by: float) -> TimeSeries:
    # Commands of which some steps come later, the others when they do.
    times, values = commands.times, commands.values
    steps = np.diff(values, axis=0, prepend=values[:1])
    every = np.unique(np.concatenate([times, times[chosen] + by]))
    held = values[np.searchsorted(times, every, side='right') - 1].copy()
    for k in chosen:
        missing = (every >= times[k]) & (every < times[k] + by)
        held[missing] -= steps[k]
    return TimeSeries(every, held, commands.names)


def steps_of(commands: TimeSeries, span: tuple[float, float],
             read: Callable[[TimeSeries], Rates], delay: float, early: float, spread: float
             ) -> Steps | None:
    """
    Return when each step of a drive's commands seems to have come.

    Parameters
    ----------
    commands : TimeSeries
        As they come.
    span : tuple of float
        Start and end of the drive [s].
    read : callable
        Returns the residuals of the rates with some commands.
    delay : float
        From a command to its effect [s].
    early : float
        Time before its effect in which rates show it already [s].
    spread : float
        What delays vary by [s].

    Returns
    -------
    Steps or None
        None where no rate or no step of a command is known, or none shows in a rate.

    """
    moved = np.flatnonzero(np.any(np.diff(commands.values, axis=0) != 0.0, axis=1)) + 1
    moved = moved[(commands.times[moved] > span[0]) & (commands.times[moved] < span[1])]
    rates = read(commands)
    if moved.size < int(setting('clock_steps')) or not rates:
        return None
    # Of what is steady, for the linear problem.
    scales = [1.0 / max(float(np.median(np.abs(own))), 1e-9) for own, _ in rates]
    residual, times = scaled(rates, scales), np.concatenate([at for _, at in rates])
    window, by = setting('clock_window'), setting('clock_step')
    usual = float(np.median(np.diff(commands.times[moved])))
    count = max(2, int(np.ceil((window + by) / usual)))
    order = np.argsort(times, kind='stable')
    stamps = commands.times[moved]
    rows, columns, values = [], [], []
    for first in range(count):
        chosen = np.arange(first, moved.size, count)
        change = (residual - scaled(read(_late(commands, moved[chosen], by)), scales)) / by
        for k in chosen:
            begin, end = np.searchsorted(times[order], stamps[k] + delay + np.array([
                -early, window]))
            own = order[begin:end]
            rows.append(own)
            columns.append(np.full(own.size, k))
            values.append(change[own])
    matrix = csc_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))),
                        shape=(residual.size, moved.size))
    if not matrix.count_nonzero():
        return None
    curvature = (matrix.T @ matrix).tocsc()
    slope = np.asarray(matrix.T @ residual).ravel()
    delays = spsolve(curvature + identity(moved.size, format='csc') / spread ** 2, slope)
    known = curvature.diagonal()
    return Steps(stamps, slope, curvature, delays, known / (known + 1.0 / spread ** 2),
                 [1.0 / max(float(np.std(own)), 1e-9) for own, _ in rates])
