# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Two sets of drives compared: a free fit of each, then every change by linear algebra."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from lg_husky_sim.diagnosis.before_after.drives import Drive
from lg_husky_sim.diagnosis.before_after.evidence import Evidence, Quadratic
from lg_husky_sim.diagnosis.before_after.expansion import Expansion, joined, quadratic
from lg_husky_sim.diagnosis.before_after.fitting import cost_at, fit_set, Prior
from lg_husky_sim.diagnosis.before_after.judge import Judge
from lg_husky_sim.diagnosis.before_after.prediction import Base, residual
from lg_husky_sim.diagnosis.before_after.settings import Change
from lg_husky_sim.diagnosis.before_after.whitening import first_noise, Noise, noise_of
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Told how far it is (0 to 1).
Share = Callable[[float], None]


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
        Of such a shift, of this or any other change of the block, on a robot that has not
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
    The free fits of one block of the robot, and what they say of every change.

    Parameters
    ----------
    base : Base
    before, after : numpy.ndarray, shape (n,)
        The free fits, on the scale of the estimates.
    noise : Noise
    candidates : tuple of Candidate
        Those that this block shows, by gain, the largest first.
    others : tuple of Candidate
        In the loop: the changes of the body, with all that differs.
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
    others: tuple[Candidate, ...]
    anything: float
    chance: float


def compare(base: Base, before: Sequence[Drive], after: Sequence[Drive], begin: FloatArray,
            pool: ThreadPoolExecutor, share: Share) -> Block:
    """
    Fit the base to both sets and weigh every change.

    Parameters
    ----------
    base : Base
    before, after : sequence of Drive
    begin : numpy.ndarray, shape (n,)
        Where the fits begin.
    pool : ThreadPoolExecutor
    share : callable
        Told how far it is (0 to 1).

    Returns
    -------
    Block
    """
    numbers = base.settings.fit
    quantities = base.settings.quantities
    free = np.array([not base.given or q.name in base.settings.body for q in quantities])
    prior = Prior(base.start, base.sd, free)
    steps, roughly, enough = int(numbers['steps']), numbers['roughly'], numbers['enough']
    noise = first_noise(base.settings)
    earlier = _begun(base, before, prior, noise, begin, pool)
    share(0.25)
    later = _started(base, after, prior, noise, earlier, pool)
    later = fit_set(base, after, prior, noise, later, steps, roughly, pool).z
    share(0.4)

    def renewed() -> Noise:
        return noise_of([residual(base, d, z) for ds, z in ((before, earlier), (after, later))
                         for d in ds], int(numbers['filter']))
    noise = renewed()
    sets = [fit_set(base, before, prior, noise, earlier, steps, enough, pool)]
    share(0.55)
    sets.append(fit_set(base, after, prior, noise, later, steps, enough, pool))
    share(0.7)
    # Each set's likelihood has more than one summit, that of all recordings fewer: what fits all
    # is where the sets' fits begin again.
    every = (*before, *after)
    common = min((fit_set(base, every, prior, noise, fit.z, steps, roughly, pool)
                  for fit in sets), key=lambda fit: fit.cost).z
    share(0.85)
    earlier, later = (min(fit, fit_set(base, drives, prior, noise, common, steps, enough, pool),
                          key=lambda one: one.cost).z
                      for fit, drives in zip(sets, (before, after), strict=True))
    noise = renewed()
    apart, together = ([*_quadratics(base, before, noise, old, new, prior, pool, False),
                        *_quadratics(base, after, noise, new, old, prior, pool, True)]
                       for old, new in ((earlier, later), (common, common)))
    share(0.9)
    found = _candidates(base, prior, apart, together, Expansion(
        base, prior, noise, every, (earlier, later, common), pool))
    share(1.0)
    return Block(base, earlier, later, noise, *found)


def _begun(base: Base, drives: Sequence[Drive], prior: Prior, noise: Noise, begin: FloatArray,
           pool: ThreadPoolExecutor) -> FloatArray:
    # The likeliest of several kinds of robot, each fitted roughly.
    numbers = base.settings.fit
    fits = [fit_set(base, drives, prior, noise, start, int(numbers['steps']), numbers['roughly'],
                    pool) for start in _kinds(base, prior, begin)]
    return min(fits, key=lambda fit: fit.cost).z


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


def _started(base: Base, drives: Sequence[Drive], prior: Prior, noise: Noise, begin: FloatArray,
             pool: ThreadPoolExecutor) -> FloatArray:
    names = base.names
    options = [begin]
    for entry in base.settings.starts:
        if not all(prior.free[names.index(name)] for name in entry):
            continue
        option = np.array(begin)
        for name, value in entry.items():
            option[names.index(name)] += value
        options.append(option)
    costs = [cost_at(base, drives, prior, noise, option, pool) for option in options]
    return options[int(np.argmin(costs))]


def _quadratics(base: Base, drives: Sequence[Drive], noise: Noise, z: FloatArray,
                other: FloatArray, prior: Prior, pool: ThreadPoolExecutor, after: bool
                ) -> list[Quadratic]:
    limits = [k for k, q in enumerate(base.settings.quantities)
              if prior.free[k] and q.name in base.settings.limits]

    def one(drive: Drive) -> Quadratic:
        near = quadratic(base, drive, noise, z, prior, after)
        curvature, slope = np.array(near.curvature), np.array(near.slope)
        cost = near.value(z)
        constant = near.cost
        for k in limits:
            apart = float(other[k] - z[k])
            if abs(apart) < prior.sd[k] * 1e-3:
                continue
            # A limit that is not reached has no derivative: put the other set's in.
            there = np.array(z)
            there[k] = other[k]
            white = noise.white(residual(base, drive, there))
            secant = 2.0 * (0.5 * float(white @ white) - cost) / apart ** 2
            more = max(secant - curvature[k, k], 0.0)
            curvature[k, k] += more
            slope[k] += more * z[k]
            constant += 0.5 * more * z[k] ** 2
        return Quadratic(drive.recording, after, curvature, slope, constant)
    return joined(list(pool.map(one, drives)))


def _candidates(base: Base, prior: Prior, apart: Sequence[Quadratic],
                together: Sequence[Quadratic], expansion: Expansion
                ) -> tuple[tuple[Candidate, ...], tuple[Candidate, ...], float, float]:
    quantities = base.settings.quantities
    index = np.flatnonzero(prior.free)
    place = {quantities[k].name: i for i, k in enumerate(index)}
    numbers = base.settings.fit
    shown = 'body' if base.given else 'loop'
    weight = numbers[f'recordings_{shown}']
    fits, common = (
        Evidence([q.among(index) for q in parts], prior.mean[index], prior.sd[index],
                 np.array([quantities[k].recording for k in index]),
                 np.array([quantities[k].change for k in index])).estimated(
                     weight, int(numbers['recording_rounds']), numbers['recording_free'])
        for parts in (apart, together))
    judge = Judge(fits, common, expansion, max(weight + len(fits.quadratics) - 2.0, 1.0),
                  base.settings.decision)
    count = sum(c.block == shown for c in base.settings.changes)
    changes = [(c, c.parameters if base.given else (*c.parameters, *c.more))
               for c in base.settings.changes if c.block == 'body' or not base.given]
    claims = [judge.claim(np.array([place[name] for name in names], dtype=np.intp), count)
              for _, names in changes]
    # Delays of all streams are none: that of the reference is left out where all may differ.
    whole = judge.checked([judge.claim(np.array(
        [i for i, k in enumerate(index) if k != base.reference], dtype=np.intp), 1)])[0]
    own = iter(judge.checked([claim for claim, (c, _) in zip(claims, changes, strict=True)
                              if c.block == shown]))
    found = []
    for (change, names), claim in zip(changes, claims, strict=True):
        sure = next(own) if change.block == shown else judge.about_nothing(claim)
        solved = sure.solution
        found.append(Candidate(change, names, sure.gain, solved.shared[claim.changed],
                               solved.shift, np.sqrt(np.diag(solved.covariance)), sure.chance))
    found.sort(key=lambda one: -one.gain)
    return (tuple(one for one in found if one.change.block == shown),
            tuple(one for one in found if one.change.block != shown),
            whole.gain, whole.chance)
