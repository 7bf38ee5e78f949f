# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky simulate`: drive a model and write what its sensors read as a rosbag2."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click
from lg_husky_sim.cli.common import (
    COMMANDS,
    model_option,
    Output,
    settings_option,
    spoken,
    topics_option,
)
from lg_husky_sim.cli.several import SeveralWords

if TYPE_CHECKING:
    from lg_husky_sim.api.robots import Husky
    from lg_husky_sim.recording import TopicMap
    from lg_husky_sim.signals import TimeSeries


@click.command(cls=SeveralWords,
               short_help='Drive a model with commands; write a rosbag2.')
@model_option('--model', '--robot', 'model')
@click.option('--commands', required=True, metavar='REC|SCRIPT.yaml|NAME', type=COMMANDS,
              help='A recording, whose commands are driven from its initial pose; a command '
                   'script; or a built-in manoeuvre (lg_husky manoeuvres lists them).')
@click.option('--out', required=True, type=click.Path(path_type=Path), metavar='BAG',
              help='Folder of the rosbag2 to write.')
@click.option('--storage', type=click.Choice(['mcap', 'sqlite3']), default='mcap',
              show_default=True, help='Storage of the rosbag2.')
@click.option('--rate', type=float, metavar='HZ',
              help="Samples per second; by default a recording's own stamps, else 50.")
@settings_option
@topics_option
@click.option('--overwrite', is_flag=True, help='Replace a rosbag2 that is at BAG.')
@spoken()
def command(
    model: Path | None, commands: str, out: Path, storage: str, rate: float | None,
    settings: dict[str, float], topics: TopicMap, overwrite: bool, say: Output,
) -> None:
    """
    Drive a model with commands and write what its sensors read as a rosbag2.

    BAG gets the Husky's topics: /joint_states, /imu_um7/data, /tf and
    /husky_velocity_controller/cmd_vel. A recording with gaps is driven segment by segment, each
    from the state that the robot was in.

    A wheel rate is the mean over the 20 ms before its stamp, as an encoder counts it; all else is
    the state at the stamp.
    """
    from lg_husky_sim.api.driving import fastest_side
    from lg_husky_sim.api.robots import Husky
    from lg_husky_sim.recording.writer import check_target

    check_target(out, overwrite=overwrite)
    husky = Husky(model, **settings)
    driven = husky.simulate(commands, rate=rate, topics=topics)
    driven.save(out, storage=storage, overwrite=overwrite)
    x, y, heading = (float(value) for value in driven.pose.values[-1])
    seconds = float(driven.pose.times[-1] - driven.pose.times[0])
    say.result(
        f'{out}: {seconds:.1f} s, {len(driven.pose)} poses, ends at x = {x:.3f} m, '
        f'y = {y:.3f} m, heading = {heading:.3f} rad',
        {'bag': str(out), 'duration_s': seconds, 'poses': len(driven.pose),
         'end': {'x_m': x, 'y_m': y, 'heading_rad': heading}})
    wanted = fastest_side(driven.command, husky.parameters)
    most = 1.0 / husky.parameters['command_gain']
    if wanted > most:
        say.remark(f'commands ask {wanted:.2f} m/s of a side, and the model has its whole supply '
                   f'at {most:.2f} m/s (1/command_gain): it stays behind them')
    for remark in _missed(husky, driven.command):
        say.remark(remark)


def _missed(husky: Husky, commands: TimeSeries) -> Iterator[str]:
    """Say where the steady speed of the model is not the commanded one."""
    from lg_husky_sim.husky.by_hand import setting
    from lg_husky_sim.husky.steady_speed import steady_shares
    values, limit = husky.parameters, setting('missed_speed')
    forward, yaw = steady_shares(values)
    if commands.column('forward').any() and abs(forward - 1.0) > limit:
        yield (f'by its parameters the model drives straight at {forward:.2f} times the commanded '
               'speed; command_gain = torque_constant gear_ratio / (supply_voltage wheel_radius) '
               f'= {values["command_gain"] / forward:.4g} s/m would drive it as commanded')
    # Effects change how a robot turns; in straight driving they are losses beside this.
    if not husky.effects and commands.column('yaw').any() and min(
            abs(yaw - 1.0), abs(yaw / forward - 1.0)) > limit:
        yield (f'by its parameters the model turns at {yaw:.2f} times the commanded yaw rate; '
               f'with yaw_damping = {values["yaw_damping"]:.4g} N·m·s/rad, turn_ratio = '
               f'{values["turn_ratio"] * forward / yaw:.4g} m fits')
