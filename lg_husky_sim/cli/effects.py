# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky effects`: the catalogue of physics that can be added and found."""

from __future__ import annotations

from pathlib import Path

import click
from lg_husky_sim.cli.common import EFFECT, model_option, Output, spoken


@click.command(short_help='List the catalogue of effects, or what belongs to one.')
@click.argument('effect', required=False, metavar='[ID]', type=EFFECT)
@model_option('--robot', '--model', 'robot')
@spoken()
def command(effect: str | None, robot: Path | None, say: Output) -> None:
    """
    List the effects that a model can have, or what belongs to one.

    Of one: its parameters, drives and sensors that show it, and what to change on the robot and in
    the simulator where it is found. Typical values and bounds of parameters are in proportion to
    the robot. diagnose looks for all of these effects except static_friction and tyre_windup.
    """
    from lg_husky_sim.api.lists import list_effects
    say.result(list_effects(effect, robot))
