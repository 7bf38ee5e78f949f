# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What the sections of a page are made of: text, tables, charts and drawings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import enum
from typing import TYPE_CHECKING

from lg_husky_sim.signals import FloatArray

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Tone(enum.Enum):
    """How a headline or a cell is coloured."""

    PLAIN = 'plain'
    GOOD = 'good'
    BAD = 'bad'
    FOUND = 'found'


@dataclass(frozen=True)
class Cell:
    """A cell of a table: text, a bar behind it (0 to 1), and its tone."""

    text: str
    bar: float = 0.0
    tone: Tone = Tone.PLAIN


@dataclass(frozen=True)
class Table:
    """A table: the cells of its head and of its rows."""

    head: Sequence[str]
    rows: Sequence[Sequence[str | Cell]]


@dataclass(frozen=True, eq=False)
class Line:
    """
    A line of a chart.

    Parameters
    ----------
    label : str
    x, y : numpy.ndarray, shape (n,)
    spread : numpy.ndarray, shape (n,), optional
        Half the width of a band around it.
    dots : bool
        Points in place of a line.

    """

    label: str
    x: FloatArray
    y: FloatArray
    spread: FloatArray | None = None
    dots: bool = False


@dataclass(frozen=True, eq=False)
class Chart:
    """A chart of lines: on the page to zoom in, and beside it as PNG under its name."""

    name: str
    caption: str
    lines: tuple[Line, ...]
    x_title: str
    y_title: str
    logarithmic: bool = False


@dataclass(frozen=True, eq=False)
class Drawing:
    """A picture that its owner draws: a file name without its end, a caption, the drawing."""

    name: str
    caption: str
    draw: Callable[[], Figure]


@dataclass(frozen=True)
class Section:
    """
    A section of the page.

    Parameters
    ----------
    heading : str
    text, points : tuple of str
        Paragraphs, and items of a list; code stands in backquotes.
    tables : tuple of Table
    charts : tuple of Chart
    drawings : tuple of Drawing
    verbatim : str
        Text in fixed width.
    folded : bool
        Whether the reader opens it first.

    """

    heading: str
    text: tuple[str, ...] = ()
    points: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    charts: tuple[Chart, ...] = ()
    drawings: tuple[Drawing, ...] = ()
    verbatim: str = ''
    folded: bool = False
