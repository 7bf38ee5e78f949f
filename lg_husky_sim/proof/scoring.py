# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Compare sealed answers with diagnoses, case by case."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math
from pathlib import PurePath
from typing import Any

from lg_husky_sim.proof import catalogue
from lg_husky_sim.proof.measures import share

CONFIDENT = 0.9
Json = Mapping[str, Any]


@dataclass(frozen=True)
class Judgement:
    """
    One case, judged.

    Attributes
    ----------
    case, kind, world, drive, effects, severities
        The case, as the answer says.
    failed
        Why there is no diagnosis, or no drive of its model, or ''.
    verdict
        'nothing_missing', 'known', 'unknown' or '' (failed).
    named
        Effects that were named, in order; 'unknown' where the finding says so.
    first
        `named` or inner ones: the first name, 'unknown', 'nothing' or 'failed'.
    top1, top2, nearest, subsystem, side
        The first name, one of the first two or declared inseparable, the same or the nearest
        entry of an "unknown", the first subsystem, the side are right (None: not asked).
    found
        How many of the hidden effects are among the names.
    extra
        Known effects that were named and are not there.
    acceptable
        For a kind outside the catalogue: called unknown, or the right subsystem without a
        confident wrong name.
    onset_kind
        True kind of onset.
    onset_error
        Seconds or metres; infinite where no onset or the wrong recording was given; None
        where there is no onset to find.
    onset_invented
        An onset was given where there is none.
    shares
        Share of the achievable held-out improvement ('all' and 'position_m'), None where
        nothing could be gained; 0 where a failure left nothing to measure.
    seconds
        Run time of the diagnosis.

    """

    case: str
    kind: str
    world: str
    drive: str
    effects: tuple[str, ...]
    severities: tuple[str, ...]
    failed: str
    verdict: str
    named: tuple[str, ...]
    first: str
    top1: bool
    top2: bool
    nearest: bool
    subsystem: bool
    side: bool | None
    found: int
    extra: int
    acceptable: bool
    onset_kind: str
    onset_error: float | None
    onset_invented: bool
    shares: Mapping[str, float | None]
    seconds: float


def _declared(diagnosis: Json, named: str, truth: str) -> bool:
    """Tell whether the diagnosis says that `named` and `truth` cannot be told apart."""
    return any({named, truth} <= set(item.get('effects', ()))
               for item in diagnosis.get('indistinguishable', ()))


def _second(findings: Sequence[Json]) -> str:
    """Return the name that stands second: the next finding, else the best rival, or ''."""
    if len(findings) > 1:
        return str(findings[1].get('effect'))
    rivals = findings[0].get('rivals') or () if findings else ()
    best: Json = max(rivals, default={}, key=lambda rival: float(
        rival.get('held_out_gain_nats') or -math.inf))
    return str(best.get('effect', ''))


def _onset_error(truth: Json, findings: Sequence[Json]) -> float:
    best = math.inf
    for finding in findings:
        said = finding.get('onset') or {}
        if said.get('kind') != truth['kind']:
            continue
        if truth['kind'] == 'time' and said.get('time_s') is not None:
            if PurePath(str(said.get('recording'))).name == truth['recording']:
                best = min(best, abs(float(said['time_s']) - float(truth['time_s'])))
        elif truth['kind'] == 'place' and said.get('x_m') is not None:
            best = min(best, abs(float(said['x_m']) - float(truth['x_m'])))
    return best


def _begins_later(said: Json) -> bool:
    """Tell an onset from "all along": a change since the baseline may begin with the first."""
    if said.get('kind', 'none') == 'time' and said.get('time_s') is not None:
        return not (PurePath(str(said.get('recording'))).name == 'rec1'
                    and float(said['time_s']) < 1.0)
    return str(said.get('kind', 'none')) != 'none'


def _shares(held_out: Sequence[Json], failed: bool) -> dict[str, float | None]:
    if failed and not held_out:
        return dict.fromkeys(('all', 'position_m'), 0.0)
    result: dict[str, float | None] = {}
    for name in ('all', 'position_m'):
        sums = {who: math.sqrt(sum(float(item[who][name]) ** 2 for item in held_out))
                for who in ('plain', 'augmented', 'truth')} if held_out else {}
        result[name] = share(sums['plain'], sums['augmented'], sums['truth']) if sums else None
    return result


def judge(answer: Json, outcome: Json) -> Judgement:
    """
    Judge one case.

    Parameters
    ----------
    answer
        The sealed answer (`cases.generate`).
    outcome
        What came of it (`trial.diagnose`): 'diagnosis' (diagnosis.json or None), 'error',
        'seconds' and 'held_out' (list of 'plain', 'augmented', 'truth' errors).

    """
    spec = answer['spec']
    hidden = [item['effect'] for item in answer['effects']]
    diagnosis: Json = outcome.get('diagnosis') or {}
    findings: Sequence[Json] = diagnosis.get('findings') or ()
    verdict = str(diagnosis.get('verdict', ''))
    named = tuple(str(finding.get('effect')) for finding in findings)
    first = named[0] if named else ('nothing' if verdict == 'nothing_missing' else verdict)
    if not diagnosis:
        first = 'failed'
    if verdict == 'unknown':
        first = 'unknown'
    known = [name for name in named if name in catalogue.SUBSYSTEM]
    truths = set(hidden)
    top1 = bool(hidden) and first in truths
    second = _second(findings) in truths or any(
        _declared(diagnosis, name, truth) for name in named[:1] for truth in hidden)
    # Rivals of an "unknown" were refused as names.
    top2, nearest = top1 or (second and verdict == 'known'), top1 or second
    failed = str(outcome.get('error') or outcome.get('held_out_error') or '')
    places = {catalogue.subsystem(name) for name in hidden}
    place = str(findings[0].get('subsystem')) if findings else ''
    right_place = place in places
    confidence = float(diagnosis.get('confidence') or 0.0)
    acceptable = verdict == 'unknown' or (
        right_place and not (known and confidence >= CONFIDENT))
    sides = {item['effect']: item['side'] for item in answer['effects']}
    side: bool | None = None
    for finding in findings:
        if sides.get(str(finding.get('effect'))) in ('left', 'right'):
            side = finding.get('side') == sides[str(finding['effect'])]
    onset = answer['onset']
    error = _onset_error(onset, findings) if onset['kind'] != 'none' else None
    invented = onset['kind'] == 'none' and any(
        _begins_later(finding.get('onset') or {}) for finding in findings)
    return Judgement(
        case=str(answer['case']), kind=spec['kind'], world=spec['world'], drive=spec['drive'],
        effects=tuple(hidden),
        severities=tuple(item['severity'] for item in answer['effects']),
        failed=failed, verdict=verdict, named=named, first=first,
        top1=top1, top2=top2, nearest=nearest, subsystem=right_place, side=side,
        found=len(truths & set(named)), extra=len([n for n in known if n not in truths]),
        acceptable=acceptable and bool(diagnosis), onset_kind=onset['kind'],
        onset_error=error, onset_invented=invented,
        shares=_shares(outcome.get('held_out') or (), bool(failed)),
        seconds=float(outcome.get('seconds') or math.nan))
