# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A search for bursts ends, and takes no absence of scores for calm."""

from __future__ import annotations

from lg_husky_sim.diagnosis.decision.adoption import evidence_beyond_chance
from lg_husky_sim.diagnosis.hypotheses.bursts import burst_evidence, levelled
import numpy as np
import pytest


def test_scores_of_nothing_are_no_calm_between_bursts() -> None:
    """More than half of them, and a search for two scales had no end."""
    rng = np.random.default_rng(5)
    own, speeds = rng.standard_normal(90), rng.uniform(0.0, 1.0, 90)
    alone = burst_evidence(own)
    assert alone < 0.0
    for nothing in (0.0, np.nan, np.inf):
        mixed, place = np.full(240, nothing), np.sort(rng.permutation(240)[:90])
        mixed[place] = own
        assert burst_evidence(mixed) == pytest.approx(alone, abs=1e-9)
        there = levelled(mixed, np.interp(np.arange(240), place, speeds))
        assert np.all(np.isfinite(there))
        assert burst_evidence(there) < evidence_beyond_chance(30)
        assert burst_evidence(np.full(40, nothing)) == 0.0


def test_a_search_for_two_scales_ends_where_half_of_the_scores_are_one() -> None:
    scores = np.append(np.full(40, 1e-200), np.full(20, 1.0))
    assert np.isfinite(burst_evidence(scores))
    assert burst_evidence(np.full(40, 1e-200)) == 0.0
    assert np.isfinite(burst_evidence(np.ones(40)))
