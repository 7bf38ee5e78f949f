# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
How far a model stays from the data, whatever it is that is missing.

With recordings from before a change, the yardstick is how well the same model follows those: a
model that is wrong about the robot is wrong in both. Without any, it is the sensors' noise.
"""

from __future__ import annotations

from collections.abc import Collection
import math

from lg_husky_sim.diagnosis.fits import Fit
from lg_husky_sim.diagnosis.search import Search
from lg_husky_sim.identification.noise import Metric
from lg_husky_sim.identification.problem import Observations, PERIOD
import numpy as np

#: Largest squared residual, in units of the noise: a larger one counts as this.
LARGEST = 1e4
#: Mean square below which a channel is at its noise.
NOISE = 0.5
#: Mean square, in units of the noise, from which "nothing missing" is no answer. A rough floor
#: shakes the yaw rate most, the wheels less, and what a pose moves by hardly at all.
FAR = {'yaw_rate': 16.0, 'wheel_left': 4.0, 'wheel_right': 4.0, 'advance': 3.0, 'turn': 3.0}
#: With recordings from before a change: multiple of their mean square from which it is none, if
#: there are so many seconds of data on either side; of less, chance alone makes more.
FARTHER, ENOUGH = 2.0, 60.0
#: Most that distance takes off the belief in a name; mean square at which half of that is taken,
#: and the multiple of the mean square before a change from which it begins to be taken.
DISTRUST, HALF_TRUSTED, MORE = 0.5, 12.0, 3.0


def mean_squares(observations: Observations, fit: Fit, metric_: Metric,
                 recordings: Collection[str] | None = None, alike: bool = False
                 ) -> dict[str, float]:
    """
    Return the mean square of the residual of each channel, in units of its noise.

    Parameters
    ----------
    observations : Observations
    fit : Fit
    metric_ : Metric
    recordings : collection of str, optional
        Those that count; all if not given.
    alike : bool
        Whether errors that may be alike in all recordings are taken off first.

    Returns
    -------
    dict of str to float
    """
    residual = observations.measured - fit.solution.predicted
    scaled = metric_.uncorrelated.whiten(observations, residual) if alike else (
        residual * metric_.scale)
    counts = metric_.scale > 0.0
    found = {}
    for name in observations.channels:
        parts = [slice(s.first, s.last) for s in observations.slices if s.channel == name and (
            recordings is None or observations.pieces[s.piece].recording in recordings)]
        values = [scaled[part][counts[part]] for part in parts]
        squares = np.minimum(np.concatenate(values) ** 2, LARGEST) if values else np.zeros(0)
        if squares.size:
            found[name] = float(np.mean(squares))
    return found


def ratios(search: Search, fit: Fit, alike: bool) -> dict[str, float]:
    """
    Return how much farther a model is from the later recordings than from the earlier ones.

    Parameters
    ----------
    search : Search
        For a change.
    fit : Fit
    alike : bool
        Whether errors that may be alike in all recordings are taken off first.

    Returns
    -------
    dict of str to float
        Ratio of the mean squares of each channel.
    """
    if search.change is None:
        return {}
    before, after = (mean_squares(search.observations, fit, search.rounds[-1].metric, part, alike)
                     for part in search.sides)
    return {name: after[name] / max(before[name], NOISE) for name in after if name in before}


def against_before(search: Search, fit: Fit, alike: bool) -> float:
    """Return the largest of :func:`ratios`; 1 where no change is asked for."""
    if search.change is None:
        return 1.0
    return max(ratios(search, fit, alike).values(), default=1.0)


def beyond_chance(search: Search, ratio: float) -> float:
    """
    Return from which multiple on later recordings are farther, if much data would ask for one.

    Parameters
    ----------
    search : Search
        For a change.
    ratio : float
        Asked of a minute of data and more.

    Returns
    -------
    float
    """
    change, pieces = search.change, search.observations.pieces
    if change is None:
        return ratio
    names = search.observations.recordings
    border = names.index(change.recording)
    seconds = [0.0, 0.0]
    for piece in pieces:
        seconds[names.index(piece.recording) >= border] += piece.count * PERIOD
    return 1.0 + (ratio - 1.0) * max(1.0, math.sqrt(ENOUGH / max(min(seconds), PERIOD)))


def farthest(search: Search) -> tuple[str, float, float]:
    """
    Return the channel in which the data are farthest from the model.

    Parameters
    ----------
    search : Search

    Returns
    -------
    str
        Name of the channel; empty where no channel was recorded both before and after a change.
    float
        Its mean square: in units of the noise, or of that before a change with errors taken off
        that may be alike in all recordings.
    float
        From which on something must be missing.
    """
    if search.change is not None:
        found = ratios(search, search.final, True)
        limits = dict.fromkeys(found, beyond_chance(search, FARTHER))
    else:
        found = mean_squares(search.observations, search.final, search.rounds[-1].metric)
        limits = FAR
    if not found:
        return '', 0.0, math.inf
    name = max(found, key=lambda one: found[one] / limits[one])
    return name, found[name], limits[name]


def is_far(search: Search) -> bool:
    """Return whether the data are so far from the model that something must be missing."""
    _, square, limit = farthest(search)
    return square > limit


def trust(search: Search) -> float:
    """
    Return how much names are believed, by how far the model still is from the data.

    Parameters
    ----------
    search : Search
        That adopted something.

    Returns
    -------
    float
        1 for full belief; less where much is left beside what the names explain, or much more
        than before a change.
    """
    if search.change is not None:
        more = against_before(search, search.final, False)
        return 1.0 - DISTRUST * (1.0 - MORE / max(more, MORE))
    squares = mean_squares(search.observations, search.final, search.rounds[-1].metric)
    most = max(squares.values(), default=0.0)
    plain = mean_squares(search.observations, search.plain, search.rounds[-1].metric)
    part = most / max(max(plain.values(), default=0.0), most, NOISE)
    return 1.0 - DISTRUST * part * most / (most + HALF_TRUSTED)
