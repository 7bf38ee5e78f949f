# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A comparison as files: JSON and table, then the page and its pictures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
import json
import math
from pathlib import Path

from lg_husky_sim.comparison.models import NamedPlant
from lg_husky_sim.comparison.outcome import labels, RANKED, RecordingOutcome
from lg_husky_sim.comparison.traces import error_table, Predicted, recording_tables, traces_of
from lg_husky_sim.recording.names import printable
from lg_husky_sim.reporting.data import (
    Advice,
    ErrorTable,
    Headline,
    Provenance,
    ReportData,
)
from lg_husky_sim.reporting.words import (
    capitalised,
    plural,
    quantity,
    quantity_with_unit,
    SIGN,
    with_unit,
)
from lg_husky_sim.reporting.write import view_of, write_report

MARKER = 'compare.json'
"""File that tells a folder of comparisons."""
PAGE = 'index.html'


def write_files(
    folder: Path, data: ReportData, plain: Mapping[str, object], text: str, most: int = 6,
    on_progress: Callable[[], object] | None = None,
) -> tuple[Path, ...]:
    """
    Write compare.json, compare.txt, the pictures and index.html.

    Parameters
    ----------
    folder : pathlib.Path
        An existing, empty folder.
    data : ReportData
        The page.
    plain : mapping of str to object
        Content of compare.json.
    text : str
        Content of compare.txt.
    most : int
        Recordings that get pictures, the first ones.
    on_progress : callable, optional
        Called after each picture.

    Returns
    -------
    tuple of pathlib.Path
        The pictures.

    Raises
    ------
    MissingExtraError
        If matplotlib or jinja2 is not installed.

    """
    (folder / 'compare.txt').write_text(text, encoding='utf-8')
    (folder / MARKER).write_text(
        json.dumps(plain, indent=1, ensure_ascii=False, allow_nan=False) + '\n', encoding='utf-8')
    return write_report(data, folder, PAGE, pictured=most, on_progress=on_progress)


def report_data(
    outcomes: Sequence[RecordingOutcome], plants: Sequence[NamedPlant], horizon: float = 0.0,
    settings: Mapping[str, float] | None = None, provenance: Provenance | None = None,
    advice: Sequence[Advice] = (),
) -> ReportData:
    """
    Return a comparison as the values of a report, a column for each model and rival.

    Parameters
    ----------
    outcomes : sequence of RecordingOutcome
        One for each recording.
    plants : sequence of NamedPlant
        Models that were replayed, with their labels and files.
    horizon : float
        Time after which each prediction started anew [s]; 0 only at gaps.
    settings : mapping of str to float, optional
        Parameters that were set by hand, by name, for a note.
    provenance : Provenance, optional
        Of what files and versions the report is made.
    advice : sequence of Advice
        What to change on the robot and in the simulator.

    Returns
    -------
    ReportData

    """
    columns = labels(outcomes)
    parts: list[Predicted] = [(part.segment, part.predictions) for outcome in outcomes
                              for part in outcome.segments]
    tables = [error_table('All recordings' if len(outcomes) > 1 else outcomes[0].recording.name,
                          parts, columns)]
    if len(outcomes) > 1:
        tables += recording_tables(parts, columns)
    traces = traces_of(parts, columns)
    about = [(named.label, f'`{printable(named.path)}`'
              + (f', {named.model.about.rstrip(".")}' if named.model.about else ''))
             for named in plants]
    about += [(name, 'another recording of the same drive') for name in columns
              if name not in {named.label for named in plants}]
    seconds = sum(segment.duration for segment, _ in parts)
    starts = ('of the only segment' if len(parts) == 1 else
              f'of each of {plural(len(parts), "segment")}')
    notes = [f'The commands were replayed from the measured state at the start {starts}'
             + (f', anew every {horizon:g} s' if horizon else '')
             + f'. Errors are {SIGN}; x is ahead and y to the left of the robot as it stood at '
             'the start.']
    if settings:
        notes.append('Set in every model: ' + ', '.join(
            f'`{name} = {value:g}`' for name, value in settings.items()) + '.')
    scattered = {outcome.recording.name for outcome in outcomes if outcome.scatter()}
    notes += [f'{outcome.recording.name}: {note}' for outcome in outcomes
              for note in outcome.remarks()]
    names = ', '.join(outcome.recording.name for outcome in outcomes)
    data = ReportData(
        f'Comparison with {names}', _headline(tables[0], len(outcomes), seconds), columns,
        tuple(about), traces, tuple(tables), advice=tuple(advice), notes=tuple(notes),
        files=(('compare.json', 'has all numbers'), ('compare.txt', 'has the tables')),
        provenance=provenance or Provenance())
    # What is shown first is a difference of a model, not the scatter of a pose.
    steady = tuple(one for one in traces
                   if one.channel != 'forward' or one.recording not in scattered)
    return replace(data, view=view_of(replace(data, traces=steady)))


def _headline(table: ErrorTable, recordings: int, seconds: float) -> Headline:
    rows = {row.name: row for row in table.rows}
    shown = [quantity_with_unit(one) for one in RANKED]
    key = next((one for one in RANKED if quantity_with_unit(one) in rows), '')
    drives = ('Driven', f'{seconds:.0f} s in {plural(recordings, "recording")}')
    if not key:
        return Headline('No error can be computed', facts=(drives,))
    unit = quantity_with_unit(key).partition('[')[2].rstrip(']')
    values = {name: value for name, value in rows[quantity_with_unit(key)].values.items()
              if math.isfinite(value)}
    best = min(values, key=lambda name: values[name])
    facts = (*((name, with_unit(value, unit)) for name, value in values.items()), drives)
    if len(values) == 1:
        others = tuple((f'{capitalised(row.name.split(" [")[0])} error',
                        with_unit(row.values[best], row.name.partition('[')[2].rstrip(']')))
                       for row in table.rows if row.name in shown)
        return Headline(f'{best}: {with_unit(values[best], unit)} root mean square '
                        f'{quantity(key)} error', facts=(*others, drives))
    second = min(value for name, value in values.items() if name != best)
    return Headline(
        f'Closest to the recordings: {best}', facts=facts,
        sentences=(f'Its root mean square {quantity(key)} error is '
                   f'{with_unit(values[best], unit)}; that of the next is '
                   f'{with_unit(second, unit)}.',))
