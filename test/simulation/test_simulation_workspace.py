# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What is left in the place where the kernel works changes nothing."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.husky.effects import catalogue, Effect, Onset, OnsetKind
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation.arrays import Packed, Work, workspace
from lg_husky_sim.simulation.event_kernel import COLUMNS, follow
from lg_husky_sim.simulation.events import Propagator
import numpy as np
import pytest

Maker = Callable[..., Plant]
KINDS = [(name, late) for name, kind in sorted(catalogue().items())
         if kind.subsystem.value != 'sensor'
         for late in (False, *([True] if not kind.always_on or kind.drivetrain else []))]
STAMPS = np.array((0.0, 0.31, 0.62))
VALUES = np.array(((0.6, 0.4), (-0.3, 0.9), (0.0, 0.0)))
#: The last legs: nothing is left of the time, and little.
ENDS = np.array((0.4, 0.4, 0.9, 0.90001))


def rows(packed: Packed, initial: FloatArray, work: Work) -> FloatArray:
    """Return what the kernel reads off a drive through legs that work in the same place."""
    times = np.linspace(0.0, ENDS[-1], 37)
    out = np.empty((times.size, len(COLUMNS)))
    assert follow(np.array(initial), STAMPS, VALUES, times, np.arange(times.size), out, ENDS,
                  True, packed, work) > 0
    return out


@pytest.mark.parametrize(('name', 'late'), KINDS)
def test_what_is_left_there_means_nothing(robot: Maker, name: str, late: bool) -> None:
    """Bit for bit. NaN was taken from there into the first efforts, as zero times NaN is NaN."""
    plant = robot(Effect(name, late=True), onset=Onset(OnsetKind.TIME, 0.5)) if late else robot(
        Effect(name))
    propagator = Propagator(plant)
    initial, packed = propagator.initial(), propagator.packed
    clean = rows(packed, initial, workspace(packed))
    for left in (np.nan, np.inf, -1e300, 7.0):
        work = workspace(packed)
        for array in work:
            array.fill(left)
        np.testing.assert_array_equal(rows(packed, initial, work), clean)
