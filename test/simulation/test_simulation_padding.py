# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What makes the sets of a plant equally long reads no argument and adds no effort."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.husky.effects import catalogue, Effect, Onset, OnsetKind
from lg_husky_sim.husky.laws import CONTEXT, evaluate, MEMORY, REMEMBERING
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.simulation.merging import merged
from lg_husky_sim.simulation.modes import packed
import numpy as np
import pytest

Maker = Callable[..., Plant]
#: Effects that may begin late; a slope has no argument, so that nothing at all is allocated.
BEGINNING = sorted(name for name, kind in catalogue().items()
                   if not kind.always_on or kind.drivetrain)


@pytest.mark.parametrize('name', BEGINNING)
def test_padding_reads_nothing_and_adds_nothing(robot: Maker, name: str) -> None:
    plant = robot(Effect(name, late=True), onset=Onset(OnsetKind.TIME, 1.0))
    numbers = packed(plant)
    laws, coefficients, offsets = numbers.laws, numbers.coefficients, numbers.offsets
    for c, one in enumerate(plant.sets):
        efforts, own = laws.shape[1], merged(one).laws.size
        z, memory, out = np.full(8, np.nan), np.full(MEMORY, np.nan), np.full(efforts, 7.0)
        evaluate(c, laws, coefficients, offsets, z, np.ones(CONTEXT), memory, out)
        np.testing.assert_array_equal(out[own:], 0.0)
        assert not np.any(np.isin(laws[c, own:], REMEMBERING))
