# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Colours and lines of the models, the same in every picture and in the light and the dark."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from lg_husky_sim.reporting.data import BEFORE, FITTED, NOMINAL, RECALIBRATED, WITH_FINDING

PALETTE = (('#0072b2', '#58b4ff'), ('#d55e00', '#ff9457'), ('#009e73', '#4fd1ab'),
           ('#b5558f', '#e79ac8'), ('#6a4fc3', '#b9a8fa'), ('#b97f00', '#f0bb4d'))
"""Colours on white and on black that are told apart by all readers (after Okabe and Ito)."""
MEASURED_COLOUR = '#7b8493'
_DASHES = {'solid': '-', 'dot': ':', 'dash': '--'}

PICTURE: dict[Any, Any] = {
    'font.size': 9.0,
    'axes.titlesize': 10.0,
    'axes.titleweight': 'bold',
    'axes.titlelocation': 'left',
    'axes.spines.top': False,
    'axes.spines.right': False,
    'axes.grid': True,
    'axes.axisbelow': True,
    'grid.color': '#dddddd',
    'grid.linewidth': 0.6,
    'axes.edgecolor': '#666666',
    'xtick.color': '#444444',
    'ytick.color': '#444444',
    'legend.frameon': False,
    'legend.fontsize': 9.0,
    'figure.facecolor': 'white',
    'lines.solid_capstyle': 'round',
    'text.parse_math': False,
}
"""How matplotlib draws all pictures; names with a dollar sign are no formulas."""


@dataclass(frozen=True)
class LineStyle:
    """How the line of one model is drawn: colours on white and on black, dash, width."""

    light: str
    dark: str
    dash: str = 'solid'
    width: float = 1.4

    @property
    def drawn(self) -> dict[str, Any]:
        """Return the style as matplotlib takes it."""
        return {'color': self.light, 'linestyle': _DASHES[self.dash], 'linewidth': self.width}


_GIVEN = LineStyle(*PALETTE[3], 'dot')
_FIXED = {NOMINAL: _GIVEN, BEFORE: _GIVEN, RECALIBRATED: LineStyle(*PALETTE[1]),
          FITTED: LineStyle(*PALETTE[1]), WITH_FINDING: LineStyle(*PALETTE[0])}


def column_styles(columns: Sequence[str]) -> dict[str, LineStyle]:
    """
    Return the style of each model.

    Parameters
    ----------
    columns : sequence of str
        Models, in the order of the report.

    Returns
    -------
    dict of str to LineStyle
        The columns of a diagnosis and of a fit always look the same; others take the palette in
        order.

    """
    return {name: _FIXED.get(name, LineStyle(*PALETTE[place % len(PALETTE)],
                                             'dash' if place >= len(PALETTE) else 'solid'))
            for place, name in enumerate(columns)}
