# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Bases that apply commands at their own ticks, not when they come.

The command with the stamp t_i is applied at the next tick, ``(phase - t_i) mod period`` later, and
of several between two ticks the last one counts. The first harmonic of these delays, ``period / pi
* sin(2 pi (t_i - phase) / period)``, stands out of their spectrum over the stamps at the base's
rate, and at those that are the same to commands with a rate of their own. A base has one rate in
all recordings, one phase in each. The linear problem of the delays
(:mod:`~lg_husky_sim.diagnosis.evidence.command_steps`) finds rates and phases to begin with;
which of them they are, simulations say.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
import functools
import math
import operator

from lg_husky_sim.diagnosis.evidence import student
from lg_husky_sim.diagnosis.evidence.command_steps import Rates, scaled, Steps
from lg_husky_sim.diagnosis.evidence.drives import Clock
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.signals import FloatArray, TimeSeries
from lg_husky_sim.threads import Threads
import numpy as np
from scipy.fft import next_fast_len


@dataclass(frozen=True, eq=False)
class Ticker:
    """
    Looks for the clock of a base in one drive by simulation.

    Parameters
    ----------
    recording : str
    commands : TimeSeries
        As they come.
    read : callable
        Returns the residuals of the rates, each with its times [s], with each of some commands
        that act so much later [s].
    steps : Steps
    delay : float
        From a command to its effect, where all are applied as they come [s].

    """

    recording: str
    commands: TimeSeries
    read: Callable[[Sequence[tuple[TimeSeries, float]]], Sequence[Rates]]
    steps: Steps
    delay: float

    @functools.cached_property
    def plain(self) -> float:
        """Return the cost without a clock."""
        return self._costs([(self.commands, 0.0)])[0]

    def gains(self, clocks: Sequence[Clock]) -> FloatArray:
        """Return what rates gain by each of some clocks, in nats."""
        return np.array([self.plain - cost for cost in self._costs([
            (at_ticks(self.commands, one.period, one.phase), one.late) for one in clocks])])

    def _costs(self, tries: Sequence[tuple[TimeSeries, float]]) -> list[float]:
        return [student.cost(scaled(rates, self.steps.scales)) for rates in self.read(tries)]


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


def usual_period(series: Sequence[FloatArray]) -> float:
    """
    Return the period at which messages come that jitter, and of which some are missing.

    Of each run of n messages without a pause, with stamps t_k, a straight line ``t_k = a + P k``
    by least squares; P is common to all runs.

    Parameters
    ----------
    series : sequence of numpy.ndarray
        Stamps of one drive each [s], at least one of them with two or more.

    Returns
    -------
    float
        [s].

    """
    usual = float(np.median(np.concatenate([np.diff(times) for times in series])))
    along = across = 0.0
    for times in series:
        for run in np.split(times, np.flatnonzero(np.abs(np.diff(times) / usual - 1.0) > 0.5) + 1):
            number = np.arange(run.size) - 0.5 * (run.size - 1)
            along += float(number @ run)
            across += float(number @ number)
    return along / across if across > 0.0 else usual


def _promising(steps: Sequence[Steps]) -> list[float]:
    # Rates at which the spectra of delays and slopes stand out, strongest first, each with those
    # that are the same where commands change at a rate of their own [Hz].
    longest = max(float(np.ptp(one.stamps)) for one in steps)
    # Of stamps on a grid that is fine for the shortest period; lines as near as drives tell apart.
    grid = setting('clock_shortest') / setting('clock_grid')
    count = next_fast_len(int(np.ceil(5.0 * longest / grid)), real=True)
    first = int(np.ceil(grid * count / setting('clock_longest')))
    last = int(grid * count / setting('clock_shortest'))
    rates = np.arange(first, last) / (grid * count)
    found: list[list[float]] = []
    for seen in ([one.weights * (one.delays - one.late) for one in steps],
                 [one.slope - np.mean(one.slope) for one in steps]):
        power = np.zeros(rates.size)
        for one, values in zip(steps, seen, strict=True):
            at = np.rint((one.stamps - one.stamps[0]) / grid).astype(np.intp)
            lines = np.fft.rfft(np.bincount(at, values), count)[first:last]
            power += np.abs(lines) ** 2 / max(float(np.sum(values ** 2)), 1e-300)
        peak = np.flatnonzero((power[1:-1] >= power[:-2]) & (power[1:-1] >= power[2:])) + 1
        found.append(rates[peak[np.argsort(-power[peak], kind='stable')][
            :int(setting('clock_peaks'))]].tolist())
    own = 1.0 / float(np.median(np.concatenate([np.diff(one.stamps) for one in steps])))
    strongest = [both for pair in zip(*found, strict=False) for both in pair]
    if own < rates[0]:
        return strongest
    most = 1 + int(rates[-1] / own)
    alike = [abs(rate + own * turn) for rate in strongest[:int(setting('clock_rivals'))]
             for turn in range(-most, most + 1)]
    return [*strongest, *(rate for rate in alike if rates[0] <= rate <= rates[-1])]


def _same_rate(known: Mapping[str, Sequence[Ticker]], periods: FloatArray,
               count: int) -> dict[str, Clock]:
    # The likeliest clock of each recording by the linear problem: one rate and one lateness of
    # all, as one base has, one phase of each.
    origins = {name: float(own[0].steps.stamps[0]) for name, own in known.items()}
    fitted = {name: functools.reduce(operator.add, [
        one.steps.clock_costs(periods, origins[name], count) for one in own])
        for name, own in known.items()}
    whole = sum(one.stiffness for one in fitted.values())
    each, found = np.arange(periods.size), []
    for first in fitted.values():
        late = first.late[each, np.argmin(first.cost, axis=1)]
        for _ in range(int(setting('clock_turns'))):
            chosen = {name: one.phases(late)[0] for name, one in fitted.items()}
            late = sum((one.stiffness * one.late[each, chosen[name]]
                        for name, one in fitted.items()), np.zeros(periods.size)) / whole
        cost = sum((one.phases(late)[1] for one in fitted.values()), np.zeros(periods.size))
        place = int(np.argmin(cost))
        found.append((float(cost[place]), float(periods[place]), float(late[place]),
                      {name: int(one.phases(late)[0][place]) for name, one in fitted.items()}))
    _, period, late_by, phases = min(found, key=lambda one: one[0])
    return {name: Clock(period, origins[name] + period * phase / count, late_by)
            for name, phase in phases.items()}


@dataclass(frozen=True, eq=False)
class ClockSearch:
    """
    Looks for the clock of a base: one rate in all recordings, one phase in each.

    Parameters
    ----------
    tickers : sequence of Ticker
        One a drive.
    pool : Threads

    """

    tickers: Sequence[Ticker]
    pool: Threads

    @functools.cached_property
    def recordings(self) -> dict[str, list[Ticker]]:
        """Return the drives of each recording."""
        found: dict[str, list[Ticker]] = {}
        for ticker in self.tickers:
            found.setdefault(ticker.recording, []).append(ticker)
        return found

    @functools.cached_property
    def longest(self) -> float:
        """How long commands go on in the longest recording [s]."""
        return float(max(own[-1].steps.stamps[-1] - own[0].steps.stamps[0]
                         for own in self.recordings.values()))

    def _gains(self, tried: Mapping[str, Sequence[Clock]]) -> dict[str, FloatArray]:
        # What the drives of each recording gain by each of its clocks, in nats.
        most = int(setting('clock_batch'))
        tasks = [(one, name, first) for name, own in self.recordings.items() for one in own
                 for first in range(0, len(tried[name]), most)]
        parts = self.pool.map(
            lambda task: task[0].gains(tried[task[1]][task[2]:task[2] + most]), tasks)
        found = {name: np.zeros(len(clocks)) for name, clocks in tried.items()}
        for (_, name, first), part in zip(tasks, parts, strict=True):
            found[name][first:first + most] += part
        return found

    def _apart(self, rates: Sequence[float]) -> list[float]:
        # Without those that the longest recording cannot tell from one before.
        found: list[float] = []
        for rate in rates:
            if all(abs(rate - one) * self.longest > 0.5 for one in found):
                found.append(rate)
        return found

    def likeliest(self, least: float = 0.0) -> list[dict[str, Clock]]:
        """
        Return the likeliest clocks by recordings at each rate that stands out, best first.

        Those by which the rates gain no more than ``least`` nats are left out.
        """
        in_step = self._in_step()
        rates = self._apart([*in_step, *_promising([one.steps for one in self.tickers])])
        rivals = [*self.pool.map(self._linear, rates), *self._prompt(in_step)]
        gains = sum(self._gains({name: [clocks[name] for clocks in rivals]
                                 for name in self.recordings}).values())
        found = _best(zip(np.atleast_1d(gains).tolist(), rivals, strict=True), 'clock_rates')
        for finer in _finer():
            found = _best((self._sharpened(clocks, finer) for _, clocks in found),
                          'clock_rivals')
        return [clocks for gain, clocks in found if gain > least]

    def sharp(self, clocks: Mapping[str, Clock]) -> Mapping[str, Clock]:
        """Return the likeliest clocks near some."""
        for finer in _finer():
            _, clocks = self._sharpened(clocks, finer)
        return clocks

    def _in_step(self) -> list[float]:
        # Multiples of the rate at which commands come: their delays are all alike, or jump by a
        # whole period, and no spectrum shows it.
        own = 1.0 / usual_period([one.commands.times for one in self.tickers])
        fastest, slowest = 1.0 / setting('clock_shortest'), 1.0 / setting('clock_longest')
        return [own * k for k in range(1, int(fastest / own) + 1) if own * k >= slowest]

    def _prompt(self, rates: Sequence[float]) -> list[dict[str, Clock]]:
        # The likeliest phases of each recording, by simulation, of ticks that alone make late:
        # even ones, and those between which commands come, where a little jitter makes some late.
        count = int(setting('clock_phases'))
        parts = (np.arange(count) + 0.5) / count
        tried: dict[str, list[Clock]] = {}
        for name, own in self.recordings.items():
            times = np.concatenate([one.commands.times for one in own])
            tried[name] = [
                Clock(1.0 / rate, float(phase), -own[0].delay) for rate in rates
                for phase in (*(parts / rate), *np.quantile(np.mod(times, 1.0 / rate), parts))]
        best = {name: np.argmax(gains.reshape(len(rates), 2 * count), axis=1)
                for name, gains in self._gains(tried).items()}
        return [{name: clocks[2 * count * k + int(best[name][k])]
                 for name, clocks in tried.items()} for k in range(len(rates))]

    def _linear(self, rate: float) -> dict[str, Clock]:
        drift = setting('clock_drift') * np.linspace(-1.0, 1.0, 5) / self.longest
        return _same_rate(self.recordings, (1.0 + drift / rate) / rate,
                          int(setting('clock_phases')))

    def _sharpened(self, clocks: Mapping[str, Clock], finer: float
                   ) -> tuple[float, dict[str, Clock]]:
        # The likeliest clocks near some, by simulation, and what rates gain by them.
        drift, part = setting('clock_drift') / finer, setting('clock_shift') / finer
        steps = np.linspace(-1.0, 1.0, int(setting('clock_parts')))
        tried = {name: [_moved(clocks[name], own, drift * turn / self.longest, part * later)
                        for turn in steps for later in steps]
                 for name, own in self.recordings.items()}
        gains = {name: own.reshape(steps.size, steps.size)
                 for name, own in self._gains(tried).items()}
        rate = int(np.argmax(sum(np.max(own, axis=1) for own in gains.values())))
        return float(sum(np.max(own[rate]) for own in gains.values())), {
            name: tried[name][rate * steps.size + int(np.argmax(own[rate]))]
            for name, own in gains.items()}


def _finer() -> FloatArray:
    # How much nearer clocks are tried in each turn; as near as the one before tried them.
    return np.asarray(setting('clock_finer') ** np.arange(setting('clock_sharper')))


def _best(tried: Iterable[tuple[float, dict[str, Clock]]],
          name: str) -> list[tuple[float, dict[str, Clock]]]:
    # As many as a setting says that gain most.
    return sorted(tried, key=lambda one: -one[0])[:int(setting(name))]


def _moved(clock: Clock, drives: Sequence[Ticker], drift: float, part: float) -> Clock:
    # A clock that drifts by parts of a period in a second, and ticks a part later in the middle.
    middle = 0.5 * (drives[0].steps.stamps[0] + drives[-1].steps.stamps[-1])
    tick = clock.phase + clock.period * round((middle - clock.phase) / clock.period)
    return Clock(clock.period * (1.0 + drift * clock.period), tick + part * clock.period,
                 clock.late)


def gain_by_chance(lengths: Sequence[float]) -> float:
    """
    Return what ticks gain on a base without any, once in as many as false alarms are allowed.

    Rates 1/T apart, in a recording that lasts T, and phases a deviation d of the phase apart are
    trials of their own. For rates from f1 to f2, ticks of none of them gain more than::

        log(T (f2 - f1)) - log(d), summed over the recordings, - log(rate of false alarms)

    Parameters
    ----------
    lengths : sequence of float
        Of each recording with ticks, from its start to its end [s].

    Returns
    -------
    float
        [nats].

    """
    band = 1.0 / setting('clock_shortest') - 1.0 / setting('clock_longest')
    return (math.log(max(max(lengths) * band, 1.0)) - len(lengths) * math.log(
        setting('clock_phase')) - math.log(setting('false_alarm_rate')))
