# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky identify`: estimate a model's parameters from recordings."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click
from lg_husky_sim.cli.common import (
    EFFECTS,
    model_option,
    NUISANCES,
    OneOf,
    Output,
    PARAMETERS,
    RECORDING,
    settings_option,
    spoken,
    topics_option,
)
from lg_husky_sim.cli.several import SeveralWords

if TYPE_CHECKING:
    from lg_husky_sim.recording import TopicMap


@click.command(cls=SeveralWords,
               short_help='Estimate parameters from recordings; a model file and a report.')
@click.argument('recordings', nargs=-1, required=True, metavar='REC [REC …]', type=RECORDING)
@click.option('--out', required=True, type=click.Path(path_type=Path), metavar='FILE.yaml',
              help='Model file to write; the report is next to it as .txt, .json and .html. '
                   'With --each a folder that gets these files for every recording.')
@model_option('--model', '--robot', 'model')
@settings_option
@click.option('--free', multiple=True, metavar='NAMES', type=PARAMETERS,
              help='Parameters to estimate, separated by commas; by default those that the model '
                   'marks as free, and the parameters of its effects.')
@click.option('--effects', multiple=True, metavar='IDS', type=EFFECTS,
              help='Effects of the catalogue to add, separated by commas: id, id:side or '
                   'id:shape; command_latency,command_limit:yaw, for instance.')
@click.option('--method', type=OneOf(['least-squares', 'ga', 'de']),
              default='least-squares', show_default=True,
              help="Least squares on all outputs; or the paper's genetic algorithm, or "
                   'differential evolution, on the position alone (eq. 23).')
@click.option('--nuisance', multiple=True, metavar='NAMES', type=NUISANCES,
              help='Unknowns of the recordings to estimate as well, separated by commas: '
                   'latency, delay_wheels, delay_imu, delay_pose, gyro_bias; and initial_state, '
                   'the state at the start of every segment that begins in motion.')
@click.option('--profile', multiple=True, metavar='NAMES', type=PARAMETERS,
              help='Parameters to profile, separated by commas: likelihood intervals '
                   'that hold for non-quadratic likelihoods too, at the cost of more '
                   'simulations.')
@click.option('--seed', type=click.IntRange(min=0), default=0, show_default=True,
              help='Seed of all random numbers: starting points, genes, noise.')
@click.option('--starts', type=click.IntRange(min=1), default=6, show_default=True,
              help='Starting points of the least squares.')
@click.option('--jobs', type=click.IntRange(min=1), default=1, show_default=True,
              help='Processes to use.')
@click.option('--scheduler', metavar='ADDRESS',
              help='Dask scheduler to use in place of processes, such as tcp://10.0.0.1:8786.')
@click.option('--each', is_flag=True,
              help='Fit every recording separately instead of all together.')
@topics_option
@spoken(page=True)
def command(
    recordings: tuple[str, ...], out: Path, model: Path | None, settings: dict[str, float],
    free: tuple[str, ...], effects: tuple[str, ...], method: str, nuisance: tuple[str, ...],
    profile: tuple[str, ...], seed: int, starts: int, jobs: int, scheduler: str | None,
    each: bool, topics: TopicMap, say: Output,
) -> None:
    """
    Estimate the parameters of a model from recordings.

    The model file can be read by sim_node, simulate and compare. The report says how well each
    parameter is determined, and which of them the recordings cannot distinguish. A folder stands
    for all bags in it.
    """
    from lg_husky_sim.api.robots import Husky
    from lg_husky_sim.identification.options import names_in
    from lg_husky_sim.identification.report import report_paths
    from lg_husky_sim.reporting.write import check_extras

    check_extras()
    if not each:
        report_paths(out)
    husky = Husky(model, **settings)
    with say.stages(known=False) as report:
        if each:
            from lg_husky_sim.api.sensor_warnings import warnings_of
            from lg_husky_sim.identification.options import with_effects
            from lg_husky_sim.identification.result import Method
            from lg_husky_sim.identification.session import fit_each, Request
            from lg_husky_sim.recording.bags import bags_in
            request = Request(
                with_effects(husky.model, effects), husky.model, Method(method), names_in(free),
                names_in(nuisance), names_in(profile), seed, starts, topics, warnings_of)
            paths = [str(bag) for path in recordings for bag in bags_in(Path(path))]
            table, results = fit_each(request, paths, out, jobs, scheduler,
                                      lambda word: report(f'fitting: {word}', None))
            say.result(table, [result.data() for result in results])
            return
        fit = husky.identify(
            recordings, names_in(free), effects=effects, method=method,
            nuisance=names_in(nuisance), profiles=names_in(profile), seed=seed, starts=starts,
            jobs=jobs, scheduler=scheduler, topics=topics, progress=report)
        files = fit.save(out)
    say.result(fit, fit.data())
    say.remark('\nwritten: ' + ', '.join(str(path) for path in files[:-1]))
    say.written(files[-1])
