# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky import`: public data sets as rosbag2."""

from __future__ import annotations

from pathlib import Path

import click


@click.group(short_help='Turn a public data set into a rosbag2.')
def command() -> None:
    """Turn a public data set into a rosbag2 with the Husky's topics."""


@command.command(short_help="A run of NorLab's DRIVE data set.")
@click.argument('path', type=click.Path(path_type=Path), metavar='PATH')
@click.option('--out', required=True, type=click.Path(path_type=Path), metavar='BAG',
              help='Folder of the rosbag2 to write; it may exist only with --overwrite.')
@click.option('--robot', default='husky', show_default=True, metavar='NAME',
              help='husky or warthog: for processed runs, whose commands are wheel rates.')
@click.option('--storage', type=click.Choice(['mcap', 'sqlite3']), default='mcap',
              show_default=True, help='Storage of the rosbag2.')
@click.option('--overwrite', is_flag=True, help='Replace a rosbag2 that is at BAG.')
def drive(path: Path, out: Path, robot: str, storage: str, overwrite: bool) -> None:
    """
    Turn a run of NorLab's DRIVE data set into a rosbag2.

    PATH is a raw_dataframe.pkl or torch_ready_dataframe.pkl of
    github.com/norlab-ulaval/doughnut_calib. Pickles can run code; this one is read by a reader
    that knows tables of numbers and refuses anything else.
    """
    from lg_husky_sim.evaluation.drive_dataset import read_drive
    from lg_husky_sim.recording import write_recording
    from lg_husky_sim.recording.writer import check_target

    check_target(out, overwrite=overwrite)
    run = read_drive(path, robot)
    write_recording(out, run.streams, storage=storage, start_ns=run.start_ns,
                    overwrite=overwrite)
    streams = ', '.join(f'{name} {len(series)}' for name, series in run.streams.items())
    commands = run.streams['command'].times
    click.echo(f'{out}: {float(commands[-1] - commands[0]):.1f} s; samples: {streams}')
