# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky identify`: estimate a model's parameters from recordings."""

from __future__ import annotations

from pathlib import Path

import click
from lg_husky_sim.cli.several import SeveralWords


@click.command(cls=SeveralWords,
               short_help='Estimate parameters from recordings; a model file and a report.')
@click.argument('recordings', nargs=-1, required=True, metavar='REC [REC …]')
@click.option('--out', required=True, type=click.Path(path_type=Path), metavar='FILE.yaml',
              help='Model file to write; the report stands beside it as .txt, .json and .html. '
                   'With --each a folder that gets these files for every recording.')
@click.option('--model', type=click.Path(path_type=Path), metavar='FILE.yaml',
              help="Model to start from; the Husky with the paper's parameters by default.")
@click.option('--set', 'settings', multiple=True, metavar='NAME=VALUE […]',
              help='Override physical parameters.')
@click.option('--free', multiple=True, metavar='NAMES',
              help='Parameters to estimate, separated by commas; by default those that the model '
                   'marks as free, and the numbers of its effects.')
@click.option('--effects', multiple=True, metavar='IDS',
              help='Effects of the catalogue to add, separated by commas: id, id:side or '
                   'id:shape, such as speed_loop,command_latency,command_limit:yaw.')
@click.option('--method', type=click.Choice(['least-squares', 'ga', 'de']),
              default='least-squares', show_default=True,
              help="Least squares on all outputs; or the paper's genetic algorithm, or "
                   'differential evolution, on the position alone (eq. 23).')
@click.option('--nuisance', multiple=True, metavar='NAMES',
              help='Unknowns of the recordings to estimate as well, separated by commas: '
                   'latency, delay_wheels, delay_imu, delay_pose, gyro_bias; and initial_state, '
                   'the state at the start of every segment that begins in motion.')
@click.option('--profile', multiple=True, metavar='NAMES',
              help='Parameters to give a likelihood profile, separated by commas: intervals '
                   'that hold for bent likelihoods too, at the price of more simulations.')
@click.option('--seed', type=click.IntRange(min=0), default=0, show_default=True,
              help='Seed of all chance: starts, genes, noise.')
@click.option('--starts', type=click.IntRange(min=1), default=6, show_default=True,
              help='Starts of the least squares.')
@click.option('--jobs', type=click.IntRange(min=1), default=1, show_default=True,
              help='Processes to use.')
@click.option('--scheduler', metavar='ADDRESS',
              help='Dask scheduler to use in place of processes, such as tcp://10.0.0.1:8786.')
@click.option('--each', is_flag=True,
              help='Fit every recording on its own in place of all together.')
@click.option('--topic', 'topics', multiple=True, metavar='ROLE=NAME […]',
              help='Choose a topic or frame of the recordings by hand (command=/cmd_vel, …).')
def command(
    recordings: tuple[str, ...], out: Path, model: Path | None, settings: tuple[str, ...],
    free: tuple[str, ...], effects: tuple[str, ...], method: str, nuisance: tuple[str, ...],
    profile: tuple[str, ...], seed: int, starts: int, jobs: int, scheduler: str | None,
    each: bool, topics: tuple[str, ...],
) -> None:
    """
    Estimate the parameters of a model from recordings.

    The model file can be read by sim_node, simulate and compare. The report says how far the
    parameters are known, and which of them the recordings cannot tell apart.
    """
    from lg_husky_sim.husky.model_file import apply_settings, load_model, parse_settings
    from lg_husky_sim.identification.options import names_in, with_effects
    from lg_husky_sim.identification.pages import check_extras
    from lg_husky_sim.identification.report import report_paths
    from lg_husky_sim.identification.result import Method
    from lg_husky_sim.identification.session import fit_each, fit_together, Request
    from lg_husky_sim.recording import TopicMap
    from tqdm import tqdm

    check_extras()
    if not each:
        report_paths(out)
    start = apply_settings(load_model(model), parse_settings(settings))
    request = Request(
        with_effects(start, effects), start, Method(method), names_in(free), names_in(nuisance),
        names_in(profile), seed, starts, TopicMap.parse(topics))
    with tqdm(desc='fitting', unit='step', disable=None, leave=False) as bar:
        def tell(word: str) -> None:
            bar.set_postfix_str(word, refresh=False)
            bar.update()
        if each:
            click.echo(fit_each(request, recordings, out, jobs, scheduler, tell))
            return
        result, paths = fit_together(request, recordings, out, jobs, scheduler, tell)
    click.echo(result)
    click.echo('\nwritten: ' + ', '.join(str(path) for path in paths))
