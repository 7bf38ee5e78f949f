# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Waves of the ground: a floor whose height is a plane wave, over which robots drive at any heading.

With the wave number k = 2 pi / L in the direction alpha of the map, a robot of heading theta at
the place r is pushed along its chassis by the slope of the floor there::

    F = cos(theta - alpha) (a cos k.r + b sin k.r),   k.r = k (x cos alpha + y sin alpha)

The floor is the same for all drives, and so are a and b. Over the distance driven
(:mod:`.lines`) such a floor has no period unless the robot keeps to one heading.

With the scores s of a force over time (:mod:`..evidence.adjoint`) the power at each k is that of
``sum s cos(theta - alpha) exp(i k.r)``. Where only noise is left, its ratio to the level of the
neighbours is exponentially distributed: what stands out no more than the largest of so many
independent ones would by chance is none. Of others the log evidence of their columns counts
(:mod:`.smooth_efforts`), less the logarithm of the number of independent ones.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

from lg_husky_sim.diagnosis.evidence.adjoint import scores
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.hypotheses.smooth_efforts import (
    BALANCES,
    beyond_chance,
    Effort,
    moved_by,
    quantities,
)
from lg_husky_sim.diagnosis.selection.screening import Projection
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.jit import jit
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray

#: Samples of each coordinate of the wave number for each independent one.
DENSITY = 2


@dataclass(frozen=True, eq=False)
class Wave(Effort):
    """
    A force of a floor with waves.

    Parameters
    ----------
    period : float
        Length of the waves [m].
    way : float
        Direction in which they follow each other, against the x axis of the map [rad].

    """

    period: float
    way: float


def wave_numbers(span: float, shortest: float, most: int) -> FloatArray:
    """
    Return what waves are looked for.

    Parameters
    ----------
    span : float
        Longest way across the ground that was driven on [m].
    shortest : float
        Length of the shortest wave [m].
    most : int
        Number of waves; where there are more, the longer ones are looked for.

    Returns
    -------
    numpy.ndarray, shape (n, 2)
        Cycles per metre along x and y, of one of each pair of opposite directions; at least one
        period in the span.

    """
    step = 1.0 / (DENSITY * span)
    finest = min(1.0 / shortest, step * math.sqrt(2.0 * most / math.pi))
    count = int(finest / step)
    x, y = np.meshgrid(step * np.arange(-count, count + 1), step * np.arange(count + 1))
    found = np.column_stack([x.ravel(), y.ravel()])
    size = np.hypot(*found.T)
    half = (found[:, 1] > 0.0) | (found[:, 0] > 0.0)
    kept: FloatArray = found[half & (size <= finest) & (size >= 1.0 / span)]
    return kept


def pushed(waves: FloatArray, place: FloatArray, heading: FloatArray) -> FloatArray:
    """
    Return the parts of the forces of waves along a chassis.

    Parameters
    ----------
    waves : numpy.ndarray, shape (m, 2)
        Cycles per metre along x and y.
    place : numpy.ndarray, shape (n, 2)
        [m]
    heading : numpy.ndarray, shape (n,)
        [rad]

    Returns
    -------
    numpy.ndarray, shape (n, m), complex
        ``cos(theta - alpha) exp(i k.r)``: its real part is to be multiplied with a, its imaginary
        one with b.

    """
    way = np.arctan2(waves[:, 1], waves[:, 0])
    found: FloatArray = np.cos(heading[:, None] - way) * np.exp(2j * np.pi * (place @ waves.T))
    return found


def spectrum(waves: FloatArray, push: FloatArray, place: FloatArray, heading: FloatArray
             ) -> NDArray[np.complex128]:
    """
    Return the sum of pushes times what :func:`pushed` returns, for waves on a grid.

    Parameters
    ----------
    waves : numpy.ndarray, shape (m, 2)
        Cycles per metre along x and y; ``exp(i k.r)`` is a product of one factor of each.
    push : numpy.ndarray, shape (n,)
        Factor of each reading.
    place : numpy.ndarray, shape (n, 2)
        [m]
    heading : numpy.ndarray, shape (n,)
        [rad]

    Returns
    -------
    numpy.ndarray of complex, shape (m,)

    """
    (xs, across), (ys, up) = (np.unique(waves[:, i], return_inverse=True) for i in range(2))
    along_x, along_y = (np.exp(2j * np.pi * np.outer(place[:, i], own))
                        for i, own in enumerate((xs, ys)))
    way = np.arctan2(waves[:, 1], waves[:, 0])
    total = np.zeros(len(waves), dtype=complex)
    for turned, share in ((np.cos(heading), np.cos(way)), (np.sin(heading), np.sin(way))):
        grid = (along_x * (push * turned)[:, None]).T @ along_y
        total += share * grid[across, up]
    return total


def levels(power: FloatArray, waves: FloatArray, span: float) -> FloatArray:
    """
    Return the level of the noise at each wave, by its neighbours of about its length.

    Parameters
    ----------
    power : numpy.ndarray, shape (m,)
        Of each wave.
    waves : numpy.ndarray, shape (m, 2)
        Cycles per metre along x and y.
    span : float
        Longest way across the ground [m].

    Returns
    -------
    numpy.ndarray, shape (m,)
        ``exp(mean log P + gamma)`` of waves of about its length in any direction, but for those
        next to it, with Euler's constant gamma as in :func:`.lines.level`: what leaks into some
        of them hardly moves it. Infinite where there are none.

    """
    means = np.empty(power.size)
    _mean_logs(np.log(np.maximum(power, 1e-300)), waves, np.log(np.hypot(*waves.T)),
               math.log(setting('wave_neighbours')), setting('line_gap') / span, means)
    found: FloatArray = np.exp(means + np.euler_gamma)
    return found


@jit
def _mean_logs(logs: FloatArray, waves: FloatArray, sizes: FloatArray, reach: float, gap: float,
               means: FloatArray) -> None:
    for own in range(logs.size):
        total, count = 0.0, 0
        for other in range(logs.size):
            if abs(sizes[other] - sizes[own]) < reach:
                ahead = ((waves[other, 0] - waves[own, 0]) ** 2
                         + (waves[other, 1] - waves[own, 1]) ** 2)
                behind = ((waves[other, 0] + waves[own, 0]) ** 2
                          + (waves[other, 1] + waves[own, 1]) ** 2)
                if min(ahead, behind) > gap * gap:
                    total += logs[other]
                    count += 1
        means[own] = total / count if count else np.inf


def waves(evidence: Evidence, fit: Fit) -> tuple[Wave, ...]:
    """
    Look for a floor with waves in what a fit leaves.

    Parameters
    ----------
    evidence : Evidence
        Drives, and the noise under which the fit was made.
    fit : Fit
        What it leaves of the recordings is searched.

    Returns
    -------
    tuple of Wave
        The likeliest one; none without any evidence.

    """
    known = quantities(evidence, evidence.motions(fit.point, True))
    places = [np.column_stack([one['x'], one['y']]) for one in known]
    span = float(np.hypot(*np.ptp(np.concatenate(places), axis=0)))
    shortest = setting('wave_shortest') * fit.point.numbers['wheelbase']
    if span <= shortest:
        return ()
    tried = wave_numbers(span, shortest, int(setting('most_waves')))
    projection = Projection(fit)
    row = BALANCES['force'][0]
    weights = np.split(projection.target, np.cumsum([
        w.frame.times.size for w in evidence.whiteners])[:-1])
    pushes = [scores(w, own)[:, row] for w, own in zip(evidence.whiteners, weights, strict=True)]

    total = np.zeros(len(tried), dtype=complex)
    for push, place, one in zip(pushes, places, known, strict=True):
        total += spectrum(tried, push, place, one['heading'])
    power = np.abs(total) ** 2
    independent = math.log(max(len(tried) / DENSITY ** 2, 1.0))
    ratios = power / levels(power, tried, span)

    def at(number: int) -> Wave:
        some = tried[number:number + 1]
        shapes = [pushed(some, place, one['heading']) for place, one in zip(
            places, known, strict=True)]
        parts = [np.column_stack([shape.real, shape.imag]) for shape in shapes]
        columns = np.concatenate([whitener.apply(moved_by(whitener, row, part)) for whitener, part
                                  in zip(evidence.whiteners, parts, strict=True)])
        gain, explained, values, deviations = beyond_chance(evidence, fit, projection, columns)
        length = 1.0 / float(np.hypot(*some[0]))
        return Wave('force', 'place', gain - independent, explained, values, deviations,
                    float(np.hypot(*values)), length, float(np.arctan2(some[0, 1], some[0, 0])))
    by_chance = independent - math.log(setting('false_alarm_rate'))
    best = [number for number in np.argsort(-ratios)[:int(setting('waves_fitted'))].tolist()
            if ratios[number] > by_chance]
    found = max(evidence.pool.map(at, best), key=lambda one: one.evidence, default=None)
    return (found,) if found is not None and found.evidence > 0.0 else ()
