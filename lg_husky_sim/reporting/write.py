# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Write a report: one page that needs nothing else, and its pictures as files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
import re
from typing import TYPE_CHECKING

from lg_husky_sim.extras import require
from lg_husky_sim.reporting.data import RECALIBRATED, ReportData, Trace, View, WITH_FINDING
from lg_husky_sim.reporting.page import page, view_caption
from lg_husky_sim.reporting.payload import of_first_recordings
from lg_husky_sim.reporting.pictures import (
    chart_picture,
    first_picture,
    path_picture,
    png,
    responses_picture,
)
from lg_husky_sim.reporting.thinning import longest_stretch
from lg_husky_sim.reporting.words import plural
from lg_husky_sim.signals import FloatArray
import numpy as np

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Name of the page.
REPORT = 'report.html'
#: Recordings whose signals a page shows, and recordings whose pictures it prints.
MOST_RECORDINGS = 24
MOST_PICTURED = 3
#: Longest stretch of the first picture [s].
FIRST_VIEW = 30.0


def check_extras() -> None:
    """
    Check that pictures and pages can be made.

    Raises
    ------
    MissingExtraError
        If matplotlib or jinja2 is not installed.

    """
    require('matplotlib', 'draw figures')
    require('jinja2', 'write a page')


def write_report(data: ReportData, folder: Path, name: str = REPORT, *,
                 pictured: int = MOST_PICTURED,
                 on_progress: Callable[[], object] | None = None) -> tuple[Path, ...]:
    """
    Write the page and the pictures.

    Parameters
    ----------
    data : ReportData
        What the report says and shows.
    folder : pathlib.Path
        An existing folder.
    name : str
        Of the page.
    pictured : int
        Recordings that get pictures of their signals and path, the first ones; with none, the
        first picture of the page is not drawn either.
    on_progress : callable, optional
        Called after each picture.

    Returns
    -------
    tuple of pathlib.Path
        The pictures. One that cannot be drawn is a note on the page and no reason to lose the
        rest.

    Raises
    ------
    MissingExtraError
        If matplotlib or jinja2 is not installed.

    """
    check_extras()
    images, captions, notes = drawn(data, pictured, on_progress)
    for key, content in images.items():
        (folder / f'{key}.png').write_bytes(content)
    shown = of_first_recordings(data, MOST_RECORDINGS)
    if shown is not data:
        more = plural(len(data.recordings) - MOST_RECORDINGS, 'further recording')
        notes.append(f'The signals of {more} are left out: a page shows {MOST_RECORDINGS}.')
    (folder / name).write_text(page(shown, view_of(shown), images, captions, notes),
                               encoding='utf-8', errors='replace')
    return tuple(folder / f'{key}.png' for key in images)


def view_of(data: ReportData) -> View | None:
    """
    Return the stretch that is shown first: the one given, or where the last model helps most.

    Parameters
    ----------
    data : ReportData
        Its traces tell, unless it has a view.

    Returns
    -------
    View or None
        None without a trace of a rate.

    """
    if data.view is not None and data.trace(data.view.recording, data.view.channel):
        return data.view
    # No model says anything of the speeds of a pose that is too slow for a rate.
    rates = [trace for trace in data.traces
             if trace.predicted and trace.channel not in ('x', 'y', 'heading')]
    if not rates or not data.columns:
        return None
    gains = [(trace, _gain(trace)) for trace in rates]
    spread = {channel: float(np.nanvar(np.concatenate(
        [t.measured for t in rates if t.channel == channel]))) for channel in
        {trace.channel for trace in rates}}
    best, gain = max(gains, key=lambda one: float(np.nansum(one[1]))
                     / max(spread[one[0].channel], 1e-12) / max(one[0].times.size, 1) ** 0.5)
    return View(best.recording, best.channel, *longest_stretch(best.times, gain, FIRST_VIEW))


def _gain(trace: Trace) -> FloatArray:
    # What the finding takes off the squared error; the squared error itself without a finding.
    columns = trace.predicted
    if WITH_FINDING in columns and RECALIBRATED in columns:
        before, after = ((trace.measured - columns[name]) ** 2
                         for name in (RECALIBRATED, WITH_FINDING))
        gain: FloatArray = before - after
        return gain
    worst: FloatArray = (trace.measured - next(iter(columns.values()))) ** 2
    return worst


def file_stem(text: str) -> str:
    """Return a text that is fit for the name of a file."""
    return re.sub(r'[^A-Za-z0-9_-]+', '_', text)[:60] or 'recording'


def drawn(data: ReportData, pictured: int = MOST_PICTURED,
          on_progress: Callable[[], object] | None = None,
          ) -> tuple[dict[str, bytes], dict[str, str], list[str]]:
    """
    Draw all pictures of a report.

    Parameters
    ----------
    data : ReportData
        What the report says and shows.
    pictured : int
        Recordings that get pictures of their signals and path.
    on_progress : callable, optional
        Called after each picture.

    Returns
    -------
    dict of str to bytes
        PNG by name.
    dict of str to str
        Captions by name.
    list of str
        A line for each picture that could not be drawn.

    """
    images: dict[str, bytes] = {}
    captions: dict[str, str] = {}
    failures: list[str] = []
    for name, (caption, draw) in _jobs(data, pictured).items():
        captions[name] = caption
        try:
            images[name] = png(draw(), _about(data, caption))
        except Exception as error:  # a picture is worth less than the answer beside it
            failures.append(f'The picture {name}.png could not be drawn: '
                            f'{type(error).__name__}: {error}.')
        if on_progress is not None:
            on_progress()
    return images, captions, failures


def _about(data: ReportData, caption: str) -> dict[str, str]:
    """Return what a picture's file says of itself: what it shows, the answer, its command."""
    head, errors = data.headline, []
    for table in data.errors:
        for row in table.rows:
            values = ', '.join(f'{column} {row.values[column]:.4g}' for column in table.columns
                               if column in row.values)
            errors.append(f'{table.title}, {row.name}: {values}')
    lines = (head.text, *(f'{name}: {value}' for name, value in head.facts), *head.sentences,
             *head.warnings, *errors)
    known = {'Title': caption, 'Description': '\n'.join(lines), 'Source': data.provenance.command,
             'Software': f'lg_husky_sim {data.provenance.version}'.strip()}
    return {key: value for key, value in known.items() if value}


def _jobs(data: ReportData, pictured: int) -> Mapping[str, tuple[str, Callable[[], Figure]]]:
    jobs: dict[str, tuple[str, Callable[[], Figure]]] = {}
    view = view_of(data)
    if view is not None and pictured:
        jobs['before_after'] = (view_caption(data, view), partial(first_picture, data, view))
    for place, name in enumerate(data.recordings[:pictured]):
        stem = f'{place + 1:02d}_{file_stem(name)}'
        jobs[f'{stem}_responses'] = (
            f'Signals of {name}', partial(responses_picture, data, name))
        if data.trace(name, 'x') and data.trace(name, 'y'):
            jobs[f'{stem}_trajectory'] = (
                f'Path and tracking error of {name}', partial(path_picture, data, name))
    for section in data.sections:
        for chart in section.charts:
            jobs[chart.name] = (chart.caption, partial(chart_picture, chart))
        for drawing in section.drawings:
            jobs[drawing.name] = (drawing.caption, drawing.draw)
    return jobs
