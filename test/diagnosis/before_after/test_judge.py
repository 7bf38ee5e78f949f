# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Which of the differences that quadratics promise hold where these are looked at again."""

from __future__ import annotations

from typing import cast

from lg_husky_sim.diagnosis.before_after.evidence import Evidence, Quadratic
from lg_husky_sim.diagnosis.before_after.expansion import Expansion
from lg_husky_sim.diagnosis.before_after.judge import Claim, is_beyond_chance, Judge
from lg_husky_sim.diagnosis.before_after.settings import settings
import numpy as np
from numpy.typing import NDArray

CHANGED = np.array([0])
CURVATURE = 1e4


def about(*values: float) -> Evidence:
    """Return what two recordings before and two after say of one number, whose prior is wide."""
    return Evidence([Quadratic(f'rec{k}', k > 1, np.array([[CURVATURE]]),
                               np.array([CURVATURE * value]), 0.5 * CURVATURE * value ** 2)
                     for k, value in enumerate(values)],
                    np.zeros(1), np.ones(1), np.array([0.01]), np.ones(1))


class Modes:
    """An expansion whose evidence about what a change, or none, makes likeliest is given."""

    def __init__(self, changed: float, nothing: float) -> None:
        self.found = {CHANGED.size: changed, 0: nothing}

    def evidence(self, linear: Evidence, changed: NDArray[np.intp]) -> float:
        return self.found[changed.size]


SEEN = about(0.0, 0.01, 1.0, 1.01)
ALIKE = about(0.0, 1.01, 0.01, 1.0)
NOTHING = SEEN.solve(np.zeros(0, dtype=np.intp)).evidence


def checked(common: Evidence, changed: float, nothing: float) -> tuple[Claim, Claim]:
    """Return a claim by quadratics about the sets' fits, and what holds of it."""
    judge = Judge(SEEN, common, cast(Expansion, Modes(changed, nothing)), 10.0,
                  settings().decision)
    claim = judge.claim(CHANGED, 1)
    return claim, judge.checked([claim])[0]


def test_a_claim_that_neither_fit_bears_out_is_chance() -> None:
    claim, held = checked(ALIKE, NOTHING, NOTHING)
    assert is_beyond_chance(claim, settings().decision)
    assert not is_beyond_chance(held, settings().decision)


def test_a_claim_that_the_common_fit_bears_out_keeps_its_gain() -> None:
    claim, held = checked(SEEN, NOTHING, NOTHING)
    assert held.gain == claim.gain > 0.0
    assert held.chance == claim.chance


def test_a_claim_far_from_the_common_fit_gains_what_its_own_mode_does() -> None:
    claim, held = checked(ALIKE, NOTHING + 50.0, NOTHING)
    assert is_beyond_chance(held, settings().decision)
    np.testing.assert_allclose(held.gain, 50.0)
    assert held.gain < claim.gain


def test_what_no_change_gains_by_its_own_mode_is_taken_off() -> None:
    claim, held = checked(SEEN, NOTHING, NOTHING + 2.0)
    np.testing.assert_allclose(claim.gain - held.gain, 2.0)
