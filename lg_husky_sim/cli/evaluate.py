# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky evaluate`: the paper's evaluation redone, and real steps judged."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click
from lg_husky_sim.cli.common import (
    misused,
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
               short_help="The paper's evaluation: calibrate, hold out, six numbers, Figs. 12-16.")
@click.option('--out', required=True, type=click.Path(path_type=Path), metavar='DIR',
              help='Folder for index.html, evaluation.json, evaluation.txt and the pictures.')
@click.option('--case', 'cases', multiple=True, type=click.Choice(['synthetic', 'engine']),
              help="The robot: the paper's graph with other parameters and noisy sensors, or a "
                   'rigid-body engine (needs MuJoCo). By default both, the engine only where '
                   'MuJoCo is installed; neither if recordings are given.')
@click.option('--calibrate', multiple=True, metavar='REC', type=RECORDING,
              help='A recording to calibrate on, such as a circle.')
@click.option('--held-out', multiple=True, metavar='REC [REC …]', type=RECORDING,
              help='A recording to predict; may be given several times.')
@click.option('--rival', 'rivals', multiple=True, metavar='BAG [BAG …]', type=RECORDING,
              help="Another simulator's recording of the same drive, one for each recording in "
                   'their order.')
@click.option('--steps', 'steps', multiple=True, metavar='REC [REC …]', type=RECORDING,
              help='A recording of commanded steps: fit every other step, predict the rest, '
                   'compared with three simple models; may be given several times.')
@model_option('--model', '--robot', 'model')
@settings_option
@click.option('--seed', type=click.IntRange(min=0), default=0, show_default=True,
              help='Seed of all random numbers: starting points, genes, noise.')
@click.option('--starts', type=click.IntRange(min=1), default=6, show_default=True,
              help='Starting points of the least squares.')
@click.option('--jobs', type=click.IntRange(min=1), default=1, show_default=True,
              help='Processes to use.')
@topics_option
@spoken(page=True)
def command(
    out: Path, cases: tuple[str, ...], calibrate: tuple[str, ...], held_out: tuple[str, ...],
    rivals: tuple[str, ...], steps: tuple[str, ...], model: Path | None,
    settings: dict[str, float], seed: int, starts: int, jobs: int, topics: TopicMap,
    say: Output,
) -> None:
    """
    Redo the paper's evaluation.

    Each case is calibrated on its first drive and predicts the others; reported are the largest
    tracking errors of each, beside those that the paper prints. Recordings of steps are divided:
    every other step is fitted, the rest is predicted.
    """
    from importlib.util import find_spec

    from lg_husky_sim.errors import CommandError
    from lg_husky_sim.evaluation.session import Request, run_evaluation
    from lg_husky_sim.folders import check_folder
    from lg_husky_sim.husky.by_hand import other_robot
    from lg_husky_sim.husky.model_file import apply_settings, load_model, packaged
    from lg_husky_sim.reporting.provenance import provenance
    from lg_husky_sim.reporting.write import check_extras

    check_extras()
    check_folder(out)
    if (held_out or rivals) and not calibrate:
        raise misused('--held-out and --rival need --calibrate REC')
    start = apply_settings(load_model(model), settings)
    chosen = cases
    if (cases or not (calibrate or steps)) and other_robot(packaged().parameters,
                                                           start.parameters):
        raise CommandError(
            f'the built-in cases are a Husky, and the model is none (wheel radius '
            f'{start.parameters["wheel_radius"]:g} m, track {start.parameters["track"]:g} m): '
            'give recordings of its robot, --calibrate REC --held-out REC or --steps REC')
    if not (cases or calibrate or steps):
        chosen = ('synthetic', 'engine') if find_spec('mujoco') else ('synthetic',)
        if len(chosen) == 1:
            say.remark('without the case engine: it needs MuJoCo, pip install mujoco')
    request = Request(chosen, calibrate, held_out, rivals, steps, start, seed, starts, jobs,
                      topics)
    with say.stages(known=False) as report:
        found = run_evaluation(
            request, out, lambda word: report(f'evaluating: {word}', None), provenance(
                [(Path(path).name, path) for path in (*calibrate, *held_out, *rivals, *steps)],
                [('of --model', model)] if model else []))
    say.result(found.text, found.data)
    say.remark('')
    say.written(out / 'index.html')
