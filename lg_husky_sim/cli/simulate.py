# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky simulate`: drive a model and write what its sensors read as a rosbag2."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click
from lg_husky_sim.cli.several import SeveralWords

if TYPE_CHECKING:
    from lg_husky_sim.recording import TopicMap
    from lg_husky_sim.signals import TimeSeries


@click.command(cls=SeveralWords,
               short_help='Drive a model with commands; write a rosbag2.')
@click.option('--model', 'model', type=click.Path(path_type=Path), metavar='FILE.yaml',
              help="Model file; the Husky with the paper's parameters by default.")
@click.option('--commands', required=True, metavar='REC|SCRIPT.yaml|NAME',
              help='A recording, whose commands are driven from its initial pose; a command '
                   'script; or a built-in manoeuvre such as circle, s_bend or obstacle.')
@click.option('--out', required=True, type=click.Path(path_type=Path), metavar='BAG',
              help='Folder of the rosbag2 to write; it must not exist.')
@click.option('--storage', type=click.Choice(['mcap', 'sqlite3']), default='mcap',
              show_default=True, help='Storage of the rosbag2.')
@click.option('--rate', type=float, metavar='HZ',
              help="Samples per second; by default a recording's own stamps, else 50.")
@click.option('--set', 'settings', multiple=True, metavar='NAME=VALUE […]',
              help='Override physical parameters.')
@click.option('--topic', 'topics', multiple=True, metavar='ROLE=NAME […]',
              help='Choose a topic or frame of the recording by hand (command=/cmd_vel, …).')
@click.option('--overwrite', is_flag=True, help='Replace a rosbag2 that is at BAG.')
def command(
    model: Path | None, commands: str, out: Path, storage: str, rate: float | None,
    settings: tuple[str, ...], topics: tuple[str, ...], overwrite: bool,
) -> None:
    """
    Drive a model with commands and write what its sensors read as a rosbag2.

    BAG gets the Husky's topics: /joint_states, /imu_um7/data, /tf and
    /husky_velocity_controller/cmd_vel. A recording with gaps is driven segment by segment, each
    from the state that the robot was in.
    """
    from lg_husky_sim.comparison.models import load_plants, recordings_of
    from lg_husky_sim.husky.model_file import parse_settings
    from lg_husky_sim.manoeuvres import checked_rate
    from lg_husky_sim.recording import TopicMap, write_recording
    from lg_husky_sim.recording.writer import check_target, START_NS

    check_target(out, overwrite=overwrite)
    if rate is not None:
        checked_rate(rate)
    (named,) = load_plants([model] if model else [], parse_settings(settings))
    values = named.model.parameters
    torque = values['torque_constant'] * values['gear_ratio']
    choice = TopicMap.parse(topics)
    start_ns, frames = START_NS, ('odom', 'base_link')
    if _is_recording(commands):
        from lg_husky_sim.comparison.output import simulate_recording
        from lg_husky_sim.recording import named_as_in, read_recording
        recording, = named_as_in([read_recording(commands, choice)], recordings_of([named]))
        start_ns = recording.start_ns
        frames = recording.frames if recording.frames[0] else frames
        streams = simulate_recording(named.plant, recording, torque, rate or 0.0)
    else:
        from lg_husky_sim.comparison.output import DEFAULT_RATE, simulate_commands
        streams = simulate_commands(named.plant, _script(commands, choice), torque,
                                    rate or DEFAULT_RATE)
    write_recording(out, streams, storage=storage, start_ns=start_ns, frames=frames,
                    overwrite=overwrite)
    pose = streams['pose']
    x, y, heading = (float(value) for value in pose.values[-1])
    click.echo(f'{out}: {_length(streams):.1f} s, {len(pose)} poses, ends at x = {x:.3f} m, '
               f'y = {y:.3f} m, heading = {heading:.3f} rad')


def _is_recording(commands: str) -> bool:
    """Tell a recording from a script or a built-in name: by what is there, then by ending."""
    path = Path(commands)
    return (path.is_dir() or path.name == 'metadata.yaml'
            or path.suffix in ('.mcap', '.db3', '.bag'))


def _script(commands: str, topics: TopicMap) -> TimeSeries:
    from lg_husky_sim.errors import CommandError
    from lg_husky_sim.manoeuvres import find_manoeuvre, load_manoeuvre
    from lg_husky_sim.recording import TopicMap
    if topics != TopicMap():
        raise CommandError(f'--topic is of use only with a recording, and {commands} is none')
    path = Path(commands)
    if path.suffix in ('.yaml', '.yml') or path.is_file():
        return load_manoeuvre(path).commands()
    if len(path.parts) > 1:
        raise CommandError(f'no recording or command script {commands}: there is no such file')
    return find_manoeuvre(commands).commands()


def _length(streams: dict[str, TimeSeries]) -> float:
    times = streams['pose'].times
    return float(times[-1] - times[0])
