# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The paper's genetic algorithm and differential evolution."""

from __future__ import annotations

from collections.abc import Callable
import random
from typing import Any

from lg_husky_sim.identification.paper import paper
from lg_husky_sim.identification.search import (
    differential_evolution,
    genetic,
    SearchResult,
)
from lg_husky_sim.signals import FloatArray
import numpy as np
import pytest

LOW, HIGH = np.array([1.0, 1.0, 0.75]), np.array([100.0, 100.0, 1.0])
BEST = np.array([20.0, 60.0, 0.9])
Search = Callable[..., SearchResult]


def bowl(rows: FloatArray) -> FloatArray:
    distance: FloatArray = np.sum(((rows - BEST) / (HIGH - LOW)) ** 2, axis=1)
    return distance


def test_the_papers_settings() -> None:
    stated = paper()
    assert (stated.population, stated.generations, stated.crossover_fraction) == (100, 100, 0.5)
    assert stated.search['wheel_damping'].lower < stated.search['wheel_damping'].upper
    assert stated.search['yaw_damping'].result == 12.865
    assert stated.tracking_error['s_bend'] == (0.0352, 0.1027)


def test_the_genetic_algorithm_counts_as_the_paper_says() -> None:
    seen = []

    def counting(rows: FloatArray) -> FloatArray:
        seen.append(len(rows))
        assert np.all(rows >= LOW)
        assert np.all(rows <= HIGH)
        return bowl(rows)
    found = genetic(counting, LOW, HIGH, seed=1)
    assert seen[0] == 100
    assert len(seen) == 101
    assert found.evaluations == sum(seen)
    assert found.best.shape == found.mean.shape == (101,)
    assert np.all(np.diff(found.best) <= 0.0)
    assert found.mean[-1] < found.mean[0]


def test_a_generation_is_made_by_deaps_operators_in_the_papers_shares(
        monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 100, 5 stay, 48 are children of two parents and 47 mutants of one."""
    from deap import tools

    select, mate, mutate = tools.selTournament, tools.cxUniform, tools.mutGaussian
    selected, mated, spreads = [], [], []

    def selecting(candidates: Any, count: int, **options: Any) -> Any:
        selected.append(count)
        return select(candidates, count, **options)

    def mating(*couple: Any, **options: Any) -> Any:
        mated.append(couple)
        return mate(*couple, **options)

    def mutating(candidate: Any, sigma: list[float], **options: Any) -> Any:
        spreads.append(sigma[0] / float(HIGH[0] - LOW[0]))
        return mutate(candidate, sigma=sigma, **options)
    monkeypatch.setattr(tools, 'selTournament', selecting)
    monkeypatch.setattr(tools, 'cxUniform', mating)
    monkeypatch.setattr(tools, 'mutGaussian', mutating)
    genetic(bowl, LOW, HIGH, 0, generations=10)
    assert selected == [2 * 48 + 47] * 10
    assert len(mated) == 480
    assert spreads == pytest.approx(np.repeat(np.linspace(0.9, 0.0, 10), 47))


def test_the_best_candidates_survive_unchanged() -> None:
    seen: list[FloatArray] = []

    def keeping(rows: FloatArray) -> FloatArray:
        seen.append(rows.copy())
        return bowl(rows)
    found = genetic(keeping, LOW, HIGH, 6, generations=5)
    everything = np.vstack(seen)
    assert found.cost == bowl(everything).min() == found.best[-1]
    np.testing.assert_array_equal(found.values, everything[np.argmin(bowl(everything))])


@pytest.mark.parametrize('search', [genetic, differential_evolution])
def test_searches_find_a_minimum_and_repeat_themselves(search: Search) -> None:
    first, again, other = search(bowl, LOW, HIGH, 3), search(bowl, LOW, HIGH, 3), search(
        bowl, LOW, HIGH, 4)
    np.testing.assert_allclose(first.values, BEST, rtol=0.05)
    assert first.cost == bowl(first.values[None])[0]
    np.testing.assert_array_equal(first.values, again.values)
    np.testing.assert_array_equal(first.best, again.best)
    assert first.best[0] != other.best[0]


def test_the_programs_random_numbers_are_left_alone() -> None:
    random.seed(5)
    expected = random.random()
    random.seed(5)
    genetic(bowl, LOW, HIGH, 0, generations=2)
    assert random.random() == expected


def test_candidates_that_cannot_be_simulated_lose() -> None:
    def broken(rows: FloatArray) -> FloatArray:
        return np.where(rows[:, 0] > 50.0, np.inf, bowl(rows))
    found = genetic(broken, LOW, HIGH, 2)
    assert np.isfinite(found.cost)
    assert found.values[0] <= 50.0
    assert np.all(np.isfinite(found.mean))
