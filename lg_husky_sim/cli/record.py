# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky record`: write what a robot or simulator sends into a rosbag2."""

from __future__ import annotations

from pathlib import Path

import click
from lg_husky_sim.cli.ros_arguments import robot_options, ROS_HELP, ros_tool, RosVerb, say


@click.command(cls=RosVerb, short_help="Record the robot's topics into a rosbag2.",
               epilog=ROS_HELP)
@click.argument('bag', type=click.Path(path_type=Path))
@robot_options
@click.option('--storage', type=click.Choice(['mcap', 'sqlite3']), default='mcap',
              show_default=True, help='Storage of the rosbag2.')
@click.option('--seconds', type=click.FloatRange(min=0.0, min_open=True), metavar='SECONDS',
              help='Stop after this time; by default only on Ctrl-C.')
@click.option('--wait', default=10.0, show_default=True, metavar='SECONDS',
              type=click.FloatRange(min=0.0), help='How long to look for a robot.')
def command(bag: Path, preset: str | None, namespace: str | None, storage: str,
            seconds: float | None, wait: float) -> None:
    """
    Record command, odometry, joint states, IMU, battery and transforms into the folder BAG.

    The bag is written as it grows: a process that is killed loses at most its last second.
    """
    from lg_husky_sim.ros import bag_writer
    from lg_husky_sim.ros.recorder import NAME, record

    # Before anything is waited for.
    bag_writer.check(bag, storage)
    with ros_tool(NAME, preset, namespace, wait=wait) as (tool, settings):
        counts = record(tool, bag, settings, storage=storage, seconds=seconds, wait=wait,
                        say=say)
    for topic, count in counts.items():
        click.echo(f'{count:8d}  {topic}')
    click.echo(f'{bag} written')
