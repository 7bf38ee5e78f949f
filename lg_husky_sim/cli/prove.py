# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky prove`: a blind trial of the diagnosis on robots with hidden physics."""

from __future__ import annotations

from contextlib import contextmanager
import itertools
from pathlib import Path
from typing import Any, TYPE_CHECKING

import click

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence


@click.command(short_help='Run a blind trial of the diagnosis on robots with injected effects.')
@click.option('--cases', type=click.IntRange(1, 5000), default=30, show_default=True,
              help='How many robots.')
@click.option('--seed', type=click.IntRange(0), metavar='N',
              help='Seed of the first robot, the next has N + 1; 1 by default, 10000 with '
                   '--report.')
@click.option('--tuning/--report', 'tuning', default=True,
              help='Seeds below 10000 are for tuning, without the families left out of it; '
                   'others for a report, with all.')
@click.option('--world', type=click.Choice(['g1', 'g2', 'g3', 'g4', 'mix']), default='g1',
              show_default=True, help='Open-loop fine-step robot, MuJoCo, four tyres with a '
                                      'speed loop, Bullet, or a mixture.')
@click.option('--jobs', type=click.IntRange(1, 256), default=2, show_default=True,
              help='Cases to run at the same time.')
@click.option('--out', type=click.Path(path_type=Path), metavar='DIR',
              help='Folder of the trial; the same call resumes an interrupted one.')
@click.option('--given', type=click.Path(path_type=Path, exists=True, file_okay=False),
              metavar='DIR', help='Cases by other authors (DIR/cases, DIR/answers) instead of '
                                  'generated ones.')
@click.option('--held-out/--no-held-out', default=True,
              help='Measure the share of the achievable improvement on drives not shown.')
@click.option('--generate-only', is_flag=True, help='Make and seal the cases; diagnose nothing.')
@click.option('--score-only', is_flag=True,
              help='Score the cases that are diagnosed already; diagnose nothing.')
@click.option('--from', 'sources', multiple=True, metavar='FILE.jsonl',
              type=click.Path(path_type=Path, exists=True, dir_okay=False),
              help='Outcomes of earlier trials: compute tables and page; simulate nothing.')
@click.option('--calibrate', is_flag=True,
              help='With --from: print the maximum-likelihood coefficients of the confidence for '
                   'these outcomes, in the form of diagnosis.yaml.')
@click.option('--keep-slopes', is_flag=True,
              help='With --calibrate: fit only how often an answer is right; what informs about '
                   'it keeps its coefficients.')
@click.option('--page', type=click.Path(path_type=Path), metavar='FILE.md',
              help='Also write the results as a page, with pictures and outcomes next to it.')
def command(
    cases: int, seed: int | None, tuning: bool, world: str, jobs: int, out: Path | None,
    given: Path | None, held_out: bool, generate_only: bool, score_only: bool,
    sources: tuple[Path, ...], calibrate: bool, keep_slopes: bool, page: Path | None,
) -> None:
    """
    Run a blind trial of the diagnosis on robots with injected effects.

    A generator that shares no code with the diagnosis makes the recordings; the answers are
    sealed before the first diagnosis and opened after the last. DIR gets the recordings, the
    answers, the diagnoses, and outcomes.jsonl (one line a case), from which --from makes
    every figure again in seconds.
    """
    from lg_husky_sim.cli.common import misused
    from lg_husky_sim.proof import outcomes

    if calibrate and not sources:
        raise misused('--calibrate needs --from FILE.jsonl: outcomes to calibrate on')
    if keep_slopes and not calibrate:
        raise misused('--keep-slopes needs --calibrate')
    if sources and calibrate:
        from lg_husky_sim.proof.calibration import calibrated

        rows = [row for path in sources for row in outcomes.read(path)[1]]
        for name, (value, cases, right) in calibrated(
                rows, _slopes() if keep_slopes else None).items():
            click.echo(f'{name}: {value:.2f}  # {right} of {cases} right')
        return
    if sources:
        if out or given or generate_only or score_only:
            raise misused('--from recomputes the figures of earlier trials; it can be combined '
                          'with --page only')
        _report([(path, *outcomes.read(path)) for path in sources], page, sources)
        return
    if out is None:
        raise misused('--out DIR is missing: the folder of the trial')
    path = _trial(cases, seed, tuning, world, jobs, out, given, held_out, generate_only,
                  score_only)
    if path is not None:
        _report([(path, *outcomes.read(path))], page, ())
        click.echo(f'details: {path}')


def _slopes() -> dict[str, float]:
    # All coefficients of the confidence but its constants, as they are.
    from lg_husky_sim.diagnosis.before_after.settings import settings
    from lg_husky_sim.diagnosis.settings import setting
    from lg_husky_sim.proof.calibration import COEFFICIENTS

    decided = settings().decision
    return {name: decided[name] if name in decided else setting(name)
            for names in COEFFICIENTS.values() for name in names[1:]}


def _trial(cases: int, seed: int | None, tuning: bool, world: str, jobs: int, out: Path,
           given: Path | None, held_out: bool, generate_only: bool,
           score_only: bool) -> Path | None:
    """Make, diagnose and open the cases; return the file of outcomes."""
    from lg_husky_sim.extras import require
    from lg_husky_sim.proof import outcomes, plan, trial
    from lg_husky_sim.proof.sealing import commitment

    require('rosbags', 'write the recordings of a trial')
    folders = trial.Folders(out, given)
    if given is not None:
        sealed, name = trial.given(given)
        called, seeds = '--given CASES', '-'
    else:
        first = seed if seed is not None else (1 if tuning else plan.first_report_seed())
        plan.check_seeds(first, cases, report=not tuning)
        specs = plan.plan(cases, first, world, tuning)
        trial.keep_plan(folders, specs)
        with _counted('made', cases) as one_more:
            sealed = trial.prepare(folders, specs, jobs, lambda _: one_more(), held_out)
        name = 'tuning' if tuning else 'report'
        called = f'--cases {cases} --seed {first} --{name} --world {world}' \
            + ('' if held_out else ' --no-held-out')
        seeds = f'{first} to {first + cases - 1}'
    names = list(sealed)
    seal = commitment(sealed)
    click.echo(f'{len(names)} answers sealed, commitment {seal}')
    if generate_only:
        return None
    if score_only:
        names = trial.diagnosed(folders, names)
    else:
        with _counted('diagnosed', len(names)) as one_more:
            for _ in trial.diagnose_all(folders, names, jobs):
                one_more()
    lines = trial.opened(folders, sealed, names)
    outcomes.write(folders.outcomes, {
        'command': f'lg_husky prove {called} --out DIR', 'commit': trial.commit(),
        'planned': len(sealed), 'seal': seal, 'seeds': seeds, 'set': name}, lines)
    return folders.outcomes


@contextmanager
def _counted(what: str, number: int) -> Iterator[Callable[[], None]]:
    # Yields what is to be called after each case: a bar, or a line a case without a terminal.
    from lg_husky_sim.cli.common import Output

    done = itertools.count(1)
    with Output().stages() as report:
        def one_more() -> None:
            cases = next(done)
            report(f'{what} {cases} of {number} cases', cases / number)
        yield one_more


def _report(trials: Sequence[tuple[Path, dict[str, Any], list[dict[str, Any]]]],
            page: Path | None, sources: Sequence[Path]) -> None:
    """Print what was judged, and write the page with its outcomes and pictures."""
    from importlib.util import find_spec

    from lg_husky_sim.proof import outcomes
    from lg_husky_sim.proof import page as pages
    from lg_husky_sim.proof.pictures import draw
    from lg_husky_sim.proof.scoring import judge
    from lg_husky_sim.proof.summary import summarise

    sections: dict[str, tuple[dict[str, Any], list[dict[str, Any]]]] = {}
    judged = [(facts, [judge(row) for row in rows]) for _, facts, rows in trials]
    # The figures of a report are those of one state: that of the report which is given first.
    state = next((facts['commit'] for facts, _ in judged if facts['set'] == 'report'), None)
    for name in pages.TITLES:
        ours = [(facts, cases) for facts, cases in judged if facts['set'] == name
                and (name != 'report' or facts['commit'] == state)]
        if ours:
            results = summarise([case for _, cases in ours for case in cases])
            sections[name] = (results, [{**facts, 'cases': len(cases)} for facts, cases in ours])
            click.echo(f'{pages.TITLES[name]}\n\n{pages.text_of(results)}', nl=False)
    if page is None:
        return
    drawable = find_spec('matplotlib') is not None
    kept = list(sources)
    if not kept:
        for _, facts, rows in trials:
            kept.append(page.with_name(f'{page.stem}_{facts["set"]}.jsonl'))
            outcomes.write(kept[-1], facts, rows)
    shown = [str(path.relative_to(page.parent.parent)) if path.is_relative_to(page.parent.parent)
             else path.name for path in (one.resolve() for one in kept)] \
        if (page := page.resolve()) else []
    once = [one for one in judged if one[0]['set'] in ('report', 'exam')]
    pages.write_text(page, pages.page_of(
        sections, shown, drawable, [(facts, summarise(cases)) for facts, cases in once],
        summarise([case for _, cases in once for case in cases]) if len(once) > 1 else None))
    if drawable:
        draw(next(iter(sections.values()))[0], page.parent / 'pictures')
    else:
        click.echo('no pictures: pip install matplotlib', err=True)
    click.echo(f'page: {page}')
