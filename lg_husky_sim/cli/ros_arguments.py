# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Verbs that live in a ROS graph: ``--ros-args``, ``--preset`` and ``--namespace``."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
import sys
from typing import TYPE_CHECKING, TypeVar

import click
from lg_husky_sim.cli.several import SeveralWords

if TYPE_CHECKING:
    from lg_husky_sim.ros.settings import Settings
    from lg_husky_sim.ros.tool import Tool

_KEY = 'lg_husky_sim.ros_args'
_Verb = TypeVar('_Verb', bound=Callable[..., object])

ROS_HELP = """\b
ROS arguments go after --ros-args, as for every ROS node:
  -r __ns:=/a200_0000     namespace (also --namespace, ROS_NAMESPACE)
  -r FROM:=TO             another topic
  -p NAME:=VALUE          a parameter of sim_node (imu_topic, max_forward, …)
  -p use_sim_time:=true   the pace of /clock
"""


def split_ros_args(words: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return a command line without its --ros-args sections, and what is in them."""
    own: list[str] = []
    ros: list[str] = []
    inside = False
    for word in words:
        if not inside and word == '--ros-args':
            inside = True
        elif inside and word == '--':
            inside = False
        else:
            (ros if inside else own).append(word)
    return own, ros


class RosVerb(SeveralWords):
    """A verb that takes ROS arguments as well."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        own, ctx.meta[_KEY] = split_ros_args(args)
        return super().parse_args(ctx, own)


def robot_options(verb: _Verb) -> _Verb:
    """Give a verb the options that choose a robot."""
    namespace = click.option(
        '--namespace', metavar='NAME',
        help='Namespace of the robot; by default that of the only robot in the graph.')
    preset = click.option(
        '--preset', help='Names and types of a robot: paper, husky_ros1 or clearpath_jazzy; by '
        'default those of the only robot in the graph.')
    return preset(namespace(verb))


@contextmanager
def ros_tool(name: str, preset: str | None, namespace: str | None, *, wait: float = 10.0,
             **given: object) -> Iterator[tuple[Tool, Settings]]:
    """
    Join the graph and find the robot.

    Parameters
    ----------
    name : str
        Of the node.
    preset, namespace : str, optional
        From the command line.
    wait : float
        How long to look for a robot [s].
    **given
        Settings from the command line; None where not given.

    Yields
    ------
    tuple
        The tool, and the settings of its robot.

    Raises
    ------
    click.Abort
        If the tool was asked to end before it was done.

    """
    from lg_husky_sim.ros.tool import choose, Ended, joined, Tool

    words = click.get_current_context().meta.get(_KEY, [])
    try:
        with joined(words) as orderly:
            preset, place = choose(orderly, words, preset=preset, namespace=namespace, wait=wait,
                                   say=say)
            tool = Tool(name, orderly, place)
            try:
                settings = tool.settings(
                    {'preset': preset, **{key: value for key, value in given.items()
                                          if value is not None}})
                yield tool, settings
            finally:
                tool.close()
    except Ended:
        raise click.Abort from None


@contextmanager
def drive_bar(name: str, seconds: float) -> Iterator[Callable[[float], object]]:
    """Show how far a drive is, told its moment [s]: a bar on a terminal, elsewhere a line."""
    from tqdm import tqdm

    with tqdm(total=round(seconds, 2), desc=name, disable=None,
              bar_format='{desc}: {percentage:3.0f}%|{bar}| {n:.1f}/{total:.1f} s') as bar:
        if bar.disable:
            click.echo(f'{name}: {seconds:.1f} s', err=True)
        yield lambda moment: bar.update(moment - bar.n)


def say(text: str) -> None:
    """Print a line on standard error, where it disturbs no output; a bar there is drawn anew."""
    from tqdm import tqdm

    with tqdm.external_write_mode(file=sys.stderr):
        click.echo(text, err=True)
