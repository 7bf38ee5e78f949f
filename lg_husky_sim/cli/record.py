# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky record`: write what a robot or simulator sends into a rosbag2."""

from __future__ import annotations

from pathlib import Path

import click


@click.command(short_help="Record the robot's topics into a rosbag2.")
@click.argument('bag', type=click.Path(path_type=Path))
@click.option('--preset', default='paper', show_default=True,
              help='Names and types of a robot: paper, husky_ros1 or clearpath_jazzy.')
@click.option('--storage', type=click.Choice(['mcap', 'sqlite3']), default='mcap',
              show_default=True, help='Storage of the rosbag2.')
@click.option('--seconds', type=click.FloatRange(min=0.0, min_open=True), metavar='SECONDS',
              help='End by itself after so long; by default Ctrl-C ends it.')
def command(bag: Path, preset: str, storage: str, seconds: float | None) -> None:
    """Record command, odometry, joint states, IMU, battery and /tf into the folder BAG."""
    from lg_husky_sim.ros import api
    from lg_husky_sim.ros.recorder import record
    from lg_husky_sim.ros.settings import make_settings

    settings = make_settings(preset=preset)
    api.init(args=[])
    try:
        counts = record(bag, settings, storage=storage, seconds=seconds)
    finally:
        api.try_shutdown()
    for topic, count in counts.items():
        click.echo(f'{count:8d}  {topic}')
    click.echo(f'{bag} written')
