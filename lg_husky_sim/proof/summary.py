# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of trials: rates with Wilson intervals, by world and regime, reliability, confusion."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
import math
from typing import Any

from lg_husky_sim.proof import catalogue
from lg_husky_sim.proof.measures import wilson
from lg_husky_sim.proof.scoring import Judgement, Mark
from lg_husky_sim.proof.settings import settings
import numpy as np

Cases = Sequence[Judgement]


@dataclass(frozen=True)
class Rate:
    """A proportion: `hits` of `count`; `target` is one of `config/blind_trial.yaml` or ''."""

    name: str
    hits: float
    count: int
    target: str = ''

    @property
    def bar(self) -> tuple[float, bool] | None:
        """Return the number aimed at, and whether it is an upper one."""
        numbers: Mapping[str, float] = settings()['targets'].get(self.target, {})
        for key, at_most in (('least', False), ('most', True)):
            if key in numbers:
                return float(numbers[key]), at_most
        return None

    def as_json(self) -> dict[str, Any]:
        """Return the rate with its 95 % interval."""
        low, high = wilson(self.hits, self.count)
        value = self.hits / self.count if self.count else None
        bar = self.bar
        reached = None
        if bar is not None and value is not None:
            reached = value <= bar[0] if bar[1] else value >= bar[0]
        return {'name': self.name, 'hits': self.hits, 'count': self.count, 'value': value,
                'low': low, 'high': high, 'target': bar[0] if bar else None,
                'at_most': bool(bar and bar[1]), 'reached': reached}


def _rate(name: str, cases: Cases, right: Callable[[Judgement], float | bool],
          target: str = '') -> Rate:
    return Rate(name, float(sum(right(case) for case in cases)), len(cases), target)


def _first(case: Judgement) -> Mark:
    return case.marks[0]


def _visible(cases: Cases) -> list[Judgement]:
    """Return the cases whose effect can be seen, and was missed or claimed for certain."""
    return [case for case in cases if case.level != 'undetectable'
            and not (case.level == 'weak' and case.right is None)]


def rates(cases: Cases) -> tuple[Rate, ...]:
    """Return all rates of a set of judged cases, with the targets of the project."""
    singles = _visible([case for case in cases if case.kind == 'single'])
    strong = [case for case in singles if _first(case).severity != 'weak']
    clean = [case for case in cases if case.kind == 'none']
    pairs = [case for case in cases if case.kind == 'pair']
    outside = [case for case in cases if case.kind == 'outside']
    changed = [case for case in cases if case.kind == 'before_after']
    timed = [c for c in singles if _first(c).onset_kind == 'time' and _first(c).outright]
    placed = [c for c in singles if _first(c).onset_kind == 'place' and _first(c).outright]
    whole = [c for c in cases if c.claim and c.level != 'clean'
             and all(mark.onset is None for mark in c.marks)]
    within = settings()['marks']
    return (
        _rate('single effects: named right', singles, lambda c: _first(c).outright, 'singles'),
        _rate('single effects: with half marks for related names', singles,
              lambda c: _first(c).named),
        _rate('medium and strong: named right', strong, lambda c: _first(c).outright, 'clear'),
        _rate('single effects: among the first two or declared indistinguishable', singles,
              lambda c: _first(c).considered, 'first_two'),
        _rate('single effects: part right', singles, lambda c: _first(c).part, 'part'),
        _rate('single effects: called unknown', singles, lambda c: c.first == 'unknown',
              'known_called_unknown'),
        _rate('single effects, named right: with an additional effect',
              [c for c in singles if _first(c).outright], lambda c: c.extra > 0),
        _rate('clean robots: named, called unknown or failed (false alarm)', clean,
              lambda c: c.claim or bool(c.failed), 'false_alarms'),
        _rate('pairs: at least one right', pairs,
              lambda c: any(mark.named == 1.0 for mark in c.marks), 'pair_one'),
        _rate('pairs: both right', pairs, lambda c: c.right or 0.0, 'pair_both'),
        _rate('outside the catalogue: unknown, or part right', outside,
              lambda c: c.acceptable, 'outside'),
        _rate('what changed: named right', [c for c in changed if c.level != 'clean'],
              lambda c: c.right or 0.0, 'changed'),
        _rate('what changed: an unchanged robot flagged',
              [c for c in changed if c.level == 'clean'],
              lambda c: c.claim or bool(c.failed), 'unchanged'),
        _rate('side right, of one-sided effects that are named',
              [c for c in singles if _first(c).side is not None],
              lambda c: bool(_first(c).side)),
        _rate('onset in time within 0.5 s (effect named right)', timed,
              lambda c: (_first(c).onset or 0.0) <= 0.5, 'onset_half_second'),
        _rate(f'onset in time within {within["onset_s"]:g} s (effect named right)', timed,
              lambda c: (_first(c).onset or 0.0) <= within['onset_s'], 'onset_two_seconds'),
        _rate(f'onset at a place within {within["onset_m"]:g} m (effect named right)', placed,
              lambda c: (_first(c).onset or 0.0) <= within['onset_m'], 'onset_place'),
        _rate('onset reported where there is none', whole, lambda c: c.onset_invented,
              'onset_invented'),
        _rate('undetectable effects: nothing, low confidence, or the right name',
              [c for c in cases if c.level == 'undetectable'],
              lambda c: c.timid or c.acceptable),
        _rate('no diagnosis (error)', cases, lambda c: bool(c.failed), 'failed'),
    )


def reliability(cases: Cases) -> dict[str, Any]:
    """
    Return stated confidence against share right in bins, and the calibration error.

    The expected calibration error is the mean over cases of |confidence - share right| of
    their bin (Guo and others, On calibration of modern neural networks, ICML 2017).
    """
    number = int(settings()['marks']['bins'])
    bins: dict[int, list[tuple[float, float]]] = {}
    for case in cases:
        if case.confidence is not None and case.right is not None:
            k = min(int(case.confidence * number), number - 1)
            bins.setdefault(k, []).append((case.confidence, case.right))
    total = sum(len(rows) for rows in bins.values())
    table = []
    error = 0.0
    for k in sorted(bins):
        stated, right = (math.fsum(row[j] for row in bins[k]) for j in (0, 1))
        error += abs(stated - right)
        low, high = wilson(right, len(bins[k]))
        table.append({'from': k / number, 'to': (k + 1) / number, 'count': len(bins[k]),
                      'stated': stated / len(bins[k]), 'right': right / len(bins[k]),
                      'low': low, 'high': high})
    means = {}
    for name, wanted in (('right', 1.0), ('wrong', 0.0)):
        values = [c for rows in bins.values() for c, r in rows if r == wanted]
        means[name] = sum(values) / len(values) if values else None
    return {'bins': table, 'cases': total, 'error': error / total if total else None,
            'mean_when_right': means['right'], 'mean_when_wrong': means['wrong'],
            'target': float(settings()['targets']['calibration_error']['most'])}


def by_regime(cases: Cases) -> list[dict[str, Any]]:
    """Return, for each axis and family, singles named right and clean robots flagged."""
    groups: dict[tuple[str, str], list[Judgement]] = {}
    for case in cases:
        groups.setdefault(('world', case.world), []).append(case)
        for axis, family in case.regime.items():
            groups.setdefault((axis, family), []).append(case)
        for family in case.unseen or ('none of them',):
            groups.setdefault(('left out of tuning', family), []).append(case)
    result = []
    for (axis, family), chosen in sorted(groups.items()):
        named = _rate('named', _visible([c for c in chosen if c.kind == 'single']),
                      lambda c: _first(c).outright)
        alarms = _rate('alarms', [c for c in chosen if c.level == 'clean'],
                       lambda c: c.claim or bool(c.failed))
        result.append({'axis': axis, 'family': family, 'named': named.as_json(),
                       'alarms': alarms.as_json()})
    return result


def _quantiles(values: Sequence[float]) -> dict[str, Any]:
    if not values:
        return {'count': 0, 'median': None, 'lower_quartile': None, 'upper_quartile': None}
    low, middle, high = (float(q) for q in np.quantile(values, [0.25, 0.5, 0.75]))
    return {'count': len(values), 'median': middle, 'lower_quartile': low,
            'upper_quartile': high}


def shares(cases: Cases) -> dict[str, Any]:
    """Return medians and quartiles of the share of the achievable improvement."""
    result = {}
    for name in ('all', 'position_m'):
        for label, kinds in (('known effects', ('single', 'pair')),
                             ('outside the catalogue', ('outside',))):
            values = [value for c in cases if c.kind in kinds
                      and (value := c.shares.get(name)) is not None]
            result[f'{label}, {name}'] = _quantiles(values)
    return result


def by_effect(cases: Cases) -> dict[str, Any]:
    """Return, for each effect alone, how often it was named right and as what else."""
    result: dict[str, Any] = {}
    for case in cases:
        if len(case.marks) != 1:
            continue
        one = _first(case)
        row = result.setdefault(one.effect, {'count': 0, 'right': 0, 'part': 0, 'named': {}})
        row['count'] += 1
        row['right'] += one.outright
        row['part'] += one.part
        row['named'][case.first] = row['named'].get(case.first, 0) + 1
    return dict(sorted(result.items()))


def confusion(cases: Cases) -> dict[str, Any]:
    """Return counts of what was named first (columns) for each effect alone (rows)."""
    alone = [case for case in cases if case.kind in ('single', 'outside', 'none')]
    known = list(catalogue.SUBSYSTEM)
    hidden = {_first(case).effect if case.marks else 'clean' for case in alone}
    rows = [name for name in (*known, *sorted(hidden - {*known, 'clean'}), 'clean')
            if name in hidden]
    said = {case.first for case in alone}
    columns = [name for name in (*known, *sorted(said - {*known, 'nothing', 'unknown', 'failed'}),
                                 'unknown', 'nothing', 'failed') if name in said]
    counts = np.zeros((len(rows), len(columns)), dtype=int)
    for case in alone:
        counts[rows.index(_first(case).effect if case.marks else 'clean'),
               columns.index(case.first)] += 1
    return {'hidden': rows, 'named': columns, 'counts': counts.tolist()}


def summarise(cases: Cases) -> dict[str, Any]:
    """Return all figures of a set of judged cases, as plain data."""
    worlds = sorted({case.world for case in cases})
    seconds = [case.seconds for case in cases if case.seconds > 0.0]
    return {
        'cases': len(cases),
        'kinds': {kind: sum(case.kind == kind for case in cases)
                  for kind in ('single', 'pair', 'none', 'outside', 'before_after')},
        'rates': [rate.as_json() for rate in rates(cases)],
        'by_world': {world: [rate.as_json() for rate in rates(
            [case for case in cases if case.world == world])] for world in worlds},
        'by_regime': by_regime(cases), 'reliability': reliability(cases),
        'shares': shares(cases), 'by_effect': by_effect(cases), 'confusion': confusion(cases),
        'seconds': {**_quantiles(seconds), 'longest': max(seconds, default=None)}}
