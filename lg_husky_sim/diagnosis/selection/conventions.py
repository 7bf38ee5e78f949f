# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
How a log was made, found by the likelihood of the recalibrated model.

Wheel rates may be of the moment, means over a window with the stamp at its end, middle or begin,
low-passed, or both; so may a yaw rate be, but not both. An offset of the stamps that comes with
the smoothing of its window is a convention, one without is late.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
import math

from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit, promised_by
from lg_husky_sim.diagnosis.evidence.point import Point
from lg_husky_sim.diagnosis.evidence.reading import imu_lag, Reading, wheel_lag, WheelReading
from lg_husky_sim.diagnosis.evidence.unknowns import start_of, Unknown, window_unknown
from lg_husky_sim.diagnosis.selection.nominal import is_distorted, nominal_of
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.errors import ParameterError
from lg_husky_sim.signals import FloatArray
import numpy as np

_WINDOWS = ('wheel_window', 'wheel_mean', 'wheel_smoothing', 'imu_window')


def best_reading(evidence: Evidence, fit: Fit, afresh: bool = False) -> Fit:
    """
    Choose the reading that makes a fitted model likeliest.

    Numbers that took the place of a reading keep every other one from being likelier where they
    are. So readings are fitted from the robot as it should be as well, if it is distorted.

    Parameters
    ----------
    evidence : Evidence
        With the noise under which readings are compared.
    fit : Fit
        Of the model.
    afresh : bool
        Whether to begin there in any case.

    Returns
    -------
    Fit
        With that reading, under the same noise; the given one where none is better.

    """
    return gyro_reading(evidence, wheel_reading(evidence, fit, afresh))


def wheel_reading(evidence: Evidence, fit: Fit, afresh: bool = False) -> Fit:
    """Choose how the wheels are read, as :func:`best_reading` does."""
    return _better(evidence, fit, _wheel_options, afresh)


def gyro_reading(evidence: Evidence, fit: Fit) -> Fit:
    """Choose how the gyro is read, as :func:`best_reading` does."""
    # Its windows are short against what it follows: a step tells what they gain.
    return _better(evidence, fit, _imu_options, least=setting('least_reading'))


def _better(evidence: Evidence, fit: Fit, options_of: Callable[[
        Evidence, Reading], Sequence[Reading]], afresh: bool = False, least: float = -math.inf
        ) -> Fit:
    options = options_of(evidence, fit.point.reading)
    if not options:
        return fit
    # All by as many steps: what the same reading gains by them is not due to another one.
    rounds = int(setting('reading_rounds'))
    begins = [(fit, 1.0)]
    if afresh or is_distorted(fit):
        # One step takes the derivatives there; a model with an effect that only other numbers can
        # bear runs away there, and does not begin there.
        with suppress(ParameterError):
            begins.append(_begun_at(evidence, nominal_of(fit.point)))
    raced = [_raced(evidence, *begin, options, rounds, least) for begin in begins]
    best = min((one for one in raced if one is not None), key=lambda one: one.cost, default=None)
    if best is None:
        return fit
    ended = fit.promised < setting('fit_converged')
    same = fit if ended else min(fit, evidence.fit(fit.point, rounds=rounds),
                                 key=lambda one: one.cost)
    if best.cost > same.cost - setting('reading_gain'):
        return fit if same.cost > fit.cost - setting('reading_gain') else same
    # The length of a window that was not read before is one more number.
    more = _unread(evidence, best.point)
    if not more:
        return evidence.fit(best.point, best.slopes, rounds=int(setting('reading_finish')))
    known = len(best.point.unknowns)
    wider = replace(best.point, unknowns=(*best.point.unknowns, *more),
                    places=np.append(best.point.places, start_of(more)))
    slopes = [np.hstack([one, np.zeros((one.shape[0], len(more)))]) for one in best.slopes]
    return evidence.fit(wider, slopes, rounds=int(setting('reading_finish')),
                        renew=range(known, known + len(more)))


def _raced(evidence: Evidence, begin: Fit, inflation: float, options: Sequence[Reading],
           rounds: int, least: float) -> Fit | None:
    best = _first_of(evidence, begin, inflation, options, rounds, least)
    if inflation == 1.0 or best is None:
        return best
    # Where it won under noise that is larger than it is, it goes on under the noise as it is.
    return evidence.fit(best.point, rounds=rounds)


def _first_of(evidence: Evidence, begin: Fit, inflation: float, options: Sequence[Reading],
              rounds: int, least: float) -> Fit | None:
    # The readings that promise most, and enough, begin; of those that are ahead after a few steps
    # the ones go on that may still catch up with the first. The likeliest is returned.
    points = [_read_so(evidence, begin.point, one) for one in options]

    def promise(point: Point) -> float:
        e = evidence.residuals(evidence.predict(point)) / inflation
        return evidence.cost(e, point) - promised_by(begin.jacobian, e, point)
    promised = np.array(list(evidence.pool.map(promise, points)))
    enough = np.flatnonzero(promised <= promise(begin.point) - least)
    order = enough[np.argsort(promised[enough], kind='stable')][:int(setting('readings_fitted'))]
    first, last = int(setting('reading_start')), int(setting('readings_finished'))

    def slim(fit: Fit) -> Fit:
        # Of many fits, the whitened derivatives are not kept.
        return replace(fit, jacobian=np.zeros((0, 0)))

    def begun(place: int) -> tuple[Fit, float]:
        fit = evidence.fit(points[place], begin.slopes, rounds=first, inflation=inflation)
        return slim(fit), fit.cost - fit.promised

    def finished(one: Fit) -> Fit:
        return slim(evidence.fit(one.point, one.slopes, rounds=rounds - first,
                                 inflation=inflation))
    ahead = sorted(evidence.pool.map(begun, order.tolist()), key=lambda one: one[0].cost)[:last]
    ends = list(evidence.pool.map(finished, [
        one for one, hoped in ahead if hoped <= ahead[0][0].cost]))
    # Under the noise as it is.
    return min(ends, default=None, key=lambda one: one.cost if inflation == 1.0 else evidence.cost(
        evidence.residuals(one.predicted), one.point))


def _begun_at(evidence: Evidence, start: Point) -> tuple[Fit, float]:
    # Where a model is off by many deviations of small noise, neither one step nor the prior says
    # anything: noise as large as what is left there makes both count.
    left = evidence.residuals(evidence.predict(start))
    inflation = max(1.0, float(np.sqrt(np.mean(left ** 2))))
    return replace(evidence.fit(start, rounds=1, inflation=inflation), point=start), inflation


def _unread(evidence: Evidence, point: Point) -> list[Unknown]:
    # Windows of a reading that are not estimated yet.
    reading = point.reading
    longest = {}
    if reading.imu is not None:
        longest['imu_window'] = _longest(reading.imu, _imu_period(evidence))
    filtered = reading.wheels is WheelReading.FILTERED
    for name in ('wheel_mean',) if filtered else ('wheel_smoothing',):
        if reading.get(name):
            longest[name] = setting('longest_window')
    known = {u.name for u in point.unknowns}
    return [window_unknown(name, point.log.values.get(name) or setting('shortest_window'), most)
            for name, most in longest.items() if name not in known]


def as_late(evidence: Evidence, point: Point, name: str, more: float) -> list[Point]:
    """
    Return how a log may have been made whose stream is later than a point has it.

    Parameters
    ----------
    evidence : Evidence
        Its drives say how long the periods of the streams are.
    point : Point
        With the delays and windows of the log as they are taken now.
    name : str
        Of the delay of a stream.
    more : float
        How much later [s].

    Returns
    -------
    list of Point
        One for each place of the stamps in the windows of the rates, as long as they are, where
        the stamps need not be off by more than they may be.

    """
    now, period, wheels = point.log, _imu_period(evidence), _wheel_period(evidence)
    lag_of: Callable[[Reading], float] = {
        'delay_wheels': lambda one: wheel_lag(one, wheels),
        'delay_imu': lambda one: imu_lag(one, period)}.get(name, lambda one: 0.0)
    others = [replace(now, wheels=kind) for kind in WheelReading] if name == 'delay_wheels' else [
        replace(now, imu=place) for place in (0.0, 0.5, 1.0)] if (
            name == 'delay_imu' and now.imu is not None) else []
    found = []
    for other in others:
        for k, unknown in enumerate(point.unknowns):
            delay = point.places[k] + more + lag_of(now) - lag_of(other)
            if unknown.name == name and unknown.lower < delay < unknown.upper:
                places = point.places.copy()
                places[k] = delay
                found.append(replace(point, reading=replace(
                    point.reading, wheels=other.wheels, imu=other.imu), places=places))
    return found


def read_like(point: Point, other: Point) -> Point:
    """
    Return a point that is read like another one, with what is late where it is likeliest.

    Parameters
    ----------
    point : Point
        With the robot's numbers and effects.
    other : Point
        With its reading, and how long its windows are.

    """
    known = {u.name: place for u, place in zip(other.unknowns, other.places, strict=True)
             if u.name in _WINDOWS}
    new = tuple(u for u in other.unknowns if u.name in _WINDOWS and all(
        u.name != own.name for own in point.unknowns))
    last = sum(u.kind == 'effect' for u in point.unknowns)
    split = len(point.unknowns) - last
    unknowns = (*point.unknowns[:split], *new, *point.unknowns[split:])
    places = np.concatenate([point.places[:split], start_of(new), point.places[split:]])
    return replace(point, reading=other.reading, unknowns=unknowns, places=np.array([
        known.get(u.name, place) for u, place in zip(unknowns, places, strict=True)]))


def _read_so(evidence: Evidence, point: Point, reading: Reading) -> Point:
    # With as late a stream on the whole as before: what the reading is late, its stamps are not.
    # Windows that the readings have in common stay as long as they were fitted.
    now = point.log
    anew = {name: value for name, value in reading.values.items()
            if name in _WINDOWS and point.reading.values.get(name) != value}
    other = replace(reading, values={**reading.values, **now.values, **anew})
    period, wheels = _imu_period(evidence), _wheel_period(evidence)
    spared = {'delay_wheels': wheel_lag(now, wheels) - wheel_lag(other, wheels),
              'delay_imu': imu_lag(now, period) - imu_lag(other, period)}
    places = np.array([
        place if u.kind != 'log' else u.place(anew[u.name]) if u.name in anew
        else place + spared.get(u.name, 0.0)
        for u, place in zip(point.unknowns, point.places, strict=True)])
    return replace(point, reading=reading).at(places)


def _imu_period(evidence: Evidence) -> float:
    return _period([d.imu_times for d in evidence.drives if d.imu_times.size > 3] or [np.zeros(2)])


def _wheel_period(evidence: Evidence) -> float:
    return _period([d.wheel_times for d in evidence.drives if d.wheel_times.size > 3]
                   or [np.zeros(2)])


def _period(times: Sequence[FloatArray]) -> float:
    return float(np.median([np.median(np.diff(t)) for t in times]))


def _windows() -> tuple[float, float, float, float]:
    return (setting('tried_brief'), setting('tried_short'), setting('tried_medium'),
            setting('tried_long'))


def _wheel_options(evidence: Evidence, now: Reading) -> list[Reading]:
    times = [d.wheel_times for d in evidence.drives if d.wheel_times.size > 3 and not d.counted]
    if not times:
        return []
    longest = setting('longest_window')
    period = round(_period(times), 4)
    brief, short, medium, long = _windows()
    windows = sorted({w for w in (brief, short, medium, long, longest, period) if w <= longest})
    shortest = setting('shortest_window')

    def read(kind: WheelReading, window: float, mean: float = 0.0, smoothing: float = 0.0
             ) -> Reading:
        return replace(now, wheels=kind).replacing({
            'wheel_window': window, 'wheel_mean': mean, 'wheel_smoothing': smoothing})
    found = [read(WheelReading.WINDOW_END, shortest)]
    found += [read(kind, window) for window in windows for kind in WheelReading]
    # Means behind a low pass: of the encoder's computer, or of what is sent.
    for window in sorted({short, min(period, longest), long}):
        found += [read(WheelReading.FILTERED, lag, mean=window) for lag in (short, medium)]
    for kind, window in ((WheelReading.WINDOW_END, shortest), (WheelReading.WINDOW_END, period),
                         (WheelReading.WINDOW_MIDDLE, period), (WheelReading.WINDOW_END, long)):
        found += [read(kind, min(window, longest), smoothing=share * period) for share in (
            setting('tried_less'), setting('tried_more')) if share * period <= longest]
    return found


def _imu_options(evidence: Evidence, now: Reading) -> list[Reading]:
    times = [d.imu_times for d in evidence.drives if d.imu_times.size > 3]
    if not times:
        return []
    period = round(_period(times), 4)
    _, short, medium, _ = _windows()
    # A low pass of a time constant delays by it and smooths with its square as variance, as a mean
    # over the root of twelve of them.
    return [replace(now, imu=place).replacing({'imu_window': window})
            for place, share in ((0.0, 1.0), (0.5, 1.0), (1.0, 1.0), (math.inf, 12.0 ** -0.5))
            for window in (share * short, share * medium, share * period)
            if window <= _longest(place, period)]


def _longest(place: float | None, period: float) -> float:
    # A mean ends within its period or so; a low pass may last longer.
    return setting('slowest_gyro') if place == math.inf else max(
        setting('longest_imu_window'), period)
