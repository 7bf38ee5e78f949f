# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Trials as text: a table for the terminal, and the page docs/proof.md."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import os
from pathlib import Path
import textwrap
from typing import Any

from lg_husky_sim.proof.settings import settings

Json = Mapping[str, Any]

_ABOUT = """\
This page is generated from files of outcomes, with one JSON line per case; its figures are never
edited by hand. All of them are recomputed, in seconds, by

    lg_husky prove {sources} --page docs/proof.md

A generator that shares no code with the diagnosis injects effects into a robot, drives it, and
writes rosbags ([how](proof_generator.md)). The answers are sealed: the SHA-256 of each salted
answer is recorded before the first diagnosis. Then `lg_husky diagnose` is called as any user would
call it, with the recordings and the dimensions of the robot. What the diagnosis does, and how its
code is arranged, stands [on its page](diagnosis.md#where-it-is-in-the-code).

Conditions that differ from log to log are drawn over orders of magnitude: roughness of the floor,
noise, ticks, how wheel speeds are computed, stamps, jitter, rates, the base's own clock, lost and
late messages, missing sensors, lengths, the form of each law. Some families of them are left out
of tuning (`left_out_of_tuning` in `config/blind_trial.yaml`). A reported set is used once; its
seeds are refused afterwards.

Single effects that are too weak to show are not counted: those that would explain next to nothing
even if the truth were known (`undetectable`), and weak ones about which the diagnosis is not sure
either (`weak`; the bars are `oracle` in `config/blind_trial.yaml`).
"""


def _percent(value: float | None) -> str:
    return '-' if value is None else f'{100.0 * value:.0f} %'


def _number(value: float | None, digits: int = 2) -> str:
    return '-' if value is None else f'{value:.{digits}f}'


def _target(rate: Json) -> str:
    if rate['target'] is None:
        return ''
    return f'{"≤" if rate["at_most"] else "≥"} {_percent(rate["target"])}'


def _mark(rate: Json) -> str:
    return {True: 'reached', False: 'missed', None: ''}[rate['reached']]


def _count(rate: Json) -> str:
    return f'{rate["hits"]:g} of {rate["count"]}'


def _with_interval(rate: Json) -> str:
    if not rate['count']:
        return '-'
    return f'{_percent(rate["value"])} ({_percent(rate["low"])} to {_percent(rate["high"])}), ' \
           f'{_count(rate)}'


def _table(head: Sequence[str], rows: Sequence[Sequence[str]], right: int) -> str:
    """Return an aligned text table whose last `right` columns are flush right."""
    widths = [max(len(row[k]) for row in [head, *rows]) for k in range(len(head))]
    lines = []
    for row in [head, *rows]:
        cells = [cell.ljust(width) if k < len(head) - right else cell.rjust(width)
                 for k, (cell, width) in enumerate(zip(row, widths, strict=True))]
        lines.append('  '.join(cells).rstrip())
    return '\n'.join(lines)


def _kinds(results: Json) -> str:
    kinds = results['kinds']
    return (f'{results["cases"]} cases: {kinds["single"]} single effects, {kinds["pair"]} pairs, '
            f'{kinds["none"]} clean, {kinds["outside"]} outside the catalogue, '
            f'{kinds["before_after"]} before and after')


def text_of(results: Json) -> str:
    """Return the figures of a trial as text for a terminal."""
    rows = [(rate['name'], f'{rate["hits"]:g}/{rate["count"]}', _percent(rate['value']),
             f'{_percent(rate["low"])} - {_percent(rate["high"])}', _target(rate), _mark(rate))
            for rate in results['rates'] if rate['count']]
    parts = [_kinds(results), '', _table(('', 'cases', 'rate', '95 %', 'target', ''), rows, 5), '']
    stated = results['reliability']
    if stated['cases']:
        parts.append(f'expected calibration error {stated["error"]:.3f} over {stated["cases"]} '
                     f'cases; mean confidence when right {_number(stated["mean_when_right"])}, '
                     f'when wrong {_number(stated["mean_when_wrong"])}')
    spread = [(name, str(row['count']), _percent(row['median']),
               f'{_percent(row["lower_quartile"])} - {_percent(row["upper_quartile"])}')
              for name, row in results['shares'].items() if row['count']]
    if spread:
        parts += ['', _table(('share of the achievable improvement', 'cases', 'median',
                              'quartiles'), spread, 3), '']
    time = results['seconds']
    if time['count']:
        parts.append(f'run time: median {time["median"]:.1f} s, '
                     f'longest {time["longest"]:.1f} s a case')
    return '\n'.join(parts) + '\n'


def _markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = ['| ' + ' | '.join(head) + ' |', '|' + ' --- |' * len(head)]
    lines += ['| ' + ' | '.join(row) + ' |' for row in rows]
    return '\n'.join(lines)


_HEAD = ('question', 'cases', 'rate (95 % interval)', 'target', '')


def _rate_rows(rates: Sequence[Json]) -> list[list[str]]:
    return [[rate['name'], _count(rate),
             f'{_percent(rate["value"])} ({_percent(rate["low"])} to {_percent(rate["high"])})',
             _target(rate), _mark(rate)] for rate in rates if rate['count']]


def _facts(trials: Sequence[Json]) -> str:
    rows = [[f'`{one["command"]}`', f'`{one["commit"][:12]}`', one['seeds'],
             f'{one["cases"]} of {one["planned"]}', f'`{one["seal"][:16]}`'] for one in trials]
    return _markdown(('command', 'commit', 'seeds', 'cases', 'commitment'), rows)


def _reliability(stated: Json) -> list[str]:
    if not stated['cases']:
        return []
    rows = [[f'{row["from"]:.1f} to {row["to"]:.1f}', str(row['count']), _number(row['stated']),
             f'{_number(row["right"])} ({_number(row["low"])} to {_number(row["high"])})']
            for row in stated['bins']]
    mark = 'reached' if stated['error'] <= stated['target'] else 'missed'
    return ['### Reliability: stated confidence and share right', '',
            _markdown(('stated', 'cases', 'mean stated', 'right (95 % interval)'), rows), '',
            f'Expected calibration error {stated["error"]:.3f} over {stated["cases"]} cases '
            f'(target ≤ {stated["target"]:g}: {mark}); mean confidence '
            f'{_number(stated["mean_when_right"])} when right, '
            f'{_number(stated["mean_when_wrong"])} when wrong. Undetectable effects with '
            'a low stated confidence do not count.', '']


def _regimes(rows: Sequence[Json]) -> list[str]:
    table = [[row['axis'], row['family'], _with_interval(row['named']),
              _with_interval(row['alarms'])] for row in rows
             if row['named']['count'] or row['alarms']['count']]
    return ['### By world and by logging convention', '',
            _markdown(('axis', 'family', 'single effects named right', 'clean robots flagged'),
                      table), '']


def _gap(rates: Sequence[Json], stated: Json) -> list[str]:
    by_target = {'single effects: named right': 'singles',
                 'clean robots: named, called unknown or failed (false alarm)': 'false_alarms',
                 'outside the catalogue: unknown, or part right': 'outside',
                 'what changed: named right': 'changed'}
    exams = settings()['outside_exams']
    rows = [[rate['name'], _with_interval(rate),
             *(_percent(exam[by_target[rate['name']]]) for exam in exams)]
            for rate in rates if rate['name'] in by_target]
    rows.append(['expected calibration error', _number(stated['error']),
                 *(_number(exam['calibration_error']) for exam in exams)])
    return ['### Compared with the exams of other authors', '',
            'Those were taken by earlier states of the diagnosis; the gap shows what a trial with '
            'our own generator cannot reveal.', '',
            _markdown(('question', 'here', *(exam['name'] for exam in exams)), rows), '']


def _section(title: str, results: Json, trials: Sequence[Json], full: bool) -> list[str]:
    notes = [text for one in trials for text in (*textwrap.wrap(str(one.get('note', '')), 98), '')
             if one.get('note')]
    parts = [f'## {title}', '', _kinds(results) + '.', '', _facts(trials), '', *notes,
             _markdown(_HEAD, _rate_rows(results['rates'])), '']
    parts += _reliability(results['reliability'])
    if full:
        parts += _gap(results['rates'], results['reliability'])
    parts += _regimes(results['by_regime'])
    spread = [[name, str(row['count']), _percent(row['median']),
               f'{_percent(row["lower_quartile"])} to {_percent(row["upper_quartile"])}']
              for name, row in results['shares'].items() if row['count']]
    if spread:
        parts += ['### Held-out share of the achievable improvement', '',
                  'Share of the error of a refitted paper model, relative to the noiseless true '
                  'robot, on drives that no diagnosis has seen.', '',
                  _markdown(('cases', 'number', 'median', 'quartiles'), spread), '']
    parts += ['### Answers for each effect', '', _markdown(
        ('hidden', 'cases', 'right', 'part right', 'said instead'),
        [[name, str(row['count']), str(row['right']), str(row['part']),
          ', '.join(f'{other} {count}' for other, count in sorted(
              row['named'].items(), key=lambda item: -item[1]) if other != name)]
         for name, row in results['by_effect'].items()]), '']
    if full and len(results['by_world']) > 1:
        for world, rates in results['by_world'].items():
            parts += [f'### World: {world}', '', _markdown(_HEAD, _rate_rows(rates)), '']
    time = results['seconds']
    if time['count']:
        parts += [f'Run time: median {time["median"]:.1f} s, quartiles '
                  f'{time["lower_quartile"]:.1f} to {time["upper_quartile"]:.1f} s, longest '
                  f'{time["longest"]:.1f} s per case (process start included, report and pictures '
                  'left out).', '']
    return parts


TITLES = {'report': 'Reported trial', 'exam': 'Exams by other generators, each sat once',
          'tuning': 'Tuning trial (seen while tuning: no proof)',
          'validation': 'Validation cases of another author (tuning data: no proof)'}


_HISTORY = {'single effects': 'single effects: named right', 'pairs, both': 'pairs: both right',
            'clean, flagged': 'clean robots: named, called unknown or failed (false alarm)',
            'outside the catalogue': 'outside the catalogue: unknown, or part right',
            'changes': 'what changed: named right',
            'unchanged, flagged': 'what changed: an unchanged robot flagged'}


def _history(history: Sequence[tuple[Json, Json]], whole: Json) -> list[str]:
    def cells(results: Json) -> list[str]:
        found = {rate['name']: rate for rate in results['rates']}
        error = results['reliability']['error']
        return [str(results['cases']), *(
            _count(found[name]) if found[name]['count'] else '-' for name in _HISTORY.values()),
            _number(error)]
    rows = [[facts['set'], facts['seeds'], f'`{facts["commit"][:12]}`', *cells(results)]
            for facts, results in history]
    return ['## All reported trials and exams', '',
            'Each was diagnosed once, by the state of its commit, and has been tuning data since.',
            'The sum is over all these states.', '',
            _markdown(('set', 'seeds', 'commit', 'cases', *_HISTORY, 'calibration error'),
                      [*rows, ['sum', '', '', *cells(whole)]]), '']


def page_of(sections: Mapping[str, tuple[Json, Sequence[Json]]], sources: Sequence[str],
            pictures: bool = True, history: Sequence[tuple[Json, Json]] = (),
            whole: Json | None = None) -> str:
    """
    Return the page.

    Parameters
    ----------
    sections
        By set ('report', 'exam', 'tuning', 'validation'): its figures (`summary.summarise`) and
        the facts of its trials.
    sources
        Files of outcomes, as the reader of the page finds them.
    pictures
        Refer to the pictures.
    history
        Facts and figures of each reported trial and exam, of any state.
    whole
        Figures of all of them together; no table of them if not given.

    """
    left_out = '; '.join(f'{axis}: {", ".join(map(str, names))}'
                         for axis, names in settings()['left_out_of_tuning'].items())
    about = _ABOUT.format(sources=' '.join(f'--from {name}' for name in sources))
    parts = ['# Proof: a blind trial', '', about, *textwrap.wrap(
        f'Left out of tuning: {left_out}.', 98), '']
    if 'report' not in sections:
        parts += ['No set is reported for this state of the diagnosis: the following cases were',
                  'used for tuning. A report is made by', '',
                  '    lg_husky prove --report --cases 600 --seed 91000 --world mix '
                  '--out report --page docs/proof.md', '']
    for name, title in TITLES.items():
        if name in sections:
            results, trials = sections[name]
            parts += _section(title, results, trials, full=name == 'report')
            if pictures and name == next(iter(sections)):
                parts += ['![rates with intervals](pictures/proof_rates.png)', '',
                          '![reliability](pictures/proof_reliability.png)', '',
                          '![confusion matrix](pictures/proof_confusion.png)', '']
                if whole is not None:
                    parts += _history(history, whole)
    return '\n'.join(parts)


def write_text(path: Path, text: str) -> None:
    """Write a text file in UTF-8, complete or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(path.name + '.part')
    draft.write_text(text, encoding='utf-8')
    os.replace(draft, path)
