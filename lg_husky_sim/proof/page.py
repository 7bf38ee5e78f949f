# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A trial as text: a table for the terminal, and the page docs/proof.md."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import os
from pathlib import Path
from typing import Any

from lg_husky_sim.proof.motion import LEAST_TRACE

Json = Mapping[str, Any]

_ABOUT = """\
This page is written by {these} below from the results of a blind trial; nobody edits its
figures.

    {command}

A generator that shares no code with the diagnosis hides physics in a robot, drives it,
and publishes rosbags. The answers are sealed: the SHA-256 of each salted answer is written down
before the first diagnosis (all of them together: `{seal}`). Then
`lg_husky diagnose --no-report` is called as any user would call it, with the recordings and
nothing else. Robots used for tuning have seeds below 10000 or are those of earlier trials; those
reported here have {seeds}.

| world | what stands in for the real robot |
| --- | --- |
| g1 | own Newton-Euler equations at 0.5 ms: motors, battery, choppers, side slip, brush tyres |
| g2 | MuJoCo: rigid bodies on dry contact; asked with `--baseline` what changed |
| g3 | four real tyres, a wheel-speed loop, limits, dead time; asked with `--baseline` too |

No two robots are alike: damping and scrub differ by up to 30 %, the voltage gain by 3 %, mass and
inertia by 5 to 10 %, every floor is rough, encoders count ticks, stamps jitter, commands get
lost or come a few milliseconds late, poses have gaps, gyros a small bias. Where the drives that
were drawn cannot show an effect (a weak reverse gear, and nothing goes backwards: it moves no
channel by {least:g} of its noise), another robot with another effect is drawn.
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


def _table(head: Sequence[str], rows: Sequence[Sequence[str]], right: int) -> str:
    """Return an aligned text table whose last `right` columns are flush right."""
    widths = [max(len(row[k]) for row in [head, *rows]) for k in range(len(head))]
    lines = []
    for row in [head, *rows]:
        cells = [cell.ljust(width) if k < len(head) - right else cell.rjust(width)
                 for k, (cell, width) in enumerate(zip(row, widths, strict=True))]
        lines.append('  '.join(cells).rstrip())
    return '\n'.join(lines)


def text_of(results: Json) -> str:
    """Return the figures of a trial as text for a terminal."""
    kinds = results['kinds']
    rows = [(rate['name'], f'{rate["hits"]}/{rate["count"]}', _percent(rate['value']),
             f'{_percent(rate["low"])} - {_percent(rate["high"])}', _target(rate), _mark(rate))
            for rate in results['rates'] if rate['count']]
    parts = [f'{results["cases"]} cases: {kinds["single"]} single effects, {kinds["pair"]} pairs, '
             f'{kinds["clean"]} clean, {kinds["outside"]} outside the catalogue', '',
             _table(('', 'cases', 'rate', '95 %', 'target', ''), rows, 5), '']
    spread = [(name, str(row['count']), _percent(row['median']),
               f'{_percent(row["lower_quartile"])} - {_percent(row["upper_quartile"])}')
              for name, row in results['shares'].items() if row['count']]
    if spread:
        parts += [_table(('share of the achievable improvement', 'cases', 'median', 'quartiles'),
                         spread, 3), '']
    time = results['seconds']
    if time['count']:
        parts.append(f'run time: median {time["median"]:.1f} s, '
                     f'longest {time["longest"]:.1f} s a case')
    return '\n'.join(parts) + '\n'


def _markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = ['| ' + ' | '.join(head) + ' |', '|' + ' --- |' * len(head)]
    lines += ['| ' + ' | '.join(row) + ' |' for row in rows]
    return '\n'.join(lines)


def _rate_rows(rates: Sequence[Json]) -> list[list[str]]:
    return [[rate['name'], f'{rate["hits"]} of {rate["count"]}',
             f'{_percent(rate["value"])} ({_percent(rate["low"])} to {_percent(rate["high"])})',
             _target(rate), _mark(rate)] for rate in rates if rate['count']]


def _trials(results: Json) -> Sequence[Json]:
    return results.get('trials') or [results]


def _about(results: Json) -> str:
    trials = _trials(results)
    return _ABOUT.format(
        least=LEAST_TRACE,
        these='the command' if len(trials) == 1 else 'the commands',
        command='\n    '.join(one['command'] for one in trials),
        seal='` and `'.join(one['seal'][:16] for one in trials),
        seeds=' and '.join(f'{one["first_seed"]} to {one["last_seed"]}' for one in trials)).strip()


def _unfinished(results: Json) -> list[str]:
    trials = _trials(results)
    if all(one['cases'] == one['planned'] for one in trials):
        return []
    said = ' and '.join(f'the first {one["cases"]} of {one["planned"]}' for one in trials)
    return [f'{said[0].upper()}{said[1:]} cases to finish; their order is random.', '']


def page_of(results: Json, pictures: str = 'pictures') -> str:
    """
    Return docs/proof.md.

    Parameters
    ----------
    results
        The results file: `summary.summarise` with 'command', 'planned', 'seal',
        'first_seed', 'last_seed' beside; or, of several trials, with a list of these and
        of their 'cases' in 'trials'.
    pictures
        Folder of the pictures, as the page links to them.

    """
    head = ('question', 'cases', 'rate (95 % interval)', 'target', '')
    parts = [
        '# Proof: a blind trial', '', _about(results), '',
        *_unfinished(results), '## Figures', '', _markdown(head, _rate_rows(results['rates'])), '',
        f'![rates with intervals]({pictures}/proof_rates.png)', '',
        '## Held-out improvement', '',
        'Share = (error of the refitted plain model - error of the diagnosed model) / (error of '
        'the plain model - error of the hidden robot itself without chance), on recordings '
        'that no diagnosis saw; robots of which less than a tenth of the plain error could be '
        'gained are left out, failures count 0. "all" puts wheel speeds, yaw rate and motion '
        'within one second together, "position_m" is the open-loop path over a whole recording. '
        'The plain model is that of the paper, refitted to the same recordings. Against a '
        'baseline the share counts also what the diagnosis learnt of the base beforehand, such as '
        'its speed loop: the clean robots show how much that is.', '',
        _markdown(('cases', 'number', 'median', 'quartiles'), [
            [name, str(row['count']), _percent(row['median']),
             f'{_percent(row["lower_quartile"])} to {_percent(row["upper_quartile"])}']
            for name, row in results['shares'].items() if row['count']]), '',
        f'![share by effect]({pictures}/proof_shares.png)', '',
        '## What was named', '',
        f'![confusion matrix]({pictures}/proof_confusion.png)', '',
        _markdown(('hidden', 'cases', 'named right', 'subsystem right',
                   'median share (no baseline)', 'named instead'), [
            [name, str(row['count']), str(row['right']), str(row['subsystem']),
             _number(row['median_share']),
             ', '.join(f'{other} {count}' for other, count in sorted(
                 row['named'].items(), key=lambda item: -item[1]) if other != name)]
            for name, row in results['by_effect'].items()]), '']
    if len(results['by_world']) > 1:
        for world, rates in results['by_world'].items():
            parts += [f'## World {world}', '', _markdown(head, _rate_rows(rates)), '']
    time = results['seconds']
    if time['count']:
        parts += ['## Run time', '',
                  f'Median {time["median"]:.1f} s, quartiles {time["lower_quartile"]:.1f} to '
                  f'{time["upper_quartile"]:.1f} s, longest {time["longest"]:.1f} s for one case '
                  f'on one core (process start included, report and pictures left out).', '']
    return '\n'.join(parts)


def write_text(path: Path, text: str) -> None:
    """Write a text file, complete or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = path.with_name(path.name + '.part')
    draft.write_text(text)
    os.replace(draft, path)
