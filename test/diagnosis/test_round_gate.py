# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""When a round of the search ends before hypotheses are compared under a noise of their own."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from lg_husky_sim.diagnosis.selection import rounds
from lg_husky_sim.diagnosis.settings import setting
import pytest

FIRST = 10000.0
#: What a further effect needs, before the rest of the model is fitted with it [nats].
NEEDED = setting('rough_share') * setting('least_apart') * FIRST


class _WentOnError(Exception):
    """The round compares hypotheses under a noise of their own."""


class _Noise:
    """Noise under which the base is by so much less likely than the effect."""

    def __init__(self, gain: float) -> None:
        self.gain = gain

    def renoised(self, fit: object) -> _Noise:
        del fit
        return self

    def surprise(self, base: object) -> float:
        del base
        return self.gain

    def surprise_at(self, point: object) -> float:
        del point
        return 0.0

    def fit(self, point: object, slopes: object) -> object:
        raise _WentOnError


def _step(monkeypatch: pytest.MonkeyPatch, seen: float, own: float, chance: float = 0.0,
          first: float = FIRST) -> rounds.Round:
    # A round whose best effect gains `seen` under the noise of the base, `own` under its own.
    fit: Any = SimpleNamespace(point=SimpleNamespace(), slopes=())
    tried: Any = SimpleNamespace(score=seen, gain=seen, fit=fit)
    noise: Any = _Noise(own)
    monkeypatch.setattr(rounds, '_looks', lambda *_: [])
    monkeypatch.setattr(rounds, 'fitted', lambda *_, **__: [tried])
    monkeypatch.setattr(rounds, 'with_jitter', lambda point, _: point)
    monkeypatch.setattr(rounds, '_chance', lambda *_: chance)
    return rounds.forward_step(noise, fit, [], None, first)


@pytest.mark.parametrize(('seen', 'own'), [
    (0.1 * NEEDED, 1.1 * NEEDED), (1.1 * NEEDED, 0.1 * NEEDED), (1.1 * NEEDED, 1.1 * NEEDED)])
def test_a_round_goes_on_where_either_noise_leaves_a_gain(
        monkeypatch: pytest.MonkeyPatch, seen: float, own: float) -> None:
    """Noise of the base that has taken the place of an effect does not end the round."""
    with pytest.raises(_WentOnError):
        _step(monkeypatch, seen, own)


def test_a_round_ends_where_neither_noise_leaves_a_gain(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside a first effect, what gains too little of it under both is not compared further."""
    found = _step(monkeypatch, 0.9 * NEEDED, 0.9 * NEEDED)
    assert not found.adopted
    assert len(found.tried) == 1


def test_a_first_effect_needs_no_part_of_another(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a first effect, all that is not likely by chance is compared."""
    with pytest.raises(_WentOnError):
        _step(monkeypatch, 1.0, 1.0, first=0.0)


def test_a_round_ends_where_its_best_is_likely_by_chance(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever noise of its own would leave, it is not looked for."""
    found = _step(monkeypatch, 10.0 * NEEDED, 10.0 * NEEDED, chance=0.9)
    assert not found.adopted
    assert found.chance == 0.9
