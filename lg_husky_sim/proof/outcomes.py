# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Outcomes: one JSON line a case, kept beside the page, from which every figure follows.

The first line of a file says which trial it was ('trial': command, commit, seeds, seal, set).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import json
from pathlib import Path
from typing import Any

from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.proof.page import write_text

Json = Mapping[str, Any]

SCHEMA = 'lg_husky_sim/outcomes/1'
_FACTS = ('schema', 'command', 'commit', 'planned', 'seal', 'seeds', 'set')


def line_of(answer: Json, outcome: Json) -> dict[str, Any]:
    """Return what one case was and what was said of it, as short as the figures allow."""
    diagnosis: Json = outcome.get('diagnosis') or {}
    keys = ('effect', 'in_list', 'severity', 'side', 'form', 'size', 'related_answers', 'onset')
    line = {
        'case': outcome['case'], 'kind': answer['kind'], 'level': answer['level'],
        'world': answer['world'], 'regime': answer.get('regime', {}),
        'unseen': answer.get('unseen', []), 'nats': answer.get('nats', []),
        'true': [{**{key: item.get(key) for key in keys},
                  'subsystem': item['location']['subsystem']} for item in answer['answers']],
        'verdict': diagnosis.get('verdict', ''), 'confidence': diagnosis.get('confidence'),
        'features': diagnosis.get('confidence_from') or {},
        'said': [_finding(item) for item in diagnosis.get('findings', ())],
        'groups': [list(item.get('effects', ()))
                   for item in diagnosis.get('indistinguishable', ())],
        'failed': str(outcome.get('error') or ''), 'held_out': outcome.get('held_out') or [],
        'held_out_failed': str(outcome.get('held_out_error') or ''),
        'seconds': round(float(outcome.get('seconds') or 0.0), 1)}
    return line


def _finding(item: Json) -> dict[str, Any]:
    evidence: Json = item.get('evidence') or {}
    return {'effect': item.get('effect'), 'side': item.get('side'),
            'subsystem': item.get('subsystem'), 'onset': item.get('onset'),
            'gain': evidence.get('held_out_gain_nats'),
            'rivals': [[rival.get('effect'), rival.get('held_out_gain_nats')]
                       for rival in item.get('rivals', ())][:5]}


def write(path: Path, facts: Json, lines: Sequence[Json]) -> None:
    """Write a trial's outcomes, complete or not at all."""
    rows = [{'trial': {'schema': SCHEMA, **facts}}, *lines]
    write_text(path, ''.join(json.dumps(row, sort_keys=True, ensure_ascii=False) + '\n'
                             for row in rows))


def read(path: Path) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """
    Return the facts and the lines of a file of outcomes.

    Raises
    ------
    LgHuskyError
        The file is not one of outcomes.

    """
    try:
        rows = [json.loads(text) for text in path.read_text(encoding='utf-8').splitlines()
                if text.strip()]
        facts = dict(rows[0]['trial'])
    except (OSError, ValueError, KeyError, IndexError, TypeError) as error:
        raise LgHuskyError(f'{path} holds no outcomes of a trial: {error}') from error
    missing = [name for name in _FACTS if name not in facts]
    if missing or facts['schema'] != SCHEMA:
        raise LgHuskyError(f'{path}: the first line lacks {", ".join(missing) or SCHEMA}')
    for number, row in enumerate(rows[1:], 2):
        if not isinstance(row, dict) or 'case' not in row or 'kind' not in row:
            raise LgHuskyError(f'{path}, line {number}: no outcome of a case')
    return facts, rows[1:]
