# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""`lg_husky compare`: replay recordings through models, draw and measure the difference."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click
from lg_husky_sim.cli.several import SeveralWords


@click.command(cls=SeveralWords,
               short_help='Replay recordings through models; figures and errors.')
@click.argument('recordings', nargs=-1, required=True, metavar='REC [REC …]')
@click.option('--model', 'models', multiple=True, type=click.Path(path_type=Path),
              metavar='FILE.yaml',
              help="Model file; several stand side by side. The Husky with the paper's "
                   'parameters by default.')
@click.option('--out', required=True, type=click.Path(path_type=Path), metavar='DIR',
              help='Folder for index.html, compare.json, compare.txt and the pictures.')
@click.option('--rival', 'rivals', multiple=True, metavar='BAG',
              help='A recording of the same drive by another simulator, one for each REC in '
                   'their order, to stand beside the models.')
@click.option('--set', 'settings', multiple=True, metavar='NAME=VALUE […]',
              help='Override physical parameters of every model.')
@click.option('--topic', 'topics', multiple=True, metavar='ROLE=NAME […]',
              help='Choose a topic or frame of the recordings by hand (command=/cmd_vel, …).')
@click.option('--horizon', type=float, default=0.0, metavar='SECONDS',
              help='Start anew from the measured state after so many seconds; by default only '
                   'at gaps.')
@click.option('--figures', 'most', type=click.IntRange(min=0), default=6, show_default=True,
              metavar='N', help='Segments of each recording that get pictures.')
def command(
    recordings: tuple[str, ...], models: tuple[Path, ...], out: Path, rivals: tuple[str, ...],
    settings: tuple[str, ...], topics: tuple[str, ...], horizon: float, most: int,
) -> None:
    """
    Replay the commands of recordings through models and show how far they are apart.

    Each segment without a gap starts in the state that the robot was in. DIR gets the paper's
    figures (responses; trajectory and tracking error), the root mean square error of each
    channel and the largest tracking errors, as a table, as JSON and on one page. Give the
    recordings in the order in which they were driven.
    """
    from lg_husky_sim.comparison.models import load_plants, plants_in, recordings_of
    from lg_husky_sim.comparison.outcome import compare_recording, text_table
    from lg_husky_sim.comparison.page import check_extras, MARKER, pictured, write_files
    from lg_husky_sim.errors import CommandError
    from lg_husky_sim.folders import check_folder, result_folder
    from lg_husky_sim.husky.model_file import parse_settings
    from lg_husky_sim.recording import named_apart, named_as_in, read_recording, TopicMap
    from tqdm import tqdm

    check_extras()
    check_folder(out)
    if not 0.0 <= horizon < float('inf'):
        raise CommandError(f'--horizon {horizon:g} s must be 0 or positive')
    if rivals and len(rivals) != len(recordings):
        raise CommandError(f'{len(rivals)} rivals for {len(recordings)} recordings: give one '
                           'for each recording, in their order, or none')
    overridden = parse_settings(settings)
    plants = load_plants(models, overridden)
    choice = TopicMap.parse(topics)
    read, = named_apart(named_as_in([read_recording(path, choice) for path in tqdm(
        recordings, desc='reading', unit='recording', disable=None, leave=False)],
        recordings_of(plants)))
    names = [recording.name for recording in read]
    outcomes = []
    for place, recording in enumerate(tqdm(read, desc='replaying', unit='recording',
                                           disable=None, leave=False)):
        rival = None
        if rivals:
            rival = (_rival_label(rivals, place, [named.label for named in plants]),
                     read_recording(rivals[place]))
        outcomes.append(compare_recording(
            recording, plants_in(plants, recording.name, names), rival, horizon))
    total = sum(1 for outcome in outcomes for _ in pictured(outcome, most))
    with result_folder(out, MARKER) as folder, \
            tqdm(total=total, desc='drawing', unit='segment', disable=None, leave=False) as bar:
        write_files(folder, outcomes, plants, horizon, most, overridden, bar.update)
    click.echo(text_table(outcomes))
    click.echo(f'{out / "index.html"}: pictures of {total} segment{"s" if total != 1 else ""}')


def _rival_label(rivals: tuple[str, ...], place: int, taken: Sequence[str]) -> str:
    """Return the name of a rival: one name for all, so that they are pooled, and no model's."""
    from lg_husky_sim.recording.names import printable
    label = printable('rival' if len(rivals) > 1 else Path(rivals[place]).stem)
    return f'{label} (rival)' if label in taken else label
