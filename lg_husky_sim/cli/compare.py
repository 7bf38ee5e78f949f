# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky compare`: replay recordings through models, draw and measure the difference."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click
from lg_husky_sim.cli.common import (
    MODEL,
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
               short_help='Replay recordings through models; figures and errors.')
@click.argument('recordings', nargs=-1, required=True, metavar='REC [REC …]', type=RECORDING)
@click.option('--model', '--robot', 'models', multiple=True, type=MODEL, metavar='FILE.yaml',
              help="Model file; several are shown side by side. The Husky with the paper's "
                   'parameters by default, which is also called paper.')
@click.option('--out', required=True, type=click.Path(path_type=Path), metavar='DIR',
              help='Folder for index.html, compare.json, compare.txt and the pictures.')
@click.option('--rival', 'rivals', multiple=True, metavar='BAG', type=RECORDING,
              help='A recording of the same drive by another simulator, one for each REC in '
                   'their order, to be compared as well.')
@settings_option
@topics_option
@click.option('--horizon', type=float, default=0.0, metavar='SECONDS',
              help='Restart from the measured state at this interval; by default only at '
                   'gaps.')
@click.option('--figures', 'most', type=click.IntRange(min=0), default=6, show_default=True,
              metavar='N',
              help='Number of recordings, from the first, whose signals and path are drawn as '
                   'PNG too.')
@click.option('--bag', type=click.Path(path_type=Path), metavar='BAG',
              help='Write measured, predicted and residual of the first REC as a rosbag2, with '
                   'layouts for Foxglove and PlotJuggler next to it.')
@click.option('--overwrite', is_flag=True,
              help='Replace a rosbag2 that is at BAG, with its layouts.')
@click.option('--trajectories', type=click.Path(path_type=Path), metavar='DIR',
              help='Write trajectories in the TUM format, for evo.')
@spoken(page=True)
def command(
    recordings: tuple[str, ...], models: tuple[Path, ...], out: Path, rivals: tuple[str, ...],
    settings: dict[str, float], topics: TopicMap, horizon: float, most: int,
    bag: Path | None, overwrite: bool, trajectories: Path | None, say: Output,
) -> None:
    """
    Replay the commands of recordings through models and show how far the models are off.

    Each segment without a gap starts in the state that the robot was in. DIR gets the paper's
    figures (responses; trajectory and tracking error), the root mean square error of each
    channel and the largest tracking errors, as a table, as JSON and on one page. Give the
    recordings in the order in which they were driven; a folder stands for all bags in it.
    """
    from lg_husky_sim.api.comparing import compare
    from lg_husky_sim.comparison.signals_bag import check_bag, check_trajectories
    from lg_husky_sim.folders import check_folder, check_writable
    from lg_husky_sim.reporting.write import check_extras

    check_extras()
    check_folder(out)
    if bag is not None:
        check_bag(bag, overwrite)
        check_writable(bag)
    if trajectories is not None:
        check_folder(trajectories)
    with say.stages() as report:
        comparison = compare(
            recordings, models or None, rivals=rivals, horizon=horizon,
            settings=settings, topics=topics, progress=report)
        if trajectories is not None:
            check_trajectories(trajectories, comparison.outcomes)
        page = comparison.save(out, most, report)
    if bag is not None:
        comparison.save_bag(bag, overwrite=overwrite)
    if trajectories is not None:
        comparison.save_trajectories(trajectories)
    say.result(comparison, comparison.data())
    say.written(page)
