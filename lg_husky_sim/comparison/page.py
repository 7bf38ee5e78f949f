# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A comparison as files: table, JSON, pictures, and one page that holds them all."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
import json
import math
from pathlib import Path
import re
from typing import TYPE_CHECKING

from lg_husky_sim.comparison.figures import line_styles, responses_figure, trajectory_figure
from lg_husky_sim.comparison.metrics import UNITS
from lg_husky_sim.comparison.models import NamedPlant
from lg_husky_sim.comparison.outcome import (
    as_json,
    labels,
    RecordingOutcome,
    SegmentOutcome,
    text_table,
)
from lg_husky_sim.extras import require
from lg_husky_sim.recording.names import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MARKER = 'compare.json'
"""File that tells a folder of comparisons."""
LONGEST_VIEW = 60.0
"""Longest time shown in one picture of responses [s]; more cannot be read."""
DOTS = 130


@dataclass(frozen=True)
class Picture:
    """A picture file of one segment, and what it shows."""

    path: Path
    alt: str


def write_files(
    folder: Path, outcomes: Sequence[RecordingOutcome], plants: Sequence[NamedPlant],
    horizon: float = 0.0, most: int = 6, settings: Mapping[str, float] | None = None,
    on_progress: Callable[[], object] | None = None,
) -> tuple[Path, ...]:
    """
    Write compare.json, compare.txt, the pictures and index.html.

    Parameters
    ----------
    folder : pathlib.Path
        An existing, empty folder.
    outcomes : sequence of RecordingOutcome
    plants : sequence of NamedPlant
    horizon : float
        As it was compared with.
    most : int
        Segments of a recording that get pictures, the longest ones.
    settings : mapping of str to float, optional
        Parameters that were overridden in every model.
    on_progress : callable, optional
        Called after the pictures of each segment.

    Returns
    -------
    tuple of pathlib.Path
        The pictures.

    Raises
    ------
    MissingExtraError
        If matplotlib or jinja2 is not installed.
    """
    check_extras()
    data = as_json(outcomes, plants, horizon, settings)
    names = labels(outcomes)
    rivals = [name for name in names if name not in {named.label for named in plants}]
    styles = line_styles(names, rivals)
    pictures: list[list[Picture]] = []
    for place, outcome in enumerate(outcomes):
        made: list[Picture] = []
        for index, part in pictured(outcome, most):
            stem = f'{place + 1:02d}_{_safe(outcome.recording.name)}_{index + 1:02d}'
            title = outcome.recording.name
            if len(outcome.segments) > 1:
                title += f', segment {index + 1} of {len(outcome.segments)}'
            figure = responses_figure(part.segment, part.predictions, styles, title, LONGEST_VIEW)
            made.append(_save(figure, folder / f'{stem}_responses.png', f'Responses: {title}'))
            if part.tracks:
                figure = trajectory_figure(part.segment, part.tracks, styles, title, LONGEST_VIEW)
                made.append(_save(figure, folder / f'{stem}_trajectory.png',
                                  f'Trajectory and tracking error: {title}'))
            if on_progress is not None:
                on_progress()
        pictures.append(made)
    (folder / 'compare.txt').write_text(text_table(outcomes), encoding='utf-8')
    (folder / 'index.html').write_text(
        _page(outcomes, plants, names, pictures, horizon, most, settings or {}), encoding='utf-8')
    (folder / MARKER).write_text(
        json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False) + '\n', encoding='utf-8')
    return tuple(picture.path for made in pictures for picture in made)


def check_extras() -> None:
    """
    Check that pictures and page can be made.

    Raises
    ------
    MissingExtraError
        If matplotlib or jinja2 is not installed.
    """
    require('matplotlib', 'draw figures')
    require('jinja2', 'write a page')


def pictured(outcome: RecordingOutcome, most: int) -> Iterator[tuple[int, SegmentOutcome]]:
    """Yield the longest segments with their numbers, in order of time."""
    by_length = sorted(range(len(outcome.segments)),
                       key=lambda k: (-outcome.segments[k].segment.duration, k))
    for index in sorted(by_length[:most]):
        yield index, outcome.segments[index]


def _save(figure: Figure, path: Path, alt: str) -> Picture:
    figure.savefig(path, dpi=DOTS, metadata={'Software': None})
    return Picture(path, alt)


def _page(
    outcomes: Sequence[RecordingOutcome], plants: Sequence[NamedPlant], names: Sequence[str],
    pictures: Sequence[Sequence[Picture]], horizon: float, most: int,
    settings: Mapping[str, float],
) -> str:
    from jinja2 import Environment, PackageLoader
    environment = Environment(
        loader=PackageLoader('lg_husky_sim.comparison', '.'), autoescape=True,
        trim_blocks=True, lstrip_blocks=True)
    recordings = [{
        'name': outcome.recording.name,
        'path': printable(outcome.recording.path),
        'seconds': sum(part.segment.duration for part in outcome.segments),
        'segments': len(outcome.segments),
        'rows': _rows(outcome, names),
        'notes': (*outcome.recording.notes, *outcome.gaps()),
        'pictures': [{'data': b64encode(picture.path.read_bytes()).decode('ascii'),
                      'alt': picture.alt} for picture in made],
        'left_out': max(0, len(outcome.segments) - most),
    } for outcome, made in zip(outcomes, pictures, strict=True)]
    return environment.get_template('page.html.j2').render(
        title='Model and recording compared', labels=names, recordings=recordings,
        horizon=horizon, settings=settings,
        models=[{'label': named.label, 'path': named.path, 'about': named.model.about}
                for named in plants])


def _rows(outcome: RecordingOutcome, names: Sequence[str]) -> list[dict[str, object]]:
    errors = {name: outcome.errors(name) for name in names}
    rows = []
    for channel, unit in UNITS.items():
        values = [errors[name][channel].rmse if channel in errors[name] else math.nan
                  for name in names]
        rows.append(_row(f'{channel} [{unit}]', values))
    bounds = [outcome.bounds(name) for name in names]
    rows.append(_row('largest |X| error [m]', [pair[0] for pair in bounds]))
    rows.append(_row('largest |Y| error [m]', [pair[1] for pair in bounds]))
    return [row for row in rows if row]


def _row(name: str, values: Sequence[float]) -> dict[str, object]:
    known = [value for value in values if math.isfinite(value)]
    if not known:
        return {}
    return {'name': name, 'cells': [
        {'text': f'{value:.4f}' if math.isfinite(value) else '–',
         'best': len(known) > 1 and value == min(known)} for value in values]}


def _safe(name: str) -> str:
    """Return a name that is fit for a file."""
    return re.sub(r'[^A-Za-z0-9_-]+', '_', name)[:60] or 'recording'
