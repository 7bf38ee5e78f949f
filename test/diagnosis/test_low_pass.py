# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The low pass on wheel rates, against its differential equation."""

from __future__ import annotations

from lg_husky_sim.diagnosis.evidence.low_pass import low_passed
from lg_husky_sim.signals import FloatArray
import numpy as np
import pytest


def uneven(seed: int, count: int = 200) -> FloatArray:
    """Return times from 0, some of them the same."""
    steps = np.random.default_rng(seed).uniform(0.0, 0.008, count)
    steps[::7] = 0.0
    return np.asarray(np.concatenate([[0.0], np.cumsum(steps)]), dtype=np.float64)


@pytest.mark.parametrize('lag', [0.001, 0.02, 0.15])
def test_a_parabola_is_followed_exactly(lag: float) -> None:
    t = uneven(1)
    rates, turned = 3.0 + 2.0 * t - 5.0 * t ** 2, 3.0 * t + t ** 2 - 5.0 / 3.0 * t ** 3
    # y' = (3 + 2 t - 5 t^2 - y) / lag from y(0) = 3.
    steady = 3.0 + 2.0 * (t - lag) - 5.0 * (t ** 2 - 2.0 * lag * t + 2.0 * lag ** 2)
    exact = steady + (3.0 - steady[0]) * np.exp(-t / lag)
    np.testing.assert_allclose(low_passed(t, rates, turned, lag), exact, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize('lag', [0.008, 0.1])
def test_a_wheel_that_answers_a_command_within_a_step_is_followed(lag: float) -> None:
    """By the integral of its rate; the rates alone leave several times the error."""
    answer, at = 0.003, 0.1
    t = np.sort(np.append(np.arange(0.0, 0.4, 0.004), [at, at + 0.001]))
    after = np.maximum(t - at, 0.0)
    rates = 0.3 * (1.0 - np.exp(-after / answer))
    turned = 0.3 * (after - answer * (1.0 - np.exp(-after / answer)))
    exact = 0.3 * (1.0 - (lag * np.exp(-after / lag) - answer * np.exp(-after / answer))
                   / (lag - answer))
    error = np.max(np.abs(low_passed(t, rates, turned, lag) - exact))
    assert error < 3e-4
    straight = np.concatenate([[0.0], np.cumsum(
        0.5 * (rates[1:] + rates[:-1]) * np.diff(t))])
    assert np.max(np.abs(low_passed(t, rates, straight, lag) - exact)) > 5.0 * error


def test_what_is_steady_passes_and_no_lag_changes_nothing() -> None:
    t = uneven(2)
    np.testing.assert_allclose(low_passed(t, np.full(t.size, 1.7), 1.7 * t, 0.05), 1.7,
                               rtol=1e-12)
    rates = 2.0 + 3.0 * t
    np.testing.assert_allclose(low_passed(t, rates, 2.0 * t + 1.5 * t ** 2, 1e-9), rates,
                               rtol=1e-6)
