# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What a diagnosis found out of how a log was made, and read otherwise than it is written."""

from __future__ import annotations

from collections.abc import Sequence
import math

from lg_husky_sim.diagnosis.evidence.drives import Drive
from lg_husky_sim.diagnosis.evidence.reading import Reading, WheelReading
from lg_husky_sim.diagnosis.settings import setting
import numpy as np

#: Streams as a reader knows them, by the field of their stamps.
NAMES = {'wheel_times': 'wheels', 'imu_times': 'IMU', 'pose_times': 'pose'}


def log_notes(drives: Sequence[Drive]) -> tuple[str, ...]:
    """
    Return what was read otherwise than it is written, in sentences.

    Parameters
    ----------
    drives : sequence of Drive
        As the last fit saw them.

    Returns
    -------
    tuple of str

    """
    notes = []
    periods = [d.clock.period for d in drives if d.clock is not None]
    if periods:
        notes.append('the base seems to apply commands at its own ticks, every '
                     f'{1e3 * float(np.mean(periods)):.3g} ms, not when they arrive')
    for stream, name in NAMES.items():
        jitters = [d.jitter[stream] for d in drives if stream in d.jitter]
        if jitters:
            notes.append(f'the stamps of the {name} jitter by {1e3 * max(jitters):.2g} ms about '
                         f'even times, which took their place in {len(jitters)} of {len(drives)} '
                         'segments')
    count = sum(_changed(d) for d in drives if d.clock is None)
    if count:
        notes.append(f'{count} of {sum(len(d.logged) for d in drives)} commands seem to have '
                     'reached the base late or not at all, or to be missing in the log: the '
                     'model was driven by what the base seems to have got')
    return tuple(notes)


def reading_notes(drives: Sequence[Drive], reading: Reading) -> tuple[str, ...]:
    """
    Return how the rates of wheels and yaw seem to have been made, in sentences.

    Parameters
    ----------
    drives : sequence of Drive
        Say which rates were logged.
    reading : Reading
        As estimated; of rates of the moment nothing is said.

    Returns
    -------
    tuple of str

    """
    notes, window = [], reading.get('wheel_window')
    rated = any(d.wheel_times.size and not d.counted for d in drives)
    # One that is as it began has not been found.
    begun = (Reading().wheels, setting('wheel_window')) == (reading.wheels, window)
    filtered = reading.wheels is WheelReading.FILTERED
    lag = 0.0 if filtered else reading.get('wheel_smoothing')
    if rated and max(window, lag) > setting('shortest_window') and (lag or not begun):
        kind = {WheelReading.WINDOW_END: 'means over {} ms before their stamps',
                WheelReading.WINDOW_MIDDLE: 'means over {} ms around their stamps',
                WheelReading.WINDOW_START: 'means over {} ms after their stamps',
                WheelReading.FILTERED: 'behind a first-order low pass of {} ms'}[reading.wheels]
        mean = reading.get('wheel_mean') if filtered else 0.0
        before = f'means over {1e3 * mean:.0f} ms ' if mean > setting('shortest_window') else ''
        after = f', behind a first-order filter of the messages of {1e3 * lag:.0f} ms' if (
            lag > setting('shortest_window')) else ''
        notes.append('wheel rates seem to be ' + before + kind.format(f'{1e3 * window:.0f}')
                     + after)
    if reading.imu is not None and any(d.imu_times.size for d in drives):
        length = f'{1e3 * reading.get("imu_window"):.0f} ms'
        notes.append('yaw rates of the IMU seem to be ' + (
            f'behind a first-order low pass of {length}' if reading.imu == math.inf
            else f'means over {length}'))
    return tuple(notes)


def _changed(drive: Drive) -> int:
    # A late command is one that is gone and one that is new.
    logged, got = (set(series.times.tolist()) for series in (drive.logged, drive.commands))
    return max(len(logged - got), len(got - logged))
