# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Two sets of drives compared: a free fit of each, then every change by linear algebra."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from lg_husky_sim.diagnosis.before_after.drives import Drive
from lg_husky_sim.diagnosis.before_after.evidence import Evidence, Quadratic, Solution
from lg_husky_sim.diagnosis.before_after.expansion import Expansion, joined, quadratic
from lg_husky_sim.diagnosis.before_after.fitting import cost_at, fit_set, Prior
from lg_husky_sim.diagnosis.before_after.prediction import Base, residual
from lg_husky_sim.diagnosis.before_after.settings import Change
from lg_husky_sim.diagnosis.before_after.whitening import first_noise, Noise, noise_of
from lg_husky_sim.signals import FloatArray
import numpy as np
from scipy.stats import f as fisher

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
    steps, enough = int(numbers['steps']), numbers['enough']
    noise = first_noise(base.settings)
    earlier = _begun(base, before, prior, noise, begin, pool)
    share(0.35)
    later = _started(base, after, prior, noise, earlier, pool)
    later = fit_set(base, after, prior, noise, later, steps, numbers['roughly'], pool).z
    share(0.6)
    for last in (False, True):
        noise = noise_of([residual(base, d, z) for ds, z in ((before, earlier), (after, later))
                          for d in ds], int(numbers['filter']))
        if not last:
            earlier = fit_set(base, before, prior, noise, earlier, steps, enough, pool).z
            share(0.75)
            later = fit_set(base, after, prior, noise, later, steps, enough, pool).z
            share(0.9)
    quadratics = [*_quadratics(base, before, noise, earlier, later, prior, pool, False),
                  *_quadratics(base, after, noise, later, earlier, prior, pool, True)]
    share(1.0)
    return Block(base, earlier, later, noise, *_candidates(
        base, prior, quadratics, Expansion(
            base, prior, noise, (*before, *after), (earlier, later), pool)))


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
    for kind in base.settings.kinds:
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


def _candidates(base: Base, prior: Prior, quadratics: Sequence[Quadratic],
                expansion: Expansion
                ) -> tuple[tuple[Candidate, ...], tuple[Candidate, ...], float, float]:
    quantities = base.settings.quantities
    index = np.flatnonzero(prior.free)
    place = {quantities[k].name: i for i, k in enumerate(index)}
    reduced = [q.among(index) for q in quadratics]
    numbers = base.settings.fit
    shown = 'body' if base.given else 'loop'
    weight = numbers[f'recordings_{shown}']
    evidence = Evidence(reduced, prior.mean[index], prior.sd[index],
                        np.array([quantities[k].recording for k in index]),
                        np.array([quantities[k].change for k in index])).estimated(
                            weight, int(numbers['recording_rounds']))
    freedom = max(weight + len(reduced) - 2.0, 1.0)
    # Delays of all streams are none: that of the reference is left out where all may differ.
    everything = np.array([i for i, k in enumerate(index) if k != base.reference], dtype=np.intp)
    changes = [(c, names, np.array([place[name] for name in names], dtype=np.intp))
               for c in base.settings.changes if c.block == 'body' or not base.given
               for names in [c.parameters if base.given else (*c.parameters, *c.more)]]
    solutions = [evidence.solve(changed) for _, _, changed in changes]
    whole = evidence.solve(everything)
    nothing = evidence.solve(np.zeros(0, dtype=np.intp)).evidence
    rate = base.settings.decision['false_alarm_rate']
    count = sum(c.block == shown for c in base.settings.changes)

    def claimed(solved: Solution, tries: int, less: float) -> bool:
        return (solved.evidence - nothing > less
                and tries * chance_of(solved, freedom, less) < rate)
    less = less_whole = 0.0
    if claimed(whole, 1, 0.0) or any(claimed(solved, count, 0.0) for solved in solutions):
        # Far from the sets' fits the expansions about these are not to be trusted.
        less = less_whole = max(expansion.evidence(
            evidence, np.zeros(0, dtype=np.intp)) - nothing, 0.0)
        if claimed(whole, 1, less):
            less_whole += max(whole.evidence - expansion.evidence(evidence, everything), 0.0)
    found = [Candidate(c, names, solved.evidence - nothing - less, solved.shared[changed],
                       solved.shift, np.sqrt(np.diag(solved.covariance)),
                       min(1.0, count * chance_of(solved, freedom, less)))
             for (c, names, changed), solved in zip(changes, solutions, strict=True)]
    found.sort(key=lambda one: -one.gain)
    return (tuple(one for one in found if one.change.block == shown),
            tuple(one for one in found if one.change.block != shown),
            whole.evidence - nothing - less_whole, chance_of(whole, freedom, less_whole))


def chance_of(solved: Solution, freedom: float, less: float = 0.0) -> float:
    """
    Return how probable so large a shift is where nothing has changed.

    The deviations from recording to recording are themselves estimated, so that the shift d of k
    parameters with covariance C is judged by Fisher's distribution::

        P(F(k, freedom) > (d' C^-1 d - 2 less) / k)

    Parameters
    ----------
    solved : Solution
    freedom : float
        Degrees of freedom of the deviations.
    less : float
        What the expansions say too much [nats].

    Returns
    -------
    float
    """
    size = solved.shift.size
    square = float(solved.shift @ np.linalg.solve(solved.covariance, solved.shift)) - 2.0 * less
    return float(fisher.sf(square / size, size, freedom))
