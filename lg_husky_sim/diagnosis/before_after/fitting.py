# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Fit the base to a set of drives: Gauss-Newton with priors."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TypeVar

from lg_husky_sim.diagnosis.before_after.drives import Drive
from lg_husky_sim.diagnosis.before_after.prediction import Base, jacobian, residual
from lg_husky_sim.diagnosis.before_after.whitening import Noise
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray

Task = TypeVar('Task')
Outcome = TypeVar('Outcome')
#: Applies a function to tasks, in order.
Mapper = Callable[[Callable[[Task], Outcome], Iterable[Task]], Iterable[Outcome]]


@contextmanager
def threads(jobs: int) -> Iterator[ThreadPoolExecutor]:
    """Give threads: the integrator runs without the interpreter's lock."""
    with ThreadPoolExecutor(max(jobs, 1)) as pool:
        yield pool


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
        strain = (z - self.mean)[self.free] / self.sd[self.free]
        return 0.5 * float(strain @ strain)


@dataclass(frozen=True, eq=False)
class SetFit:
    """
    The base fitted to a set of drives.

    Parameters
    ----------
    z : numpy.ndarray, shape (n,)
        On the scale of the estimates.
    cost : float
        Negative log posterior [nats], up to a constant of the noise.
    """

    z: FloatArray
    cost: float


def cost_at(base: Base, drives: Sequence[Drive], prior: Prior, noise: Noise, z: FloatArray,
            pool: ThreadPoolExecutor) -> float:
    """Return the negative log posterior [nats]; infinity where the simulation breaks down."""
    def one(drive: Drive) -> float:
        e = noise.white(residual(base, drive, z))
        return 0.5 * float(e @ e)
    total = sum(pool.map(one, drives)) + prior.cost(z)
    return float(total) if np.isfinite(total) else float(np.inf)


def fit_set(base: Base, drives: Sequence[Drive], prior: Prior, noise: Noise, begin: FloatArray,
            steps: int, enough: float, pool: ThreadPoolExecutor) -> SetFit:
    """
    Fit by Gauss-Newton with Levenberg's damping.

    Parameters
    ----------
    base : Base
    drives : sequence of Drive
    prior : Prior
    noise : Noise
    begin : numpy.ndarray, shape (n,)
    steps : int
        At most.
    enough : float
        A step that gains less ends the fit [nats].
    pool : ThreadPoolExecutor

    Returns
    -------
    SetFit
    """
    lower, upper = base.bounds()
    z = np.clip(begin, lower, upper)
    cost = cost_at(base, drives, prior, noise, z, pool)
    damping = 1e-3
    count = int(np.sum(prior.free))
    for _ in range(steps):
        gram, slope = np.zeros((count, count)), np.zeros(count)

        def one(drive: Drive, at: FloatArray = z) -> tuple[FloatArray, FloatArray]:
            rows, columns = jacobian(base, drive, at, prior.free)
            e, j = noise.white(rows), noise.white(columns)[:, prior.free]
            return j.T @ j, j.T @ e
        for part, direction in pool.map(one, drives):
            gram += part
            slope += direction
        precision = 1.0 / prior.sd[prior.free] ** 2
        slope += precision * (z - prior.mean)[prior.free]
        gram[np.diag_indices(count)] += precision
        gained = -1.0
        for _attempt in range(6):
            damped = gram + damping * np.diag(np.diag(gram))
            move = np.linalg.solve(damped, slope)
            near = np.array(z)
            near[prior.free] -= move
            near = np.clip(near, lower, upper)
            other = cost_at(base, drives, prior, noise, near, pool)
            if other < cost:
                gained, z, cost = cost - other, near, other
                damping = max(damping / 5.0, 1e-6)
                break
            damping *= 8.0
        if gained < enough:
            break
    return SetFit(z, cost)
