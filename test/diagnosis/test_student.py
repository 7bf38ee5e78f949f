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
