# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky manoeuvres`: the built-in command scripts."""

from __future__ import annotations

import click
from lg_husky_sim.cli.common import Output, spoken


@click.command(short_help='List the built-in manoeuvres.')
@spoken()
def command(say: Output) -> None:
    """List the manoeuvres that simulate, drive and demo know by name."""
    from lg_husky_sim.api.lists import list_manoeuvres
    say.result(list_manoeuvres())
