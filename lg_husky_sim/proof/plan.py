# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Which cases a trial consists of, balanced over effects, severities and drives."""

from __future__ import annotations

from lg_husky_sim.errors import CommandError
from lg_husky_sim.proof import catalogue
from lg_husky_sim.proof.cases import Spec
import numpy as np

FIRST_REPORT_SEED = 10_000
# Of every case: share of singles, clean, pairs, outside.
_SHARES = (('single', 0.62), ('clean', 0.15), ('pair', 0.13), ('outside', 0.10))
_LEVELS = ('medium', 'strong', 'weak', 'medium', 'strong')


def check_seeds(seed: int, cases: int, report: bool) -> None:
    """
    Keep tuning and reporting apart: seeds below 10000 are for tuning only.

    Raises
    ------
    CommandError
        The seeds do not belong to what the trial is for.

    """
    last = seed + cases - 1
    if report and seed < FIRST_REPORT_SEED:
        raise CommandError(f'seed = {seed} is a tuning seed; a report needs '
                           f'{FIRST_REPORT_SEED} or more')
    if not report and last >= FIRST_REPORT_SEED:
        raise CommandError(f'seeds {seed} to {last} reach the reporting seeds; tuning '
                           f'must stay below {FIRST_REPORT_SEED}')


def _worlds(world: str, count: int, rng: np.random.Generator) -> list[str]:
    if world != 'mix':
        return [world] * count
    return [str(name) for name in rng.choice(['g1', 'g2', 'g3'], count, p=[0.7, 0.12, 0.18])]


def plan(count: int, seed: int, world: str = 'g1', drive: str = 'mix') -> tuple[Spec, ...]:
    """
    Return the cases of a trial, in random order.

    Every effect of the catalogue comes up equally often (within one), severities in
    the proportion weak 1, medium 2, strong 2. Where a case's drives cannot show its effect,
    `trial.prepare` draws another one.

    Parameters
    ----------
    count
        Number of cases.
    seed
        Seed of the first case; the k-th has `seed + k`.
    world
        'g1', 'g2', 'g3' or 'mix'.
    drive
        'paper', 'full', 'drive-like' or 'mix'.

    """
    rng = np.random.default_rng([seed, 77])
    kinds: list[str] = []
    for kind, share in _SHARES[1:]:
        kinds += [kind] * round(share * count)
    kinds += ['single'] * (count - len(kinds))
    kinds = [str(kind) for kind in rng.permutation(kinds)]
    decks: dict[str, list[str]] = {}
    result = []
    for k, (kind, where) in enumerate(zip(kinds, _worlds(world, count, rng), strict=True)):
        chosen: tuple[str, ...] = ()
        severity = ''
        if kind in ('single', 'outside'):
            name = _next(decks, kind, where, rng)
            severity = _severity(decks, name, kind, where, rng)
            chosen = (name,)
        which = drive
        if drive == 'mix':
            which = str(rng.choice(['paper', 'full', 'drive-like'], p=[0.5, 0.38, 0.12]))
        result.append(Spec(seed + k, kind, where, which, chosen, severity))
    return tuple(result)


def _next(decks: dict[str, list[str]], kind: str, where: str, rng: np.random.Generator) -> str:
    """Draw without putting back, until every name has come up."""
    key = f'{kind} {where}'
    if not decks.get(key):
        names = sorted(catalogue.SUBSYSTEM if kind == 'single' else catalogue.OUTSIDE)
        names = [name for name in names if name not in catalogue.absent_from(where)]
        decks[key] = [str(name) for name in rng.permutation(names)]
    return decks[key].pop()


def _severity(decks: dict[str, list[str]], name: str, kind: str, where: str,
              rng: np.random.Generator) -> str:
    if kind == 'outside' or where != 'g1':
        return str(rng.choice(['medium', 'strong']))
    key = f'severity {name}'
    if not decks.get(key):
        decks[key] = [str(level) for level in rng.permutation(_LEVELS)]
    return decks[key].pop()
