# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The noise of a counted encoder is its step, however often the reading stays the same."""

from __future__ import annotations

from lg_husky_sim.identification.noise import spread, stepwise
import numpy as np
import pytest

RNG = np.random.default_rng(1)


@pytest.mark.parametrize('step', [0.02, 0.05, 0.2])
def test_a_coarse_count_is_not_taken_for_exact(step: float) -> None:
    speed = 2.0 + 0.01 * np.cumsum(RNG.standard_normal(4000)) * step
    angle = np.cumsum(speed) * 0.02
    read = np.diff(np.floor(angle / (0.02 * step)) * step)
    error = read - speed[1:]
    level = max(spread(np.diff(error)), stepwise(np.diff(error))) / np.sqrt(2.0)
    # Neighbouring errors of a count have opposite signs, so that their steps are large.
    assert 0.6 * np.std(error) < level < 3.0 * np.std(error)


def test_plain_noise_is_left_to_the_median() -> None:
    noise = 0.03 * RNG.standard_normal(5000)
    assert stepwise(np.diff(noise)) == 0.0
    noise[::50] += 3.0
    assert stepwise(np.diff(noise)) == 0.0


def test_a_channel_that_never_changes_has_no_steps() -> None:
    assert stepwise(np.zeros(100)) == 0.0
