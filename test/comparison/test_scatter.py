# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The scatter of a pose is told from the errors of a model."""

from __future__ import annotations

import math

from lg_husky_sim.comparison.scatter import counts, scatter_notes, scatter_of
from lg_husky_sim.recording import Segment
from lg_husky_sim.signals import TimeSeries
import numpy as np
import pytest

NOISE = 0.05
TIMES = np.arange(0.0, 80.0, 0.25)


def grass(noise: float) -> Segment:
    """Return a drive to and fro whose position is known to some noise [m] four times a second."""
    x = 5.0 * np.sin(0.2 * TIMES) + noise * np.random.default_rng(3).standard_normal(TIMES.size)
    pose = TimeSeries(TIMES, np.column_stack([x, 0.0 * x, 0.0 * x]), ('x', 'y', 'heading'))
    return Segment('grass', 0, TIMES[0], TIMES[-1], {'pose': pose})


def test_the_scatter_of_a_speed_is_that_of_its_noise() -> None:
    speed = np.sin(0.2 * TIMES) + 0.3 * np.random.default_rng(1).standard_normal(TIMES.size)
    assert scatter_of(TIMES, speed) == pytest.approx(0.3, rel=0.25)
    assert scatter_of(TIMES, np.sin(0.2 * TIMES)) < 0.01
    assert np.isnan(scatter_of(TIMES[:1], speed[:1]))
    assert np.isnan(scatter_of(TIMES[:3], speed[:3]))


def test_a_recording_whose_speed_is_mostly_noise_is_named() -> None:
    (said,) = scatter_notes([grass(NOISE)], 0.2)
    assert said.startswith('grass: the measured forward speed is the rate of change of the pose')
    assert 'not due to a model' in said
    # A model that is far off, and a pose that is exact, are another matter.
    assert not scatter_notes([grass(NOISE)], 5.0)
    assert not scatter_notes([grass(0.0)], 0.2)


def test_a_speed_that_a_model_foretells_does_not_scatter() -> None:
    """Commands do not foretell noise: where a model is that near, the speed itself bends so."""
    scatter = 0.2
    assert counts(scatter, 0.9 * scatter)
    assert not counts(scatter, 1e-3 * scatter)
    assert not counts(math.nan, 1.0)
    assert not scatter_notes([grass(NOISE)], 1e-6)
