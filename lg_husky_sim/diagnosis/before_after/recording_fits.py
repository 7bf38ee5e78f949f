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
from concurrent.futures import Executor
from dataclasses import dataclass, replace

from lg_husky_sim.diagnosis.before_after.base import Base
from lg_husky_sim.diagnosis.before_after.dispersion import dispersed
from lg_husky_sim.diagnosis.before_after.drives import Drive
from lg_husky_sim.diagnosis.before_after.evidence import Evidence, joined, Quadratic
from lg_husky_sim.diagnosis.before_after.fitting import fit_set, Prior, raced, SetFit
from lg_husky_sim.diagnosis.before_after.limits import with_limits
from lg_husky_sim.diagnosis.before_after.middle import middle
from lg_husky_sim.diagnosis.before_after.prediction import (
    CHANNELS,
    jacobian,
    measured,
    residual,
)
from lg_husky_sim.diagnosis.before_after.robot_kinds import kinds_of, of_likeliest_kind, Places
from lg_husky_sim.diagnosis.before_after.starts import starts_from
from lg_husky_sim.diagnosis.before_after.whitening import first_noise, Noise, noise_of
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Told how far it is (0 to 1).
Share = Callable[[float], None]


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
    drives : tuple of Drive

    """

    base: Base
    prior: Prior
    noise: Noise
    common: FloatArray
    places: Places
    quadratics: tuple[Quadratic, ...]
    drives: tuple[Drive, ...]

    def again(self, expected: Mapping[str, Prior], pool: Executor) -> RecordingFits:
        """
        Return this with some recordings fitted once more.

        Parameters
        ----------
        expected : mapping of str to Prior
            By recording, what is expected of it; its fit begins where it was, and there.
        pool : Executor
            Threads, one recording each.

        Returns
        -------
        RecordingFits

        """
        base, numbers = self.base, self.base.settings.fit
        groups = by_recording(self.drives)
        held = np.array([q.name in base.settings.runs_as for q in base.settings.quantities])

        def end(name: str) -> FloatArray:
            about = expected[name]
            return min((fit_set(
                base, groups[name], about, self.noise, start, int(numbers['steps']),
                numbers['enough'], map) for start in (
                    np.where(held, about.mean, self.places[name]), about.mean)),
                key=lambda fit: fit.cost).z
        ends = pool.map(end, expected)
        places = {**self.places, **dict(zip(expected, ends, strict=True))}
        found = {one.recording: with_limits(base, groups[one.recording], self.noise, self.prior,
                                            places, one)
                 for one in _quadratics(base, {name: groups[name] for name in expected},
                                        self.noise, self.prior, places, pool)}
        return replace(self, places=places, quadratics=tuple(
            found.get(one.recording, one) for one in self.quadratics))


def fit_recordings(base: Base, drives: Sequence[Drive], lags: Places, begin: FloatArray,
                   pool: Executor, share: Share) -> RecordingFits:
    """
    Fit the base to each recording.

    The longest is fitted first, from every kind of robot; the others begin there, or where any
    start is likelier, and all together tell the kind. Then all are fitted twice more, with a prior
    about their mean that is as wide as a change, and once with one as wide as the recordings show
    themselves to differ, whichever set they are of. Each may begin where any other ended, or at a
    start from there. Where a fit begins, and what its delays are expected to be, differs by as
    much as its streams say.

    Parameters
    ----------
    base : Base
        Robot to fit.
    drives : sequence of Drive
        Of all recordings, whichever set they are of.
    lags : mapping of str to numpy.ndarray, shape (n,)
        By how much the streams of each recording are late, on the scale of the estimates.
    begin : numpy.ndarray, shape (n,)
        Where the fits begin.
    pool : Executor
        Threads, one recording each.
    share : callable
        Told how far it is (0 to 1).

    Returns
    -------
    RecordingFits

    """
    numbers, quantities = base.settings.fit, base.settings.quantities
    free = np.array([not base.given or q.name in base.settings.body for q in quantities])
    # What the nominal robot has not stays out of the fits, which it would lead astray: whether it
    # has come to be there is told from the derivatives.
    held = np.array([q.name in base.settings.runs_as for q in quantities])
    every, prior = Prior(base.start, base.sd, free), Prior(base.start, base.sd, free & ~held)
    wide = np.array([np.hypot(q.recording, q.change) for q in quantities])
    # A delay of every stream is one of the commands: that of one stream is none in all recordings.
    wide[base.reference] = base.sd[base.reference]
    groups = by_recording(drives)
    places, noise, prior = _alone(base, prior, wide, groups, lags, begin, pool, share)
    every = replace(every, mean=prior.mean)
    about = _deviations(base, prior, wide, {
        name: place - lags[name] for name, place in places.items()}, [
        q.less(lags[q.recording])
        for q in _quadratics(base, groups, noise, prior, places, pool)])

    def drawn(name: str) -> FloatArray:
        here = replace(about, mean=about.mean + lags[name])
        own = raced(base, groups[name], here, noise, [[places[name]], [here.mean]],
                    numbers['enough'], map)
        ends = [[place - lags[other] + lags[name]] for other, place in places.items()
                if other != name]
        other = raced(base, groups[name], here, noise, ends, numbers['enough'],
                      map) if ends else own
        # Of optima that are as likely, its own.
        return other.z if own.cost - other.cost > numbers['enough'] else own.z
    ended = dict(zip(groups, pool.map(drawn, groups), strict=True))
    found = _quadratics(base, groups, noise, every, ended, pool)
    share(1.0)
    return RecordingFits(base, every, noise, about.mean, ended, tuple(
        with_limits(base, groups[one.recording], noise, every, ended, one) for one in found),
        tuple(drives))


def _alone(base: Base, prior: Prior, wide: FloatArray, groups: Mapping[str, Sequence[Drive]],
           lags: Places, begin: FloatArray, pool: Executor, share: Share
           ) -> tuple[Places, Noise, Prior]:
    # Each recording by itself, its parameters as far from the mean of all as a change is wide; and
    # the prior of the kind of robot that they are of.
    numbers = base.settings.fit
    steps, enough, roughly = int(numbers['steps']), numbers['enough'], numbers['roughly']
    noise = first_noise(base.settings).among(_moving(
        base, [drive for drives in groups.values() for drive in drives]))
    names = list(groups)
    longest = max(names, key=lambda name: sum(d.steps for d in groups[name]))
    kinds = kinds_of(base, prior, begin)
    firsts = list(pool.map(lambda kind: fit_set(
        base, groups[longest], replace(kind[1], mean=kind[1].mean + lags[longest]), noise,
        kind[0] + lags[longest], steps, roughly, map), kinds))
    best = min(range(len(kinds)), key=lambda k: firsts[k].cost)
    first, prior = firsts[best].z, kinds[best][1]
    share(0.2)

    def fitted(name: str, about: Prior, kinds: Sequence[Sequence[FloatArray]], until: float,
               most: str = 'raced') -> SetFit:
        return raced(base, groups[name], replace(about, mean=about.mean + lags[name]), noise,
                     kinds, until, map, most)
    options = [*([start] for start, _ in kinds),
               *starts_from(base, prior.free, first - lags[longest])]
    places: Places = dict(zip(names, pool.map(lambda name: first if name == longest else fitted(
        name, prior, [[one + lags[name] for one in kind] for kind in options], roughly).z,
        names), strict=True))
    share(0.4)
    noise = _renewed(base, groups, places, replace(prior, sd=wide), noise, pool)
    places, prior = of_likeliest_kind(base, groups, noise, places, lags, prior,
                                      [kind for _, kind in kinds], pool)
    for turn, until in enumerate((roughly, enough)):
        mean = middle(base, prior, wide, {
            name: place - lags[name] for name, place in places.items()},
            _quadratics(base, groups, noise, prior, places, pool))
        about = Prior(mean, wide, prior.free)
        ends = {'': mean, **{name: place - lags[name] for name, place in places.items()}}

        def again(name: str, about: Prior = about, ends: Places = ends, places: Places = places,
                  until: float = until, turn: int = turn) -> FloatArray:
            # Of starts of a kind that begin at different ends, the likeliest.
            begins = [end + lags[name] for other, end in ends.items() if other != name or not turn]
            others = [[one] for one in begins] if turn else [
                [one for kind in alike for one in kind] for alike in zip(
                    *(starts_from(base, prior.free, one) for one in begins), strict=True)]
            fits = [fitted(name, about, [[places[name]]], until),
                    fitted(name, about, others, until, 'raced' if turn else 'raced_first')]
            return min(fits, key=lambda fit: fit.cost).z
        places = dict(zip(names, pool.map(again, names), strict=True))
        share(0.6 + 0.15 * turn)
        if not turn:
            noise = _renewed(base, groups, places, about, noise, pool)
    return places, noise, prior


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
    e, j = noise.white(rows, drive.vigour), noise.white(columns, drive.vigour)
    curvature, slope = j.T @ j, j.T @ e
    return Quadratic(drive.recording, False, z, curvature, curvature @ z - slope,
                     0.5 * float(e @ e) - float(z @ slope) + 0.5 * float(z @ curvature @ z))


def by_recording(drives: Sequence[Drive]) -> dict[str, list[Drive]]:
    """Return the drives of each recording."""
    groups: dict[str, list[Drive]] = {}
    for drive in drives:
        groups.setdefault(drive.recording, []).append(drive)
    return groups


def _moving(base: Base, drives: Sequence[Drive]) -> set[str]:
    # Channels that read more than one value: an IMU without an accelerometer reads zeros.
    return {name for drive in drives for stream, rows in measured(base, drive).items()
            for name, column in zip(CHANNELS[stream], rows.T, strict=True)
            if column.size and np.ptp(column) > 0.0}


def _renewed(base: Base, groups: Mapping[str, Sequence[Drive]], places: Places, prior: Prior,
             of: Noise, pool: Executor) -> Noise:
    # That of the residuals where each recording was fitted, in the channels of another one.
    drives = [d for ds in groups.values() for d in ds]
    noise = noise_of([residual(base, d, places[d.recording]) for d in drives],
                     [d.vigour for d in drives], base.settings, base.given).among(of.sd)
    return dispersed(base, groups, places, noise, prior, pool)


def _quadratics(base: Base, groups: Mapping[str, Sequence[Drive]], noise: Noise, prior: Prior,
                places: Places, pool: Executor) -> list[Quadratic]:
    return joined(list(pool.map(
        lambda drive: quadratic(base, drive, noise, places[drive.recording], prior),
        [d for ds in groups.values() for d in ds])))


def _deviations(base: Base, prior: Prior, wide: FloatArray, places: Places,
                quadratics: Sequence[Quadratic]) -> Prior:
    # What is expected of each recording by the others: about what they share, as wide as they show
    # themselves to differ. Derivatives of recordings that lie apart for no reason do not fit each
    # other. A limit may be anywhere that a change brings it to.
    index, numbers = np.flatnonzero(prior.free), base.settings.fit
    quantities = base.settings.quantities
    sd = np.array([q.recording for q in quantities])
    sd[base.reference] = wide[base.reference]
    found = Evidence([one.among(index) for one in quadratics], prior.mean[index], prior.sd[index],
                     sd[index], wide[index]).estimated(
        numbers['recordings_body' if base.given else 'recordings_loop'],
        int(numbers['recording_rounds']), numbers['recording_free'])
    sd[index] = np.hypot(found.recording_sd, numbers['drawn_least'] * prior.sd[index])
    for k, quantity in enumerate(quantities):
        if quantity.name in base.settings.limits or k == base.reference:
            sd[k] = wide[k]
    return Prior(middle(base, prior, sd, places, quadratics), sd, prior.free)
