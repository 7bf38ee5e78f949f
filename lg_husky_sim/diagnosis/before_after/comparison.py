# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Two sets of recordings compared: every change by linear algebra on the recordings' fits."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from itertools import combinations
import math

from lg_husky_sim.diagnosis.before_after.base import Base
from lg_husky_sim.diagnosis.before_after.evidence import Evidence, Quadratic
from lg_husky_sim.diagnosis.before_after.fitting import Prior
from lg_husky_sim.diagnosis.before_after.judge import chance_of_one, exchange_chance
from lg_husky_sim.diagnosis.before_after.recording_fits import RecordingFits
from lg_husky_sim.diagnosis.before_after.settings import Change
from lg_husky_sim.diagnosis.before_after.whitening import Noise
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Candidate:
    """
    A change with its evidence.

    Parameters
    ----------
    change : Change
    parameters : tuple of str
        Those that differ.
    gain : float
        Log evidence over that of no change but those adopted [nats].
    told : float
        The same by all but any one of the recordings, see :meth:`Evidence.told`: what one
        recording says alone may be an accident of that one.
    before, shift : numpy.ndarray, shape (k,)
        Its parameters before, and what differs, on the scale of the estimates.
    sd : numpy.ndarray, shape (k,)
        Standard deviations of the shift.
    chance : float
        Of such a gain, by this or any other change of the block, on a robot that has not
        changed.

    """

    change: Change
    parameters: tuple[str, ...]
    gain: float
    told: float
    before: FloatArray
    shift: FloatArray
    sd: FloatArray
    chance: float


@dataclass(frozen=True, eq=False)
class Block:
    """
    What the recordings' fits of one block of the robot say of every change.

    Parameters
    ----------
    base : Base
    before, after : numpy.ndarray, shape (n,)
        Means of the sets where what is adopted differs, or everything where nothing is, on the
        scale of the estimates.
    noise : Noise
    candidates : tuple of Candidate
        By gain, the largest first; with the wheels as measured, those of the body only.
    explained : float
        Log evidence of what is adopted over that of no change [nats].
    anything : float
        Log evidence of everything being different over that of no change [nats].
    chance : float
        Of a difference as large as that of everything on a robot that has not changed.

    """

    base: Base
    before: FloatArray
    after: FloatArray
    noise: Noise
    candidates: tuple[Candidate, ...]
    explained: float
    anything: float
    chance: float


def compare(fits: RecordingFits, later: Collection[str], adopted: Sequence[Change] = ()
            ) -> Block:
    """
    Weigh every change, and how probable its gain is where no more has changed than is adopted.

    The fits do not know which recordings are of which set. So a gain is held against those of the
    same recordings parted in any other way into two sets of these sizes, once what is claimed to
    have changed is taken out of the later ones (permutation of the residuals, ter Braak 1992), and
    against what unchanged robots gain; and so is what all but any one of the recordings gain
    (jackknife). The larger chance of both counts. A change that the latter do not make likelier
    than none, where even odds are spread over all n changes (gain below log n), is chance.

    Parameters
    ----------
    fits : RecordingFits
        Of all recordings, before and after the change.
    later : collection of str
        Names of the recordings after the change.
    adopted : sequence of Change
        What differs anyway: the parameters of these differ under every hypothesis.

    Returns
    -------
    Block

    """
    comparison = _Comparison(fits, adopted)
    n = comparison.index.size
    numbers = fits.base.settings.decision
    by_any = {**numbers, 'null_gain': numbers['null_gain_by_any']}
    evidence = comparison.evidence(comparison.quadratics, later)
    candidates = comparison.candidates(evidence)
    nothing = np.zeros(0, dtype=np.intp)
    every = evidence.solve(comparison.everything)
    anything = every.evidence - evidence.nothing
    all_of_it = np.zeros(n)
    all_of_it[comparison.everything] = every.shift
    best_of_all, told, wholes, wholes_told = [], [], [], []
    own: dict[Change, list[Candidate]] = {one.change: [] for one in candidates}
    best = comparison.shift(evidence, candidates[0].parameters) if candidates else np.zeros(n)
    for way in partitions([q.recording for q in fits.quadratics], later,
                          int(numbers['partitions']), int(numbers['partitions_listed'])):
        weighed = comparison.candidates(comparison.evidence(comparison.without(best, later), way))
        best_of_all.append(weighed[0].gain if weighed else 0.0)
        told.append(max((one.told for one in weighed), default=0.0))
        for one in weighed:
            own[one.change].append(one)
        other = comparison.evidence(comparison.without(all_of_it, later), way)
        wholes.append(other.solve(comparison.everything).evidence - other.nothing)
        wholes_told.append(other.told(comparison.everything, nothing))
    shared, moved = every.shared, all_of_it
    if adopted:
        shared, moved = evidence.solve(comparison.changed).shared, comparison.shift(evidence, ())
    before = np.array(fits.prior.mean)
    before[comparison.index] = shared
    after = np.array(before)
    after[comparison.index] += moved
    bounds = fits.base.bounds()
    return Block(
        fits.base, np.clip(before, *bounds), np.clip(after, *bounds), fits.noise,
        tuple(replace(one, chance=1.0 if one.told < math.log(len(candidates)) else max(
            comparison.chance(one.parameters, one.gain, [o.gain for o in own[one.change]],
                              best_of_all, len(candidates), numbers),
            comparison.chance(one.parameters, one.told, [o.told for o in own[one.change]],
                              told, len(candidates), by_any))) for one in candidates),
        comparison.explained(evidence), anything, max(
            exchange_chance(anything, wholes, numbers),
            exchange_chance(evidence.told(comparison.everything, nothing), wholes_told, by_any)))


def refitted(fits: RecordingFits, later: Collection[str], adopted: Sequence[Change],
             pool: Executor) -> RecordingFits:
    """
    Return the later recordings fitted once more, with what a nominal robot has not.

    Of a parameter that the fits hold, a derivative where it is nominal tells whether it has
    changed, but not by how much where that is a lot, nor what else has.

    Parameters
    ----------
    fits : RecordingFits
        Of all recordings, before and after the change.
    later : collection of str
        Names of the recordings after the change.
    adopted : sequence of Change
        What differs; its parameters are wide open, the others as wide as recordings differ.
        A limit may be anywhere that a change brings it to.
    pool : Executor
        Threads to fit with.

    Returns
    -------
    RecordingFits
        The same where all that differs is fitted already.

    """
    quantities = fits.base.settings.quantities
    brought = {name for change in adopted for name in change.parameters
               if name in fits.base.settings.runs_as}
    comparison = _Comparison(fits, adopted)
    if not brought & {quantities[k].name for k in comparison.index}:
        return fits
    evidence, index = comparison.evidence(comparison.quadratics, later), comparison.index
    mean, sd = np.array(fits.prior.mean), np.array(fits.prior.sd)
    mean[index] = evidence.solve(comparison.changed).shared + comparison.shift(evidence, ())
    sd[index] = np.hypot(evidence.recording_sd,
                         fits.base.settings.fit['drawn_least'] * fits.prior.sd[index])
    changed = index[comparison.changed]
    sd[changed] = [quantities[k].change for k in changed]
    held = np.array([q.name in fits.base.settings.runs_as and q.name not in brought
                     for q in quantities])
    for k, quantity in enumerate(quantities):
        if quantity.name in fits.base.settings.limits:
            mean[k] = max(place[k] for place in fits.places.values())
            sd[k] = quantity.change
    mean = np.clip(np.where(held, fits.base.start, mean), *fits.base.bounds())
    about = Prior(mean, sd, fits.prior.free & ~held)
    return fits.again({one.recording: about for one in fits.quadratics if one.recording in later},
                      pool)


def partitions(names: Sequence[str], later: Collection[str], most: int, listed: int
               ) -> list[frozenset[str]]:
    """
    Return the other ways to part recordings into two sets of the same sizes.

    Parameters
    ----------
    names : sequence of str
        Of all recordings; their order does not matter.
    later : collection of str
        One set as it is.
    most : int
        Ways at most; where there are more, they are drawn.
    listed : int
        Choices of a set up to which all are listed before that.

    Returns
    -------
    list of frozenset of str
        One of the two sets of each way.

    """
    names, given, size = sorted(names), frozenset(later), len(later)
    halves = 2 * size == len(names)
    if math.comb(len(names), size) > listed:
        rng = np.random.default_rng(len(names))
        drawn = (rng.permutation(len(names))[:size] for _ in range(20 * most))
    else:
        drawn = (np.array(way) for way in combinations(range(len(names)), size))
    found: dict[frozenset[str], None] = {}
    for way in drawn:
        one = frozenset(names[k] for k in way)
        if halves and names[0] not in one:
            one = frozenset(names) - one  # the other set of the same two
        if one != given and not (halves and frozenset(names) - one == given):
            found[one] = None
    ways = list(found)
    if len(ways) > most:
        ways = [ways[k] for k in np.random.default_rng(most).permutation(len(ways))[:most]]
    return ways


class _Comparison:
    """The recordings' quadratics in the parameters that are free, and the changes of them."""

    def __init__(self, fits: RecordingFits, adopted: Sequence[Change]) -> None:
        self.fits = fits
        self.index = np.flatnonzero(fits.prior.free)
        self.quadratics = [one.among(self.index) for one in fits.quadratics]
        quantities = fits.base.settings.quantities
        self._place = {quantities[k].name: i for i, k in enumerate(self.index)}
        # Delays of all streams are none: that of the reference is left out where all may differ.
        self.everything = np.array([i for i, k in enumerate(self.index)
                                    if k != fits.base.reference], dtype=np.intp)
        self._adopted = tuple(dict.fromkeys(
            name for change in adopted for name in self._names(change)))

    def _names(self, change: Change) -> tuple[str, ...]:
        # Of the parameters that differ by a change and are free here.
        more = () if self.fits.base.given else change.more
        return tuple(name for name in (*change.parameters, *more, *change.aside)
                     if name in self._place)

    def places(self, names: Sequence[str]) -> NDArray[np.intp]:
        """Return where parameters of these names are."""
        return np.array([self._place[name] for name in names], dtype=np.intp)

    @property
    def changed(self) -> NDArray[np.intp]:
        """Where the parameters are that are adopted to differ."""
        return self.places(self._adopted)

    def explained(self, evidence: Evidence) -> float:
        """Return what the changes that are adopted gain together [nats]."""
        return evidence.solve(self.changed).evidence - evidence.nothing

    def shift(self, evidence: Evidence, names: Sequence[str]) -> FloatArray:
        """Return by how much all parameters differ where these and those adopted may."""
        changed = self.places((*self._adopted, *names))
        found = np.zeros(self.index.size)
        found[changed] = evidence.solve(changed).shift
        return found

    def without(self, shift: FloatArray, later: Collection[str]) -> list[Quadratic]:
        """Return the recordings with a shift taken out of the later ones."""
        return [one.less(shift) if one.recording in later else one for one in self.quadratics]

    def evidence(self, quadratics: Sequence[Quadratic], later: Collection[str]) -> Evidence:
        """Return the evidence with the deviations that recordings of these sets have."""
        base, index, prior = self.fits.base, self.index, self.fits.prior
        quantities, numbers = base.settings.quantities, base.settings.fit
        lower, upper = base.bounds()
        return Evidence(
            [replace(one, after=one.recording in later) for one in quadratics],
            prior.mean[index], prior.sd[index],
            np.array([quantities[k].recording for k in index]),
            np.array([quantities[k].change for k in index]),
            (lower[index], upper[index])).estimated(
                numbers['recordings_body' if base.given else 'recordings_loop'],
                int(numbers['recording_rounds']), numbers['recording_free'])

    def chance(self, names: Sequence[str], gain: float, own: Sequence[float],
               best: Sequence[float], count: int, numbers: Mapping[str, float]) -> float:
        """
        Return how probable a gain is on a robot that has not changed.

        What the recordings are not fitted with shows no deviation of its own from one to another.
        """
        if set(names) & set(self.fits.base.settings.runs_as):
            return exchange_chance(gain, best, numbers)
        return chance_of_one(gain, own, best, count, len(self.quadratics), numbers)

    def candidates(self, evidence: Evidence) -> list[Candidate]:
        """
        Return every change with its gain, the largest first; their chance is not known yet.

        Of a change that shares parameters with what is adopted, only the others are weighed.
        """
        base, found, count = self.fits.base, [], len(self._adopted)
        known = evidence.solve(self.changed).evidence
        for change in base.settings.changes:
            names = tuple(name for name in self._names(change) if name not in self._adopted)
            if (base.given and change.block != 'body') or not names:
                continue
            changed = self.places((*self._adopted, *names))
            solved = evidence.solve(changed)
            gain = solved.evidence - known
            found.append(Candidate(
                change, names, gain, gain if gain <= 0.0 else evidence.told(changed, self.changed),
                solved.shared[changed[count:]], solved.shift[count:],
                np.sqrt(np.diag(solved.covariance)[count:]), 1.0))
        return sorted(found, key=lambda one: -one.gain)
