# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky play`: send a recording into the ROS graph, as if the robot were there."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click
from lg_husky_sim.cli.common import topics_option
from lg_husky_sim.cli.ros_arguments import (
    drive_bar,
    robot_options,
    ROS_HELP,
    ros_tool,
    RosVerb,
    say,
)

if TYPE_CHECKING:
    from lg_husky_sim.recording import TopicMap


@click.command(cls=RosVerb, short_help='Play a recording into the ROS graph.', epilog=ROS_HELP)
@click.argument('recording', type=click.Path(path_type=Path), metavar='REC')
@robot_options
@topics_option
@click.option('--speed', default=1.0, show_default=True, type=click.FloatRange(0.01, 100.0),
              help='Speed of playing, as a multiple of the recorded one.')
@click.option('--wait', default=10.0, show_default=True, metavar='SECONDS',
              type=click.FloatRange(min=0.0), help='How long to wait for a subscriber.')
def command(recording: Path, preset: str | None, namespace: str | None, topics: TopicMap,
            speed: float, wait: float) -> None:
    """
    Send command, joint states, IMU and odometry of a recording, stamped now.

    A real Husky in this ROS domain that subscribes to the command topic moves: clear the area
    first. The subscribing nodes are printed first, commands stay within the limits of the preset,
    and zero commands are sent last, however it ends.
    """
    from lg_husky_sim.recording import read_recording
    from lg_husky_sim.ros.player import NAME, play

    read = read_recording(recording, topics)
    longest = max(series.times[-1] for series in read.streams.values() if len(series))
    with ros_tool(NAME, preset, namespace, wait=wait) as (tool, settings), \
            drive_bar(read.name, float(longest)) as report:
        sent = play(tool, read.streams, settings, wait=wait, speed=speed, say=say,
                    progress=report)
    click.echo(f'{sent} messages sent')
