# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A page of sections with tables and pictures, in one file that needs nothing else."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
import os
from pathlib import Path
import tempfile
from typing import TYPE_CHECKING

from lg_husky_sim.extras import require

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Resolution of a picture [1/inch].
DOTS = 130


@dataclass(frozen=True)
class Table:
    """A table: the cells of its head and of its rows, as text."""

    head: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True)
class Picture:
    """
    A picture as PNG, and what it shows.

    Parameters
    ----------
    png : bytes
    caption : str
    name : str
        For a file of its own.
    """

    png: bytes
    caption: str
    name: str = ''

    @property
    def data(self) -> str:
        """The picture in base64, for a page."""
        return b64encode(self.png).decode('ascii')


@dataclass(frozen=True)
class Section:
    """
    A section of a page.

    Parameters
    ----------
    heading : str
    text, points : sequence of str
        Paragraphs, and items of a list.
    tables : sequence of Table
    pictures : sequence of Picture
    verbatim : str
        Text in fixed width.
    warning : bool
        Whether the points are warnings.
    """

    heading: str
    text: Sequence[str] = ()
    points: Sequence[str] = ()
    tables: Sequence[Table] = ()
    pictures: Sequence[Picture] = ()
    verbatim: str = ''
    warning: bool = False


def picture(figure: Figure, caption: str, name: str = '') -> Picture:
    """Return a figure as a picture."""
    stream = BytesIO()
    figure.savefig(stream, format='png', dpi=DOTS, metadata={'Software': None})
    return Picture(stream.getvalue(), caption, name)


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


def page(title: str, intro: Sequence[str], sections: Sequence[Section]) -> str:
    """
    Return a page as HTML; every text in it is escaped.

    Parameters
    ----------
    title : str
    intro : sequence of str
        Paragraphs below the title.
    sections : sequence of Section
    """
    from jinja2 import Environment, PackageLoader
    environment = Environment(
        loader=PackageLoader('lg_husky_sim.identification', '.'), autoescape=True,
        trim_blocks=True, lstrip_blocks=True)
    return environment.get_template('page.html.j2').render(
        title=title, intro=intro, sections=sections)


@contextmanager
def files_together(paths: Sequence[Path]) -> Iterator[Mapping[Path, Path]]:
    """
    Write several files, all or none.

    Parameters
    ----------
    paths : sequence of pathlib.Path
        In one folder, which is made.

    Yields
    ------
    mapping of pathlib.Path to pathlib.Path
        Where to write each; they are moved into place when the block ends without an exception.
    """
    folder = paths[0].parent
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix='.lg_husky.', dir=folder) as scratch:
        places = {path: Path(scratch) / path.name for path in paths}
        yield places
        for path, place in places.items():
            os.replace(place, path)
