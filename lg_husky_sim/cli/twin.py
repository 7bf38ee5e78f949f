# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky twin`: models beside a live robot, and how far each is off."""

from __future__ import annotations

from collections.abc import Sequence
import math
from pathlib import Path
from typing import TYPE_CHECKING

import click
from lg_husky_sim.cli.ros_arguments import robot_options, ROS_HELP, ros_tool, RosVerb, say

if TYPE_CHECKING:
    from lg_husky_sim.ros.twin import Twin


@click.command(cls=RosVerb, epilog=ROS_HELP,
               short_help='Run models alongside a live robot; show their errors.')
@click.option('--model', '--robot', 'model', required=True, type=click.Path(path_type=Path),
              metavar='FILE.yaml',
              help='Model file, such as the model.yaml of a diagnosis.')
@click.option('--plain', type=click.Path(path_type=Path), metavar='FILE.yaml',
              help="Model to compare with; by default the Husky with the paper's parameters, or "
              'of another robot the model without its effects.')
@robot_options
@click.option('--seconds', type=click.FloatRange(min=0.0, min_open=True), metavar='SECONDS',
              help='Stop after this time; by default only on Ctrl-C.')
@click.option('--every', default=1.0, show_default=True, metavar='SECONDS',
              type=click.FloatRange(min=0.05),
              help='Time between two printed lines, and between two publications.')
@click.option('--pose-topic', metavar='TOPIC',
              help='Odometry with the true pose of the robot (filtered, ground truth); the '
              'models are kept at it.')
@click.option('--wait', default=10.0, show_default=True, metavar='SECONDS',
              type=click.FloatRange(min=0.0), help='How long to look for a robot.')
def command(model: Path, plain: Path | None, preset: str | None, namespace: str | None,
            seconds: float | None, every: float, pose_topic: str | None, wait: float) -> None:
    """
    Subscribe to a robot's commands, joint states and IMU, and run two models alongside.

    The running errors (root mean square, the last 10 s) are printed and published as
    std_msgs/Float64 on twin/plain/wheel_rate_error, twin/model/yaw_rate_error, …; for plots
    (layout config/twin.foxglove.json), twin/measured and twin/model/reading are published at each
    stamp. The models start at the robot's wheel angles and pose, apply the delays, sensor
    faults and onsets that were found, and follow the clock of its stamps. The robot may as well be
    `lg_husky play REC` or another simulator. With -p use_sim_time:=true the times of the options
    are those of /clock.
    """
    from lg_husky_sim.husky.model import compile_model
    from lg_husky_sim.husky.model_file import load_model, nominal_of
    from lg_husky_sim.ros.tool import Ended
    from lg_husky_sim.ros.twin import NAME, Twin

    own = load_model(model)
    files = {'plain': nominal_of(own) if plain is None else load_model(plain), 'model': own}
    plants = {name: compile_model(one.structure).at(one.parameters)
              for name, one in files.items()}
    with ros_tool(NAME, preset, namespace, wait=wait) as (tool, settings):
        if tool.simulated:
            say('waiting for /clock')
            tool.wait_for_time(wait)
        twin = Twin(tool, plants, settings, _sides, pose_topic)

        def show(passed: float, silent: bool) -> None:
            now = (f'nothing received for {twin.silence:.1f} s' if silent
                   else _errors(twin, 'now'))
            click.echo(f'{passed:7.1f} s  {now}')
        try:
            twin.run(seconds, every, show)
        except Ended:
            click.echo('')
        finally:
            click.echo(f'  overall  {_errors(twin, "overall")}')


def _sides(names: Sequence[str], rates: Sequence[float]) -> tuple[float, float]:
    from lg_husky_sim.recording.wheels import side_means, wheel_sides
    sides = wheel_sides(names, len(rates))
    return side_means(rates, sides) if sides is not None else (math.nan, math.nan)


def _errors(twin: Twin, which: str) -> str:
    from lg_husky_sim.ros.twin import QUANTITIES
    words = []
    for quantity, unit in QUANTITIES.items():
        before, after = (float(getattr(twin.shadows[name].errors[quantity], which))
                         for name in ('plain', 'model'))
        if math.isfinite(before) and math.isfinite(after):
            change = f' ({100.0 * (after / before - 1.0):+.0f} %)' if before > 0.0 else ''
            words.append(f'{quantity.replace("_", " ")}: plain {before:.4f}, model {after:.4f} '
                         f'{unit}{change}')
    return '; '.join(words) or 'nothing received yet'
