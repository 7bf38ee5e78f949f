# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Two sets of recordings compared: every change by linear algebra on the recordings' fits."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
import math

from lg_husky_sim.diagnosis.before_after.evidence import Evidence
from lg_husky_sim.diagnosis.before_after.judge import chance_of, exchange_chance
from lg_husky_sim.diagnosis.before_after.prediction import Base
from lg_husky_sim.diagnosis.before_after.recording_fits import RecordingFits
from lg_husky_sim.diagnosis.before_after.settings import Change
from lg_husky_sim.diagnosis.before_after.whitening import Noise
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Ways to part recordings above which they are drawn and not listed.
_ENUMERATED = 2000


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
        Log evidence over that of no change [nats].
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
        Means of the sets, on the scale of the estimates.
    noise : Noise
    candidates : tuple of Candidate
        By gain, the largest first; with the wheels as measured, those of the body only.
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
    anything: float
    chance: float


def compare(fits: RecordingFits, later: Collection[str]) -> Block:
    """
    Weigh every change, and how probable its gain is where nothing has changed.

    The fits do not know which recordings are of which set. Where nothing has changed, the sets as
    they are may therefore gain no more than the same recordings parted in any other way into two
    sets of these sizes, which is what their gains are held against. Where there is no other way,
    the shifts are judged by what the recordings of a set differ by.

    Parameters
    ----------
    fits : RecordingFits
    later : collection of str
        Names of the recordings after the change.

    Returns
    -------
    Block
    """
    block = _weighed(fits, later)
    numbers = fits.base.settings.decision
    others = [_weighed(fits, names) for names in partitions(
        [one.recording for one in fits.quadratics], later, int(numbers['partitions']))]
    if not others:
        return block

    def chance(gain: float, gains: Iterable[float]) -> float:
        return exchange_chance(gain, list(gains), numbers['least_gain'])
    return replace(
        block, candidates=tuple(replace(one, chance=chance(
            one.gain, (o.candidates[0].gain for o in others))) for one in block.candidates),
        chance=chance(block.anything, (o.anything for o in others)))


def partitions(names: Sequence[str], later: Collection[str], most: int) -> list[frozenset[str]]:
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

    Returns
    -------
    list of frozenset of str
        One of the two sets of each way.
    """
    names, given, size = sorted(names), frozenset(later), len(later)
    halves = 2 * size == len(names)
    if math.comb(len(names), size) > 2 * _ENUMERATED:
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


def _weighed(fits: RecordingFits, later: Collection[str]) -> Block:
    base, prior = fits.base, fits.prior
    settings, numbers = base.settings, base.settings.fit
    quantities = settings.quantities
    index = np.flatnonzero(prior.free)
    place = {quantities[k].name: i for i, k in enumerate(index)}
    shown = 'body' if base.given else 'loop'
    weight = numbers[f'recordings_{shown}']
    evidence = Evidence(
        [replace(q.among(index), after=q.recording in later) for q in fits.quadratics],
        prior.mean[index], prior.sd[index], np.array([quantities[k].recording for k in index]),
        np.array([quantities[k].change for k in index])).estimated(
            weight, int(numbers['recording_rounds']), numbers['recording_free'])
    freedom = max(weight + len(evidence.quadratics) - 2.0, 1.0)
    nothing = evidence.solve(np.zeros(0, dtype=np.intp)).evidence
    changes = [c for c in settings.changes if c.block == 'body' or not base.given]
    found = []
    for change in changes:
        names = change.parameters if base.given else (*change.parameters, *change.more)
        changed = np.array([place[name] for name in names], dtype=np.intp)
        solved = evidence.solve(changed)
        found.append(Candidate(
            change, names, solved.evidence - nothing, solved.shared[changed], solved.shift,
            np.sqrt(np.diag(solved.covariance)),
            min(1.0, len(changes) * chance_of(solved, freedom))))
    found.sort(key=lambda one: -one.gain)
    # Delays of all streams are none: that of the reference is left out where all may differ.
    free = np.array([i for i, k in enumerate(index) if k != base.reference], dtype=np.intp)
    every = evidence.solve(free)
    before = np.array(prior.mean)
    before[index] = every.shared
    after = np.array(before)
    after[index[free]] += every.shift
    bounds = base.bounds()
    return Block(base, np.clip(before, *bounds), np.clip(after, *bounds), fits.noise,
                 tuple(found), every.evidence - nothing, chance_of(every, freedom))
