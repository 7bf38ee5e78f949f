# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Moments at which a wheel does what no command can have made it do: a motor that drops out.

A likelihood with Student's t takes innovations far beyond their noise for accidents, so that what
happens for moments weighs next to nothing in it. Most such moments are accidents: a command that
came late, or never, or a bump of the floor. But no command moves a wheel by more than it changes,
and no bump of a floor by more than a speed that is as good as none, so that these are left out:
neighbouring innovations of a side count, the largest of which stands for a rate beyond that, and
beyond what all commands of the time before it change together. Their evidence is what the cost
loses without them, each less half the logarithm of the number of readings for its time and its
size::

    sum over bursts of  sum (nu+1)/2 log(1 + e^2/nu) - log n
"""

from __future__ import annotations

from lg_husky_sim.diagnosis.evidence import student
from lg_husky_sim.diagnosis.evidence.drives import Channel, Drive
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.signals import FloatArray
import numpy as np

CHANNELS = {'left': (Channel.WHEEL_LEFT, Channel.ANGLE_LEFT),
            'right': (Channel.WHEEL_RIGHT, Channel.ANGLE_RIGHT)}


def wheel_bursts(evidence: Evidence, fit: Fit, side: str) -> float:
    """
    Return the evidence of moments at which the wheels of a side do what no command explains.

    Parameters
    ----------
    evidence : Evidence
        Drives, and the noise under which the fit was made.
    fit : Fit
        What it leaves of the recordings is searched.
    side : str
        'left' or 'right'.

    Returns
    -------
    float
        [nats], at least 0, without the strongest one: what happens once is an accident.

    """
    gains: list[float] = []
    readings, top = 0, 0
    numbers = fit.point.numbers
    lever, radius = numbers['turn_ratio'], numbers['wheel_radius']
    for whitener in evidence.whiteners:
        frame, drive = whitener.frame, whitener.frame.drive
        whitened = fit.whitened[top:top + frame.times.size]
        top += frame.times.size
        own = np.isin(drive.channels[frame.order], [int(c) for c in CHANNELS[side]])
        times, e = frame.times[frame.order][own], whitened[own]
        readings += times.size
        if times.size < 2:
            continue
        sizes = np.abs(e) * whitener.scale[own]
        if drive.counted:
            sizes /= np.median(np.diff(times))
        gains += _gains(times, e, sizes, drive, lever, radius)
    price = float(np.log(max(readings, 1)))
    beyond = sorted(gain - price for gain in gains if gain > price)
    return float(sum(beyond[:-1]))


def _gains(times: FloatArray, e: FloatArray, sizes: FloatArray, drive: Drive, lever: float,
           radius: float) -> list[float]:
    # Of each burst of a side, without its largest innovation, which may be a sensor's.
    far = np.flatnonzero(np.abs(e) > setting('far'))
    if not far.size:
        return []
    before, bump = setting('burst_before'), setting('still_speed')
    stamps = drive.logged.times
    changes = np.abs(np.diff(drive.logged.values, axis=0, prepend=drive.logged.values[:1]))
    costs = student.costs(e)
    found = []
    for burst in np.split(far, np.flatnonzero(np.diff(times[far]) > setting('burst_apart')) + 1):
        begin, end = times[burst[0]] - before, times[burst[-1]]
        recent = changes[(stamps > begin) & (stamps <= end)]
        most = max(float(np.sum(recent[:, 0] + lever * recent[:, 1])), bump) / radius
        if np.max(sizes[burst]) > most:
            found.append(float(np.sum(costs[burst]) - np.max(costs[burst])))
    return found
