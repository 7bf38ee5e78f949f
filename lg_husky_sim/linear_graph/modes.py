# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A step response as a sum of its modes, and the figures that follow from them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import zip_longest
from math import factorial

from lg_husky_sim.linear_graph.state_space import FloatArray
from lg_husky_sim.linear_graph.transfer import STANDING
import numpy as np
from numpy.typing import NDArray

ComplexArray = NDArray[np.complex128]

RISE = (0.1, 0.9)
"""Parts of the final value between which the rise time is taken; the usual ones."""
BAND = 0.02
"""Part of the final value within which a response has settled; the usual one."""
PER_RADIAN, CHUNK, MOST = 8, 2000, 2_000_000
"""Samples in a radian of the fastest mode that is left, at a time, and in all; extremes and
crossings between samples are bisected."""
HALVINGS = 60
"""Bisections of an interval, after which it is as narrow as numbers allow."""
ROUNDING = 1e-9
"""Relative size by which a peak is above another one."""


@dataclass(frozen=True, eq=False)
class Modes:
    """
    A sum of modes, each a factor times t^power exp(pole t).

    Parameters
    ----------
    factors, poles : numpy.ndarray of complex, shape (n,)
    powers : numpy.ndarray of int, shape (n,)

    """

    factors: ComplexArray
    powers: NDArray[np.intp]
    poles: ComplexArray

    def __call__(self, times: FloatArray) -> FloatArray:
        """Return the values at times, shape (n_times,)."""
        t = times[:, None]
        return np.asarray((self.factors * t ** self.powers * np.exp(self.poles * t)).real.sum(1))

    def slope(self, times: FloatArray) -> FloatArray:
        """Return the rates of change at times, shape (n_times,)."""
        t = times[:, None]
        inner = self.poles * t ** self.powers + self.powers * t ** np.maximum(self.powers - 1, 0)
        return np.asarray((self.factors * inner * np.exp(self.poles * t)).real.sum(1))

    def largest_from(self, time: float) -> FloatArray:
        """Return the largest size of each mode from a time on, shape (n,)."""
        found = np.full(self.poles.shape, np.inf)       # unless it decays
        at = self.poles.real < 0.0
        powers, rates = self.powers[at], self.poles.real[at]
        t = np.maximum(-powers / rates, time)
        found[at] = np.abs(self.factors[at]) * t ** powers * np.exp(rates * t)
        return found

    def only(self, kept: NDArray[np.bool_]) -> Modes:
        """Return some of the modes."""
        return Modes(self.factors[kept], self.powers[kept], self.poles[kept])


def step_modes(gain: float, zeros: ComplexArray, poles: ComplexArray) -> Modes:
    """Return the modes of the response to a unit step (partial fractions, poles repeated)."""
    every = np.append(poles, 0.0)
    found: list[tuple[complex, int, complex]] = []
    for pole, count in zip(*np.unique(every, return_counts=True), strict=True):
        series = np.zeros(count, dtype=np.complex128)
        series[0] = gain
        for zero, other in zip_longest(zeros, every[every != pole]):     # in turn: none overflows
            if zero is not None:
                series = (pole - zero) * series + np.append(0.0, series[:-1])
            if other is not None:
                for at in range(count):
                    series[at] = (series[at] - (series[at - 1] if at else 0.0)) / (pole - other)
        found += [(value / factorial(count - 1 - at), count - 1 - at, pole)
                  for at, value in enumerate(series)]
    factors, powers, of = zip(*found, strict=True)
    return Modes(np.array(factors), np.array(powers, dtype=np.intp), np.array(of))


@dataclass(frozen=True)
class StepFigures:
    """
    What a table of a step response says; None where there is no such thing.

    Parameters
    ----------
    rise, settling : float, optional
        Times [s].
    overshoot : float, optional
        [%].
    peak, peak_time : float, optional
        Value that none later is larger than, and its time [s].
    complete : bool
        False if the response swings too often until it settles.

    """

    rise: float | None = None
    settling: float | None = None
    overshoot: float | None = None
    peak: float | None = None
    peak_time: float | None = None
    complete: bool = True


def step_figures(modes: Modes, final: float, end: float) -> StepFigures:
    """
    Return the figures of a response, however far apart its poles are.

    It is followed from 0 with steps that are short for the fastest mode that still counts; what
    lies between samples is bisected. It ends when the modes left cannot change a figure.

    Parameters
    ----------
    modes : Modes
        Those that a step response is made of, with poles [1/s].
    final : float
        What it settles at; NaN if it does not.
    end : float
        Where to stop if it does not settle [s].

    """
    if (modes.poles.real > STANDING * np.abs(modes.poles)).any():
        return StepFigures()        # it grows
    return _Walk(modes, final, end).figures()


class _Walk:
    """What is known of a response up to a time."""

    def __init__(self, modes: Modes, final: float, end: float) -> None:
        """Begin at 0."""
        self.modes, self.final = modes, final
        self.settles = not np.isnan(final)
        self.goal = abs(final) if self.settles else 0.0
        self.end = np.inf if self.settles else end
        self.moving = modes.only(modes.poles != 0.0)
        self.crossed: list[float | None] = [None, None]
        self.settling, self.top, self.peak, self.peak_time = 0.0, -np.inf, 0.0, 0.0

    def figures(self) -> StepFigures:
        """Walk until nothing can change any more."""
        time, count = 0.0, 0
        while not self._over(time) and count < MOST:
            time = self._chunk(time)
            count += CHUNK
        complete = self._over(time)
        has_peak = complete and self.peak != 0.0 and self.peak_time < self.end and (
            abs(self.peak) > self.goal * (1.0 + ROUNDING))
        rise = settling = overshoot = None
        if self.goal:
            begin, finish = self.crossed
            rise = None if begin is None or finish is None else finish - begin
            settling = self.settling if complete else None
            above = self.top - 1.0
            overshoot = (100.0 * above if above > ROUNDING else 0.0) if complete else None
        return StepFigures(rise, settling, overshoot, self.peak if has_peak else None,
                           self.peak_time if has_peak else None, complete)

    def _over(self, time: float) -> bool:
        if not self.settles:
            return time >= self.end
        left = float(self.moving.largest_from(time).sum())
        if time == 0.0 or (self.goal and None in self.crossed):
            return time > 0.0 and left == 0.0
        highest = max(abs(self.peak), self.goal)
        if self.goal:       # whatever is left is within the band, and below what was seen
            highest = min(highest, max(self.top, 1.0) * self.goal)
            if left > BAND * self.goal:
                return False
        return self.goal + left <= highest * (1.0 + ROUNDING)

    def _chunk(self, begin: float) -> float:
        """Look at the next samples; return the time of the last."""
        rounding = np.finfo(float).eps * max(self.goal, abs(self.peak))
        own = self.moving.only(self.moving.largest_from(begin) > rounding)
        fastest = float(np.abs(own.poles).max(initial=0.0))
        span = CHUNK / (PER_RADIAN * fastest) if fastest else 1.0 if self.settles else self.end
        last = min(begin + span, self.end)
        t = np.linspace(begin, last, CHUNK + 1)
        slope = self.modes.slope(t)
        turns = np.flatnonzero(slope[:-1] * slope[1:] < 0.0)
        if turns.size:
            t = np.sort(np.append(t, bisected(self.modes.slope, t[turns], t[turns + 1])))
        self._note(t, self.modes(t))
        return last

    def _note(self, t: FloatArray, y: FloatArray) -> None:
        at = int(np.abs(y).argmax())
        if abs(y[at]) > abs(self.peak) * (1.0 + ROUNDING):
            self.peak, self.peak_time = float(y[at]), float(t[at])
        if not self.goal:
            return
        part = y / self.final
        self.top = max(self.top, float(part.max()))
        for which, level in enumerate(RISE):
            above = np.flatnonzero(part >= level)
            if self.crossed[which] is None and above.size:
                self.crossed[which] = self._crossing(level, t, int(above[0]))
        outside = np.flatnonzero(np.abs(part - 1.0) > BAND)
        if outside.size and outside[-1] + 1 < t.size:
            edge = 1.0 + np.copysign(BAND, part[outside[-1]] - 1.0)
            self.settling = self._crossing(float(edge), t, int(outside[-1]) + 1)

    def _crossing(self, level: float, t: FloatArray, at: int) -> float:
        """Return when a part of the final value is passed, just before a sample."""
        if at == 0:
            return float(t[0])

        def above(moment: FloatArray) -> FloatArray:
            return self.modes(moment) / self.final - level

        return float(bisected(above, t[[at - 1]], t[[at]])[0])


def bisected(what: Callable[[FloatArray], FloatArray], low: FloatArray,
             high: FloatArray) -> FloatArray:
    """Return where a function changes its sign in each of some intervals, shape (n,)."""
    low, high = np.array(low), np.array(high)
    rising = what(high) >= 0.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        upper = (what(middle) >= 0.0) == rising
        high, low = np.where(upper, middle, high), np.where(upper, low, middle)
    return high
