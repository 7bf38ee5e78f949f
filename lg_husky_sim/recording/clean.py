# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Samples as they come to samples that make sense: sorted, one a stamp, finite."""

from __future__ import annotations

from lg_husky_sim.recording.wheels import rates_from_angles, unwrapped
from lg_husky_sim.signals import FloatArray
import numpy as np

Sample = tuple[FloatArray, FloatArray]
"""Times [s], shape (n,), and values, shape (n, k)."""

LARGEST = 1e8
"""No recorded quantity is larger in SI units (map coordinates reach 1e7 m)."""


def clean(name: str, times: FloatArray, values: FloatArray, notes: list[str]) -> Sample:
    """
    Sort samples by time, keep the last one of each stamp, and drop senseless ones.

    Parameters
    ----------
    name : str
        For the notes. Rows of ``wheels`` may hold NaN in some columns.
    times : numpy.ndarray, shape (n,)
        Stamps [s] in any order.
    values : numpy.ndarray, shape (n, k)
        A row for each stamp.
    notes : list of str
        Gets a line for what was dropped.

    Returns
    -------
    times : numpy.ndarray, shape (m,)
        Strictly increasing.
    values : numpy.ndarray, shape (m, k)

    """
    order = np.argsort(times, kind='stable')
    if np.any(np.diff(times) < 0.0):
        notes.append(f'{name}: messages out of order were sorted')
    times, values = times[order], values[order]
    last = np.append(np.diff(times) > 0.0, True)[:times.size]
    if not np.all(last):
        notes.append(f'{name}: {np.count_nonzero(~last)} of {last.size} samples share a stamp '
                     'with a later one and were dropped')
    times, values = times[last], values[last]
    with np.errstate(invalid='ignore'):
        sound = np.abs(values) < LARGEST
    usable = np.any(sound, axis=1) if name == 'wheels' else np.all(sound, axis=1)
    unclean, values = values, np.where(sound, values, np.nan)
    if not np.all(usable):
        notes.append(f'{name}: {np.count_nonzero(~usable)} of {usable.size} samples were dropped: '
                     + _wrong(name, unclean[~usable]))
    return times[usable], values[usable]


def _wrong(name: str, rows: FloatArray) -> str:
    # What is wrong with rows that are of no use, each counted once.
    missing = np.any(np.isnan(rows), axis=1)
    # A transform has x, y and heading.
    turned = np.isnan(rows[:, -1]) & np.all(np.isfinite(rows[:, :-1]), axis=1) & ('>' in name)
    kinds = {'without a heading (a quaternion of zeros or no numbers)': turned,
             'not a number': missing & ~turned, f'beyond {LARGEST:g}': ~missing}
    return ', '.join(f'{np.count_nonzero(which)} {what}' for what, which in kinds.items()
                     if np.any(which))


def wheel_streams(times: FloatArray, values: FloatArray, notes: list[str]) -> dict[str, Sample]:
    """
    Split rows of joint states into rates, angles and torques of the two sides.

    Parameters
    ----------
    times : numpy.ndarray, shape (n,)
        Stamps [s], increasing.
    values : numpy.ndarray, shape (n, 6)
        Rates [rad/s], angles [rad] and efforts [N·m], each left and right; NaN where missing.
    notes : list of str
        Gets a line for what was dropped or derived.

    Returns
    -------
    dict of str to (times, values)
        ``wheels`` [rad/s], derived from the angles where no rate was recorded;
        ``wheel_angles`` [rad] and ``wheel_torques`` [N·m] where recorded.

    """
    streams: dict[str, Sample] = {}
    for name, first in (('wheels', 0), ('wheel_angles', 2), ('wheel_torques', 4)):
        part = values[:, first:first + 2]
        there = np.all(np.isfinite(part), axis=1)
        if not np.any(there):
            continue
        dropped = np.count_nonzero(~there)
        if dropped:
            notes.append(f'{name}: {dropped} of {there.size} joint states lack a value of one '
                         'side and were dropped')
        streams[name] = times[there], part[there]
    if 'wheel_angles' in streams:
        streams['wheel_angles'] = (
            streams['wheel_angles'][0], unwrapped(streams['wheel_angles'][1]))
        if 'wheels' not in streams and streams['wheel_angles'][0].size >= 2:
            streams['wheels'] = rates_from_angles(*streams['wheel_angles'])
            notes.append('wheels: no velocities recorded; derived from the positions')
    return streams


def joined(left: Sample, right: Sample) -> Sample:
    """
    Join two single channels at the stamps of the first, within the time of both.

    Parameters
    ----------
    left, right : (times, values)
        Shapes (n,), (n, 1) and (m,), (m, 1).

    Returns
    -------
    times : numpy.ndarray, shape (k,)
    values : numpy.ndarray, shape (k, 2)

    """
    times, values = left
    if not times.size or not right[0].size:
        return np.zeros(0), np.zeros((0, 2))
    both = (times >= right[0][0]) & (times <= right[0][-1])
    other = np.interp(times[both], right[0], right[1][:, 0])
    return times[both], np.column_stack((values[both, 0], other))
