# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The paper's figures, drawn into axes that the caller owns.

Nothing here opens or saves a file; matplotlib is not needed until a figure is made.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TYPE_CHECKING

from lg_husky_sim.comparison.metrics import measured_channels, Tracking
from lg_husky_sim.recording import Segment
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MEASURED = 'measured'
COLOURS = ('#0072b2', '#d55e00', '#009e73', '#cc79a7', '#56b4e9', '#e69f00')
"""Colours that are told apart by all readers (Okabe and Ito)."""

RESPONSES: Mapping[str, tuple[str, str]] = {
    'wheel_left': ('Left wheels', 'rad/s'),
    'wheel_right': ('Right wheels', 'rad/s'),
    'forward': ('Linear velocity', 'm/s'),
    'yaw_rate': ('Rotational velocity', 'rad/s'),
}
"""Channels of the paper's Fig. 13: title and unit."""

STYLE: dict[Any, Any] = {
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
}

WIDEST = 95
"""Letters of title and legend that fit beside one another."""


@dataclass(frozen=True)
class LineStyle:
    """How the line of one model is drawn."""

    colour: str
    dash: str = '-'
    width: float = 1.3


def line_styles(labels: Sequence[str], rivals: Sequence[str] = ()) -> dict[str, LineStyle]:
    """Return a style for each label; those of rivals are dashed."""
    return {label: LineStyle(COLOURS[k % len(COLOURS)], '--' if label in rivals else '-')
            for k, label in enumerate(labels)}


def draw_response(
    axes: Axes, measured: TimeSeries | None, predictions: Mapping[str, TimeSeries], channel: str,
    styles: Mapping[str, LineStyle], start: float = 0.0,
) -> None:
    """
    Draw one channel over time, measured and predicted.

    Parameters
    ----------
    axes : matplotlib Axes
    measured : TimeSeries or None
        One channel; None where it was not measured.
    predictions : mapping of str to TimeSeries
        By label; those without the channel are passed over.
    channel : str
        Column of the predictions.
    styles : mapping of str to LineStyle
    start : float
        Time that becomes zero [s].
    """
    lines: list[FloatArray] = []
    if measured is not None and len(measured):
        values = _gaps(measured)
        axes.plot(values[:, 0] - start, values[:, 1], color='#333333', linewidth=2.2, alpha=0.45,
                  label=MEASURED, solid_joinstyle='round')
        lines.append(measured.values[:, 0])
    for label, series in predictions.items():
        if channel in series.names:
            style = styles[label]
            axes.plot(series.times - start, series.column(channel), color=style.colour,
                      linestyle=style.dash, linewidth=style.width, label=label)
            lines.append(series.column(channel))
    title, unit = RESPONSES.get(channel, (channel, ''))
    axes.set_title(title)
    axes.set_ylabel(unit)
    axes.margins(x=0.01)
    _limit(axes, lines)


def draw_trajectory(
    axes: Axes, tracks: Mapping[str, Tracking], styles: Mapping[str, LineStyle],
    until: float = np.inf,
) -> None:
    """
    Draw the ways driven and predicted, x ahead and y to the left, to one scale.

    Parameters
    ----------
    axes : matplotlib Axes
    tracks : mapping of str to Tracking
        By label, all of one segment.
    styles : mapping of str to LineStyle
    until : float
        Last time that is drawn [s].
    """
    first = True
    for label, track in tracks.items():
        shown = track.times <= until
        if first:
            axes.plot(*track.measured[shown].T, color='#333333', linewidth=2.2, alpha=0.45,
                      label=MEASURED)
            axes.plot(*track.measured[shown][-1:].T, 'o', color='#333333', markersize=5,
                      alpha=0.7)
            first = False
        style = styles[label]
        axes.plot(*track.predicted[shown].T, color=style.colour, linestyle=style.dash,
                  linewidth=style.width, label=label)
        axes.plot(*track.predicted[shown][-1:].T, 'o', color=style.colour, markersize=4)
    axes.plot(0.0, 0.0, marker='>', color='black', markersize=6, linestyle='none', zorder=5)
    axes.set_aspect('equal', adjustable='datalim')
    axes.set_xlabel('x [m]')
    axes.set_ylabel('y [m]')
    axes.set_title('Trajectory')


def draw_tracking_error(
    axes: Axes, tracks: Mapping[str, Tracking], axis: int, styles: Mapping[str, LineStyle],
    start: float = 0.0, *, named: bool = True,
) -> None:
    """
    Draw the tracking error of one axis over time, with its largest size.

    Parameters
    ----------
    axes : matplotlib Axes
    tracks : mapping of str to Tracking
    axis : int
        0 for x (ahead at the start), 1 for y (to the left).
    styles : mapping of str to LineStyle
    start : float
        Time that becomes zero [s].
    named : bool
        Whether the labels stand beside the bounds in the legend.
    """
    name = 'XY'[axis]
    axes.axhline(0.0, color='#333333', linewidth=0.8)
    for label, track in tracks.items():
        style = styles[label]
        bound = track.bounds[axis]
        axes.plot(track.times - start, track.error[:, axis], color=style.colour,
                  linestyle=style.dash, linewidth=style.width,
                  label=f'{label}: ' * named + f'|{name}| ≤ {bound:.4g} m')
    axes.set_ylabel(f'{name.lower()} error [m]')
    axes.margins(x=0.01)
    axes.legend(loc='best', frameon=True, framealpha=0.8, edgecolor='none')


def responses_figure(
    segment: Segment, predictions: Mapping[str, TimeSeries], styles: Mapping[str, LineStyle],
    title: str = '', longest: float = np.inf,
) -> Figure:
    """
    Make the paper's Fig. 13: wheel speeds, linear and rotational velocity.

    Parameters
    ----------
    segment : Segment
    predictions : mapping of str to TimeSeries
    styles : mapping of str to LineStyle
    title : str
    longest : float
        At most this time [s] from the segment's start is shown.

    Returns
    -------
    matplotlib Figure
        Not shown, not saved; no global state is touched.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    end = min(segment.end, segment.start + longest)
    measured = measured_channels(segment)
    with rc_context(STYLE):
        figure = Figure(figsize=(9.0, 5.6), layout='constrained')
        grid = figure.subplots(2, 2, sharex=True)
        for place, (axes, channel) in enumerate(zip(grid.flat, RESPONSES, strict=True)):
            own = measured.get(channel)
            draw_response(
                axes, own.slice(segment.start, end) if own is not None else None,
                {label: series.slice(segment.start, end)
                 for label, series in predictions.items()},
                channel, styles, segment.start)
            axes.set_title(f'({"abcd"[place]}) {axes.get_title(loc="left")}')
        for axes in grid[1]:
            axes.set_xlabel('time [s]')
        _heading(figure, _entitled(title, segment, end), grid.flat)
    return figure


def trajectory_figure(
    segment: Segment, tracks: Mapping[str, Tracking], styles: Mapping[str, LineStyle],
    title: str = '', longest: float = np.inf,
) -> Figure:
    """
    Make the paper's Figs. 14-16: trajectory on the left, tracking errors on the right.

    Parameters
    ----------
    segment : Segment
    tracks : mapping of str to Tracking
    styles : mapping of str to LineStyle
    title : str
    longest : float
        The trajectory shows at most this time [s]; the errors are shown throughout.

    Returns
    -------
    matplotlib Figure
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    end = min(segment.end, segment.start + longest)
    with rc_context(STYLE):
        figure = Figure(figsize=(9.0, 4.4), layout='constrained')
        grid = figure.add_gridspec(2, 2, width_ratios=(1.0, 1.0))
        left = figure.add_subplot(grid[:, 0])
        upper = figure.add_subplot(grid[0, 1])
        lower = figure.add_subplot(grid[1, 1], sharex=upper)
        draw_trajectory(left, tracks, styles, end)
        left.set_title(_entitled('(a) Trajectory', segment, end))
        for place, axes in enumerate((upper, lower)):
            draw_tracking_error(axes, tracks, place, styles, segment.start, named=False)
        upper.set_title('(b) Tracking error')
        upper.tick_params(labelbottom=False)
        lower.set_xlabel('time [s]')
        _heading(figure, title, [left])
    return figure


def _entitled(title: str, segment: Segment, end: float) -> str:
    if end < segment.end:
        return f'{title} – first {end - segment.start:.0f} s of {segment.duration:.0f} s'
    return title


def _heading(figure: Figure, title: str, axes: Iterable[Axes]) -> None:
    """Put the title and one legend for all axes above them, in the space of the title."""
    found: dict[str, Any] = {}
    for each in axes:
        for handle, label in zip(*each.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    crowded = len(title) + sum(len(label) + 8 for label in found) > WIDEST
    figure.suptitle((title or ' ') + ('\n ' if crowded else ''), x=0.01, ha='left', fontsize=11,
                    fontweight='bold')
    row = 1.0 - 0.25 / figure.get_figheight() if crowded else 1.0  # the second line of the title
    figure.legend(list(found.values()), list(found), ncol=max(1, len(found)), borderaxespad=0.1,
                  loc='upper left' if crowded else 'upper right',
                  bbox_to_anchor=(0.0 if crowded else 1.0, row))


def _gaps(series: TimeSeries) -> FloatArray:
    """Return times and values with a NaN row in each long silence, so that no line spans it."""
    steps = np.diff(series.times)
    longest = max(0.5, 3.0 * float(np.median(steps))) if steps.size else np.inf
    places = np.flatnonzero(steps > longest) + 1
    table = np.column_stack((series.times, series.values[:, 0]))
    result: FloatArray = np.insert(table, places, np.nan, axis=0)
    return result


def _limit(axes: Axes, lines: Sequence[FloatArray]) -> None:
    """Keep single outliers from flattening the rest: they are cut off."""
    values = np.concatenate(lines) if lines else np.zeros(0)
    values = values[np.isfinite(values)]
    if not values.size:
        return
    low, high = np.quantile(values, (0.005, 0.995))
    room = 0.12 * max(high - low, 0.05)
    axes.set_ylim(max(low - 2.0 * room, values.min() - 0.5 * room),
                  min(high + 2.0 * room, values.max() + 0.5 * room))
