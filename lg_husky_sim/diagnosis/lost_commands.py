# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Moments that one lost message explains.

A command that a recording holds may never have reached the base, and one that reached it may be
missing in the recording. The robot then does for one interval what it did before, or begins early
by one; at ten commands a second this is far off for a moment, and no physics.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace

from lg_husky_sim.diagnosis.fits import extras_of, Fit
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.identification.pieces import Piece
from lg_husky_sim.identification.problem import Observations
from lg_husky_sim.signals import TimeSeries
import numpy as np

#: Time before and after a moment's begin in which the message may be [s], and how many of the
#: largest steps there are tried.
BEFORE, AFTER, TRIED = 0.5, 0.05, 3
#: Time before and after the begin in which it must explain the moment [s], and what it may leave
#: of the sum of squares.
AHEAD, FOLLOWING, LEFT = 0.2, 1.0, 0.25
#: Multiple of the usual interval from which a message may be missing in the recording.
GAP = 1.5


def other_commands(piece: Piece, begin: float) -> Iterator[Piece]:
    """
    Give the piece with one message lost, or one more, near a moment.

    Parameters
    ----------
    piece : Piece
    begin : float
        Of the moment [s].

    Yields
    ------
    Piece
        The messages with the largest steps first.
    """
    times, values = piece.commands.times, piece.commands.values
    if times.size < 4:
        return
    usual = float(np.median(np.diff(times)))
    sizes = np.concatenate([[0.0], np.max(np.abs(np.diff(values, axis=0)), axis=1)])
    near = np.flatnonzero((times > begin - BEFORE) & (times < begin + AFTER + usual) & (
        sizes > 0.0))
    for k in near[np.argsort(-sizes[near])][:TRIED]:
        yield replace(piece, commands=TimeSeries(
            np.delete(times, k), np.delete(values, k, axis=0), piece.commands.names))
        if times[k] - times[k - 1] > GAP * usual:
            early = np.array(times)
            early[k] -= usual
            yield replace(piece, commands=TimeSeries(early, values, piece.commands.names))


def without_lost_commands(observations: Observations, fit: Fit,
                          begins: Collection[tuple[str, float]]) -> Fit:
    """
    Return a fit that predicts what moments hold where one message explains them.

    Parameters
    ----------
    observations : Observations
    fit : Fit
    begins : collection of (str, float)
        Recording and time [s] of the moments.

    Returns
    -------
    Fit
        Its prediction is another one around these moments; all else is as given.
    """
    if not begins:
        return fit
    plant, extra = compile_model(fit.structure).at(fit.parameters), extras_of(fit)
    predicted = np.array(fit.solution.predicted)
    for recording, begin in sorted(begins):
        for number, piece in enumerate(observations.pieces):
            rows = [s for s in observations.slices if s.piece == number]
            if piece.recording != recording or not rows:
                continue
            part = slice(rows[0].first, rows[-1].last)
            times = observations.times[part]
            near = (times > begin - AHEAD) & (times < begin + FOLLOWING)
            wheels = np.concatenate([np.full(s.last - s.first, s.channel.startswith('wheel'))
                                     for s in rows])
            seen = near & (wheels if np.any(wheels) else True)
            if not np.any(seen):
                continue
            own = observations.plant_in(plant, recording)
            told = Observations((piece,)).predict(own, extra)
            measured = observations.measured[part]
            left = float(np.sum((measured - predicted[part])[seen] ** 2))
            for other in other_commands(piece, begin):
                change = Observations((other,)).predict(own, extra) - told
                if float(np.sum((measured - predicted[part] - change)[seen] ** 2)) < LEFT * left:
                    predicted[part] += np.where(near, change, 0.0)
                    break
    return replace(fit, solution=replace(fit.solution, predicted=predicted))
