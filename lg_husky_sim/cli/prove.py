# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky prove`: a blind trial of the diagnosis on robots with hidden physics."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TYPE_CHECKING

import click

if TYPE_CHECKING:
    from collections.abc import Sequence

    from lg_husky_sim.proof.scoring import Judgement
    from lg_husky_sim.proof.trial import Folders


@click.command(short_help='Try the diagnosis blind on robots with hidden physics.')
@click.option('--cases', type=click.IntRange(1, 5000), default=30, show_default=True,
              help='How many robots.')
@click.option('--seed', type=click.IntRange(0), metavar='N',
              help='Seed of the first robot, the next has N + 1; 1 by default, 10000 with '
                   '--report.')
@click.option('--tuning/--report', 'tuning', default=True,
              help='Seeds below 10000 are for tuning, others for a report; never both.')
@click.option('--world', type=click.Choice(['g1', 'g2', 'g3', 'mix']), default='g1',
              show_default=True, help='Open-loop fine-step robot, rigid-body engine, real tyres '
                                      'with a speed loop, or 70 %, 12 % and 18 % of them.')
@click.option('--set', 'drive', default='mix', show_default=True,
              type=click.Choice(['paper', 'full', 'drive-like', 'mix']),
              help="Manoeuvres: the paper's three, six with reversals, steps of 6 s.")
@click.option('--jobs', type=click.IntRange(1, 256), default=2, show_default=True,
              help='Cases at the same time.')
@click.option('--out', required=True, type=click.Path(path_type=Path), metavar='DIR',
              help='Folder of the trial; the same call resumes an interrupted one.')
@click.option('--generate-only', is_flag=True, help='Make and seal the cases; diagnose nothing.')
@click.option('--score-only', is_flag=True,
              help='Score the cases that are diagnosed already; diagnose nothing.')
@click.option('--pool', 'pooled', multiple=True, type=click.Path(path_type=Path), metavar='DIR',
              help='Count the cases of another trial, scored before, with this one.')
@click.option('--page', type=click.Path(path_type=Path), metavar='FILE.md',
              help='Also write the results as a page, with pictures beside it.')
def command(
    cases: int, seed: int | None, tuning: bool, world: str, drive: str, jobs: int, out: Path,
    generate_only: bool, score_only: bool, pooled: tuple[Path, ...], page: Path | None,
) -> None:
    """
    Try the diagnosis blind on robots with hidden physics.

    A generator that shares no code with the diagnosis makes the recordings; the answers are
    sealed before the first diagnosis and opened after the last. DIR gets the recordings, the
    answers, the diagnoses, results.json, results.md and pictures.
    """
    from lg_husky_sim.errors import CommandError
    from lg_husky_sim.extras import require
    from lg_husky_sim.proof import plan, trial

    require('rosbags', 'write the recordings of a trial')
    first = seed if seed is not None else (1 if tuning else plan.FIRST_REPORT_SEED)
    plan.check_seeds(first, cases, report=not tuning)
    specs = plan.plan(cases, first, world, drive)
    together = [path.resolve() for path in (*pooled, out)]
    if len(set(together)) < len(together):
        raise CommandError('--pool names a folder twice, or that of --out; each trial counts once')
    others = [trial.scored(root) for root in pooled]
    for _, other in others:
        plan.check_seeds(other['first_seed'], other['planned'], report=not tuning)
    folders = trial.Folders(out)
    trial.keep_plan(folders, specs)
    names = [trial.name_of(k) for k in range(cases)]
    with click.progressbar(length=cases, label='hiding  ') as bar:
        sealed = trial.prepare(folders, specs, jobs, lambda _: bar.update(1))
    seal = _seal_of(sealed, names)
    click.echo(f'{cases} answers sealed, commitment {seal}')
    if generate_only:
        return
    if score_only:
        names = trial.diagnosed(folders, names)
    else:
        with click.progressbar(length=cases, label='diagnosing') as bar:
            for _ in trial.diagnose_all(folders, names, jobs):
                bar.update(1)
    called = (f'lg_husky prove --cases {cases} --seed {first} '
              f'--{"tuning" if tuning else "report"} --world {world} --set {drive} --out DIR'
              + ' --pool OTHER' * len(pooled))
    facts = {'command': called, 'planned': cases, 'seal': seal, 'first_seed': first,
             'last_seed': first + cases - 1}
    judged = trial.open_and_judge(folders, sealed, names)
    if others:
        facts['trials'] = [*(other for _, other in others), {**facts, 'cases': len(judged)}]
    _report(folders, (*(one for before, _ in others for one in before), *judged), facts, page)


def _seal_of(sealed: dict[str, str], names: Sequence[str]) -> str:
    """Return one commitment to all answers."""
    from lg_husky_sim.proof.sealing import commitment
    return commitment({name: sealed[name] for name in names})


def _report(folders: Folders, judged: Sequence[Judgement], facts: dict[str, Any],
            page: Path | None) -> None:
    """Print what was judged, and write the results and the page."""
    from dataclasses import asdict
    from importlib.util import find_spec

    from lg_husky_sim.proof import page as pages
    from lg_husky_sim.proof.cases import plain
    from lg_husky_sim.proof.pictures import draw
    from lg_husky_sim.proof.sealing import write_json
    from lg_husky_sim.proof.summary import summarise

    results = {**summarise(judged), **facts}
    write_json(folders.root / 'results.json', plain({
        **results, 'judgements': [asdict(one) for one in judged]}))
    drawable = find_spec('matplotlib') is not None
    for path in [folders.root / 'results.md', *([page] if page else [])]:
        pages.write_text(path, pages.page_of(results))
        if drawable:
            draw(results, path.parent / 'pictures')
    click.echo(pages.text_of(results), nl=False)
    if not drawable:
        click.echo("no pictures: pip install 'lg_husky_sim[plot]'", err=True)
    click.echo(f'details: {folders.root / "results.md"}')
