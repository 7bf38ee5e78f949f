# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky play`: send a recording into the ROS graph, as if the robot were there."""

from __future__ import annotations

from pathlib import Path

import click
from lg_husky_sim.cli.several import SeveralWords


@click.command(cls=SeveralWords,
               short_help='Play a recording into the ROS graph.')
@click.argument('recording', type=click.Path(path_type=Path), metavar='REC')
@click.option('--preset', default='paper', show_default=True,
              help='Names and types to send under: paper, husky_ros1 or clearpath_jazzy.')
@click.option('--topic', 'topics', multiple=True, metavar='ROLE=NAME […]',
              help='Choose a topic of the recording by hand (command=/cmd_vel, …).')
@click.option('--speed', default=1.0, show_default=True, type=click.FloatRange(0.01, 100.0),
              help='How many times as fast as it was recorded.')
@click.option('--wait', default=10.0, show_default=True, metavar='SECONDS',
              type=click.FloatRange(min=0.0), help='How long to wait for a listener.')
def command(recording: Path, preset: str, topics: tuple[str, ...], speed: float, wait: float
            ) -> None:
    """
    Send command, joint states, IMU and odometry of a recording, stamped now.

    A real Husky moves when it listens to the command topic in this ROS domain: look before you
    play.
    """
    from lg_husky_sim.recording import read_recording, TopicMap
    from lg_husky_sim.ros import api
    from lg_husky_sim.ros.player import play
    from lg_husky_sim.ros.settings import make_settings
    from tqdm import tqdm

    read = read_recording(recording, TopicMap.parse(topics))
    settings = make_settings(preset=preset)
    longest = max(series.times[-1] for series in read.streams.values() if len(series))
    api.init(args=[])
    try:
        with tqdm(total=round(float(longest), 2), desc=read.name, disable=None,
                  bar_format='{desc}: {percentage:3.0f}%|{bar}| {n:.1f}/{total:.1f} s') as bar:
            sent = play(read.streams, settings, wait=wait, speed=speed,
                        progress=lambda moment: bar.update(moment - bar.n))
    except api.ExternalShutdownException:
        # ROS 2 turns a signal into the end of the graph.
        raise click.Abort from None
    finally:
        api.try_shutdown()
    click.echo(f'{sent} messages sent')
