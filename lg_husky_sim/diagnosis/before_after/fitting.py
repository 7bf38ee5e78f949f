# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Fit the base to a set of drives: Gauss-Newton with priors."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

from lg_husky_sim.diagnosis.before_after.base import Base
from lg_husky_sim.diagnosis.before_after.drives import Drive
from lg_husky_sim.diagnosis.before_after.prediction import jacobian, residual, residuals
from lg_husky_sim.diagnosis.before_after.whitening import Noise
from lg_husky_sim.diagnosis.evidence.bounded_step import step_inside
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray

Task = TypeVar('Task')
Outcome = TypeVar('Outcome')


class Mapper(Protocol):
    """Applies a function to tasks, in order."""

    def __call__(self, function: Callable[[Task], Outcome], tasks: Iterable[Task], /
                 ) -> Iterable[Outcome]:
        """Return what the function makes of each."""


@dataclass(frozen=True, eq=False)
class Prior:
    """
    A Gaussian prior on the scale of the estimates.

    Parameters
    ----------
    mean, sd : numpy.ndarray, shape (n,)
    free : numpy.ndarray of bool, shape (n,)
        Which are estimated; the others stay at the mean.

    """

    mean: FloatArray
    sd: FloatArray
    free: NDArray[np.bool_]

    def cost(self, z: FloatArray) -> float:
        """Return its part of the negative log posterior."""
        deviation = (z - self.mean)[self.free] / self.sd[self.free]
        return 0.5 * float(deviation @ deviation)


@dataclass(frozen=True, eq=False)
class SetFit:
    """
    The base fitted to a set of drives.

    Parameters
    ----------
    z : numpy.ndarray, shape (n,)
        On the scale of the estimates.
    cost : float
        Negative log posterior [nats], up to a constant of the noise; infinity where the
        simulation breaks down at the start.

    """

    z: FloatArray
    cost: float


def whites(base: Base, drives: Sequence[Drive], noise: Noise, z: FloatArray,
           each: Mapper) -> list[FloatArray]:
    """Return the whitened residuals of each drive."""
    return list(each(lambda drive: noise.white(residual(base, drive, z), drive.vigour), drives))


def _cost(errors: Sequence[FloatArray], prior: Prior, z: FloatArray) -> float:
    with np.errstate(over='ignore'):
        total = 0.5 * sum(float(e @ e) for e in errors) + prior.cost(z)
    return total if np.isfinite(total) else float(np.inf)


def costs_at(base: Base, drives: Sequence[Drive], prior: Prior, noise: Noise,
             places: Sequence[FloatArray], each: Mapper) -> list[float]:
    """
    Return the negative log posterior at each of some places [nats].

    It is infinite where the simulation breaks down.
    """
    rows = list(each(lambda drive: [noise.white(one, drive.vigour) for one in residuals(
        base, drive, places)], drives))
    return [_cost([of_drive[k] for of_drive in rows], prior, z) for k, z in enumerate(places)]


def fit_set(base: Base, drives: Sequence[Drive], prior: Prior, noise: Noise, begin: FloatArray,
            steps: int, enough: float, each: Mapper) -> SetFit:
    """
    Fit inside bounds by Gauss-Newton with Levenberg's damping.

    Derivatives serve for further steps as long as these gain about what they promise.

    Parameters
    ----------
    base : Base
        Robot to fit, with the bounds of its parameters.
    drives : sequence of Drive
        All are fitted at once.
    prior : Prior
        Means and standard deviations of the parameters, and which are free.
    noise : Noise
        What residuals and derivatives are whitened with.
    begin : numpy.ndarray, shape (n,)
        Where to begin, on the scale of the estimates; moved inside the bounds.
    steps : int
        With derivatives of their own, at most.
    enough : float
        A step that gains less ends the fit [nats].
    each : callable
        Applies a function to the drives: `map`, or that of a pool.

    Returns
    -------
    SetFit

    """
    lower, upper = base.bounds()
    z = np.clip(begin, lower, upper)
    free = prior.free
    precision = 1.0 / prior.sd[free] ** 2
    damping = 1e-3
    cost = float(np.inf)
    for _ in range(steps):
        def one(drive: Drive, at: FloatArray = z) -> tuple[FloatArray, FloatArray]:
            rows, columns = jacobian(base, drive, at, free)
            return (noise.white(rows, drive.vigour),
                    noise.white(columns, drive.vigour)[:, free])
        pairs = list(each(one, drives))
        errors, derivatives = [e for e, _ in pairs], [j for _, j in pairs]
        cost = _cost(errors, prior, z)
        if not np.isfinite(cost):
            break
        gram = np.diag(precision) + sum(j.T @ j for j in derivatives)
        begun = cost
        for _attempt in range(8):
            slope = -precision * (z - prior.mean)[free] - sum(
                j.T @ e for j, e in zip(derivatives, errors, strict=True))
            move = step_inside(gram + damping * np.diag(np.diag(gram)), slope,
                               (lower - z)[free], (upper - z)[free])
            near = np.array(z)
            near[free] += move
            near = np.clip(near, lower, upper)
            promised = float(slope @ move - 0.5 * move @ gram @ move)
            other = whites(base, drives, noise, near, each)
            reached = _cost(other, prior, near)
            if reached >= cost:
                damping *= 8.0
                if begun > cost:
                    break
                continue
            gained, z, cost, errors = cost - reached, near, reached, other
            damping = max(damping / 5.0, 1e-6)
            if gained < max(0.5 * promised, enough):
                break
        if begun - cost < enough:
            break
    return SetFit(z, cost)


def raced(base: Base, drives: Sequence[Drive], about: Prior, noise: Noise,
          kinds: Sequence[Sequence[FloatArray]], until: float, each: Mapper,
          most: str = 'raced') -> SetFit:
    """
    Fit from the likeliest start of each kind; of those, the best part goes on, and so on.

    Of starts that are as likely as another, as a limit that is not reached is, that one is enough.

    Parameters
    ----------
    base : Base
        Robot to fit; its settings say how many start, and how many steps a round has.
    drives : sequence of Drive
        All are fitted at once.
    about : Prior
        Means and standard deviations of the parameters, and which are free.
    noise : Noise
        What residuals and derivatives are whitened with.
    kinds : sequence of sequence of numpy.ndarray, shape (n,)
        Starts by kind, on the scale of the estimates.
    until : float
        A step that gains less ends a fit [nats].
    each : callable
        Applies a function to the drives: `map`, or that of a pool.
    most : str
        Setting of ``fit`` that says how many start at most.

    Returns
    -------
    SetFit

    """
    numbers = base.settings.fit

    def fit(start: FloatArray, at_most: int) -> SetFit:
        return fit_set(base, drives, about, noise, start, at_most, until, each)
    costs = iter(costs_at(base, drives, about, noise, [
        one for kind in kinds for one in kind], each))
    ranked = [[(next(costs), k, one) for one in kind] for k, kind in enumerate(kinds)]
    likeliest = [min(kind, key=lambda one: one[0]) for kind in ranked]
    alive: list[FloatArray] = []
    last = -np.inf
    for cost, _, one in sorted(likeliest, key=lambda one: one[:2]):
        if len(alive) < int(numbers[most]) and cost > last + numbers['enough']:
            alive.append(one)
            last = cost
    while len(alive) > 1:
        fits = sorted((fit(one, int(numbers['race_steps'])) for one in alive),
                      key=lambda one: one.cost)
        alive = [one.z for one in fits[:max(1, len(fits) // int(numbers['race_part']))]]
    return fit(alive[0], int(numbers['steps']))
