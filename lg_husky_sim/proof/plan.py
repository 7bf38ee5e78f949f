# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Which cases a trial consists of, balanced over effects, severities, floors and sensors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from lg_husky_sim.errors import CommandError
from lg_husky_sim.proof import catalogue, conventions
from lg_husky_sim.proof.cases import Spec, WORLDS
from lg_husky_sim.proof.settings import settings
import numpy as np

Rng = np.random.Generator


def first_report_seed() -> int:
    """Return the first seed of reports; those below are for tuning."""
    return int(settings()['plan']['first_report_seed'])


def check_seeds(seed: int, cases: int, report: bool) -> None:
    """
    Keep tuning and reporting apart, and reported seeds spent.

    Raises
    ------
    CommandError
        The seeds do not belong to what the trial is for.

    """
    first, last = first_report_seed(), seed + cases - 1
    if report and seed < first:
        raise CommandError(f'seed = {seed} is a tuning seed; a report needs {first} or more')
    if not report and last >= first:
        raise CommandError(f'seeds {seed} to {last} reach the reporting seeds; tuning '
                           f'must stay below {first}')
    for low, high in settings()['plan']['spent']:
        if report and seed <= high and last >= low:
            raise CommandError(f'seeds {seed} to {last} reach {low} to {high}, which were '
                               'reported before; a reported set is used once')


class Deck:
    """Draw without putting back, until every card has come up."""

    def __init__(self, rng: Rng) -> None:
        self.rng, self.decks = rng, dict[str, list[Any]]()

    def draw(self, key: str, cards: Sequence[Any]) -> Any:
        """Return the next of some cards, which are shuffled again when all are out."""
        if not self.decks.get(key):
            self.decks[key] = [cards[int(k)] for k in self.rng.permutation(len(cards))]
        return self.decks[key].pop()


def _pick(rng: Rng, shares: Mapping[str, float]) -> str:
    total = sum(shares.values())
    return str(rng.choice(list(shares), p=[share / total for share in shares.values()]))


def _worlds(world: str, tuning: bool, rng: Rng) -> str:
    if world != 'mix':
        return world
    left_out = conventions.left_out('worlds', tuning)
    return _pick(rng, {name: float(share) for name, share in settings()['plan']['worlds'].items()
                       if name not in left_out})


def plan(count: int, seed: int, world: str = 'g1', tuning: bool = True) -> tuple[Spec, ...]:
    """
    Return the cases of a trial, in random order.

    Every effect of the catalogue comes up equally often (within one), severities in
    the proportion weak 1, medium 2, strong 2, and clean robots on every floor with every
    kind of wheel speeds. Where a case's drives cannot show its effect,
    `trial.prepare` draws another one.

    Parameters
    ----------
    count
        Number of cases.
    seed
        Seed of the first case; the k-th has `seed + k`.
    world
        One of `cases.WORLDS`, or 'mix'.
    tuning
        Leave out the families that tuning may not see.

    Raises
    ------
    CommandError
        The world is left out of tuning.

    """
    numbers = settings()['plan']
    if world != 'mix' and world in conventions.left_out('worlds', tuning):
        raise CommandError(f'world {world} is left out of tuning; it is for reports only')
    if world not in (*WORLDS, 'mix'):
        raise CommandError(f'world = {world!r} is none of {", ".join((*WORLDS, "mix"))}')
    rng = np.random.default_rng([seed, 77])
    deck = Deck(rng)
    kinds: list[str] = []
    for kind, share in numbers['shares'].items():
        if kind != 'single':
            kinds += [kind] * round(float(share) * count)
    kinds += ['single'] * (count - len(kinds))
    kinds = [str(kind) for kind in rng.permutation(kinds)]
    return tuple(_spec(seed + k, kind, _worlds(world, tuning, rng), tuning, deck)
                 for k, kind in enumerate(kinds))


def _spec(seed: int, kind: str, where: str, tuning: bool, deck: Deck) -> Spec:
    numbers = settings()['plan']
    chosen: tuple[str, ...] = ()
    severity = floor = wheels = ''
    if kind in ('single', 'outside'):
        names = sorted(catalogue.SUBSYSTEM if kind == 'single' else catalogue.OUTSIDE)
        absent = catalogue.absent_from(where)
        name = str(deck.draw(f'{kind} {where}', [name for name in names if name not in absent]))
        chosen = (name,)
        known = kind == 'single' and where == 'g1'
        severity = str(deck.draw(f'severity {name}', numbers['severities']) if known
                       else deck.rng.choice(['medium', 'strong']))
    elif kind == 'clean':
        axes = settings()['conventions']
        floor = str(deck.draw('floor', list(axes['floor']['levels'])))
        wheels = str(deck.draw('wheels', [
            name for name in axes['wheels']['kinds']
            if name not in conventions.left_out('wheels', tuning)]))
    long = deck.rng.random() < float(numbers['long'])
    low, high = settings()['conventions']['seconds'] if long else numbers['seconds']
    return Spec(seed, kind, where, _pick(deck.rng, numbers['drives']), chosen, severity,
                tuning=tuning, floor=floor, wheels=wheels, seconds=(float(low), float(high)))
