# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The base fitted to each recording by itself, whichever set it is of.

Which recordings are of which set is not used here. So two sets of one robot cannot end on
different summits of the likelihood, and a fit that fails adds to what recordings of a set differ
by.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

from lg_husky_sim.diagnosis.before_after.drives import Drive
from lg_husky_sim.diagnosis.before_after.evidence import Evidence, joined, Quadratic
from lg_husky_sim.diagnosis.before_after.fitting import cost_at, fit_set, Prior, SetFit
from lg_husky_sim.diagnosis.before_after.prediction import (
    Base,
    CHANNELS,
    jacobian,
    measured,
    residual,
)
from lg_husky_sim.diagnosis.before_after.whitening import first_noise, Noise, noise_of
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Told how far it is (0 to 1).
Share = Callable[[float], None]
#: Parameters by recording, on the scale of the estimates.
Places = Mapping[str, FloatArray]


@dataclass(frozen=True, eq=False)
class RecordingFits:
    """
    The base fitted to each recording.

    Parameters
    ----------
    base : Base
    prior : Prior
        Of the parameters, without what is known of them by other recordings.
    noise : Noise
    common : numpy.ndarray, shape (n,)
        Mean of the recordings, less what their streams are late, on the scale of the estimates.
    places : mapping of str to numpy.ndarray, shape (n,)
        Where each recording is likeliest.
    quadratics : tuple of Quadratic
        The likelihood of each recording about its own fit, for all parameters.
    """

    base: Base
    prior: Prior
    noise: Noise
    common: FloatArray
    places: Places
    quadratics: tuple[Quadratic, ...]


def fit_recordings(base: Base, drives: Sequence[Drive], lags: Places, begin: FloatArray,
                   pool: ThreadPoolExecutor, share: Share) -> RecordingFits:
    """
    Fit the base to each recording.

    The longest is fitted first, from every kind of robot; the others begin there, or where any
    start is likelier. Then all are fitted twice more, with a prior about their mean that is as
    wide as a change, and each may begin where any other ended, or at a start from there. Where it
    begins, and what its delays are expected to be, differs by as much as its streams say.

    Parameters
    ----------
    base : Base
    drives : sequence of Drive
    lags : mapping of str to numpy.ndarray, shape (n,)
        By how much the streams of each recording are late, on the scale of the estimates.
    begin : numpy.ndarray, shape (n,)
        Where the fits begin.
    pool : ThreadPoolExecutor
    share : callable
        Told how far it is (0 to 1).

    Returns
    -------
    RecordingFits
    """
    numbers = base.settings.fit
    quantities = base.settings.quantities
    free = np.array([not base.given or q.name in base.settings.body for q in quantities])
    # What the nominal robot has not stays out of the fits, which it would lead astray: whether it
    # has come to be there is told from the derivatives.
    held = np.array([q.name in base.settings.runs_as for q in quantities])
    every, prior = Prior(base.start, base.sd, free), Prior(base.start, base.sd, free & ~held)
    steps, enough, roughly = int(numbers['steps']), numbers['enough'], numbers['roughly']
    noise = first_noise(base.settings).among(_moving(base, drives))
    groups: dict[str, list[Drive]] = {}
    for drive in drives:
        groups.setdefault(drive.recording, []).append(drive)
    longest = max(groups, key=lambda name: sum(d.steps for d in groups[name]))
    kinds = _kinds(base, prior, begin)
    firsts = list(pool.map(lambda start: fit_set(
        base, groups[longest], replace(prior, mean=prior.mean + lags[longest]), noise,
        start + lags[longest], steps, roughly, map), kinds))
    first = min(firsts, key=lambda fit: fit.cost).z
    share(0.2)

    def fitted(name: str, about: Prior, kinds: Sequence[Sequence[FloatArray]], until: float
               ) -> SetFit:
        about = replace(about, mean=about.mean + lags[name])

        def cost(start: FloatArray) -> float:
            return cost_at(base, groups[name], about, noise, start, map)

        def fit(start: FloatArray, at_most: int) -> SetFit:
            return fit_set(base, groups[name], about, noise, start, at_most, until, map)
        nearest = sorted(((cost(one), k, one) for k, kind in enumerate(kinds) for one in [
            min(kind, key=cost)]), key=lambda one: one[:2])[:int(numbers['raced'])]
        begun = min((fit(one, int(numbers['race_steps'])) for _, _, one in nearest),
                    key=lambda one: one.cost)
        return fit(begun.z, steps)
    names = list(groups)
    options = [*kinds, *_shifted(base, free, first - lags[longest])]
    places = dict(zip(names, pool.map(lambda name: first if name == longest else fitted(
        name, prior, [[one + lags[name]] for one in options], roughly).z, names), strict=True))
    share(0.4)
    noise = _renewed(base, groups, places).among(noise.sd)
    wide = np.array([np.hypot(q.recording, q.change) for q in quantities])
    # A delay of every stream is one of the commands: that of one stream is none in all recordings.
    wide[base.reference] = base.sd[base.reference]
    for turn, until in enumerate((roughly, enough)):
        middle = _mean(base, prior, wide, places, [q.less(lags[q.recording]) for q in _quadratics(
            base, groups, noise, prior, places, pool)])
        about = Prior(middle, wide, prior.free)
        ends = {'': middle, **{name: place - lags[name] for name, place in places.items()}}

        def again(name: str, about: Prior = about, ends: Places = ends, places: Places = places,
                  until: float = until, turn: int = turn) -> FloatArray:
            # Of starts of a kind that begin at different ends, the likeliest.
            begins = [end + lags[name] for other, end in ends.items() if other != name or not turn]
            others = [[one] for one in begins] if turn else list(zip(
                *(_shifted(base, free, one) for one in begins), strict=True))
            fits = [fitted(name, about, [[places[name]]], until),
                    fitted(name, about, others, until)]
            return min(fits, key=lambda fit: fit.cost).z
        places = dict(zip(names, pool.map(again, names), strict=True))
        share(0.65 + 0.2 * turn)
        if not turn:
            noise = _renewed(base, groups, places).among(noise.sd)
    found = _quadratics(base, groups, noise, every, places, pool)
    share(1.0)
    return RecordingFits(base, every, noise, middle, places, tuple(
        _with_limits(base, groups[one.recording], noise, every, places, one) for one in found))


def at_the_edge(base: Base, drives: Sequence[Drive]) -> Base:
    """Return a base whose limits of commands are the largest that were sent; none is refuted."""
    start = np.array(base.start)
    for column, name in enumerate(('limit_forward', 'limit_yaw')):
        largest = max(drive.largest_command(column) for drive in drives)
        if largest > 0.0:
            start[base.names.index(name)] = base.place(name, largest)
    return replace(base, start=np.clip(start, *base.bounds()))


def quadratic(base: Base, drive: Drive, noise: Noise, z: FloatArray, prior: Prior) -> Quadratic:
    """
    Return the quadratic of a drive about a point on the scale of the estimates.

    With residuals e and their derivatives J at z, whitened, the negative log likelihood is::

        |e + J (x - z)|^2 / 2 = x' J'J x / 2 - (J'J z - J'e)' x + |e - J z|^2 / 2
    """
    rows, columns = jacobian(base, drive, z, prior.free)
    e, j = noise.white(rows), noise.white(columns)
    curvature, slope = j.T @ j, j.T @ e
    return Quadratic(drive.recording, False, curvature, curvature @ z - slope,
                     0.5 * float(e @ e) - float(z @ slope) + 0.5 * float(z @ curvature @ z))


def _moving(base: Base, drives: Sequence[Drive]) -> set[str]:
    # Channels that read more than one value: an IMU without an accelerometer reads zeros.
    return {name for drive in drives for stream, rows in measured(base, drive).items()
            for name, column in zip(CHANNELS[stream], rows.T, strict=True)
            if column.size and np.ptp(column) > 0.0}


def _kinds(base: Base, prior: Prior, begin: FloatArray) -> list[FloatArray]:
    # Where the kinds of robot are the same for this block, once.
    names, found = base.names, [begin]
    for kind in base.kinds:
        start = np.array(begin)
        for name, value in kind.items():
            k = names.index(name)
            if prior.free[k]:
                start[k] = base.place(name, value)
        if not any(np.array_equal(start, one) for one in found):
            found.append(start)
    return found


def _shifted(base: Base, free: FloatArray, begin: FloatArray) -> list[FloatArray]:
    names, (lower, upper) = base.names, base.bounds()
    found = [begin]
    for entry in base.settings.starts:
        if all(free[names.index(name)] for name in entry):
            one = np.array(begin)
            for name, value in entry.items():
                one[names.index(name)] += value
            found.append(np.clip(one, lower, upper))
    return found


def _renewed(base: Base, groups: Mapping[str, Sequence[Drive]], places: Places) -> Noise:
    return noise_of([residual(base, d, places[name]) for name, ds in groups.items() for d in ds],
                    int(base.settings.fit['filter']))


def _quadratics(base: Base, groups: Mapping[str, Sequence[Drive]], noise: Noise, prior: Prior,
                places: Places, pool: ThreadPoolExecutor) -> list[Quadratic]:
    return joined(list(pool.map(
        lambda drive: quadratic(base, drive, noise, places[drive.recording], prior),
        [d for ds in groups.values() for d in ds])))


def _mean(base: Base, prior: Prior, wide: FloatArray, places: Places,
          quadratics: Sequence[Quadratic]) -> FloatArray:
    # A limit is the highest of all recordings: where none is reached, none is told.
    index = np.flatnonzero(prior.free)
    z = np.array(prior.mean)
    z[index] = Evidence([q.among(index) for q in quadratics], prior.mean[index], prior.sd[index],
                        wide[index], wide[index]).solve(np.zeros(0, dtype=np.intp)).shared
    for k, quantity in enumerate(base.settings.quantities):
        if prior.free[k] and quantity.name in base.settings.limits:
            z[k] = max(place[k] for place in places.values())
    return np.clip(z, *base.bounds())


def _with_limits(base: Base, drives: Sequence[Drive], noise: Noise, prior: Prior, places: Places,
                 near: Quadratic) -> Quadratic:
    # A limit that is not reached has no derivative: put the lowest of all recordings in.
    z = places[near.recording]

    def cost(at: FloatArray) -> float:
        return 0.5 * sum(float(e @ e) for e in (
            noise.white(residual(base, d, at)) for d in drives))
    here = near.value(z)
    for k, quantity in enumerate(base.settings.quantities):
        lowest = min(place[k] for place in places.values())
        apart = float(lowest - z[k])
        if not prior.free[k] or quantity.name not in base.settings.limits or (
                abs(apart) < prior.sd[k] * base.settings.fit['limit_apart']):
            continue
        there = np.array(z)
        there[k] = lowest
        near = near.curved(k, z[k], 2.0 * (cost(there) - here) / apart ** 2)
    return near
