# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The low pass on wheel rates, against its differential equation."""

from __future__ import annotations

from lg_husky_sim.diagnosis.evidence.low_pass import low_passed
import numpy as np
import pytest


@pytest.mark.parametrize('lag', [0.02, 0.15])
def test_a_ramp_is_followed_exactly(lag: float) -> None:
    times = np.asarray(0.004 * np.arange(200), dtype=np.float64)
    # y' = (2 t + 3 - y) / lag from y(0) = 3.
    exact = 2.0 * times + 3.0 - 2.0 * lag * (1.0 - np.exp(-times / lag))
    np.testing.assert_allclose(low_passed(2.0 * times + 3.0, 0.004, lag), exact, rtol=1e-12)


def test_what_is_steady_passes_and_no_lag_changes_nothing() -> None:
    values = np.random.default_rng(2).standard_normal(50)
    np.testing.assert_allclose(low_passed(np.full(50, 1.7), 0.004, 0.05), 1.7, rtol=1e-13)
    # What is left of the step before is a lag over a spacing of it.
    np.testing.assert_allclose(low_passed(values, 0.004, 1e-9), values, rtol=0.0,
                               atol=1e-9 / 0.004 * float(np.ptp(values)))
