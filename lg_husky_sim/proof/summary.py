# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of a whole trial: rates with Wilson intervals, medians, the confusion matrix."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import math
from typing import Any

from lg_husky_sim.proof import catalogue
from lg_husky_sim.proof.measures import wilson
from lg_husky_sim.proof.scoring import Judgement
import numpy as np
from numpy.typing import NDArray

WITH_BASELINE = ('g2', 'g3')
"""Worlds whose robots are asked what changed since baseline recordings."""


@dataclass(frozen=True)
class Rate:
    """A proportion: `hits` of `count`, wanted at least (or, `at_most`, at most) `target`."""

    name: str
    hits: int
    count: int
    target: float | None = None
    at_most: bool = False

    @property
    def value(self) -> float:
        """The proportion; not a number without any case."""
        return self.hits / self.count if self.count else math.nan

    @property
    def reached(self) -> bool | None:
        """Whether the target is met; None without target or case."""
        if self.target is None or not self.count:
            return None
        return self.value <= self.target if self.at_most else self.value >= self.target

    def as_json(self) -> dict[str, Any]:
        """Return the rate with its 95 % interval."""
        low, high = wilson(self.hits, self.count)
        return {'name': self.name, 'hits': self.hits, 'count': self.count,
                'value': self.value if self.count else None, 'low': low, 'high': high,
                'target': self.target, 'at_most': self.at_most, 'reached': self.reached}


def _rate(name: str, cases: Sequence[Judgement], right: Callable[[Judgement], bool],
          target: float | None = None, at_most: bool = False) -> Rate:
    return Rate(name, sum(right(case) for case in cases), len(cases), target, at_most)


def rates(cases: Sequence[Judgement]) -> tuple[Rate, ...]:
    """Return all rates of a set of judged cases, with the targets of the project."""
    singles = [case for case in cases if case.kind == 'single']
    clear = [case for case in singles if case.severities != ('weak',)]
    weak = [case for case in singles if case.severities == ('weak',)]
    clean = [case for case in cases if case.kind == 'clean']
    pairs = [case for case in cases if case.kind == 'pair']
    outside = [case for case in cases if case.kind == 'outside']
    timed = [case for case in singles if case.onset_kind == 'time' and case.top1]
    placed = [case for case in singles if case.onset_kind == 'place' and case.top1]
    sided = [case for case in cases if case.side is not None]
    whole = [case for case in cases if case.onset_kind == 'none' and case.kind != 'clean']
    return (
        _rate('medium and strong: named right', clear, lambda c: c.top1, 0.80),
        _rate('medium and strong: among the first two or declared inseparable', clear,
              lambda c: c.top2, 0.92),
        _rate('medium and strong: the same, or the nearest entry of an "unknown"', clear,
              lambda c: c.nearest),
        _rate('medium and strong: subsystem right', clear, lambda c: c.subsystem, 0.92),
        _rate('weak: named right', weak, lambda c: c.top1),
        _rate('weak: named right, nothing or unknown, and no wrong name', weak,
              lambda c: not c.extra and (c.top1 or c.first in ('nothing', 'unknown'))),
        _rate('medium and strong, named right: another effect named beside',
              [c for c in clear if c.top1], lambda c: c.extra > 0),
        _rate('clean: named, called unknown or failed (false alarm)', clean,
              lambda c: c.verdict != 'nothing_missing', 0.05, at_most=True),
        _rate('pairs: at least one right', pairs, lambda c: c.found >= 1, 0.90),
        _rate('pairs: both right', pairs, lambda c: c.found >= 2, 0.60),
        _rate('pairs: an effect named that is not there', pairs, lambda c: c.extra > 0),
        _rate('outside the catalogue: unknown, or place right without a confident name',
              outside, lambda c: c.acceptable, 0.80),
        _rate('outside the catalogue: noticed', outside,
              lambda c: c.verdict in ('known', 'unknown')),
        _rate('side right where one side is hit and its effect named', sided,
              lambda c: bool(c.side)),
        _rate('onset in time within 0.5 s (effect named right)', timed,
              lambda c: (c.onset_error or 0.0) <= 0.5, 0.50),
        _rate('onset in time within 2 s (effect named right)', timed,
              lambda c: (c.onset_error or 0.0) <= 2.0, 0.90),
        _rate('onset at a place within 0.5 m (effect named right)', placed,
              lambda c: (c.onset_error or 0.0) <= 0.5),
        _rate('an onset said where there is none', whole, lambda c: c.onset_invented),
        _rate('no diagnosis, or no drive of its model (error)', cases,
              lambda c: bool(c.failed), 0.0, at_most=True),
    )


def _quantiles(values: Sequence[float]) -> dict[str, Any]:
    if not values:
        return {'count': 0, 'median': None, 'lower_quartile': None, 'upper_quartile': None}
    low, middle, high = (float(q) for q in np.quantile(values, [0.25, 0.5, 0.75]))
    return {'count': len(values), 'median': middle, 'lower_quartile': low,
            'upper_quartile': high}


def shares(cases: Sequence[Judgement]) -> dict[str, Any]:
    """
    Return medians and quartiles of the share of the achievable improvement.

    Against a baseline the share also counts what the diagnosis learnt of the base beforehand,
    which the plain model does not have: these cases stand apart, with the clean ones.
    """
    result = {}
    alone = [c for c in cases if c.world not in WITH_BASELINE]
    against = [c for c in cases if c.world in WITH_BASELINE]
    for name in ('all', 'position_m'):
        for label, chosen in (
                ('known effects', [c for c in alone if c.kind in ('single', 'pair')]),
                ('outside the catalogue', [c for c in alone if c.kind == 'outside']),
                ('against a baseline', [c for c in against if c.kind != 'clean']),
                ('against a baseline, clean', [c for c in against if c.kind == 'clean'])):
            values = [value for c in chosen if (value := c.shares.get(name)) is not None]
            result[f'{label}, {name}'] = _quantiles(values)
    return result


def seconds(cases: Sequence[Judgement]) -> dict[str, Any]:
    """Return median and quartiles of the run time [s], and the longest."""
    values = [case.seconds for case in cases if math.isfinite(case.seconds)]
    return {**_quantiles(values), 'longest': max(values) if values else None}


def by_effect(cases: Sequence[Judgement]) -> dict[str, Any]:
    """
    Return, for each hidden effect alone, how often it was named right and as what else.

    The median share is that of the robots that come without a baseline.
    """
    result: dict[str, Any] = {}
    for case in cases:
        if case.kind not in ('single', 'outside'):
            continue
        row = result.setdefault(case.effects[0], {
            'count': 0, 'right': 0, 'subsystem': 0, 'named': {}, 'shares': []})
        row['count'] += 1
        row['right'] += case.top1
        row['subsystem'] += case.subsystem
        row['named'][case.first] = row['named'].get(case.first, 0) + 1
        if case.shares.get('all') is not None and case.world not in WITH_BASELINE:
            row['shares'].append(case.shares['all'])
    for row in result.values():
        row['median_share'] = float(np.median(row['shares'])) if row['shares'] else None
        del row['shares']
    return dict(sorted(result.items()))


def confusion(cases: Sequence[Judgement]) -> tuple[list[str], list[str], NDArray[np.int64]]:
    """
    Return rows (hidden), columns (named first) and counts of the confusion matrix.

    Pairs are left out; the last columns are 'unknown', 'nothing' and 'failed'.
    """
    order = list(catalogue.SUBSYSTEM)
    hidden = {case.effects[0] if case.effects else 'clean'
              for case in cases if case.kind != 'pair'}
    rows = [name for name in order if name in hidden]
    rows += ['clean'] * ('clean' in hidden)
    rows += [name for name in catalogue.OUTSIDE if name in hidden]
    columns = [*order, 'unknown', 'nothing', 'failed']
    counts = np.zeros((len(rows), len(columns)), dtype=np.int64)
    for case in cases:
        if case.kind == 'pair':
            continue
        row = rows.index(case.effects[0] if case.effects else 'clean')
        first = case.first if case.first in columns else 'failed'
        counts[row, columns.index(first)] += 1
    return rows, columns, counts


def summarise(cases: Sequence[Judgement]) -> dict[str, Any]:
    """Return everything that the page and the results file say, as JSON's own types."""
    rows, columns, counts = confusion(cases)
    worlds = sorted({case.world for case in cases})
    return {
        'cases': len(cases),
        'kinds': {kind: sum(case.kind == kind for case in cases)
                  for kind in ('single', 'pair', 'clean', 'outside')},
        'rates': [rate.as_json() for rate in rates(cases)],
        'by_world': {world: [rate.as_json() for rate in rates(
            [case for case in cases if case.world == world])] for world in worlds},
        'shares': shares(cases), 'seconds': seconds(cases), 'by_effect': by_effect(cases),
        'confusion': {'hidden': rows, 'named': columns, 'counts': counts.tolist()},
    }
