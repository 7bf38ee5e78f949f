# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
What commands that take a little longer now and then leave in the data.

A base asks for commands at a rate of its own, so each is some milliseconds late, no two alike.
Every step of the command therefore leaves an error of the shape of the robot's answer to it. A
late step among early ones looks like a dead time that begins there, or like a limit of the
acceleration; what gains nothing once each step may be late by itself is neither.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from lg_husky_sim.diagnosis.fits import extras_of, Fit
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.identification.noise import Metric
from lg_husky_sim.identification.pieces import Piece
from lg_husky_sim.identification.problem import Observations, PERIOD
from lg_husky_sim.signals import TimeSeries
import numpy as np

#: Deviation of a command's time that is believed possible [s]: that of a base that asks at 50 Hz.
JITTER = 0.006
#: Smallest step that counts [m/s, rad/s], and how many of the largest do.
LEAST, MOST = (0.05, 0.05), 80
#: Commands that change one after another within so much time are one step, of such a length at
#: most [s]: a ramp is late as a whole.
NEXT, LONGEST = 0.15, 0.5


@dataclass(frozen=True)
class Step:
    """
    One step of the commands.

    Parameters
    ----------
    piece : int
        Number of the piece.
    first, last : int
        Places of the first and the last command of the step.
    size : float
        Largest change, in units of the smallest that counts.
    """

    piece: int
    first: int
    last: int
    size: float


def steps_of(observations: Observations) -> list[Step]:
    """
    Return the largest steps of the commands.

    Parameters
    ----------
    observations : Observations

    Returns
    -------
    list of Step
        In their order.
    """
    found = []
    for number, piece in enumerate(observations.pieces):
        times, values = piece.commands.times, piece.commands.values
        end = piece.start + piece.count * PERIOD
        changed = [int(k) + 1 for k in np.flatnonzero(np.any(np.diff(values, axis=0), axis=1))
                   if piece.start < times[k + 1] < end]
        groups: list[list[int]] = []
        for k in changed:
            if groups and times[k] - times[groups[-1][-1]] < NEXT and (
                    times[k] - times[groups[-1][0]] < LONGEST):
                groups[-1].append(k)
            else:
                groups.append([k])
        for group in groups:
            size = float(np.max(np.abs(values[group[-1]] - values[group[0] - 1]) / LEAST))
            if size >= 1.0:
                found.append(Step(number, group[0], group[-1], size))
    found.sort(key=lambda one: -one.size)
    return sorted(found[:MOST], key=lambda one: (one.piece, one.first))


def later(piece: Piece, step: Step) -> tuple[Piece, float]:
    """
    Return a piece one of whose steps comes later.

    Parameters
    ----------
    piece : Piece
    step : Step
        Of its commands.

    Returns
    -------
    Piece
    float
        By how much [s]: a period, or less where the next command comes sooner.
    """
    commands = piece.commands
    times = np.array(commands.times)
    late = min([PERIOD, *(0.5 * np.diff(times[step.last:step.last + 2]))])
    times[step.first:step.last + 1] += late
    return replace(piece, commands=TimeSeries(times, commands.values, commands.names)), late


def with_jitter(observations: Observations, fit: Fit) -> Observations:
    """
    Return observations that make room for commands that are a little late, each by itself.

    Parameters
    ----------
    observations : Observations
    fit : Fit
        Whose answers to the commands' steps are taken.

    Returns
    -------
    Observations
        The same, with ``common`` set.
    """
    steps = steps_of(observations)
    plant, extra = compile_model(fit.structure).at(fit.parameters), extras_of(fit)
    columns = np.zeros((observations.measured.size, len(steps)))
    as_told: dict[int, np.typing.NDArray[np.float64]] = {}
    for k, step in enumerate(steps):
        number = step.piece
        if number not in as_told:
            as_told[number] = Observations((observations.pieces[number],)).predict(plant, extra)
        moved, late = later(observations.pieces[number], step)
        if late <= 0.0:
            # Two commands with one stamp: neither can come later than the other.
            continue
        change = Observations((moved,)).predict(plant, extra) - as_told[number]
        rows = [s for s in observations.slices if s.piece == number]
        columns[rows[0].first:rows[-1].last, k] = JITTER / late * change
    return replace(observations, common=columns)


def gains_beside_jitter(observations: Observations, base: Fit, fits: Sequence[Fit],
                        metric_: Metric) -> list[float]:
    """
    Return what fits gain where each step of the commands may be late by itself.

    Parameters
    ----------
    observations : Observations
    base : Fit
        Against which they gain.
    fits : sequence of Fit
    metric_ : Metric

    Returns
    -------
    list of float
        Drop of the half sum of squares of each [nats].
    """
    shaken = with_jitter(observations, base)
    own = Metric(metric_.scale, metric_.filters, metric_.parts)
    left = [0.5 * float(np.sum(own.whiten(
        shaken, shaken.measured - fit.solution.predicted) ** 2)) for fit in (base, *fits)]
    return [left[0] - one for one in left[1:]]
