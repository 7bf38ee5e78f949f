# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of linear graphs: tree branches thick, links thin, one panel for each subsystem."""

from __future__ import annotations

from collections.abc import Collection
import os
from pathlib import Path
from typing import Any

from lg_husky_sim.errors import GraphError
from lg_husky_sim.extras import require
from lg_husky_sim.folders import check_marked, scratch_beside
from lg_husky_sim.linear_graph.elements import Domain
from lg_husky_sim.linear_graph.graph import LinearGraph
from lg_husky_sim.linear_graph.layout import Block, Curve, HEIGHT, layout, Point
from lg_husky_sim.linear_graph.normal_tree import normal_tree

FORMATS = ('.svg', '.png', '.pdf')
MARK = 'lg_husky_sim/linear_graph/1'
"""Program that a picture says has made it, by which it may be replaced."""
SCALE = 0.62    # inches a drawing unit
HEADING = 0.45  # inches
LEGEND = 7.0    # width that the legend needs, in drawing units
_COLOURS = {
    Domain.ELECTRICAL: '#8a5a00', Domain.TRANSLATIONAL: '#1b5fa6', Domain.ROTATIONAL: '#1d7a46',
    Domain.FLUID: '#6b3fa0', Domain.THERMAL: '#a83232'}
_CULPRIT, _NEW = '#d40000', '#d6336c'
_SYMBOLS = {'omega': 'ω', 'tau': 'τ'}


def draw_graph(axes: Any, graph: LinearGraph, *, culprits: Collection[str] = (),
               new: Collection[str] = ()) -> None:
    """
    Draw a graph into axes.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Emptied of its frame; nothing is opened or saved.
    graph : LinearGraph
        The graph.
    culprits : collection of str
        Branches, two-ports or ports to mark in red.
    new : collection of str
        Branches, two-ports or ports to draw dashed, as proposed additions.

    Raises
    ------
    GraphError
        If the graph has no normal tree, or a marked name is not in it.

    """
    known = {*graph.names, *(edge.name for edge in graph.edges)}
    for name in (*culprits, *new):
        if name not in known:
            raise GraphError(f'cannot mark {name!r}: there is no such branch in the graph')
    tree = set(normal_tree(graph).tree)
    blocks = layout(graph)
    middles: dict[str, Point] = {}
    for block in blocks:
        _panel(axes, block)
        for edge in graph.edges:
            if edge.name in block.edges:
                names = {edge.name, edge.owner.name}
                _branch(axes, block.edges[edge.name], edge.name.replace('.', ' : '),
                        colour=_CULPRIT if names & set(culprits) else (
                            _NEW if names & set(new) else _COLOURS[block.domain]),
                        thick=edge.name in tree, dashed=bool(names & set(new)),
                        halo=bool(names & set(culprits)))
                middles[edge.name] = block.edges[edge.name].at(0.5)
        _nodes(axes, block)
    for two_port in graph.two_ports:
        _link(axes, middles[f'{two_port.name}.1'], middles[f'{two_port.name}.2'])
    _legend(axes, bool(graph.two_ports), bool(culprits), bool(new))
    right = max(block.x + block.width for block in blocks)
    spare = max(LEGEND - right, 0.0) / 2.0
    axes.set_xlim(-0.5 - spare, right + spare + 0.5)
    axes.set_ylim(min(block.y for block in blocks) - 1.5, 1.2)
    axes.set_aspect('equal')
    axes.set_axis_off()


def _panel(axes: Any, block: Block) -> None:
    from matplotlib.patches import FancyBboxPatch

    colour = _COLOURS[block.domain]
    axes.add_patch(FancyBboxPatch(
        (block.x + 0.02, block.y - 0.35), block.width - 0.04, block.top + 1.3,
        boxstyle='round,pad=0.12', facecolor=colour, alpha=0.07, edgecolor='none', zorder=0))
    symbols = ', '.join(_SYMBOLS.get(s, s) for s in (block.domain.across, block.domain.through))
    axes.text(block.x + 0.05, block.y + block.top + 0.82, f'{block.domain.value} ({symbols})',
              color=colour, fontsize=8.5, fontweight='bold', va='center', zorder=5)
    axes.plot([block.x + 0.15, block.x + block.width - 0.15], [block.y, block.y], color='0.25',
              linewidth=3.2, solid_capstyle='round', zorder=2)
    steps = max(int(block.width / 0.3), 2)
    for at in range(steps):
        x = block.x + 0.2 + at * (block.width - 0.4) / (steps - 1)
        axes.plot([x, x - 0.13], [block.y, block.y - 0.2], color='0.45', linewidth=0.8, zorder=1)


def _branch(axes: Any, curve: Curve, label: str, *, colour: str, thick: bool, dashed: bool,
            halo: bool) -> None:
    from matplotlib.patches import FancyArrowPatch, PathPatch
    from matplotlib.path import Path as Outline

    outline = Outline(curve.points, [Outline.MOVETO, Outline.CURVE4, Outline.CURVE4,
                                     Outline.CURVE4])
    if halo:
        axes.add_patch(PathPatch(outline, facecolor='none', edgecolor=colour, linewidth=9.0,
                                 alpha=0.22, zorder=2, capstyle='round'))
    axes.add_patch(PathPatch(outline, facecolor='none', edgecolor=colour,
                             linewidth=3.0 if thick else 1.0,
                             linestyle=(0, (3.0, 1.6)) if dashed else '-', zorder=3))
    axes.add_patch(FancyArrowPatch(
        curve.at(0.64), curve.at(0.72), arrowstyle='-|>', mutation_scale=19 if thick else 11,
        color=colour, linewidth=0.0, shrinkA=0.0, shrinkB=0.0, zorder=4))
    (x, y), ahead = curve.at(0.5), curve.at(0.52)
    level = abs(ahead[1] - y) < 0.3 * abs(ahead[0] - x)
    axes.text(x if level else x + 0.11, y + 0.14 if level else y, label, fontsize=7.5,
              color=colour, ha='center' if level else 'left', va='bottom' if level else 'center',
              fontweight='bold' if thick or dashed or halo else 'normal', zorder=6,
              bbox={'facecolor': 'white', 'alpha': 0.75, 'edgecolor': 'none', 'pad': 0.6})


def _nodes(axes: Any, block: Block) -> None:
    for (_, name), (x, y) in block.nodes.items():
        axes.plot([x], [y], marker='o', markersize=6.0, color=_COLOURS[block.domain],
                  markeredgecolor='white', markeredgewidth=0.8, zorder=7)
        at_top = y - block.y >= HEIGHT - 1e-9
        axes.text(x if at_top else x - 0.15, y + 0.16 if at_top else y, name, fontsize=6.5,
                  parse_math=False, color='0.3', ha='center' if at_top else 'right',
                  va='bottom' if at_top else 'center', style='italic', zorder=8,
                  bbox={'facecolor': 'white', 'alpha': 0.7, 'edgecolor': 'none', 'pad': 0.4})


def _link(axes: Any, one: Point, two: Point) -> None:
    from matplotlib.patches import FancyArrowPatch

    axes.add_patch(FancyArrowPatch(
        one, two, arrowstyle='-', connectionstyle='arc3,rad=-0.12', color='0.5', linewidth=0.8,
        linestyle=(0, (1.0, 2.2)), zorder=1.5))


def _legend(axes: Any, two_ports: bool, culprits: bool, new: bool) -> None:
    from matplotlib.lines import Line2D

    entries = [Line2D([], [], color='0.2', linewidth=3.0, label='tree branch'),
               Line2D([], [], color='0.2', linewidth=1.0, label='link'),
               Line2D([], [], color='0.25', linewidth=3.2, marker='|', label='ground')]
    if two_ports:
        entries.append(Line2D([], [], color='0.55', linewidth=0.8, linestyle=':',
                              label='two ports of one element'))
    if culprits:
        entries.append(Line2D([], [], color=_CULPRIT, linewidth=3.0, label='suspected'))
    if new:
        entries.append(Line2D([], [], color=_NEW, linewidth=2.0, linestyle='--', label='added'))
    axes.legend(handles=entries, loc='lower center', bbox_to_anchor=(0.5, 0.0), fontsize=8,
                ncol=len(entries), frameon=False)


def save_picture(graph: LinearGraph, path: str | Path, *, title: str = '',
                 culprits: Collection[str] = (), new: Collection[str] = ()) -> Path:
    """
    Write a picture of a graph, whole or not at all.

    Parameters
    ----------
    graph : LinearGraph
        The graph.
    path : path-like
        Ends in .svg, .png or .pdf. A picture of ours that is there is replaced.
    title : str
        Heading.
    culprits, new : collection of str
        As for :func:`draw_graph`.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    GraphError
        If the ending is another one, or the graph cannot be drawn.
    MissingExtraError
        If matplotlib is not installed.
    SettingsError
        If a file is there that is no such picture.
    OSError
        If the file cannot be written.

    """
    path = Path(path)
    check_picture(path)
    require('matplotlib', 'draw graphs')
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    blocks = layout(graph)
    width = max(max(block.x + block.width for block in blocks), LEGEND) + 1.0
    height = -min(block.y for block in blocks) + 2.8
    inches = height * SCALE + (HEADING if title else 0.0)
    figure = Figure(figsize=(width * SCALE, inches))
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, 0.0, 1.0, height * SCALE / inches))
    draw_graph(axes, graph, culprits=culprits, new=new)
    if title:
        figure.suptitle(title, fontsize=11, y=1.0 - 0.4 * HEADING / inches, va='center',
                        parse_math=False)
    # a fixed salt and no date: the same graph gives the same file
    with scratch_beside(path) as folder, rc_context(
            {'svg.hashsalt': 'lg_husky_sim', 'svg.fonttype': 'none'}):
        draft = folder / f'picture{path.suffix.lower()}'
        metadata = {'.svg': {'Date': None, 'Creator': MARK}, '.png': {'Software': MARK},
                    '.pdf': {'CreationDate': None, 'Creator': MARK}}
        figure.savefig(draft, dpi=150, metadata=metadata[path.suffix.lower()])
        os.replace(draft, path)
    return path


def check_picture(path: Path) -> None:
    """
    Check that a graph can be drawn into a file of this name.

    Raises
    ------
    GraphError
        If the ending is unknown.
    SettingsError
        If something else than such a picture is there.

    """
    if path.suffix.lower() not in FORMATS:
        raise GraphError(f'picture {str(path)!r} must end in {", ".join(FORMATS)}')
    check_marked(path, MARK)
