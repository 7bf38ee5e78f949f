# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky demo`: the live node drives the paper's circle over the real topic."""

from __future__ import annotations

import os
from pathlib import Path

import click
from lg_husky_sim.cli.ros_arguments import drive_bar

MARKER = 'summary.txt'


@click.command(short_help="The live node drives the paper's circle; picture and summary.")
@click.option('--out', default=Path('out/demo'), show_default=True,
              type=click.Path(path_type=Path), metavar='DIR',
              help='Folder for bag/, picture.png and summary.txt; an earlier run is replaced.')
@click.option('--manoeuvre', default='circle', show_default=True, metavar='NAME',
              help='One of the built-in manoeuvres.')
@click.option('--model', '--robot', 'model', default='', metavar='FILE.yaml',
              help='Model file for the node, as written by identify and diagnose.')
def command(out: Path, manoeuvre: str, model: str) -> None:
    """
    Start the node, send it a manoeuvre from another process, record it and draw the result.

    Everything stays on this machine, in a ROS domain of its own, unless ROS_DOMAIN_ID and
    ROS_AUTOMATIC_DISCOVERY_RANGE say otherwise.
    """
    from lg_husky_sim.extras import require
    from lg_husky_sim.folders import check_folder, result_folder
    from lg_husky_sim.manoeuvres import find_manoeuvre
    from lg_husky_sim.ros.settings import make_settings

    require('rosbags', 'write recordings')
    require('matplotlib', 'draw pictures')
    check_folder(out)
    script = find_manoeuvre(manoeuvre)
    settings = make_settings()
    from lg_husky_sim.ros import api
    from lg_husky_sim.ros.demo import isolate, run_demo
    from lg_husky_sim.ros.demo_report import read_drive, save_picture, summary_lines

    isolate(os.environ, domain=10 + os.getpid() % 80)
    with result_folder(out, MARKER) as made:
        with drive_bar(f'driving the {script.name}', script.duration) as report:
            try:
                demo = run_demo(script, made / 'bag', settings, model, progress=report)
            except api.ExternalShutdownException:
                # ROS 2 turns a signal into the end of the graph.
                raise click.Abort from None
        drive = read_drive(made / 'bag', f'/{settings.command_topic}',
                           f'/{settings.ground_truth_topic}', f'/{settings.odometry_topic}')
        save_picture(drive, made / 'picture.png',
                     f'Live node in a ROS 2 graph, {script.name}: {script.about}')
        lines = [
            f'manoeuvre        {script.name}: {script.about}',
            f'model            {model or "packaged Husky, parameters of the paper"}',
            f'first odometry   {demo.first_odometry:.2f} s after the start of the node',
            *summary_lines(drive),
            f'node             ended with exit code {demo.exit_code} after Ctrl-C',
            'messages         ' + ', '.join(
                f'{topic} {count}' for topic, count in demo.counts.items()),
        ]
        (made / MARKER).write_text('\n'.join(lines) + '\n', encoding='utf-8')
    click.echo('\n'.join(lines))
    click.echo(f'\n{out}/picture.png, {out}/summary.txt and the recording {out}/bag are written')
