# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""When a round of the search ends before hypotheses are compared under a noise of their own."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from types import SimpleNamespace
from typing import Any

from lg_husky_sim.diagnosis.selection import rounds
import pytest


class _WentOnError(Exception):
    """The round compares hypotheses under a noise of their own."""


class _Noise:
    """Noise under which fits end where they begin, until points are compared."""

    def __init__(self, own: bool) -> None:
        self.own = own

    def renoised(self, fit: object) -> _Noise:
        del fit
        return _Noise(True)

    def fit(self, point: object, slopes: object) -> object:
        return SimpleNamespace(point=point, slopes=slopes, cost=100.0)


@dataclass(frozen=True)
class _Ranking:
    """Chances of the best effect, under the noise of the base and under its own."""

    evidence: Any
    base: Any
    laws: Any
    starts: int
    chances: tuple[float, float]

    def ordered(self, tried: list[Any]) -> list[Any]:
        return tried

    def chance(self, best: object) -> float:
        del best
        return self.chances[self.evidence.own]


def _step(monkeypatch: pytest.MonkeyPatch, chance: float, under_its_own: float, *,
          distorted: bool = False) -> rounds.Round:
    def looks(*given: Any) -> list[Any]:
        if given[0].own:
            raise _WentOnError
        return []
    fit: Any = SimpleNamespace(point=SimpleNamespace(), slopes=(), cost=100.0)
    tried: Any = SimpleNamespace(score=10.0, gain=10.0, fit=fit, count=100,
                                 hypothesis=SimpleNamespace(effect='effect', label='effect'))
    noise: Any = _Noise(False)
    monkeypatch.setattr(rounds, '_looks', looks)
    monkeypatch.setattr(rounds, 'fitted', lambda *_, **__: [tried])
    monkeypatch.setattr(rounds, 'with_jitter', lambda point, _: point)
    monkeypatch.setattr(rounds, 'is_distorted', lambda _: distorted)
    monkeypatch.setattr(rounds, 'Ranking', partial(_Ranking, chances=(chance, under_its_own)))
    return rounds.forward_step(noise, fit, [], None)


def test_a_round_goes_on_where_its_best_is_not_likely_by_chance(
        monkeypatch: pytest.MonkeyPatch) -> None:
    """However little it gains: noise of the base may have taken the place of the effect."""
    with pytest.raises(_WentOnError):
        _step(monkeypatch, 0.3, 0.1)


def test_a_round_ends_where_its_best_is_likely_by_chance(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever noise of its own would leave, it is not looked for."""
    found = _step(monkeypatch, 0.9, 1e-9)
    assert not found.adopted
    assert found.chance == 0.9


def test_a_round_ends_where_its_best_is_likely_by_chance_under_its_own_noise(
        monkeypatch: pytest.MonkeyPatch) -> None:
    """No rival is looked at once more, unless the base may have taken the effect's place."""
    found = _step(monkeypatch, 0.3, 0.4)
    assert not found.adopted
    assert found.chance == 0.4
    with pytest.raises(_WentOnError):
        _step(monkeypatch, 0.3, 0.4, distorted=True)
