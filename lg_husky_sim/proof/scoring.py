# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Mark what was said of a case against what is true; the marks are those of the outside exams.

As many findings count as there are true effects, the strongest first. A name is worth 1, a
related one 0.5; where the true effect stands in one declared group of inseparable
effects with the named one, a related name is worth 1 and another 0.5.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import itertools
import math
from pathlib import PurePath
from typing import Any

from lg_husky_sim.proof import catalogue
from lg_husky_sim.proof.measures import share
from lg_husky_sim.proof.settings import settings

Json = Mapping[str, Any]


@dataclass(frozen=True)
class Mark:
    """
    One true effect against the finding that was matched to it.

    `named`: 0, 0.5 or 1; `outright` the right name; `considered` so among the first two or
    declared inseparable; `part` the right subsystem; `side` None where both are hit;
    `onset` its error [s or m], None where there is none to find.
    """

    effect: str
    known: bool
    severity: str
    named: float
    outright: bool
    considered: bool
    part: bool
    side: bool | None
    onset_kind: str
    onset: float | None


@dataclass(frozen=True)
class Judgement:
    """
    One case, marked.

    Attributes
    ----------
    case, kind, level, world, regime, unseen
        The case; `unseen` families were left out of tuning.
    first
        The first name, 'unknown', 'nothing' or 'failed'.
    said
        All names.
    claim
        Something was said to be missing.
    marks
        One a true effect.
    extra
        Known effects that were named and are not there.
    acceptable
        Of an effect outside the catalogue: unknown, or the right part everywhere.
    timid
        Nothing claimed, or without certainty.
    right
        0 or 1; None where it does not count (weak or undetectable, and timid).
    onset_invented
        An onset was given where there is none.
    confidence, failed, seconds, shares
        As stated; why there is no diagnosis; run time [s]; shares of the achievable
        held-out improvement ('all', 'position_m').

    """

    case: str
    kind: str
    level: str
    world: str
    regime: Mapping[str, str]
    unseen: tuple[str, ...]
    first: str
    said: tuple[str, ...]
    claim: bool
    marks: tuple[Mark, ...]
    extra: int
    acceptable: bool
    timid: bool
    right: float | None
    onset_invented: bool
    confidence: float | None
    failed: str
    seconds: float
    shares: Mapping[str, float | None]


def _credit(true: Json, said: str, groups: Sequence[set[str]]) -> float:
    """Return what a name is worth."""
    if said == true['effect'] or (said == 'unknown' and not true['in_list']):
        return 1.0
    near = said in true['related_answers']
    if any(said in group and true['effect'] in group for group in groups):
        return 1.0 if near else 0.5
    return 0.5 if near else 0.0


def _onset_error(begins: Json, said: Json) -> float:
    """Return by how much an onset is wrong [s or m]; infinite where it is no such onset."""
    if begins['type'] == 'time':
        if said.get('kind') == 'time' and said.get('time_s') is not None \
                and PurePath(str(said.get('recording'))).name == begins['recording']:
            return abs(float(said['time_s']) - float(begins['seconds_after_epoch']))
    elif said.get('kind') == 'place' and said.get('x_m') is not None:
        return abs(float(said['x_m']) - float(begins['x0']))
    return math.inf


def _mark(true: Json, finding: Json, groups: Sequence[set[str]]) -> Mark:
    said = str(finding.get('effect', ''))
    named, right = _credit(true, said, groups), said == true['effect']
    rivals = [str(rival[0]) for rival in sorted(
        finding.get('rivals') or (), key=lambda rival: -float(rival[1] or -math.inf))]
    begins: Json = true.get('onset') or {}
    begun = begins.get('type') in ('time', 'place')
    two_sided = true['effect'] == 'coulomb_drivetrain'
    return Mark(
        true['effect'], bool(true['in_list']), str(true.get('severity') or ''), named,
        right or (named == 1.0 and said == 'unknown'),
        named == 1.0 or true['effect'] in rivals[:1]
        or any(true['effect'] in group for group in groups),
        finding.get('subsystem') == true['subsystem']
        or (right and catalogue.SUBSYSTEM.get(said) == finding.get('subsystem')),
        finding.get('side') == true['side'] if right and (true['side'] != 'both' or two_sided)
        else None,
        str(begins.get('type', 'none')),
        _onset_error(begins, finding.get('onset') or {}) if begun else None)


def _begins_later(said: Json) -> bool:
    """Tell an onset from "all along": a change since the baseline may begin with the first."""
    if said.get('kind', 'none') == 'time' and said.get('time_s') is not None:
        return not (PurePath(str(said.get('recording'))).name == 'rec1'
                    and float(said['time_s']) < 1.0)
    return str(said.get('kind', 'none')) not in ('none', 'set')


def _shares(held_out: Sequence[Json], failed: bool) -> dict[str, float | None]:
    if failed:
        return dict.fromkeys(('all', 'position_m'), 0.0)
    result: dict[str, float | None] = {}
    for name in ('all', 'position_m'):
        sums = {who: math.sqrt(sum(float(item[who][name]) ** 2 for item in held_out))
                for who in ('plain', 'augmented', 'truth')} if held_out else {}
        result[name] = share(sums['plain'], sums['augmented'], sums['truth']) if sums else None
    return result


def _matched(line: Json, claim: bool) -> tuple[Mark, ...]:
    """Match findings to true effects as favourably as can be."""
    largest = int(settings()['marks']['largest_group'])
    groups = [set(group) for group in line['groups'] if len(group) <= largest] if claim else []
    true: Sequence[Json] = line['true']
    found = sorted(line['said'], key=lambda item: -float(item['gain'] or 0.0)) if claim else []
    top = [*found[:len(true)], *([{}] * len(true))][:len(true)]
    return max(
        (tuple(_mark(t, f, groups) for t, f in zip(true, order, strict=True))
         for order in itertools.permutations(top)),
        key=lambda marks: sum(4.0 * mark.named + mark.part for mark in marks))


def judge(line: Json) -> Judgement:
    """
    Judge one case.

    Parameters
    ----------
    line
        Its outcome (`outcomes.line_of`).

    """
    failed = str(line['failed'])
    claim = not failed and line['verdict'] != 'nothing_missing'
    said = tuple(str(item['effect']) for item in line['said'])
    first = said[0] if said else 'nothing'
    if failed or line['verdict'] == 'unknown':
        first = 'failed' if failed else 'unknown'
    confidence = None if line['confidence'] is None else float(line['confidence'])
    sure = float(settings()['marks']['sure'])
    timid = not failed and (not claim or (confidence or 0.0) < sure)
    marks = _matched(line, claim)
    all_named = bool(marks) and all(mark.named == 1.0 for mark in marks)
    outside = any(not mark.known for mark in marks)
    acceptable = all_named or (outside and claim and (
        line['verdict'] == 'unknown' or all(mark.part for mark in marks)))
    right: float | None = float(acceptable)
    if line['level'] == 'clean':
        right = float(not failed and not claim)
    elif timid and not all_named and line['level'] in ('weak', 'undetectable'):
        right = None
    truths = {str(item['effect']) for item in line['true']}
    begins = any(mark.onset is not None for mark in marks)
    return Judgement(
        str(line['case']), str(line['kind']), str(line['level']), str(line['world']),
        line['regime'], tuple(line['unseen']), first, said, claim, marks,
        len([name for name in said if name in catalogue.SUBSYSTEM and name not in truths]),
        acceptable, timid, right,
        claim and not begins and any(_begins_later(item['onset'] or {}) for item in line['said']),
        confidence, failed, float(line['seconds']),
        _shares(line['held_out'], bool(failed or line['held_out_failed'])))
