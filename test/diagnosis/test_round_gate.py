# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""When a round of the search ends before hypotheses are compared under a noise of their own."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from lg_husky_sim.diagnosis.selection import rounds
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.effects import Subsystem
import pytest

FIRST = 10000.0
#: What a further effect of the body, and one of the tyres, has to gain [nats].
BODY, TYRES = (setting(name) * FIRST for name in ('least_part', 'least_apart'))
SHARE = setting('rough_share')


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


def _tried(seen: float, subsystem: Subsystem) -> Any:
    kind = SimpleNamespace(subsystem=subsystem)
    fit = SimpleNamespace(point=SimpleNamespace(), slopes=())
    return SimpleNamespace(score=seen, gain=seen, fit=fit,
                           hypothesis=SimpleNamespace(effect=SimpleNamespace(kind=kind)))


def _step(monkeypatch: pytest.MonkeyPatch, seen: float, own: float, *, tyres: float = 0.0,
          chance: float = 0.0, first: float = FIRST) -> rounds.Round:
    # A round whose best effect, of the body, gains `seen` under the noise of the base, and `own`
    # under its own; one of the tyres gains `tyres`.
    tried = [_tried(seen, Subsystem.TRANSLATION), _tried(tyres, Subsystem.TRACTION)]
    noise: Any = _Noise(own)
    monkeypatch.setattr(rounds, '_looks', lambda *_: [])
    monkeypatch.setattr(rounds, 'fitted', lambda *_, **__: tried)
    monkeypatch.setattr(rounds, 'with_jitter', lambda point, _: point)
    monkeypatch.setattr(rounds, '_chance', lambda *_: chance)
    return rounds.forward_step(noise, tried[0].fit, [], None, first)


@pytest.mark.parametrize(('seen', 'own', 'tyres'), [
    (0.9 * SHARE * BODY, 1.1 * BODY, 0.0), (1.1 * SHARE * BODY, 0.0, 0.0),
    (0.9 * SHARE * BODY, 0.0, 1.1 * SHARE * TYRES)])
def test_a_round_goes_on_where_an_effect_may_gain_what_it_needs(
        monkeypatch: pytest.MonkeyPatch, seen: float, own: float, tyres: float) -> None:
    """Noise of the base that has taken the place of an effect does not end the round."""
    with pytest.raises(_WentOnError):
        _step(monkeypatch, seen, own, tyres=tyres)


def test_a_round_ends_where_no_effect_may(monkeypatch: pytest.MonkeyPatch) -> None:
    """What gains too little beside a first effect under either noise is not compared further."""
    found = _step(monkeypatch, 0.9 * SHARE * BODY, 0.9 * BODY, tyres=0.9 * SHARE * TYRES)
    assert not found.adopted
    assert len(found.tried) == 2


def test_a_first_effect_needs_no_part_of_another(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a first effect, all that is not likely by chance is compared."""
    with pytest.raises(_WentOnError):
        _step(monkeypatch, 1.0, 1.0, first=0.0)


def test_a_round_ends_where_its_best_is_likely_by_chance(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever noise of its own would leave, it is not looked for."""
    found = _step(monkeypatch, 10.0 * BODY, 10.0 * BODY, chance=0.9)
    assert not found.adopted
    assert found.chance == 0.9
