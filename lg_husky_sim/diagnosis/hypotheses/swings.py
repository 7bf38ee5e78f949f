# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Forces that swing over time in fixed directions over ground: a deck that tilts or moves, gusts.

A force that varies freely in time is what a rough floor does, and counts as noise. One of a single
period T is no such noise: along a chassis of heading theta it is::

    F(t) = (a cos wt + b sin wt) cos theta + (c cos wt + d sin wt) sin theta,   w = 2 pi / T

with a, b, c and d of each drive Gaussian, since nobody knows when the recordings were made. Its
log evidence is that of the columns at the likeliest size (:mod:`.smooth_efforts`), less the
logarithm of the number of independent periods that were looked at. Unlike a line over a distance
(:mod:`.lines`), it has too few periods in a drive for its neighbours to tell the level of noise.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.evidence.observation import probe_times
from lg_husky_sim.diagnosis.hypotheses.smooth_efforts import (
    BALANCES,
    beyond_chance,
    Effort,
    moved_by,
    quantities,
)
from lg_husky_sim.diagnosis.selection.screening import Projection
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Frequencies looked at for each independent one.
DENSITY = 2


@dataclass(frozen=True, eq=False)
class Swing(Effort):
    """
    A force that swings.

    Parameters
    ----------
    period : float
        [s]

    """

    period: float


def swinging(times: FloatArray, heading: FloatArray, frequency: float) -> FloatArray:
    """
    Return the parts of a swinging force along a chassis.

    Parameters
    ----------
    times, heading : numpy.ndarray, shape (n,)
        [s], [rad]
    frequency : float
        [Hz]

    Returns
    -------
    numpy.ndarray, shape (n, 4)
        To be multiplied with a, b, c and d.

    """
    phase = 2.0 * np.pi * frequency * times
    return np.column_stack([swing * way for way in (np.cos(heading), np.sin(heading))
                            for swing in (np.cos(phase), np.sin(phase))])


def swings(evidence: Evidence, fit: Fit) -> tuple[Swing, ...]:
    """
    Look for a force that swings in what a fit leaves.

    Parameters
    ----------
    evidence : Evidence
        Drives, and the noise under which the fit was made.
    fit : Fit
        What it leaves of the recordings is searched.

    Returns
    -------
    tuple of Swing
        Of the likeliest period; none without any evidence.

    """
    known = quantities(evidence, evidence.motions(fit.point, True))
    projection = Projection(fit)
    row = BALANCES['force'][0]
    longest = max(drive.end - drive.start for drive in evidence.drives)
    first = int(setting('swing_least') * DENSITY)
    last = int(setting('swing_fastest') * longest * DENSITY)
    frequencies = np.arange(first, last + 1) / (longest * DENSITY)
    penalty = math.log(max(frequencies.size / DENSITY, 1.0))

    def at(frequency: float) -> Swing:
        columns = np.zeros((evidence.count, 4 * len(known)))
        shapes, top = [], 0
        for number, (one, whitener) in enumerate(zip(known, evidence.whiteners, strict=True)):
            shape = swinging(probe_times(whitener.frame.drive), one['heading'], frequency)
            own = whitener.apply(moved_by(whitener, row, shape))
            columns[top:top + len(own), 4 * number:4 * number + 4] = own
            shapes.append(shape)
            top += len(own)
        gain, explained, values, deviations = beyond_chance(evidence, fit, projection, columns)
        largest = max(float(np.max(np.abs(shape @ part))) for shape, part in zip(
            shapes, np.split(values, len(shapes)), strict=True))
        return Swing('force', 'time', gain - penalty, explained, values, deviations,
                     largest, 1.0 / frequency)
    found = max(evidence.pool.map(at, frequencies.tolist()), key=lambda one: one.evidence,
                default=None)
    return (found,) if found is not None and found.evidence > 0.0 else ()
