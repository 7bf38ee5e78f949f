# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
How a log was made, found by the likelihood of the recalibrated model.

Wheel rates may be of the moment, means over a window with the stamp at its end, middle or begin,
or low-passed; a yaw rate may be of the moment or a mean over its period. An offset of the stamps
that comes with the smoothing of its window is a convention, one without is late.
"""

from __future__ import annotations

from dataclasses import replace

from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.evidence.observation import Reading, WheelReading
from lg_husky_sim.diagnosis.settings import setting
import numpy as np

#: Reading of the wheels, place of the gyro's stamp in its window, window of the wheels [s].
Change = tuple[WheelReading, float | None, float]


def best_reading(evidence: Evidence, fit: Fit) -> Fit:
    """
    Choose the reading that makes a fitted model likeliest.

    Parameters
    ----------
    evidence : Evidence
    fit : Fit
        Of the model.

    Returns
    -------
    Fit
        With that reading, under the same noise; the given one where none is better.
    """
    chosen = fit
    for options_of in (_wheel_options, _imu_options):
        # One after the other: a fit has work for all threads itself.
        tried = [_refitted(evidence, chosen, change)
                 for change in options_of(evidence, chosen.point.reading)]
        best = min(tried, key=lambda one: one.cost, default=chosen)
        if best.cost < chosen.cost - setting('reading_gain'):
            chosen = best
    if chosen.point.reading.wheels is not fit.point.reading.wheels or (
            chosen.point.reading.get('wheel_window') != fit.point.reading.get('wheel_window')):
        window = chosen.point.reading.get('wheel_window')
        tried = [_refitted(evidence, chosen, (chosen.point.reading.wheels,
                                              chosen.point.reading.imu, factor * window))
                 for factor in (0.7, 0.85, 1.18, 1.4)]
        chosen = min([chosen, *tried], key=lambda one: one.cost)
    return chosen


def _refitted(evidence: Evidence, fit: Fit, change: Change) -> Fit:
    wheels, imu, window = change
    reading: Reading = replace(fit.point.reading, wheels=wheels, imu=imu).replacing(
        {'wheel_window': window})
    return evidence.fit(replace(fit.point, reading=reading), fit.slopes, rounds=2)


def _wheel_options(evidence: Evidence, now: Reading) -> list[Change]:
    if not any(d.wheel_times.size and not d.counted for d in evidence.drives):
        return []
    periods = [float(np.median(np.diff(d.wheel_times))) for d in evidence.drives
               if d.wheel_times.size > 3]
    longest = setting('longest_window')
    windows = sorted({w for w in (0.005, 0.01, 0.04, 0.08, longest, *np.round(
        [np.median(periods)], 4).tolist()) if w <= longest})
    found: list[Change] = [(WheelReading.WINDOW_END, now.imu, setting('shortest_window'))]
    for window in windows:
        found += [(kind, now.imu, window) for kind in WheelReading]
    return found


def _imu_options(evidence: Evidence, now: Reading) -> list[Change]:
    if not any(d.imu_times.size for d in evidence.drives):
        return []
    return [(now.wheels, place, now.get('wheel_window')) for place in (0.0, 0.5, 1.0)]
