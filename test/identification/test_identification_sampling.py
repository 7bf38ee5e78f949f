# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A simulated column read at the stamps of a sensor, compiled and plain."""

from __future__ import annotations

from lg_husky_sim.identification import sampling
from lg_husky_sim.identification.fit_segments import PERIOD
import numpy as np
import pytest

START = 1000.5


@pytest.mark.parametrize('contiguous', [True, False])
def test_the_loop_and_the_arrays_agree_to_the_last_bit(
        monkeypatch: pytest.MonkeyPatch, contiguous: bool) -> None:
    generator = np.random.default_rng(3)
    grid = generator.normal(size=(200, 3))
    column = np.array(grid[:, 1]) if contiguous else grid[:, 1]
    times = START + generator.uniform(-1.0, 200.0 * PERIOD + 1.0, 500)
    one = sampling.sample(column, START, times)
    monkeypatch.setattr(sampling, '_COMPILED', False)
    other = sampling.sample(column, START, times)
    np.testing.assert_array_equal(one, other)
    steps = START + PERIOD * np.arange(200)
    np.testing.assert_allclose(other, np.interp(times, steps, column), atol=1e-5)


def test_beyond_its_ends_a_column_stays_what_it_is() -> None:
    read = sampling.sample(np.array([1.0, 3.0]), START, np.array([0.0, START, START + 9.0]))
    np.testing.assert_allclose(read, [1.0, 1.0, 3.0], atol=1e-5)
