# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Bases that apply commands at their own ticks, not when they come.

The command with the stamp t_i is applied at the next tick, ``(phase - t_i) mod period`` later, and
of several between two ticks the last one counts. With the change c_i of the readings for each
second that a step of the commands comes later, the residuals r of a simulation that applies all as
they come are those of delays d_i, which vary by s, by::

    |r - C d|^2 = |r|^2 - 2 b'd + d'G d,   b = C'r,   G = C'C,   d = (G + I/s^2)^-1 b

Their first harmonic, ``period / pi * sin(2 pi (t_i - phase) / period)``, stands out of their
spectrum over the stamps at the base's rate. What is linear here finds rates and phases to begin
with; which of them it is, simulations say.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from lg_husky_sim.diagnosis.evidence.drives import Channel, Clock, Drive
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.evidence.observation import observe, simulate
from lg_husky_sim.diagnosis.evidence.reading import Reading
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len
from scipy.sparse import csc_matrix, identity
from scipy.sparse.linalg import spsolve

_RATES = (Channel.WHEEL_LEFT, Channel.WHEEL_RIGHT, Channel.YAW_RATE)
_ANGLES = (Channel.ANGLE_LEFT, Channel.ANGLE_RIGHT)


def at_ticks(commands: TimeSeries, period: float, phase: float) -> TimeSeries:
    """
    Return commands when a base applies them.

    Parameters
    ----------
    commands : TimeSeries
        When they come.
    period, phase : float
        Of its ticks [s].

    Returns
    -------
    TimeSeries
        At the next tick each; of several between two ticks the last one.
    """
    number = np.ceil((commands.times - phase) / period)
    last = np.append(np.diff(number) > 0.5, True)
    return TimeSeries(phase + period * number[last], commands.values[last], commands.names)


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
        """The mean delay [s]."""
        return float(self.weights @ self.delays / np.sum(self.weights))

    def clock(self, periods: FloatArray, count: int, known: float | None = None) -> Clock:
        """
        Return the likeliest clock of some periods and of so many phases, by the linear problem.

        Parameters
        ----------
        periods : numpy.ndarray, shape (n,)
            [s]
        count : int
        known : float, optional
            How late commands act beside [s]; the likeliest of each clock if not given.

        Returns
        -------
        Clock
        """
        one = np.ones(self.stamps.size)
        whole = self.curvature @ one
        stiffness = float(one @ whole)
        best, found = np.inf, Clock(0.0, 0.0, 0.0)
        for period in periods.tolist():
            phases = self.stamps[0] + period * np.arange(count) / count
            ticks = np.mod(phases - self.stamps[:, None], period)
            late = (one @ self.slope - whole @ ticks) / stiffness
            apart = 0.0 if known is None else known - late
            cost = (0.5 * np.sum(ticks * (self.curvature @ ticks), axis=0) - self.slope @ ticks
                    - 0.5 * stiffness * (late ** 2 - apart ** 2))
            place = int(np.argmin(cost))
            if cost[place] < best:
                best, found = float(cost[place]), Clock(
                    period, float(phases[place]), float(late[place]) if known is None else known)
        return found


def _rated(drive: Drive, values: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    # Rates of wheels and yaw, or what angles change by, each with its times.
    found = []
    for channel in (*_RATES, *_ANGLES):
        rows = drive.slice_of(channel)
        if rows.stop > rows.start:
            own, times = values[rows], drive.times[rows]
            found.append((own, times) if channel in _RATES else (np.diff(own), times[1:]))
    return found


def _scaled(rates: Sequence[tuple[FloatArray, FloatArray]], scales: Sequence[float]) -> FloatArray:
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


def steps_of(plant: Plant, drive: Drive, log: Reading, spread: float) -> Steps | None:
    """
    Return when each step of a drive's commands seems to have come.

    Parameters
    ----------
    plant : Plant
        As it is in the drive's recording.
    drive : Drive
        With the commands as they come.
    log : Reading
    spread : float
        What delays vary by [s].

    Returns
    -------
    Steps or None
        None where no rate or no step of a command is known, or none shows in a rate.
    """
    commands = drive.commands
    moved = np.flatnonzero(np.any(np.diff(commands.values, axis=0) != 0.0, axis=1)) + 1
    moved = moved[(commands.times[moved] > drive.start) & (commands.times[moved] < drive.end)]
    plain = observe(simulate(plant, drive, log), drive, log)
    rates = _rated(drive, drive.measured - plain)
    if moved.size < int(setting('clock_steps')) or not rates:
        return None
    # Of what is steady, for the linear problem.
    scales = [1.0 / max(float(np.median(np.abs(own))), 1e-9) for own, _ in rates]
    residual, times = _scaled(rates, scales), np.concatenate([at for _, at in rates])
    window, by = setting('clock_window'), setting('clock_step')
    usual = float(np.median(np.diff(commands.times[moved])))
    count = max(2, int(np.ceil((window + by) / usual)))
    order = np.argsort(times, kind='stable')
    stamps = commands.times[moved]
    delay = log.get('command_delay')
    rows, columns, values = [], [], []
    for first in range(count):
        chosen = np.arange(first, moved.size, count)
        later = replace(drive, commands=_late(commands, moved[chosen], by))
        change = _scaled(_rated(drive, observe(
            simulate(plant, later, log), later, log) - plain), scales) / by
        for k in chosen:
            begin, end = np.searchsorted(times[order], stamps[k] + delay + np.array([
                -log.get('wheel_window'), window]))
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


def _promising(steps: Sequence[Steps]) -> FloatArray:
    # Rates at which the spectra of delays and slopes stand out, strongest first [Hz].
    longest = max(float(np.ptp(one.stamps)) for one in steps)
    # Of stamps on a grid that is fine for the shortest period; lines as near as drives tell apart.
    grid = setting('clock_shortest') / setting('clock_grid')
    count = next_fast_len(int(np.ceil(5.0 * longest / grid)), real=True)
    first = int(np.ceil(grid * count / setting('clock_longest')))
    last = int(grid * count / setting('clock_shortest'))
    rates = np.arange(first, last) / (grid * count)
    found = []
    for seen in ([one.weights * (one.delays - one.late) for one in steps],
                 [one.slope - np.mean(one.slope) for one in steps]):
        power = np.zeros(rates.size)
        for one, values in zip(steps, seen, strict=True):
            at = np.rint((one.stamps - one.stamps[0]) / grid).astype(np.intp)
            lines = np.fft.rfft(np.bincount(at, values), count)[first:last]
            power += np.abs(lines) ** 2 / max(float(np.sum(values ** 2)), 1e-300)
        peak = np.flatnonzero((power[1:-1] >= power[:-2]) & (power[1:-1] >= power[2:])) + 1
        found.append(rates[peak[np.argsort(-power[peak], kind='stable')][
            :int(setting('clock_rates'))]])
    return np.unique(np.concatenate(found))


def _ticked(drive: Drive, clock: Clock) -> Drive:
    held = at_ticks(drive.commands, clock.period, clock.phase)
    return replace(drive, commands=held, logged=held, clock=clock)


def ticked_as(drive: Drive, known: Sequence[Drive]) -> Drive:
    """
    Return a drive with commands at the ticks of its base, where those are known.

    Parameters
    ----------
    drive : Drive
        With the commands as they come.
    known : sequence of Drive
        The one that is nearest in the same recording tells.

    Returns
    -------
    Drive
    """
    near = min((one for one in known if one.recording == drive.recording), default=None,
               key=lambda one: max(one.start - drive.start, drive.start - one.end))
    return drive if near is None or near.clock is None else _ticked(drive, near.clock)


@dataclass(frozen=True, eq=False)
class Ticker:
    """
    Looks for the clock of a base in one drive by simulation.

    Parameters
    ----------
    plant : Plant
        As it is in the drive's recording.
    drive : Drive
        With the commands as they come.
    log : Reading
    steps : Steps
    """

    plant: Plant
    drive: Drive
    log: Reading
    steps: Steps

    def cost(self, clock: Clock | None) -> float:
        """Return the negative log likelihood of rates with a clock or none, to a constant."""
        held, log = self.drive, self.log
        if clock is not None:
            held = _ticked(held, clock)
            log = log.replacing({'command_delay': log.get('command_delay') + clock.late})
        left = _scaled(_rated(held, held.measured - observe(
            simulate(self.plant, held, log), held, log)), self.steps.scales)
        nu = setting('student')
        return 0.5 * (nu + 1.0) * float(np.sum(np.log1p(left ** 2 / nu)))

    def at_rate(self, rate: float) -> tuple[float, Clock]:
        """Return the cost and the likeliest clock of a base at a rate [Hz]."""
        # Up to a drift over the drive of a third of a period.
        drift = np.linspace(-0.3, 0.3, 7) / (rate * float(np.ptp(self.steps.stamps)))
        clock = self.steps.clock((1.0 + drift) / rate, int(setting('clock_phases')))
        return self.cost(clock), clock

    def sharpened(self, clock: Clock, late: float) -> Clock:
        """Return the likeliest clock near one whose commands act so late beside."""
        drift = 0.1 * clock.period / float(np.ptp(self.steps.stamps))
        return self.steps.clock(clock.period * (1.0 + drift * np.linspace(-1.0, 1.0, 9)),
                                8 * int(setting('clock_phases')), late)


def likeliest(tickers: Sequence[Ticker]) -> list[Clock]:
    """
    Return the likeliest clock of a base in each of its drives: one rate, any phase.

    Parameters
    ----------
    tickers : sequence of Ticker
        One a drive.

    Returns
    -------
    list of Clock
    """
    found = [[ticker.at_rate(rate) for ticker in tickers]
             for rate in _promising([ticker.steps for ticker in tickers]).tolist()]
    best = min(found, key=lambda tried: sum(cost for cost, _ in tried))
    # As late beside in all drives.
    late = float(np.average([clock.late for _, clock in best], weights=[
        float(np.sum(ticker.steps.weights)) for ticker in tickers]))
    return [ticker.sharpened(clock, late) for ticker, (_, clock) in zip(
        tickers, best, strict=True)]


def ticking(evidence: Evidence, fit: Fit) -> list[Drive] | None:
    """
    Return drives with commands at the likeliest ticks of their base.

    Parameters
    ----------
    evidence : Evidence
    fit : Fit
        With commands that are applied as they come.

    Returns
    -------
    list of Drive or None
        None where commands jitter too little for it, are at ticks already, no drive tells, or
        rates are likelier without ticks.
        Whether these ticks make the drives likelier than none is for a fit to say.
    """
    spread = evidence.noise.values['command_jitter']
    if spread < setting('clock_shows') or any(d.clock for d in evidence.drives):
        return None
    log = fit.point.log
    plants = evidence.plants(fit.point.plant)
    plain = [replace(d, commands=d.logged) for d in evidence.drives]
    steps = evidence.pool.map(lambda pair: steps_of(pair[0], pair[1], log, spread),
                              zip(plants, plain, strict=True))
    tickers = {k: Ticker(plants[k], plain[k], log, one) for k, one in enumerate(steps)
               if one is not None}
    if not tickers:
        return None
    clocks = dict(zip(tickers, likeliest(list(tickers.values())), strict=True))
    if sum(t.cost(clocks[k]) - t.cost(None) for k, t in tickers.items()) >= 0.0:
        return None
    return [_ticked(drive, clocks[k]) if k in clocks else drive for k, drive in enumerate(plain)]
