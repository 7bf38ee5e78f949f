# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Costs and weights of innovations are those of Student's t, as SciPy has it."""

from __future__ import annotations

from lg_husky_sim.diagnosis.evidence import student
from lg_husky_sim.diagnosis.settings import setting
import numpy as np
import pytest
from scipy import stats

E = np.array([[-7.0, -1.0, 0.0], [0.3, 2.5, 40.0]])


def test_an_innovation_costs_what_it_is_less_likely_than_none() -> None:
    t = stats.t(setting('student'))
    np.testing.assert_allclose(student.costs(E), t.logpdf(0.0) - t.logpdf(E), rtol=1e-12)
    assert student.cost(E) == pytest.approx(float(np.sum(student.costs(E))))


def test_weights_are_slopes_of_the_cost_over_the_innovation() -> None:
    step = 1e-5
    slope = (student.costs(E + step) - student.costs(E - step)) / (2.0 * step)
    np.testing.assert_allclose(E * student.weights(E), slope, rtol=1e-7, atol=1e-9)


def test_costs_add_up_however_large_and_however_many_there_are() -> None:
    """Products of terms stand for sums of logarithms, and must not overflow."""
    many = 5.0 * np.random.default_rng(1).standard_t(1.5, 20000)
    assert student.cost(many) == pytest.approx(float(np.sum(student.costs(many))), rel=1e-12)
    for large in (1e60, 1e140):
        some = np.array([3.0, large, -large, 0.5, large])
        assert student.cost(some) == pytest.approx(float(np.sum(student.costs(some))), rel=1e-12)
    assert np.isnan(student.cost(np.array([1.0, np.nan])))
    assert student.cost(np.array([1.0, np.inf])) == np.inf
    assert student.cost(np.zeros(0)) == 0.0


@pytest.mark.parametrize('count', [1, 3])
def test_a_reweighted_problem_is_that_of_its_definition(count: int) -> None:
    random = np.random.default_rng(2)
    innovations, columns = 3.0 * random.standard_normal(500), random.standard_normal((500, count))
    sizes = random.standard_normal(count)
    cost, normal, slope = student.reweighted(innovations, columns, sizes)
    left = innovations - columns @ sizes
    weight = student.weights(left)
    assert cost == pytest.approx(float(np.sum(student.costs(left))), rel=1e-12)
    np.testing.assert_allclose(normal, columns.T @ (weight[:, None] * columns), rtol=1e-10)
    np.testing.assert_allclose(slope, columns.T @ (weight * innovations), rtol=1e-9, atol=1e-9)
