# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Tables on a terminal: as wide as it is, lines broken between words or names of a topic."""

from __future__ import annotations

from collections.abc import Sequence
import re
from typing import Any

from lg_husky_sim.api.tables import cell, Table

#: Columns between two columns of a table.
GAP = 2


def print_table(table: Table, console: Any) -> None:
    """
    Print a table.

    Parameters
    ----------
    table : Table
        Columns in which nothing is known are left out.
    console : rich.console.Console
        Lines are longer than it is wide only where whole words do not fit side by side.

    """
    from rich.box import SIMPLE_HEAD
    from rich.table import Table as Grid
    from rich.text import Text

    shown = [place for place in range(len(table.columns))
             if not table.rows or any(row[place] is not None for row in table.rows)]
    names = [table.columns[place] for place in shown]
    cells = [[cell(row[place]) for place in shown] for row in table.rows]
    widths = _widths([names, *cells], console.width)
    flush = table.flush()
    grid = Grid(box=SIMPLE_HEAD, header_style='bold cyan', padding=(0, GAP - 1, 0, 0),
                pad_edge=False, show_edge=False)
    for place, name, width in zip(shown, names, widths, strict=True):
        # Text, since rich takes the unit [s] for a markup.
        grid.add_column(Text(name), justify='right' if flush[place] else 'left', width=width,
                        style='bold' if place == 0 else '')
    for row in cells:
        broken = map(_broken, row, widths)
        grid.add_row(*map(Text, broken))
    if table.title:
        console.print(Text(table.title, 'bold'), soft_wrap=True)
    console.width = max(_room(widths), console.width)
    console.print(grid)
    for line in table.remarks():
        console.print(Text(line), soft_wrap=True)


def marked(text: str) -> Any:
    """Return a text for a console with its warnings, and gains and losses of tables, coloured."""
    from rich.text import Text

    shown = Text(text)
    shown.highlight_regex(r'(?m)^ *warning:', 'bold red')
    shown.highlight_regex(r'(?m)\S+(?:\s%)? worse$', 'bold red')
    shown.highlight_regex(r'(?m)\S+(?:\s%)? better$', 'bold green')
    return shown


def _parts(text: str) -> list[str]:
    """Return what is not broken, spaces left as they are: words, and the names in a topic."""
    return re.findall(r'\s*/[^\s/]*|\s*\S+' if text.startswith('/') else r'\s*\S+', text) or ['']


def _room(widths: Sequence[int]) -> int:
    return sum(widths) + GAP * (len(widths) - 1)


def _widths(rows: Sequence[Sequence[str]], room: int) -> list[int]:
    """Return the widths of columns: those give way that have the fewest cells to break."""
    columns = list(zip(*rows, strict=True))
    widths = [max(map(len, column)) for column in columns]
    least = [max(len(part.strip()) for text in column for part in _parts(text))
             for column in columns]

    def cost(place: int) -> tuple[int, int]:
        broken = sum(len(text) >= widths[place] for text in columns[place])
        return broken, -widths[place]
    while _room(widths) > room:
        able = [place for place, width in enumerate(widths) if width > least[place]]
        if not able:
            break
        widths[min(able, key=cost)] -= 1
    return widths


def _broken(text: str, width: int) -> str:
    """Return a text with line breaks where it is wider than its column."""
    lines = ['']
    for part in _parts(text):
        if lines[-1] and len(lines[-1] + part) > width:
            lines.append('')
            part = part.lstrip()
        lines[-1] += part
    return '\n'.join(lines)
