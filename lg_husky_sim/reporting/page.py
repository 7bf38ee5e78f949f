# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of a report: HTML that needs no other file; every text in it is escaped."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Mapping, Sequence
from importlib.resources import files
import math
from typing import Any, TYPE_CHECKING

from lg_husky_sim.reporting.data import (
    ErrorTable,
    MEASURED,
    Mismatch,
    ParameterRow,
    RECALIBRATED,
    ReportData,
    View,
)
from lg_husky_sim.reporting.payload import packed_library, payload
from lg_husky_sim.reporting.sections import Cell, Table, Tone
from lg_husky_sim.reporting.words import (
    capitalised,
    change,
    digits_apart,
    number,
    padded,
    quantity,
    quantity_with_unit,
    SIGN,
    UNKNOWN,
)

if TYPE_CHECKING:
    from markupsafe import Markup

#: Mismatches in the table of a page; all of them are in the JSON file.
MOST_MISMATCHES = 15
#: Digits of an estimate that differs from the ends of its interval in none before.
MOST_DIGITS = 8
#: Errors [SI] that are all but zero: no sensor of a robot tells two of them apart.
NEGLIGIBLE = 1e-3


def code(text: str) -> Markup:
    """Return an escaped text whose parts in backquotes are code."""
    from markupsafe import escape, Markup
    parts = str(text).split('`')
    if len(parts) % 2 == 0:  # a backquote that belongs to a name
        return escape(text)
    return Markup('').join(
        Markup('<code>{}</code>').format(part) if place % 2 else escape(part)
        for place, part in enumerate(parts))


def breakable(name: str) -> Markup:
    """Return a name as it is typed, which a narrow column may break behind an underscore."""
    from markupsafe import escape, Markup
    return Markup('_<wbr>').join(escape(part) for part in name.split('_'))


def worded(table: Table) -> list[bool]:
    """Return which columns of a table hold words and stand to the left."""
    columns = [[one.text if isinstance(one, Cell) else one for one in column]
               for column in zip(*table.rows, strict=True)]
    return [any(text[:1].isalpha() or text[:1] in '`(' for text in column) for column in columns
            ] or [False] * len(table.head)


def error_cells(table: ErrorTable) -> Table:
    """
    Return a table of errors as cells: bars for sizes, and the change as gain or loss.

    Parameters
    ----------
    table : ErrorTable
        A row for each quantity, an error for each model.

    Returns
    -------
    Table
        Without a column to compare with, the smallest error of a row is marked.

    """
    head = ['error', *table.columns]
    if table.compared:
        head.append('change')
    rows = []
    for row in table.rows:
        known = {name: row.values[name] for name in table.columns
                 if math.isfinite(row.values.get(name, math.nan))}
        if not known:
            continue
        most, least = max(known.values()), min(known.values())
        cells: list[str | Cell] = [row.name]
        for name in table.columns:
            value = known.get(name, math.nan)
            best = table.compared is None and len(known) > 1 and value == least
            share = value / most if most > 0.0 and len(known) > 1 and name in known else 0.0
            cells.append(Cell(padded(value), share, Tone.GOOD if best else Tone.PLAIN))
        if table.compared:
            cells.append(_change_cell(known, table.compared, row.low, row.high))
        rows.append(cells)
    return Table(head, rows)


def _change_cell(known: Mapping[str, float], compared: tuple[str, str], low: float, high: float
                 ) -> Cell:
    before, after = (known.get(name, math.nan) for name in compared)
    if max(before, after) < NEGLIGIBLE:
        return Cell('both near 0')
    words = change(before, after)
    if math.isfinite(low) and math.isfinite(high):
        # On a narrow screen in two lines: the table must not hide its last column.
        ends = f'({change(1.0, low)} to {change(1.0, high)})'
        words += ' ' + ends.replace('\u00a0% to ', '\u00a0to ')
    # A change that is rounded away, or whose interval includes none, is neither.
    if not (math.isfinite(before) and math.isfinite(after)) or low < 1.0 < high or (
            abs(after - before) < 0.005 * before):
        return Cell(words)
    if after > before:
        return Cell(f'{words} worse', tone=Tone.BAD)
    return Cell(words, tone=Tone.GOOD if after < before else Tone.PLAIN)


def change_words(cell: Cell) -> str:
    """Return what a cell says where there are no colours: a gain is marked as a loss is."""
    return f'{cell.text} better' if cell.tone is Tone.GOOD else cell.text


def parameter_rows(rows: Sequence[ParameterRow]) -> list[dict[str, Any]]:
    """Return the table of parameters: numbers as text, and places within what the fit allows."""
    return [_parameter(one) for one in rows]


def _parameter(one: ParameterRow) -> dict[str, Any]:
    known = math.isfinite(one.low) and math.isfinite(one.high)
    drawn = math.isfinite(one.least) and math.isfinite(one.most) and one.most > one.least
    digits = max(4, min(MOST_DIGITS, digits_apart(one.value, one.low, one.high))) if known else 4
    interval = f'{number(one.low, digits)} to {number(one.high, digits)}' if known else '–'

    def at(value: float) -> float:
        share = 100.0 * (value - one.least) / (one.most - one.least)
        return min(100.0, max(0.0, share))
    places = {}
    if drawn:
        low, high = (at(one.low), at(one.high)) if known else (at(one.value), at(one.value))
        places = {'left': f'{low:.1f}', 'width': f'{high - low:.1f}',
                  'value_at': f'{at(one.value):.1f}', 'nominal_at': f'{at(one.nominal):.1f}',
                  'words': f'{number(one.value)} within {number(one.least)} to '
                           f'{number(one.most)}'}
    moved = change(1.0, one.value / one.nominal, 1) if one.nominal else UNKNOWN
    return {'name': breakable(one.name), 'nominal': number(one.nominal, 4),
            'value': number(one.value, digits), 'interval': interval,
            'unit': '' if one.unit == '1' else one.unit, 'at_bound': one.at_bound,
            'change': moved, 'drawn': drawn, **places}


def _mismatches(shown: Sequence[Mismatch], jumps: Mapping[int, int]) -> list[dict[str, Any]]:
    places = {place: number for number, place in jumps.items()}
    return [{'recording': breakable(one.recording), 'channel': one.channel, 'start': one.start,
             'end': one.end, 'strength': one.strength, 'part': one.part,
             'place': places.get(place)} for place, one in enumerate(shown)]


def jumps_of(data: ReportData) -> dict[int, int]:
    """
    Return which mismatches of the table can be shown: their place by a number of its own.

    Those of a quantity without a signal of its own (heading) show when they were in the others.
    """
    able = [place for place, one in enumerate(data.mismatches[:MOST_MISMATCHES])
            if one.recording in data.recordings]
    return dict(enumerate(able))


def said(text: str) -> str:
    """Return a remark as a sentence: a large letter first, a full stop last."""
    if text.split(' ')[0].isalpha():  # else a name, of a recording for one, which stays as it is
        text = capitalised(text)
    return text if text.endswith(('.', '!', '?', ':')) else f'{text}.'


def view_caption(data: ReportData, view: View) -> str:
    """Return what the first picture of a page shows."""
    words = ', '.join((MEASURED, *data.columns))
    return (f'{capitalised(quantity(view.channel))} of {view.recording}: {words}; below it the '
            f'errors, {SIGN}.')


def page(data: ReportData, view: View | None, images: Mapping[str, bytes],
         captions: Mapping[str, str], notes: Sequence[str] = ()) -> str:
    """
    Return the page.

    Parameters
    ----------
    data : ReportData
        What the report says and shows.
    view : View or None
        Of the first picture.
    images : mapping of str to bytes
        PNG by name; what the page shows where its live part cannot, and on paper.
    captions : mapping of str to str
        By the same names.
    notes : sequence of str
        More than those of the data.

    Returns
    -------
    str
        HTML.

    """
    from jinja2 import Environment, PackageLoader
    from markupsafe import Markup
    environment = Environment(
        loader=PackageLoader('lg_husky_sim.reporting', '.'), autoescape=True,
        trim_blocks=True, lstrip_blocks=True)
    environment.filters.update(code=code, errors=error_cells, quantity=quantity,
                               said=said, worded=worded)
    own = files('lg_husky_sim.reporting')
    jumps = jumps_of(data)
    listed = data.mismatches[:MOST_MISMATCHES]
    live = data.traces or any(section.charts for section in data.sections)
    library = packed_library() if live else ''
    heading = '' if view is None else (
        f'{capitalised(quantity_with_unit(view.channel))}: measured and predicted')
    return environment.get_template('report.html.j2').render(
        data=data, sign=SIGN, view=None if view is None else {
            'heading': heading, 'caption': view_caption(data, view)},
        css=Markup((own / 'report.css').read_text('utf-8')),  # noqa: S704, our own file
        script=Markup((own / 'report.js').read_text('utf-8')),  # noqa: S704, our own file
        library=Markup(library),  # noqa: S704, base64
        payload=Markup(payload(data, view, jumps)) if library else '',  # noqa: S704, no <
        images={name: b64encode(content).decode('ascii') for name, content in images.items()},
        captions=captions, recordings=data.recordings,
        responses=[name for name in images if name.endswith('_responses')],
        paths=[name for name in images if name.endswith('_trajectory')],
        has_path=any(trace.channel == 'x' for trace in data.traces),
        mismatches=_mismatches(listed, jumps), has_parts=any(one.part for one in listed),
        mismatch_of=RECALIBRATED if RECALIBRATED in data.columns else (*data.columns, '')[0],
        more_mismatches=len(data.mismatches) - len(listed),
        parameters=parameter_rows(data.parameters), notes=(*data.notes, *notes))
