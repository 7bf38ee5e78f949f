# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky diagnose`: say which physics the model lacks that the recordings show."""

from __future__ import annotations

import os
from pathlib import Path

import click
from lg_husky_sim.cli.several import SeveralWords


@click.command(cls=SeveralWords,
               short_help='Find the physics that a model lacks; report and augmented model.')
@click.argument('recordings', nargs=-1, required=True, metavar='REC [REC …]')
@click.option('--out', required=True, type=click.Path(path_type=Path), metavar='DIR',
              help='Folder for diagnosis.json, model.yaml, report.html and the pictures.')
@click.option('--baseline', 'baselines', multiple=True, metavar='REC [REC …]',
              help='Recordings of the same robot before a change; then the question is what '
                   'changed. Give the recordings after it first, or behind --.')
@click.option('--robot', '--model', 'robot', type=click.Path(path_type=Path),
              metavar='FILE.yaml',
              help="Model in doubt; the Husky with the paper's parameters by default.")
@click.option('--set', 'settings', multiple=True, metavar='NAME=VALUE […]',
              help='Override physical parameters.')
@click.option('--topic', 'topics', multiple=True, metavar='ROLE=NAME […]',
              help='Choose a topic or frame of the recordings by hand (command=/cmd_vel, …).')
@click.option('--seed', type=click.IntRange(min=0), default=0, show_default=True,
              help='Kept for reproducible scripts: the search itself draws nothing by chance.')
@click.option('--jobs', type=click.IntRange(min=1), default=None, metavar='N',
              help='Processes to use; as many as there are cores by default.')
@click.option('--scheduler', default=None, metavar='ADDRESS',
              help='Dask scheduler that takes the work instead (tcp://10.0.0.1:8786); its workers '
                   'need this package.')
@click.option('--report/--no-report', 'with_report', default=True, show_default=True,
              help='Whether to write report.html and the pictures, a third of the time.')
def command(
    recordings: tuple[str, ...], out: Path, baselines: tuple[str, ...], robot: Path | None,
    settings: tuple[str, ...], topics: tuple[str, ...], seed: int, jobs: int | None,
    scheduler: str | None, with_report: bool,
) -> None:
    """
    Say what physics a model lacks, where it shows, and how much better it gets with it.

    The model is recalibrated first, within the tolerances of its parameters. What is left is
    compared with every effect of the catalogue; one is adopted only if it predicts data better
    that were not fitted.
    """
    os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
    from lg_husky_sim.diagnosis.diagnose import diagnose
    from lg_husky_sim.diagnosis.output import MARKER, summary_text, write_files
    from lg_husky_sim.diagnosis.workers import Workers
    from lg_husky_sim.folders import check_folder, result_folder
    from lg_husky_sim.husky.model_file import apply_settings, load_model, parse_settings
    from lg_husky_sim.recording import read_recording, TopicMap
    from lg_husky_sim.reporting.provenance import given_command, provenance
    from lg_husky_sim.reporting.write import check_extras
    from tqdm import tqdm

    del seed
    check_folder(out)
    if with_report:
        check_extras()
    model = apply_settings(load_model(robot), parse_settings(settings))
    choice = TopicMap.parse(topics)
    with tqdm(total=100, desc='reading', disable=None, leave=False,
              bar_format='{desc:40.40} {percentage:3.0f} % |{bar}| {elapsed}') as bar:
        def progress(text: str, share: float) -> None:
            bar.set_description(text, refresh=False)
            bar.n = round(100.0 * share)
            bar.refresh()

        with Workers(jobs or os.cpu_count() or 1, scheduler) as workers:
            after = [read_recording(path, choice) for path in recordings]
            before = [read_recording(path, choice) for path in baselines]
            case = diagnose(after, model, progress, before, workers)
        progress('report and pictures' if with_report else 'files', 0.95)
        try:
            with result_folder(out, MARKER) as folder:
                failure = write_files(folder, case, with_report, provenance(
                    [(one.name, one.path) for one in (*before, *after)],
                    [('of --robot', robot)] if robot else [], given_command()))
        finally:  # the answer is worth a minute, whatever becomes of the files
            bar.close()
            if baselines:
                click.echo(f'before: {", ".join(baselines)}; after: {", ".join(recordings)}')
            click.echo(summary_text(case.diagnosis))
    if failure:
        click.echo(f'warning: {failure}', err=True)
    click.echo(f'{out / ("report.html" if with_report and not failure else MARKER)}')
