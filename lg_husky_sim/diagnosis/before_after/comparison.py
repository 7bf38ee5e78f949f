# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Two sets of drives compared: a free fit of each, then every change by linear algebra."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from lg_husky_sim.diagnosis.before_after.drives import Drive
from lg_husky_sim.diagnosis.before_after.evidence import Evidence, Quadratic
from lg_husky_sim.diagnosis.before_after.fitting import cost_at, fit_set, Prior
from lg_husky_sim.diagnosis.before_after.prediction import Base, jacobian, residual
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
    """

    change: Change
    parameters: tuple[str, ...]
    gain: float
    before: FloatArray
    shift: FloatArray
    sd: FloatArray


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
    """

    base: Base
    before: FloatArray
    after: FloatArray
    noise: Noise
    candidates: tuple[Candidate, ...]
    others: tuple[Candidate, ...]
    anything: float


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
    earlier = fit_set(base, before, prior, noise, begin, steps, numbers['roughly'], pool).z
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
    return Block(base, earlier, later, noise, *_candidates(base, prior, quadratics))


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
        rows, columns = jacobian(base, drive, z, prior.free)
        e, j = noise.white(rows), noise.white(columns)
        curvature = j.T @ j
        slope = curvature @ z - j.T @ e
        cost = 0.5 * float(e @ e)
        for k in limits:
            apart = float(other[k] - z[k])
            if abs(apart) < prior.sd[k] * 1e-3:
                continue
            # A limit that is not reached has no derivative: put the other set's in.
            near = np.array(z)
            near[k] = other[k]
            white = noise.white(residual(base, drive, near))
            secant = 2.0 * (0.5 * float(white @ white) - cost) / apart ** 2
            more = max(secant - curvature[k, k], 0.0)
            curvature[k, k] += more
            slope[k] += more * z[k]
        return Quadratic(drive.recording, after, curvature, slope)
    return _joined(list(pool.map(one, drives)))


def _joined(parts: Sequence[Quadratic]) -> list[Quadratic]:
    # The stretches of a recording share its deviation.
    found: dict[str, Quadratic] = {}
    for part in parts:
        there = found.get(part.recording)
        found[part.recording] = part if there is None else Quadratic(
            part.recording, part.after, there.curvature + part.curvature,
            there.slope + part.slope)
    return list(found.values())


def _candidates(base: Base, prior: Prior, quadratics: Sequence[Quadratic]
                ) -> tuple[tuple[Candidate, ...], tuple[Candidate, ...], float]:
    quantities = base.settings.quantities
    index = np.flatnonzero(prior.free)
    place = {quantities[k].name: i for i, k in enumerate(index)}
    reduced = [Quadratic(q.recording, q.after, q.curvature[np.ix_(index, index)],
                         q.slope[index] - q.curvature[index][:, ~prior.free]
                         @ prior.mean[~prior.free]) for q in quadratics]
    evidence = Evidence(reduced, prior.mean[index], prior.sd[index],
                        np.array([quantities[k].recording for k in index]),
                        np.array([quantities[k].change for k in index]))
    nothing = evidence.solve(np.zeros(0, dtype=np.intp)).evidence
    own: list[Candidate] = []
    others: list[Candidate] = []
    for change in base.settings.changes:
        if base.given and change.block != 'body':
            continue
        names = change.parameters if base.given else (*change.parameters, *change.more)
        changed = np.array([place[name] for name in names], dtype=np.intp)
        solved = evidence.solve(changed)
        one = Candidate(change, names, solved.evidence - nothing, solved.shared[changed],
                        solved.shift, np.sqrt(np.diag(solved.covariance)))
        (own if base.given or change.block == 'loop' else others).append(one)

    def ordered(found: Sequence[Candidate]) -> tuple[Candidate, ...]:
        return tuple(sorted(found, key=lambda one: -one.gain))
    anything = evidence.solve(np.arange(index.size)).evidence - nothing
    return ordered(own), ordered(others), anything
