# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of a trial, drawn from its results file."""

from __future__ import annotations

from collections.abc import Mapping
import os
from pathlib import Path
from typing import Any, TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Json = Mapping[str, Any]


def plot_confusion(axes: Axes, results: Json) -> None:
    """Draw what was named (columns) for each hidden effect (rows), in shares of the row."""
    from matplotlib.colors import LinearSegmentedColormap
    table = results['confusion']
    rows, columns = table['hidden'], table['named']
    counts = np.array(table['counts'], dtype=float).reshape(len(rows), len(columns))
    totals = np.maximum(counts.sum(axis=1, keepdims=True), 1.0)
    colours = LinearSegmentedColormap.from_list('share', ['#ffffff', '#9ecae1', '#08519c'])
    axes.imshow(counts / totals, cmap=colours, vmin=0.0, vmax=1.0, aspect='auto')
    for i, name in enumerate(rows):
        for j, column in enumerate(columns):
            if counts[i, j]:
                right = name == column or (name == 'clean' and column == 'nothing')
                dark = counts[i, j] / totals[i, 0] > 0.5
                axes.text(j, i, f'{counts[i, j]:.0f}', ha='center', va='center', fontsize=7,
                          color='white' if dark else ('#08306b' if right else '#b2182b'))
    axes.set_xticks(range(len(columns)), columns, rotation=90, fontsize=7)
    axes.set_yticks(range(len(rows)), rows, fontsize=7)
    axes.set_xlabel('named first')
    axes.set_ylabel('hidden')
    axes.set_xticks(np.arange(-0.5, len(columns)), minor=True)
    axes.set_yticks(np.arange(-0.5, len(rows)), minor=True)
    axes.grid(which='minor', color='#e0e0e0', linewidth=0.5)
    axes.tick_params(which='minor', length=0)


def plot_rates(axes: Axes, results: Json) -> None:
    """Draw each rate with its 95 % interval, and its target as a line."""
    rates = [rate for rate in results['rates'] if rate['count']]
    for k, rate in enumerate(rates):
        reached = rate['reached']
        colour = {True: '#238b45', False: '#cb181d', None: '#636363'}[reached]
        axes.plot([rate['low'], rate['high']], [k, k], color=colour, linewidth=2)
        axes.plot(rate['value'], k, 'o', color=colour, markersize=5)
        if rate['target'] is not None:
            axes.plot([rate['target']] * 2, [k - 0.35, k + 0.35], color='black', linewidth=1)
    axes.set_yticks(range(len(rates)), [
        f'{rate["name"]} ({rate["hits"]}/{rate["count"]})' for rate in rates], fontsize=7)
    axes.invert_yaxis()
    axes.set_xlim(-0.02, 1.02)
    axes.set_xlabel('share of cases, 95 % interval; black line: target')
    axes.grid(axis='x', color='#e0e0e0')


def plot_reliability(axes: Axes, results: Json) -> None:
    """Draw the share right against the stated confidence, with 95 % intervals."""
    axes.plot([0.0, 1.0], [0.0, 1.0], color='#969696', linewidth=1)
    for row in results['reliability']['bins']:
        axes.plot([row['stated']] * 2, [row['low'], row['high']], color='#3182bd', linewidth=2)
        axes.plot(row['stated'], row['right'], 'o', color='#3182bd', markersize=5)
        axes.annotate(str(row['count']), (row['stated'], row['right']), fontsize=7,
                      xytext=(5, -3), textcoords='offset points')
    axes.set_xlim(-0.02, 1.05)
    axes.set_ylim(-0.02, 1.02)
    axes.set_xlabel('stated confidence (mean of the bin; number of cases beside)')
    axes.set_ylabel('share right, 95 % interval')


def draw(results: Json, folder: Path) -> tuple[Path, ...]:
    """
    Write the pictures of a trial and return their paths.

    Parameters
    ----------
    results
        `summary.summarise`, or the results file.
    folder
        Where the PNG files go.

    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    folder.mkdir(parents=True, exist_ok=True)
    height = 2.5 + 0.19 * len(results['confusion']['hidden'])
    paths = []
    for name, size, plot in (('proof_confusion', (9.0, height), plot_confusion),
                             ('proof_rates', (9.0, 5.0), plot_rates),
                             ('proof_reliability', (5.5, 4.5), plot_reliability)):
        figure = Figure(figsize=size, layout='constrained')
        FigureCanvasAgg(figure)
        plot(figure.subplots(), results)
        path = folder / f'{name}.png'
        draft = folder / f'.{name}.part.png'
        figure.savefig(draft, dpi=130, metadata={'Software': None})
        os.replace(draft, path)
        paths.append(path)
    return tuple(paths)
