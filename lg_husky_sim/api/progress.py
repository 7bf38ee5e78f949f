# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Progress that shows itself: a bar in terminals and notebooks, one line a stage elsewhere."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
import re
import sys
import time
from typing import Any, TypeAlias

Report: TypeAlias = Callable[[str, float | None], None]
"""Told what is being done, and which share of all is done (0 to 1; None where nobody knows)."""
Shown: TypeAlias = bool | Report
"""True: shown where someone watches; False: never; or a function that is told."""

#: Stages that differ in numbers only (generations), with the same share of what is done, get no
#: second line within this time [s].
_COUNTED = 5.0
_BAR = '{desc:40.40} {percentage:3.0f} % |{bar}| {elapsed}'
_COUNT = '{desc:40.40} {n_fmt} [{elapsed}]'
# Widgets have room for the whole name of a stage.
_WIDGET_BAR = '{desc}{percentage:3.0f} %|{bar}|{elapsed}'
_WIDGET_COUNT = '{desc}{n_fmt} |{bar}|{elapsed}'


def in_notebook() -> bool:
    """Return whether this process is the kernel of a notebook."""
    shell: Any = getattr(sys.modules.get('IPython'), 'get_ipython', lambda: None)()
    return hasattr(shell, 'kernel')


def watched() -> bool:
    """Return whether someone sees a bar: in a notebook, or on a terminal."""
    return in_notebook() or sys.stderr.isatty()


@contextmanager
def shown(progress: Shown, known: bool = True) -> Iterator[Report]:
    """
    Show how work goes on while the block runs.

    Parameters
    ----------
    progress : bool or callable
        See `Shown`.
    known : bool
        Whether shares are told; without them the steps are counted.

    Yields
    ------
    callable
        To be told the stage and the share.

    """
    if callable(progress):
        yield progress
        return
    if not progress or not watched():
        yield lambda stage, share: None
        return
    with _bar(known) as bar:
        def report(stage: str, share: float | None) -> None:
            bar.set_description(stage, refresh=False)
            if share is not None:
                bar.n = round(100.0 * share)
            elif not known:
                bar.update()
            bar.refresh()
        yield report


def _bar(known: bool) -> Any:
    # A widget needs ipywidgets; a notebook without it has the line of a terminal.
    widget = in_notebook() and find_spec('ipywidgets') is not None
    made = import_module('tqdm.notebook' if widget else 'tqdm').tqdm
    form = (_WIDGET_BAR if known else _WIDGET_COUNT) if widget else _BAR if known else _COUNT
    return made(total=100 if known else None, leave=False, disable=False, bar_format=form)


class Lines:
    """
    One line a stage, for logs: what is being done, and after how long.

    Parameters
    ----------
    write : callable
        Takes a line.
    brief : float
        Stages that end within this time from the beginning get no line [s].

    """

    def __init__(self, write: Callable[[str], object], brief: float = 0.0) -> None:
        """Start the clock."""
        self._write, self._brief = write, brief
        self._began = time.monotonic()
        self._last, self._written = '', self._began
        self._share: float | None = None

    def __call__(self, stage: str, share: float | None) -> None:
        """Write a line if the stage is another one than before, and no mere count without gain."""
        now = time.monotonic()
        elapsed = now - self._began
        if stage == self._last or elapsed < self._brief:
            return
        if (_wordy(stage), share) == (_wordy(self._last), self._share) and (
                now - self._written < _COUNTED):
            return
        self._last, self._written, self._share = stage, now, share
        self._write(f'{elapsed:7.1f} s {"" if share is None else f"{share:.0%}":>5}  {stage}')


def _wordy(stage: str) -> str:
    # A stage without its numbers.
    return re.sub(r'[\d.]+', '', stage)
