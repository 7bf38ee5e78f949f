# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Searches of a bounded box by populations: the paper's genetic algorithm, and its successor."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
import math
import random
from typing import Any

from lg_husky_sim.extras import require
from lg_husky_sim.identification.paper import paper
from lg_husky_sim.signals import FloatArray
import numpy as np

Objective = Callable[[FloatArray], FloatArray]
#: Called after each generation with its number and the best cost so far.
Progress = Callable[[int, float], None]


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


class _Candidate(list[float]):
    # Genes, with the fitness by which DEAP compares them: minus the cost.
    fitness = -math.inf


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

    The best candidates so far, the elite, make up a share of each generation; of the rest, the
    crossover fraction are children of two parents by scattered crossover and the others Gaussian
    mutants of one, whose standard deviation shrinks linearly to zero. Parents are the winners of
    tournaments of two, which in expectation is linear ranking. All of these are DEAP's operators.

    Parameters
    ----------
    objective : callable
        Costs, shape (n,), of candidates, shape (n, n_free).
    lower, upper : numpy.ndarray, shape (n_free,)
        Bounds of each free parameter.
    seed : int
        The same seed gives the same result to the last bit.
    progress : callable, optional
        Called with the number of a generation and the best cost so far.
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
    require('deap', 'run the genetic algorithm')
    from deap import tools

    size = population or paper().population
    count = generations or paper().generations
    fraction = paper().crossover_fraction if crossover_fraction is None else crossover_fraction
    elite = max(1, round(paper().population_search['elite'] * size))
    crossed = round(fraction * (size - elite))
    box = _toolbox(objective, lower, upper)
    best_so_far, logbook = tools.HallOfFame(elite), tools.Logbook()
    costs = tools.Statistics(lambda candidate: -candidate.fitness)
    costs.register('mean', _mean)
    with _seeded(seed):
        generation = box.evaluate(tools.initRepeat(list, box.draw, size))
        for number in range(count + 1):
            if number:
                parents = list(map(box.clone, box.select(generation, size - elite + crossed)))
                couples, others = parents[:2 * crossed], parents[2 * crossed:]
                for first, second in zip(couples[::2], couples[1::2], strict=True):
                    box.mate(first, second)
                spread = ((upper - lower) * (1.0 - number / count)).tolist()
                for parent in others:
                    box.mutate(parent, sigma=spread)
                generation = [*best_so_far, *box.evaluate([*couples[::2], *others])]
            best_so_far.update(generation)
            logbook.record(best=-best_so_far[0].fitness, **costs.compile(generation))
            if number and progress is not None:
                progress(number, logbook[-1]['best'])
    best, mean = map(np.array, logbook.select('best', 'mean'))
    return SearchResult(np.array(best_so_far[0]), float(best[-1]), best, mean,
                        size + count * (size - elite), True, f'{count} generations')


def _toolbox(objective: Objective, lower: FloatArray, upper: FloatArray) -> Any:
    # DEAP's operators; a generation is put between the bounds and evaluated at once.
    from deap import base, tools

    def draw() -> _Candidate:
        return _Candidate(map(random.uniform, lower.tolist(), upper.tolist()))

    def evaluate(candidates: Sequence[_Candidate]) -> Sequence[_Candidate]:
        genes = np.clip(np.array(candidates), lower, upper)  # mutants may lie outside
        for one, row, value in zip(candidates, genes.tolist(), objective(genes).tolist(),
                                   strict=True):
            one[:] = row
            one.fitness = -value
        return candidates

    numbers = paper().population_search
    box = base.Toolbox()
    box.register('draw', draw)
    box.register('clone', _Candidate)
    box.register('evaluate', evaluate)
    box.register('select', tools.selTournament, tournsize=round(numbers['tournament']))
    box.register('mate', tools.cxUniform, indpb=numbers['exchanged'])
    box.register('mutate', tools.mutGaussian, mu=[0.0] * lower.size, indpb=1.0)
    return box


def _mean(costs: Iterable[float]) -> float:
    values = np.asarray(costs, dtype=np.float64)
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if finite.size else float('inf')


def differential_evolution(objective: Objective, lower: FloatArray, upper: FloatArray,
                           seed: int, progress: Progress | None = None,
                           generations: int | None = None) -> SearchResult:
    """
    Search by differential evolution (SciPy's, all candidates of a generation at once).

    Parameters
    ----------
    objective : callable
        Costs, shape (n,), of candidates, shape (n, n_free).
    lower, upper : numpy.ndarray, shape (n_free,)
        Bounds of each free parameter.
    seed : int
        The same seed gives the same result to the last bit.
    progress : callable, optional
        Called with the number of a generation and the best cost so far.
    generations : int, optional
        At most; as in ``config/paper.yaml`` if not given.

    Returns
    -------
    SearchResult

    """
    from scipy import optimize

    numbers = paper().population_search
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
        batch, list(zip(lower, upper, strict=True)), seed=seed,
        maxiter=generations or round(numbers['evolution_generations']),
        popsize=round(numbers['evolution_population']), tol=numbers['evolution_tolerance'],
        polish=False, vectorized=True, updating='deferred', init='sobol')
    return SearchResult(np.asarray(found.x, dtype=np.float64), float(found.fun), np.array(best),
                        np.array(mean), evaluated, bool(found.success),
                        str(found.message))
