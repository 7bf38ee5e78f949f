# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky diagnose`: say which physics the model lacks that the recordings show."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click
from lg_husky_sim.cli.common import (
    model_option,
    Output,
    RECORDING,
    settings_option,
    spoken,
    topics_option,
)
from lg_husky_sim.cli.several import SeveralWords

if TYPE_CHECKING:
    from lg_husky_sim.recording import TopicMap


@click.command(cls=SeveralWords,
               short_help='Find the physics that a model lacks; report and augmented model.')
@click.argument('recordings', nargs=-1, required=True, metavar='REC [REC …]', type=RECORDING)
@click.option('--out', required=True, type=click.Path(path_type=Path), metavar='DIR',
              help='Folder for diagnosis.json, diagnosis.txt, model.yaml, plain.yaml, report.html '
                   'and the pictures.')
@click.option('--baseline', 'baselines', multiple=True, metavar='REC [REC …]', type=RECORDING,
              help='Recordings of the same robot before a change; then the question is what '
                   'changed. Put the recordings after the change first, or after --.')
@model_option('--robot', '--model', 'robot')
@settings_option
@topics_option
@click.option('--seed', type=click.IntRange(min=0), default=0, show_default=True,
              help='Other programs give it; the search uses no random numbers.')
@click.option('--jobs', type=click.IntRange(min=1), default=None, metavar='N',
              help='Threads to use; as many as there are cores by default.')
@click.option('--report/--no-report', 'with_report', default=True, show_default=True,
              help='Write report.html and the pictures, which takes a third of the time.')
@spoken(page=True)
def command(
    recordings: tuple[str, ...], out: Path, baselines: tuple[str, ...], robot: Path | None,
    settings: dict[str, float], topics: TopicMap, seed: int, jobs: int | None,
    with_report: bool, say: Output,
) -> None:
    """
    Find the physics that a model lacks, where it shows, and how much it improves the fit.

    The model is recalibrated first, within the tolerances of its parameters. The remaining
    residual is compared with every effect of the catalogue; one is adopted only if it explains
    more than chance does at the nominal false-alarm rate. A folder stands for all bags in it.
    """
    from lg_husky_sim.api.robots import Husky
    from lg_husky_sim.folders import check_folder
    from lg_husky_sim.reporting.provenance import given_command
    from lg_husky_sim.reporting.write import check_extras

    del seed
    check_folder(out)
    if with_report:
        check_extras()
    husky = Husky(robot, **settings)
    with say.stages() as report:
        found = husky.diagnose(
            recordings, baseline=baselines, jobs=jobs,
            topics=topics, progress=report)
        try:
            report('report and pictures' if with_report else 'files', 0.95)
            page = found.save(out, with_report, given_command(),
                              lambda text: click.echo(f'warning: {text}', err=True))
        finally:  # the answer is worth a minute, whatever becomes of the files
            if baselines:
                say.remark(f'before: {", ".join(baselines)}; after: {", ".join(recordings)}')
            say.result(found, found.data())
    say.written(page)
