# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Tables of results: as text, as HTML for notebooks, and as DataFrames."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
import math
import re
from typing import Any

from lg_husky_sim.extras import require


def cell(value: object) -> str:
    """Return a value as it stands in a table; what is missing is a dash."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return '–'
    if isinstance(value, float):
        return f'{value:.4g}'
    if isinstance(value, bool):
        return 'yes' if value else 'no'
    return ', '.join(value) if isinstance(value, tuple) else str(value)


def is_number(value: object) -> bool:
    """Return whether a cell is set flush right."""
    return value is None or (isinstance(value, (int, float)) and not isinstance(value, bool))


@dataclass(frozen=True, repr=False)
class Table:
    """
    Rows under named columns.

    Parameters
    ----------
    title : str
    columns : tuple of str
    rows : tuple of tuple
        Texts, numbers, booleans and tuples of texts; None where there is none.
    notes : mapping of str to tuple of str
        Sentences below it by their heading.

    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[object, ...], ...]
    notes: Mapping[str, tuple[str, ...]] = field(default_factory=dict, hash=False)

    def flush(self) -> list[bool]:
        """Return which columns hold numbers only and are set flush right."""
        return [bool(self.rows) and all(is_number(row[k]) for row in self.rows)
                for k in range(len(self.columns))]

    def __str__(self) -> str:
        """Return the table as text, columns aligned."""
        cells = [self.columns, *(tuple(map(cell, row)) for row in self.rows)]
        widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
        right = self.flush()
        lines = ['  '.join(text.rjust(width) if flush else text.ljust(width)
                           for text, width, flush in zip(row, widths, right, strict=True)
                           ).rstrip() for row in cells]
        return '\n'.join([*[self.title] * bool(self.title), *lines, *self.remarks()])

    __repr__ = __str__

    def remarks(self) -> list[str]:
        """Return the notes as lines of text."""
        return [line for heading, items in self.notes.items() if items
                for line in ('', heading, *(f'  - {item}' for item in items))]

    def html(self) -> str:
        """Return the table as HTML; every text in it is escaped."""
        sides = ['right' if flush else 'left' for flush in self.flush()]
        head = ''.join(f'<th style="text-align:{side}">{escape(name)}</th>'
                       for name, side in zip(self.columns, sides, strict=True))
        body = ''.join('<tr>' + ''.join(
            f'<td style="text-align:{side}">{escape(cell(value))}</td>'
            for value, side in zip(row, sides, strict=True)) + '</tr>' for row in self.rows)
        title = f'<caption>{escape(self.title)}</caption>' if self.title else ''
        table = f'<table>{title}<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>'
        return table + _lists(self.notes)

    _repr_html_ = html

    def to_pandas(self) -> Any:
        """Return the table as a pandas DataFrame."""
        require('pandas', 'make a DataFrame')
        import pandas as pd

        return pd.DataFrame(list(self.rows), columns=list(self.columns))

    def data(self) -> list[dict[str, object]]:
        """Return the rows as plain data for JSON, keys in one word; no finite number is None."""
        keys = [re.sub(r'\W+', '_', name).strip('_') for name in self.columns]
        return [{key: finite(value) for key, value in zip(keys, row, strict=True)}
                for row in self.rows]


def finite(value: object) -> object:
    """Return a value that JSON can hold."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _code(text: str) -> str:
    return re.sub('`([^`]*)`', r'<code>\1</code>', escape(text))


def _lists(points: Mapping[str, Sequence[str]]) -> str:
    # Lists as HTML, by their heading; empty ones are left out.
    return ''.join(
        f'<p><b>{escape(heading)}</b></p><ul>'
        + ''.join(f'<li>{_code(item)}</li>' for item in items) + '</ul>'
        for heading, items in points.items() if items)


def page_part(title: str, lines: Sequence[str], tables: Sequence[Table],
              points: Mapping[str, Sequence[str]] | None = None) -> str:
    """
    Return a result as HTML for a notebook; every text in it is escaped.

    Parameters
    ----------
    title : str
        Heading of the part, as plain text.
    lines : sequence of str
        Paragraphs.
    tables : sequence of Table
        Below the paragraphs; those without rows are left out.
    points : mapping of str to sequence of str, optional
        Lists by their heading; empty ones are left out.

    """
    parts = [f'<h4>{escape(title)}</h4>', *(f'<p>{escape(line)}</p>' for line in lines),
             *(table.html() for table in tables if table.rows)]
    return '<div class="lg-husky">' + ''.join(parts) + _lists(points or {}) + '</div>'
