# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Searches of a bounded box by populations: the paper's genetic algorithm, and its successor."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
import random

from lg_husky_sim.errors import MissingExtraError
from lg_husky_sim.identification.paper import paper
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray

Objective = Callable[[FloatArray], FloatArray]
#: Called after each generation with its number and the best cost so far.
Progress = Callable[[int, float], None]
#: Share of a generation that survives unchanged (MATLAB's default for ``ga``).
ELITE = 0.05
#: Population of differential evolution, a free parameter.
DE_POPULATION = 15
#: Spread of the costs at which differential evolution has converged, relative to their mean.
DE_TOLERANCE = 1e-8


@dataclass(frozen=True, eq=False)
class SearchResult:
    """
    What a search found.

    Parameters
    ----------
    values : numpy.ndarray, shape (n_free,)
    cost : float
    best, mean : numpy.ndarray, shape (n_generations + 1,)
        Best cost so far and mean cost of each generation, the first population included.
    evaluations : int
        Candidates that were evaluated.
    converged : bool
    message : str
    """

    values: FloatArray
    cost: float
    best: FloatArray
    mean: FloatArray
    evaluations: int
    converged: bool
    message: str


@contextmanager
def _seeded(seed: int) -> Iterator[None]:
    # DEAP draws from the module random: its state is ours only while the search runs.
    state = random.getstate()
    random.seed(seed)
    try:
        yield
    finally:
        random.setstate(state)


def genetic(objective: Objective, lower: FloatArray, upper: FloatArray, seed: int,
            progress: Progress | None = None, population: int | None = None,
            generations: int | None = None, crossover_fraction: float | None = None
            ) -> SearchResult:
    """
    Search as the paper does: a genetic algorithm as MATLAB's ``ga`` runs it.

    Of each generation 5 % survive unchanged; of the rest, the crossover fraction are children
    of two parents by scattered crossover and the others Gaussian mutants of one, whose spread
    shrinks linearly to zero. Parents are the winners of tournaments of two, which in
    expectation is linear ranking.

    Parameters
    ----------
    objective : callable
        Costs, shape (n,), of candidates, shape (n, n_free).
    lower, upper : numpy.ndarray, shape (n_free,)
    seed : int
        The same seed gives the same result to the last bit.
    progress : callable, optional
    population, generations : int, optional
        100 and 100, as in the paper, if not given.
    crossover_fraction : float, optional
        0.5, as in the paper, if not given.

    Returns
    -------
    SearchResult

    Raises
    ------
    MissingExtraError
        If the package `deap` is not installed.
    """
    try:
        from deap import tools
    except ImportError as error:
        raise MissingExtraError('deap is needed to run the genetic algorithm and is not '
                                "installed: pip install 'lg_husky_sim[search]'") from error
    size = population or paper().population
    count = generations or paper().generations
    share = paper().crossover_fraction if crossover_fraction is None else crossover_fraction
    elite = max(1, round(ELITE * size))
    crossed = round(share * (size - elite))
    span = upper - lower
    draws = np.random.default_rng(seed)
    with _seeded(seed):
        genes = lower + span * draws.random((size, lower.size))
        costs = objective(genes)
        best, mean = [float(costs.min())], [_mean(costs)]
        for generation in range(1, count + 1):
            order = np.argsort(costs, kind='stable')
            rank = np.empty(size, dtype=np.int64)
            rank[order] = np.arange(size)
            parents = np.minimum(*_tournaments(rank, crossed * 2 + size - elite - crossed, draws))
            chosen = genes[order[parents]].tolist()
            children = []
            for place in range(crossed):
                first, _ = tools.cxUniform(chosen[2 * place], chosen[2 * place + 1], 0.5)
                children.append(first)
            spread = (span * (1.0 - generation / count)).tolist()
            still = [0.0] * lower.size
            for parent in chosen[2 * crossed:]:
                children.append(tools.mutGaussian(parent, still, spread, 1.0)[0])
            new = np.clip(np.array(children).reshape(-1, lower.size), lower, upper)
            genes = np.vstack([genes[order[:elite]], new])
            costs = np.concatenate([costs[order[:elite]], objective(new)])
            best.append(float(costs.min()))
            mean.append(_mean(costs))
            if progress is not None:
                progress(generation, best[-1])
    winner = int(np.argmin(costs))
    return SearchResult(genes[winner], float(costs[winner]), np.array(best), np.array(mean),
                        size + count * (size - elite), True, f'{count} generations')


def _tournaments(rank: NDArray[np.int64], count: int, draws: np.random.Generator
                 ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    rivals = draws.integers(0, rank.size, (2, count))
    return rank[rivals[0]], rank[rivals[1]]


def _mean(costs: FloatArray) -> float:
    finite = costs[np.isfinite(costs)]
    return float(finite.mean()) if finite.size else float('inf')


def differential_evolution(objective: Objective, lower: FloatArray, upper: FloatArray,
                           seed: int, progress: Progress | None = None,
                           generations: int = 300) -> SearchResult:
    """
    Search by differential evolution (SciPy's, all candidates of a generation at once).

    Parameters
    ----------
    objective : callable
        Costs, shape (n,), of candidates, shape (n, n_free).
    lower, upper : numpy.ndarray, shape (n_free,)
    seed : int
        The same seed gives the same result to the last bit.
    progress : callable, optional
    generations : int
        At most.

    Returns
    -------
    SearchResult
    """
    from scipy import optimize

    best: list[float] = []
    mean: list[float] = []
    evaluated = 0

    def batch(columns: FloatArray) -> FloatArray:
        nonlocal evaluated
        costs = objective(np.ascontiguousarray(columns.T))
        evaluated += costs.size
        low = float(np.min(costs))
        best.append(min(low, best[-1]) if best else low)
        mean.append(_mean(costs))
        if progress is not None and len(best) > 1:
            progress(len(best) - 1, best[-1])
        return costs

    found = optimize.differential_evolution(
        batch, list(zip(lower, upper, strict=True)), seed=seed, maxiter=generations,
        popsize=DE_POPULATION, tol=DE_TOLERANCE, polish=False, vectorized=True,
        updating='deferred', init='sobol')
    return SearchResult(np.asarray(found.x, dtype=np.float64), float(found.fun), np.array(best),
                        np.array(mean), evaluated, bool(found.success),
                        str(found.message))
