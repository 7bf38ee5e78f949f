# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""When two hypotheses are not told apart, and what follows for an onset."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from lg_husky_sim.diagnosis.evidence.evidence import Fit
from lg_husky_sim.diagnosis.hypotheses.hypothesis import hypotheses
from lg_husky_sim.diagnosis.selection import rounds
from lg_husky_sim.diagnosis.selection.ties import is_near
from lg_husky_sim.diagnosis.selection.tried import Tried
from lg_husky_sim.husky.effects import Onset, OnsetKind
from lg_husky_sim.husky.model_file import load_model
import numpy as np
import pytest

COUNT = 200
TIMES = np.arange(COUNT) * 0.25


def _evidence() -> Any:
    frame = SimpleNamespace(times=TIMES, order=np.arange(COUNT))
    return SimpleNamespace(whiteners=[SimpleNamespace(frame=frame)])


def _fit(whitened: Any) -> Any:
    point: Any = SimpleNamespace(places=np.zeros(1))
    errors = np.asarray(whitened, dtype=np.float64)
    return Fit(point, 0.0, errors, np.zeros((errors.size, 1)), (), ())


def test_a_difference_within_its_own_noise_tells_nothing_apart() -> None:
    rng = np.random.default_rng(3)
    one, other = (_fit(3.0 * rng.standard_normal(COUNT)) for _ in range(2))
    assert is_near(_evidence(), one, other, 20.0, 100.0)


def test_a_steady_difference_tells_apart() -> None:
    one, other = _fit(np.full(COUNT, 0.5)), _fit(np.full(COUNT, 1.0))
    assert not is_near(_evidence(), one, other, 40.0, 100.0)


def test_a_small_share_of_the_gain_tells_nothing_apart_however_steady() -> None:
    one, other = _fit(np.full(COUNT, 0.5)), _fit(np.full(COUNT, 1.0))
    assert is_near(_evidence(), one, other, 40.0, 10000.0)


@pytest.mark.parametrize(('without', 'kept'), [(990.0, False), (940.0, False), (500.0, True)])
def test_an_onset_is_for_what_does_not_do_as_well_without_it(
        without: float, kept: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    slope = next(h for h in hypotheses(load_model().structure) if h.effect.id == 'slope')
    late = slope.at(Onset(OnsetKind.TIME, 6.0, 'rec1'))
    one: Any = _fit(np.full(COUNT, 0.5))
    one.point.places, one.point.values = np.zeros(3), {p.name: 0.1 for p in late.free}
    base: Any = SimpleNamespace(point=SimpleNamespace(places=np.zeros(1), at=lambda places: None))
    again: Any = _fit(np.full(COUNT, 1.0))
    monkeypatch.setattr(rounds, 'attempt', lambda *_: Tried(slope, again, without, COUNT))
    best = rounds._from_the_start(_evidence(), base, [Tried(late, one, 1000.0, COUNT)])[0]
    assert (best.hypothesis.onset is not None) is kept
