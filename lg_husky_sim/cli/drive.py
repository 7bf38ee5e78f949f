# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky drive`: send a manoeuvre to whoever listens: the node, or a real robot."""

from __future__ import annotations

from pathlib import Path

import click
from lg_husky_sim.cli.ros_arguments import (
    drive_bar,
    robot_options,
    ROS_HELP,
    ros_tool,
    RosVerb,
    say,
)


@click.command(cls=RosVerb, short_help='Send a manoeuvre to a running node.', epilog=ROS_HELP)
@click.argument('manoeuvre', metavar='NAME|FILE.yaml')
@robot_options
@click.option('--topic', help='Command topic, if not that of the preset.')
@click.option('--type', 'kind', type=click.Choice(['Twist', 'TwistStamped']),
              help='Message type, if not that of the preset.')
@click.option('--wait', default=10.0, show_default=True, metavar='SECONDS',
              type=click.FloatRange(min=0.0), help='How long to wait for a subscriber.')
def command(manoeuvre: str, preset: str | None, namespace: str | None, topic: str | None,
            kind: str | None, wait: float) -> None:
    """
    Send a built-in manoeuvre (circle, s_bend, obstacle, …) or one from a file, in real time.

    A real Husky in this ROS domain moves too: clear the area first. The subscribing nodes are
    printed first, commands stay within the limits of the preset, and zero commands are sent last,
    however it ends (done, Ctrl-C, an error, a signal).
    """
    from lg_husky_sim.manoeuvres import find_manoeuvre, load_manoeuvre
    from lg_husky_sim.ros.driver import drive, NAME

    script = load_manoeuvre(Path(manoeuvre)) if manoeuvre.endswith(('.yaml', '.yml')) else (
        find_manoeuvre(manoeuvre))
    with ros_tool(NAME, preset or ('paper' if topic else None), namespace, wait=wait,
                  command_topic=topic, command_type=kind) as (tool, settings), \
            drive_bar(script.name, script.duration) as report:
        sent = drive(tool, script, settings, wait=wait, say=say, progress=report)
        topic = tool.node.resolve_topic_name(settings.command_topic)
    click.echo(f'{sent} commands sent to {topic}')
