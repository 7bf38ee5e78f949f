# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""When a round of the search ends before hypotheses are compared under a noise of their own."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from lg_husky_sim.diagnosis.selection import rounds
from lg_husky_sim.diagnosis.selection.tried import Ranking
import pytest


class _WentOnError(Exception):
    """The round compares hypotheses under a noise of their own."""


class _Noise:
    """Noise under which nothing is fitted any more."""

    def renoised(self, fit: object) -> _Noise:
        del fit
        return self

    def fit(self, point: object, slopes: object) -> object:
        raise _WentOnError


def _step(monkeypatch: pytest.MonkeyPatch, chance: float) -> rounds.Round:
    # A round whose best effect is likely by chance so much.
    fit: Any = SimpleNamespace(point=SimpleNamespace(), slopes=())
    tried: Any = SimpleNamespace(score=10.0, gain=10.0, fit=fit)
    noise: Any = _Noise()
    monkeypatch.setattr(rounds, '_looks', lambda *_: [])
    monkeypatch.setattr(rounds, 'fitted', lambda *_, **__: [tried])
    monkeypatch.setattr(rounds, 'with_jitter', lambda point, _: point)
    monkeypatch.setattr(Ranking, 'rough_chance', lambda *_: chance)
    return rounds.forward_step(noise, fit, [], None)


def test_a_round_goes_on_where_its_best_is_not_likely_by_chance(
        monkeypatch: pytest.MonkeyPatch) -> None:
    """However little it gains: noise of the base may have taken the place of the effect."""
    with pytest.raises(_WentOnError):
        _step(monkeypatch, 1e-3)


def test_a_round_ends_where_its_best_is_likely_by_chance(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever noise of its own would leave, it is not looked for."""
    found = _step(monkeypatch, 0.9)
    assert not found.adopted
    assert found.chance == 0.9
