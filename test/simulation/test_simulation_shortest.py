# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A step of the shortest length is taken whether it found its efforts or not."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation import event_kernel
from lg_husky_sim.simulation.arrays import Packed, Work, workspace
from lg_husky_sim.simulation.effort_kernel import solve
from lg_husky_sim.simulation.events import Propagator
import numpy as np
import pytest

UNSOLVED = 2e-4
"""Until when no step after a command finds its efforts [s]."""
GIVEN = (0.0, 0.1)
"""When commands come [s]."""


def lengths(plant: Plant, monkeypatch: pytest.MonkeyPatch) -> tuple[FloatArray, FloatArray]:
    """Return when steps are tried and how long they are, in plain Python."""
    tried: list[tuple[float, float]] = []

    def unsolved(plant: Packed, c: int, s: FloatArray, n: int, time: float, h: float,
                 before: float, work: Work) -> float:
        found = solve(plant, c, s, n, time, h, before, work)
        tried.append((time, h))
        return -1.0 if any(0.0 <= time - begin < UNSOLVED for begin in GIVEN) else found
    monkeypatch.setattr(event_kernel, 'solve', unsolved)
    drive, times = Propagator(plant), np.array([0.2])
    follow = getattr(event_kernel.follow, 'plain', event_kernel.follow)
    out = np.empty((1, len(event_kernel.COLUMNS)))
    assert follow(drive.initial(), np.array(GIVEN), np.array([[0.6, 0.3], [-0.2, 0.1]]), times,
                  np.arange(1), out, times, False, drive.packed, workspace(drive.packed)) > 0
    assert np.all(np.isfinite(out))
    at, long = np.array(tried).T
    return at, long


def test_after_a_step_without_efforts_none_is_longer_until_one_has_found_them(
        robot: Callable[..., Plant], monkeypatch: pytest.MonkeyPatch) -> None:
    """It counted as exact: the next one was thrice as long, and tried in vain each time."""
    at, long = lengths(robot('coulomb_drivetrain'), monkeypatch)
    for begin in GIVEN:
        own = long[(at >= begin) & (at < begin + UNSOLVED)]
        shortest = np.flatnonzero(own <= 1.5 * event_kernel.SHORTEST)[0]
        assert own.size - shortest > 10
        np.testing.assert_allclose(own[shortest:], own[shortest], rtol=1e-9)
