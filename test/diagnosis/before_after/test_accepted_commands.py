# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What a base accepts of its commands, against steps of a hundredth of the length."""

from __future__ import annotations

from lg_husky_sim.diagnosis.before_after.commands import accepted
import numpy as np
import pytest


@pytest.mark.parametrize(('late', 'most', 'slew'), [
    (0.0, 9.0, 1e9), (0.0131, 1.2, 2.5), (0.1007, 0.7, 0.9)])
def test_a_command_is_accepted_exactly(late: float, most: float, slew: float) -> None:
    """As steps of a hundredth of the length say, whose error is as much smaller."""
    rng = np.random.default_rng(5)
    times = np.cumsum(rng.uniform(0.03, 0.9, 30))
    values = rng.uniform(-1.5, 1.5, 30)
    coarse, fine = np.empty(1200), np.empty(120000)
    accepted(times, values, late, most, slew, 0.4, 0.5, 0.01, coarse)
    place = 0.4
    for k in range(fine.size):
        at = np.searchsorted(times, 0.5 + 1e-4 * (k + 0.5) - late, side='right') - 1
        target = np.clip(values[at] if at >= 0 else 0.0, -most, most)
        before = place
        place += np.clip(target - place, -slew * 1e-4, slew * 1e-4)
        fine[k] = 0.5 * (before + place) if slew < 1e3 else place
    np.testing.assert_allclose(coarse, fine.reshape(-1, 100).mean(axis=1), atol=0.016)
    assert np.mean(np.abs(coarse - fine.reshape(-1, 100).mean(axis=1))) < 5e-4
