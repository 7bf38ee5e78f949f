# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The part of a measured forward speed that is scatter of the pose, and no error of a model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
import math

from lg_husky_sim.comparison.slopes import body_rates, WINDOW
from lg_husky_sim.recording import Segment
from lg_husky_sim.reporting.words import number
from lg_husky_sim.settings import numbers
from lg_husky_sim.signals import FloatArray
import numpy as np


@cache
def settings() -> Mapping[str, float]:
    """Return the numbers of ``config/comparison.yaml`` by name."""
    return numbers('comparison.yaml', 'lg_husky_sim/comparison/1')


def scatter_of(times: FloatArray, forward: FloatArray) -> float:
    """
    Return the scatter of a forward speed that was derived from a pose.

    Parameters
    ----------
    times, forward : numpy.ndarray, shape (n,)
        [s], [m/s]

    Returns
    -------
    float
        Standard deviation by the second differences of values that share no sample of the pose,
        ``median |d2 v| / (0.6745 sqrt 6)`` [m/s]: that of the noise, if the speed itself hardly
        bends within three windows. Not a number if there are too few.

    """
    if times.size < 2:
        return math.nan
    step = max(1, round(WINDOW / max(float(np.median(np.diff(times))), 1e-3)))
    bends = np.diff(forward[::step], 2)
    bends = bends[np.isfinite(bends)]
    return float(np.median(np.abs(bends))) / 0.6745 / math.sqrt(6.0) if bends.size else math.nan


def counts(scatter: float, least: float) -> bool:
    """
    Return whether a scatter is a good part of the errors of all models.

    Parameters
    ----------
    scatter : float
        Of the measured forward speed [m/s].
    least : float
        Smallest error of a model's forward speed [m/s].

    Returns
    -------
    bool
        False also where a model misses the speed by much less: commands do not foretell noise.

    """
    known = settings()
    return known['scatter_share'] * least < scatter <= least / known['scatter_followed']


def scatter_note(scatter: float) -> str:
    """Return in a sentence how much the forward speed of a recording scatters [m/s]."""
    return ('the measured forward speed is the rate of change of the pose, and has a '
            f'scatter of at least {number(scatter, 2)} m/s of its own: that part of its error '
            'is not due to a model')


def scatter_notes(segments: Sequence[Segment], least: float) -> tuple[str, ...]:
    """
    Return the notes of recordings whose forward speed is noise for a good part.

    Parameters
    ----------
    segments : sequence of Segment
        Stretches of all recordings; the poses count.
    least : float
        Smallest error of a model's forward speed [m/s].

    Returns
    -------
    tuple of str

    """
    found = {}
    for name in dict.fromkeys(one.recording for one in segments):
        rates = [body_rates(one.streams['pose']) for one in segments
                 if one.recording == name and 'pose' in one.streams]
        sizes = [scatter_of(one.times, one.column('forward')) for one in rates]
        known = [size for size in sizes if math.isfinite(size)]
        if known and counts(float(np.median(known)), least):
            found[name] = float(np.median(known))
    return tuple(f'{name}: {scatter_note(size)}' for name, size in found.items())
