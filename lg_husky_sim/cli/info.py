# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky info`: what a recording holds and is good for, before any fit."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click
from lg_husky_sim.cli.common import (
    model_option,
    Output,
    RECORDING,
    settings_option,
    spoken,
    topics_option,
)
from lg_husky_sim.cli.several import SeveralWords

if TYPE_CHECKING:
    from lg_husky_sim.recording import TopicMap


@click.command(cls=SeveralWords,
               short_help='Show what recordings contain and are good for, before any fit.')
@click.argument('recordings', nargs=-1, required=True, metavar='REC [REC …]', type=RECORDING)
@model_option('--model', '--robot', 'model')
@settings_option
@topics_option
@spoken()
def command(recordings: tuple[str, ...], model: Path | None, settings: dict[str, float],
            topics: TopicMap, say: Output) -> None:
    """
    Show what recordings contain and what they are good for, before any fit.

    The streams found, their rates and gaps, what had to be repaired, what was driven, how well the
    drive can determine the model's parameters, whether the wheels were on the ground and whether
    the robot is a Husky; and what is missing for a diagnosis. A folder stands for all bags in it.
    """
    from lg_husky_sim.api.recordings import read_all
    from lg_husky_sim.api.robots import Husky

    husky = Husky(model, **settings)
    surveys = []
    with say.stages() as report:
        for recording in read_all(recordings, topics=topics, progress=report):
            report(f'looking at {recording.name}', None)
            surveys.append(recording.info(husky))
    if say.as_json:
        say.result('', [survey.data() for survey in surveys])
        return
    for place, survey in enumerate(surveys):
        if place:
            click.echo('')
        say.result(survey.heading())
        for table in survey.tables():
            click.echo('')
            say.result(table)
