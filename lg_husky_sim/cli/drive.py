# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky drive`: send a manoeuvre to a running robot or simulator."""

from __future__ import annotations

from pathlib import Path
import sys

import click


@click.command(short_help='Send a manoeuvre to a running node.')
@click.argument('manoeuvre', metavar='NAME|FILE.yaml')
@click.option('--preset', default='paper', show_default=True,
              help='Names and types of a robot: paper, husky_ros1 or clearpath_jazzy.')
@click.option('--topic', help='Command topic, if not that of the preset.')
@click.option('--type', 'kind', type=click.Choice(['Twist', 'TwistStamped']),
              help='Message type, if not that of the preset.')
@click.option('--wait', default=10.0, show_default=True, metavar='SECONDS',
              type=click.FloatRange(min=0.0), help='How long to wait for a listener.')
def command(manoeuvre: str, preset: str, topic: str | None, kind: str | None, wait: float
            ) -> None:
    """
    Send a built-in manoeuvre (circle, s_bend, obstacle, …) or one from a file, in real time.

    A real Husky moves as well when it listens in this ROS domain: look before you drive.
    """
    from lg_husky_sim.manoeuvres import find_manoeuvre, load_manoeuvre
    from lg_husky_sim.ros import api
    from lg_husky_sim.ros.driver import drive
    from lg_husky_sim.ros.settings import make_settings
    from tqdm import tqdm

    script = load_manoeuvre(Path(manoeuvre)) if manoeuvre.endswith(('.yaml', '.yml')) else (
        find_manoeuvre(manoeuvre))
    given = {'preset': preset, 'command_topic': topic, 'command_type': kind}
    settings = make_settings({name: value for name, value in given.items() if value is not None})
    api.init(args=[])
    try:
        with tqdm(total=round(script.duration, 2), unit='s', desc=script.name,
                  bar_format='{desc}: {percentage:3.0f}%|{bar}| {n:.1f}/{total:.1f} s',
                  mininterval=0.1 if sys.stderr.isatty() else 5.0) as bar:
            sent = drive(script, settings, wait=wait,
                         progress=lambda moment: bar.update(moment - bar.n))
    except api.ExternalShutdownException:
        # ROS 2 turns a signal into the end of the graph.
        raise click.Abort from None
    finally:
        api.try_shutdown()
    click.echo(f'{sent} commands sent to {settings.command_topic}')
