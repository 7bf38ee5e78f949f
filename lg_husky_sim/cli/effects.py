# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky effects`: the catalogue of physics that can be added and found."""

from __future__ import annotations

import click
from lg_husky_sim.cli.common import EFFECT, Output, spoken


@click.command(short_help='List the catalogue of effects, or the parameters of one.')
@click.argument('effect', required=False, metavar='[ID]', type=EFFECT)
@spoken()
def command(effect: str | None, say: Output) -> None:
    """List the effects that a model can have, or the parameters of one.

    What diagnose looks for are these, but for static_friction and tyre_windup.
    """
    from lg_husky_sim.api.lists import list_effects
    say.result(list_effects(effect))
