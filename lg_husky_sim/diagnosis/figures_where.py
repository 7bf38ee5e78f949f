# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of where and when: parts over time, missing efforts and their fingerprints."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, TYPE_CHECKING

from lg_husky_sim.comparison.figures import COLOURS, STYLE
from lg_husky_sim.diagnosis.locate import cells, fingerprints, Located, SUBSYSTEMS
from lg_husky_sim.husky.effects import Onset
import numpy as np

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Most pieces that are shown beside each other, and least explained that is shown [nats/s].
MOST = 6
FAINT = 1.0


def _shown(located: Located) -> list[int]:
    # The longest pieces, in order.
    lengths = [float(b.ends.max() - b.begins.min()) for b in located.bins]
    longest = sorted(range(len(lengths)), key=lambda i: (-lengths[i], i))[:MOST]
    return sorted(longest)


def where_figure(located: Located, culprits: Collection[str], onset: Onset | None = None
                 ) -> Figure:
    """
    Draw what a missing effort in each part would explain, over time.

    Parameters
    ----------
    located : Located
    culprits : collection of str
        Parts that were named; their rows are marked.
    onset : Onset, optional
        Marked where it is one in time.

    Returns
    -------
    matplotlib Figure
        One panel for each of the longest pieces; below it what was commanded.
    """
    from matplotlib import rc_context
    from matplotlib.colors import PowerNorm
    from matplotlib.figure import Figure

    pieces, strengths = _shown(located), located.strengths
    grids = [cells(located, piece) for piece in pieces]
    top = max(max(float(values.max()) for _, values in grids), 50.0 * FAINT)
    total = sum(float(edges[-1] - edges[0]) for edges, _ in grids)
    names: list[str] = []
    recordings = {located.observations.pieces[located.bins[i].piece].recording for i in pieces}
    with rc_context({**STYLE, 'axes.grid': False}):
        figure = Figure(figsize=(9.6, 4.3), layout='constrained')
        axes = figure.subplots(2, len(pieces), squeeze=False, height_ratios=(3.2, 1.0),
                               width_ratios=[float(e[-1] - e[0]) for e, _ in grids])
        image: Any = None
        for column, (piece, (edges, values)) in enumerate(zip(pieces, grids, strict=True)):
            upper, lower = axes[0, column], axes[1, column]
            image = upper.pcolormesh(
                edges, np.arange(len(SUBSYSTEMS) + 1), np.maximum(values, FAINT),
                norm=PowerNorm(0.55, FAINT, top), cmap='magma_r', rasterized=True)
            upper.invert_yaxis()
            upper.set_xticklabels([])
            upper.set_yticks(np.arange(len(SUBSYSTEMS)) + 0.5, [
                '' if column else f'{name}  {100.0 * strengths[name]:.0f} %'
                if located.certain else name for name in SUBSYSTEMS])
            for label in upper.get_yticklabels():
                named = label.get_text().split(' ')[0] in culprits
                label.set_fontweight('bold' if named else 'normal')
                label.set_color('#d40000' if named else '#333333')
            upper.tick_params(length=0)
            name = located.observations.pieces[located.bins[piece].piece].recording
            if not column or name != names[-1]:
                most = max(6, round(70 / len(recordings)))
                upper.set_title((name if len(name) <= most else name[:most - 1] + '…').replace(
                    '$', r'\$'), fontsize=9.0)
            names.append(name)
            share = float(edges[-1] - edges[0]) / total
            lower.locator_params(axis='x', nbins=2 if share < 0.2 else 4)
            if share < 0.12:
                lower.set_xticks([round(0.5 * float(edges[0] + edges[-1]))])
            _commands(lower, located, piece, edges, column == 0)
            if onset is not None and onset.kind.value == 'time' and (
                    onset.recording in ('', name)):
                for each in (upper, lower):
                    each.axvline(onset.value, color='#0072b2', linewidth=1.5, linestyle='--')
            # A line in another segment must not make room for itself here.
            upper.set_xlim(edges[0], edges[-1])
        axes[1, (len(pieces) - 1) // 2].set_xlabel('time [s]')
        bar = figure.colorbar(image, ax=axes[0, :], pad=0.01)
        bar.set_label('explained [nats/s]')
        handles, labels = axes[1, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc='outside lower center', ncol=2)
    return figure


def _commands(axes: Any, located: Located, piece: int, edges: Any, first: bool) -> None:
    commands = located.observations.pieces[located.bins[piece].piece].commands
    for column, colour, words in (('forward', '#333333', 'commanded speed [m/s]'),
                                  ('yaw', '#e69f00', 'commanded yaw rate [rad/s]')):
        axes.step(commands.times, commands.column(column), where='post', color=colour,
                  linewidth=1.1, label=words)
    axes.set_xlim(edges[0], edges[-1])
    if first:
        axes.set_ylabel('command')


def effort_figure(located: Located) -> Figure | None:
    """
    Draw the missing effort of the best family over time, and what it goes with.

    Parameters
    ----------
    located : Located

    Returns
    -------
    matplotlib Figure or None
        None where no family explains more than what healthy recordings leave.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    best = located.best()
    if not located.certain:
        return None
    explanation, prints = located.explanations[best], fingerprints(located)
    piece = max(range(len(located.bins)),
                key=lambda i: float(np.sum(explanation.estimates[i].gains)))
    estimate = explanation.estimates[piece]
    count = len(explanation.inputs)
    with rc_context(STYLE):
        figure = Figure(figsize=(9.0, 0.9 + 2.1 * count), layout='constrained')
        axes = figure.subplots(count, 2, squeeze=False, width_ratios=(1.7, 1.0))
        for row, one in enumerate(explanation.inputs):
            left, right = axes[row]
            factor = located.responses.factor(
                located.bins[piece].piece, one.terms[0].factor, estimate.times)
            value = factor * estimate.values[:, row]
            spread = np.abs(factor) * estimate.deviations[:, row]
            left.axhline(0.0, color='#333333', linewidth=0.8)
            left.fill_between(estimate.times, value - 2.0 * spread, value + 2.0 * spread,
                              color=COLOURS[0], alpha=0.22, linewidth=0.0, label='± 2 σ')
            left.plot(estimate.times, value, color=COLOURS[0], linewidth=1.1)
            low, high = np.quantile(value, (0.005, 0.995))
            room = 0.3 * max(high - low, 1e-3)
            left.set_ylim(low - room, high + room)
            left.set_ylabel(f'{one.name}\n[{one.unit}]')
            left.margins(x=0.01)
            mark = prints[row]
            right.plot(mark.at, mark.effort_values, '.', color='#8a93a3', markersize=2.0,
                       alpha=0.5, rasterized=True)
            right.plot(mark.middles, mark.means, 'o-', color=COLOURS[1], markersize=3.5,
                       linewidth=1.4)
            low, high = np.quantile(mark.effort_values, (0.005, 0.995))
            room = 0.2 * max(high - low, 1e-3)
            right.set_ylim(low - room, high + room)
            right.set_xlabel(mark.argument)
            right.set_title(f'explains {100.0 * max(mark.share, 0.0):.0f} %',
                            fontweight='normal', fontsize=9.0)
        name = located.observations.pieces[located.bins[piece].piece].recording
        title = f'{located.families[best].name.capitalize()}, {name}'
        axes[0, 0].set_title((title if len(title) <= 58 else title[:57] + '…').replace(
            '$', r'\$'))
        axes[-1, 0].set_xlabel('time [s]')
    return figure
