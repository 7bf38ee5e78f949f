# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
How far a model stays from the data, whatever it is that is missing.

With recordings from before a change, the yardstick is how well the same model follows those: a
model that is wrong about the robot is wrong in both. Without any, it is the sensors' noise.
"""

from __future__ import annotations

from collections.abc import Collection

from lg_husky_sim.diagnosis.fits import Fit
from lg_husky_sim.diagnosis.search import Search
from lg_husky_sim.identification.noise import Metric
from lg_husky_sim.identification.problem import Observations
import numpy as np

#: Squared residual above which a value counts no more, in units of the noise.
LARGEST = 1e4
#: Mean square below which a channel is at its noise.
NOISE = 0.5
#: Mean square, in units of the noise, from which nothing missing is no answer. A rough floor
#: shakes the yaw rate most, the wheels less, and what a pose moves by hardly at all.
FAR = {'yaw_rate': 12.0, 'wheel_left': 4.0, 'wheel_right': 4.0, 'advance': 3.0, 'turn': 3.0}
#: The same from which a name is less believed.
MUCH = 12.0
#: The same with recordings from before, as a multiple of theirs.
FARTHER = 2.0
#: Multiple of the mean square before a change from which a name is less believed.
MORE = 3.0


def mean_squares(observations: Observations, fit: Fit, metric_: Metric,
                 recordings: Collection[str] = (), alike: bool = False) -> dict[str, float]:
    """
    Return the mean square of the residual of each channel, in units of its noise.

    Parameters
    ----------
    observations : Observations
    fit : Fit
    metric_ : Metric
    recordings : collection of str
        Those that count; all where it is empty.
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
            not recordings or observations.pieces[s.piece].recording in recordings)]
        values = [scaled[part][counts[part]] for part in parts]
        squares = np.minimum(np.concatenate(values) ** 2, LARGEST) if values else np.zeros(0)
        if squares.size:
            found[name] = float(np.mean(squares))
    return found


def against_before(search: Search, fit: Fit, alike: bool) -> float:
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
    float
        Largest ratio of mean squares over all channels.
    """
    if search.change is None:
        return 1.0
    observations, metric_ = search.observations, search.rounds[-1].metric
    names = observations.recordings
    border = names.index(search.change.recording)
    before, after = (mean_squares(observations, fit, metric_, part, alike)
                     for part in (names[:border], names[border:]))
    return max((after[name] / max(before[name], NOISE) for name in after if name in before),
               default=1.0)


def is_far(search: Search) -> bool:
    """
    Return whether the data are so far from the model that something must be missing.

    Parameters
    ----------
    search : Search

    Returns
    -------
    bool
    """
    if search.change is not None:
        return against_before(search, search.final, True) > FARTHER
    squares = mean_squares(search.observations, search.final, search.rounds[-1].metric)
    return any(square > FAR[name] for name, square in squares.items())


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
        return 1.0 - 0.5 * max(0.0, 1.0 - MORE / more)
    squares = mean_squares(search.observations, search.final, search.rounds[-1].metric)
    most = max(squares.values(), default=0.0)
    plain = mean_squares(search.observations, search.plain, search.rounds[-1].metric)
    part = most / max(max(plain.values(), default=0.0), most, NOISE)
    return 1.0 - 0.5 * part * most / (most + MUCH)
