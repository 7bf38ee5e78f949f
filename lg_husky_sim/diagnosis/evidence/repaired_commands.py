# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Single commands that a base missed or got late, or that a log lost, by what its wheels did."""

from __future__ import annotations

from collections.abc import Callable, Iterator
import math

from lg_husky_sim.diagnosis.evidence import student
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np
from numpy.typing import NDArray

#: Innovations of a drive when its base is driven by other commands than those of the log.
Score = Callable[[TimeSeries], FloatArray]


def repaired(logged: TimeSeries, whitened: FloatArray, wheels: NDArray[np.bool_],
             times: FloatArray, score: Score) -> TimeSeries:
    """
    Return the commands that a base seems to have got.

    Where the wheels leave a simulation by far more than noise, a command is taken out, acts later,
    or is put into a gap between those before and after it, if that makes the drive likelier by a
    stated gain: whichever does most, less what its numbers cost, which are half of the logarithm
    of the number of readings each. Of few commands only: up to a stated share of all, and of those
    that change anything, which are the ones of which it shows. What is late more often than that
    is late for a reason.

    Parameters
    ----------
    logged : TimeSeries
        Forward [m/s] and yaw [rad/s], as they were recorded.
    whitened : numpy.ndarray, shape (n,)
        Innovations of the drive with these.
    wheels : numpy.ndarray of bool, shape (n,)
        Which of them are those of wheels and of what moves with them.
    times : numpy.ndarray, shape (n,)
        Their stamps [s].
    score : callable
        Returns the innovations with other commands.

    Returns
    -------
    TimeSeries
        The same object where none is repaired.

    """
    stamps = logged.times
    changes = int(np.count_nonzero(np.any(np.diff(logged.values, axis=0) != 0.0, axis=1)))
    if stamps.size <= 3:
        return logged
    most = min(int(setting('missed_share') * stamps.size) + 1,
               int(setting('missed_changes') * changes))
    best, e, cost = logged, whitened, student.cost(whitened)
    tried: set[int] = set()
    for _ in range(most):
        far = wheels & (np.abs(e) > setting('far'))
        if not np.any(far):
            break
        found = None
        for place in _suspects(times[far], np.abs(e[far]), stamps):
            if place in tried:
                continue
            tried.add(place)
            ways = [(student.cost(innovations), numbers, other, innovations) for (
                numbers, other, innovations) in _others(best, float(stamps[place]), score)]
            likelier = [way for way in ways if cost - way[0] > setting('missed_gain')]
            if likelier:
                cost, _, found, e = min(likelier, key=lambda way: (
                    way[0] + 0.5 * way[1] * math.log(whitened.size)))
                break
        if found is None:
            break
        best = found
    return best


def _suspects(times: FloatArray, sizes: FloatArray, stamps: FloatArray) -> list[int]:
    # The last command before each reading that is far off and the one before that, by how much
    # is far off after them; at most as many as are worth a simulation.
    last = np.clip(np.searchsorted(stamps, times, side='right') - 1, 0, stamps.size - 1)
    weight = np.bincount(last, np.log1p(sizes ** 2), minlength=stamps.size)
    worst = np.argsort(-weight, kind='stable')[:int(setting('suspects'))]
    found: list[int] = []
    for place in worst[weight[worst] > 0.0].tolist():
        found += [one for one in (place, place - 1) if one > 0 and one not in found]
    return found


def _others(commands: TimeSeries, stamp: float, score: Score
            ) -> Iterator[tuple[int, TimeSeries, FloatArray]]:
    # Without the command at a stamp, with it late, and with one in the middle of the gap after it,
    # each behind how many numbers were fitted.
    place = int(np.argmin(np.abs(commands.times - stamp)))
    keep = np.arange(commands.times.size) != place
    without = TimeSeries(commands.times[keep], commands.values[keep], commands.names)
    yield 0, without, score(without)
    gaps = np.diff(commands.times)
    usual = float(np.median(gaps))
    yield 1, *_held(commands, place, usual, score)
    if place < gaps.size and setting('lost_gap') * usual < gaps[place] < (
            setting('pause') * usual):
        yield 2, *_filled(commands, place, round(float(gaps[place]) / usual) - 1, score)


def _held(commands: TimeSeries, place: int, usual: float, score: Score
          ) -> tuple[TimeSeries, FloatArray]:
    # With a command that came late by so many usual gaps; those behind it waited for it.
    def late(gaps: float) -> tuple[float, float, TimeSeries, FloatArray]:
        until = commands.times[place] + gaps * usual
        times = np.array(commands.times)
        times[place:] = np.maximum(times[place:], until)
        last = np.append(np.diff(times) > 0.0, True)
        other = TimeSeries(times[last], commands.values[last], commands.names)
        e = score(other)
        return student.cost(e), gaps, other, e
    best = min((late(gaps) for gaps in (0.5, 1.5, 2.5)), key=lambda one: one[0])
    for step in (0.5, 0.25, 0.125):
        best = min((best, *(late(best[1] + side * step) for side in (-1.0, 1.0)
                            if best[1] + side * step > 0.0)), key=lambda one: one[0])
    return best[2], best[3]


def _filled(commands: TimeSeries, place: int, count: int, score: Score
            ) -> tuple[TimeSeries, FloatArray]:
    # With so many commands in a gap, between those before and after it but for what the readings
    # say that they were: linear in both numbers.
    before, after = commands.values[place:place + 2]
    parts = np.arange(1, count + 1)[:, None] / (count + 1.0)
    times = commands.times[place] + parts[:, 0] * (
        commands.times[place + 1] - commands.times[place])

    def other(shift: FloatArray) -> TimeSeries:
        values = before + parts * (after - before) + shift
        return TimeSeries(np.insert(commands.times, place + 1, times),
                          np.insert(commands.values, place + 1, values, axis=0), commands.names)
    plain = other(np.zeros(2))
    e = score(plain)
    step = np.maximum(np.abs(after - before), setting('still_speed'))
    slopes = np.column_stack([score(other(row)) - e for row in np.diag(step)])
    normal = slopes.T @ slopes + np.eye(2)
    shifted = other(-step * np.linalg.solve(normal, slopes.T @ e))
    return shifted, score(shifted)
