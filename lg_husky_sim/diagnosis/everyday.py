# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
What every robot has a little of.

Gears rub, cables have a resistance, one wheel is worn more than the other. Enough data show it,
and a model is better with it; but a robot of which that is all that can be said lacks nothing.
Effects up to the sizes that ``config/effects.yaml`` calls everyday stay in the model and are not
named.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from lg_husky_sim.diagnosis.candidates import neutral
from lg_husky_sim.diagnosis.rounds import Round
from lg_husky_sim.diagnosis.search import Search
from lg_husky_sim.diagnosis.unnamed import Unnamed
from lg_husky_sim.husky.effects import Effect, EffectParameter, LATER


def is_everyday(effect: Effect, numbers: Mapping[str, float]) -> bool:
    """
    Return whether there is no more of an effect than every robot has.

    Parameters
    ----------
    effect : Effect
        One with numbers of its own since a change counts by how much these have changed.
    numbers : mapping of str to float
        Of the model that it is in.

    Returns
    -------
    bool
    """
    def usual(p: EffectParameter) -> float:
        return numbers[p.name.removesuffix(LATER)] if effect.again else neutral(p.name)

    return all(abs(numbers[p.name] - usual(p)) <= p.everyday
               for p in effect.parameters() if not p.fixed)


def named_rounds(search: Search) -> tuple[Round, ...]:
    """Return the rounds whose effect was adopted and is more than everyday."""
    return tuple(r for r in search.rounds if r.adopted and not _is_little(search, r))


def open_rounds(search: Search) -> tuple[Round, ...]:
    """Return all rounds but those that adopted something everyday."""
    return tuple(r for r in search.rounds if not (r.adopted and _is_little(search, r)))


def most_tried(search: Search) -> float:
    """Return the most that an effect beyond everyday sizes gained where none was named [nats]."""
    return max((r.evidence for r in open_rounds(search)[0].rivals
                if not is_everyday(r.effect, r.fit.parameters)), default=0.0)


def everyday_words(search: Search) -> str:
    """Return in words what everyday effects were adopted; empty without any."""
    found = []
    for effect in (r.rivals[0].effect for r in search.rounds
                   if r.adopted and _is_little(search, r)):
        numbers = ', '.join(f'{p.name.replace("_", " ")} {search.final.parameters[p.name]:.3g} '
                            f'{p.unit}' for p in effect.parameters() if not p.fixed)
        side = '' if effect.side == 'none' else f', {effect.side}'
        found.append(f'{effect.id}{side} ({numbers})')
    return ', '.join(found)


def more_than_everyday(unnamed: Unnamed) -> Unnamed:
    """Return the descriptions whose effort somewhere exceeds what every robot has."""
    return replace(unnamed, descriptions=tuple(
        d for d in unnamed.descriptions
        if max(map(abs, d.knots)) > d.effect.kind.parameters[-1].everyday))


def _is_little(search: Search, one: Round) -> bool:
    return is_everyday(one.rivals[0].effect, search.final.parameters)
