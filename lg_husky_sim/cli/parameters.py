# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky parameters`: the physical parameters of a model."""

from __future__ import annotations

from pathlib import Path

import click
from lg_husky_sim.cli.common import misused, MODEL, model_option, Output, spoken


@click.command(short_help="List a model's parameters: value, unit, bounds, source.")
@click.argument('model', required=False, metavar='[FILE.yaml]', type=MODEL)
@model_option('--robot', '--model', 'robot')
@spoken()
def command(model: Path | None, robot: Path | None, say: Output) -> None:
    """
    List the parameters of a model file, of the packaged Husky by default.

    low and high bound the 95 % interval of an estimate; lower and upper are what the model
    accepts. tolerance is the relative standard deviation assumed before a fit.
    """
    from lg_husky_sim.api.robots import Husky
    if model is not None and robot is not None:
        message = f'{model} and --robot {robot} are given; one model is listed at a time'
        raise misused(message)
    say.result(Husky(robot if model is None else model).table())
