# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The pictures of a report as matplotlib figures; each owns its figure and saves nothing."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from io import BytesIO
import math
from typing import Any, TYPE_CHECKING

from lg_husky_sim.reporting.data import MEASURED, ReportData, Trace, View
from lg_husky_sim.reporting.sections import Chart
from lg_husky_sim.reporting.styles import (
    column_styles,
    LineStyle,
    MEASURED_COLOUR,
    PALETTE,
    PICTURE,
)
from lg_husky_sim.reporting.words import (
    capitalised,
    quantity,
    quantity_with_unit,
    SIGN,
    with_unit,
)
from lg_husky_sim.signals import FloatArray
import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Resolution [1/inch].
DOTS = 130
#: Colours of a picture.
COLOURS = 96
#: Panels of the paper's Fig. 13, those that were measured.
RESPONSES = ('wheel_left', 'wheel_right', 'forward', 'yaw_rate')
#: Longest time that a picture of responses or a path shows [s]; more cannot be read.
LONGEST = 60.0


def png(figure: Figure, about: Mapping[str, str] | None = None) -> bytes:
    """
    Return a figure as PNG, the same bytes for the same figure.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Drawn at the dots per inch of all pictures.
    about : mapping of str to str, optional
        What the file says of itself, by the keywords of the PNG specification (``Title``,
        ``Description``, ``Source``, ``Software``). A picture on its own tells what it shows.

    Returns
    -------
    bytes

    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo
    stream, text = BytesIO(), PngInfo()
    for key, value in (about or {}).items():
        text.add_itxt(key, value)
    figure.set_dpi(DOTS)
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    drawn = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert('RGB')
    # Lines on white need few colours, and a third of the bytes.
    drawn.quantize(COLOURS, dither=Image.Dither.NONE).save(
        stream, format='png', optimize=True, pnginfo=text)
    return stream.getvalue()


def _shortened(text: str, most: int = 60) -> str:
    return text if len(text) <= most else text[:most - 1] + '…'


def _legend_above(figure: Figure, axes: Iterable[Axes], title: str) -> None:
    # A title line and below it one row of all labels, so that neither covers the other.
    found = {label: handle for each in axes
             for handle, label in zip(*each.get_legend_handles_labels(), strict=True)}
    figure.suptitle(_shortened(title, 100) + '\n ', x=0.01, ha='left', fontsize=11,
                    fontweight='bold')
    figure.legend(list(found.values()), list(found), ncol=max(1, len(found)), borderaxespad=0.1,
                  loc='upper left', bbox_to_anchor=(0.0, 1.0 - 0.27 / figure.get_figheight()))


def _limit(axes: Axes, lines: Sequence[FloatArray]) -> None:
    """Keep single outliers from flattening the rest: they are cut off."""
    values = np.concatenate(lines) if lines else np.zeros(0)
    values = values[np.isfinite(values)]
    if not values.size:
        return
    low, high = np.quantile(values, (0.005, 0.995))
    room = 0.12 * max(high - low, 1e-9)
    axes.set_ylim(max(low - 2.0 * room, values.min() - 0.5 * room),
                  min(high + 2.0 * room, values.max() + 0.5 * room))


def draw_signal(axes: Axes, trace: Trace, styles: Mapping[str, LineStyle],
                start: float = -math.inf, end: float = math.inf, *, errors: bool = False) -> None:
    """
    Draw a quantity over time, measured and predicted, or the errors of the predictions.

    Parameters
    ----------
    axes : matplotlib Axes
        Where to draw; they get a title, a label and limits.
    trace : Trace
        Measured and predicted values of one quantity.
    styles : mapping of str to LineStyle
        By column, in the order of drawing.
    start, end : float
        Stretch that is shown, on the recording's clock [s].
    errors : bool
        Whether measured − predicted is drawn in place of the signals.

    """
    shown = (trace.times >= start) & (trace.times <= end)
    times, lines = trace.times[shown], []
    if errors:
        axes.axhline(0.0, color='#333333', linewidth=0.8)
        if trace.sigma is not None:
            two = 2.0 * trace.sigma[shown]
            axes.fill_between(times, -two, two, color='#000000', alpha=0.1, linewidth=0.0)
    else:
        axes.plot(times, trace.measured[shown], color=MEASURED_COLOUR, linewidth=2.6, alpha=0.6,
                  label=MEASURED)
        lines.append(trace.measured[shown])
    for column, style in styles.items():
        if column in trace.predicted:
            values = trace.predicted[column][shown]
            values = trace.measured[shown] - values if errors else values
            axes.plot(times, values, label=column, **style.drawn)
            lines.append(values)
    name = quantity_with_unit(trace.channel)
    axes.set_ylabel(f'{SIGN}\n[{trace.unit}]' if errors else f'[{trace.unit}]')
    if not errors:
        axes.set_title(capitalised(name))
    axes.set_xlim(max(start, float(trace.times[0])), min(end, float(trace.times[-1])))
    _limit(axes, lines)


def first_picture(data: ReportData, view: View) -> Figure:
    """
    Draw the stretch of a signal that tells most, and below it the errors.

    Parameters
    ----------
    data : ReportData
        With a trace of what the view shows.
    view : View
        Recording, quantity and stretch [s] to draw.

    Returns
    -------
    matplotlib Figure

    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    trace = data.trace(view.recording, view.channel)
    assert trace is not None  # a view is of a trace that is there
    styles = column_styles(data.columns)
    with rc_context(PICTURE):
        figure = Figure(figsize=(9.0, 5.0), layout='constrained')
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.7, 1.0))
        draw_signal(upper, trace, styles, view.start, view.end)
        draw_signal(lower, trace, styles, view.start, view.end, errors=True)
        upper.set_title('')
        lower.set_xlabel('time [s]')
        if math.isfinite(view.onset):
            for axes in (upper, lower):
                axes.axvline(view.onset, color='#d40000', linewidth=1.2, linestyle='--',
                             label='onset')
        _legend_above(figure, [upper],
                      f'{capitalised(quantity(trace.channel))}, {_shortened(trace.recording)}')
    return figure


def responses_picture(data: ReportData, recording: str, longest: float = LONGEST,
                      title: str = '') -> Figure:
    """
    Draw the paper's Fig. 13: wheel rates, forward speed and yaw rate.

    Parameters
    ----------
    data : ReportData
        With the traces of the recording.
    recording : str
        With at least one trace.
    longest : float
        Most time that is shown [s].
    title : str
        In place of the recording's name.

    Returns
    -------
    matplotlib Figure

    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    own = [trace for trace in (data.trace(recording, name) for name in RESPONSES) if trace]
    own = own or [trace for trace in data.traces if trace.recording == recording][:4]
    styles = column_styles(data.columns)
    start = min(float(trace.times.min()) for trace in own)
    last = max(float(trace.times.max()) for trace in own)
    end = min(last, start + longest)
    rows, columns = -(-len(own) // 2), min(2, len(own))
    with rc_context(PICTURE):
        figure = Figure(figsize=(9.0, 0.9 + 2.4 * rows), layout='constrained')
        grid = figure.subplots(rows, columns, sharex=True, squeeze=False)
        for place, (axes, trace) in enumerate(zip(grid.flat, own, strict=False)):
            draw_signal(axes, trace, styles, start, end)
            axes.set_title(f'({"abcd"[place]}) {capitalised(quantity(trace.channel))}')
        for axes in grid.flat[len(own):]:
            axes.set_axis_off()
        for axes in grid[-1]:
            axes.set_xlabel('time [s]')
        _legend_above(figure, grid.flat, _entitled(title or recording, start, end, last))
    return figure


def _entitled(title: str, start: float, end: float, last: float) -> str:
    if end < last:
        return f'{title}, first {end - start:.0f} s of {last - start:.0f} s'
    return title


def path_picture(data: ReportData, recording: str, longest: float = LONGEST,
                 title: str = '') -> Figure:
    """
    Draw the paper's Figs. 14 to 16: the path on the left, tracking errors on the right.

    Parameters
    ----------
    data : ReportData
        With the traces of the recording.
    recording : str
        With traces of x and y.
    longest : float
        The path shows at most this time [s]; the errors are shown throughout.
    title : str
        In place of the recording's name.

    Returns
    -------
    matplotlib Figure

    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    x, y = data.trace(recording, 'x'), data.trace(recording, 'y')
    assert x is not None
    assert y is not None
    styles = column_styles(data.columns)
    start, last = float(x.times.min()), float(x.times.max())
    with rc_context(PICTURE):
        figure = Figure(figsize=(9.0, 4.8), layout='constrained')
        grid = figure.add_gridspec(2, 2)
        left = figure.add_subplot(grid[:, 0])
        draw_path(left, x, y, styles, start + longest)
        left.set_title(_entitled('(a) Path', start, min(last, start + longest), last))
        upper = figure.add_subplot(grid[0, 1])
        lower = figure.add_subplot(grid[1, 1], sharex=upper)
        for axes, trace in ((upper, x), (lower, y)):
            _draw_tracking(axes, trace, styles)
        upper.set_title(f'(b) Tracking error, {SIGN}')
        upper.tick_params(labelbottom=False)
        lower.set_xlabel('time [s]')
        _legend_above(figure, [left], title or recording)
    return figure


def draw_path(axes: Axes, x: Trace, y: Trace, styles: Mapping[str, LineStyle],
              end: float = math.inf) -> None:
    """
    Draw the path that was driven and those that were predicted, to one scale.

    Parameters
    ----------
    axes : matplotlib Axes
        Where to draw; they get one scale for x and y.
    x, y : Trace
        Of one recording, at the same times.
    styles : mapping of str to LineStyle
        By column, in the order of drawing.
    end : float
        Last time that is drawn [s].

    """
    shown = x.times <= end
    axes.plot(x.measured[shown], y.measured[shown], color=MEASURED_COLOUR, linewidth=2.6,
              alpha=0.6, label=MEASURED)
    for column, style in styles.items():
        if column in x.predicted and column in y.predicted:
            axes.plot(x.predicted[column][shown], y.predicted[column][shown], label=column,
                      **style.drawn)
    first = int(np.argmax(np.isfinite(x.measured)))
    axes.plot(x.measured[first], y.measured[first], marker='>', color='black', markersize=6,
              linestyle='none', zorder=5)
    axes.set_aspect('equal', adjustable='datalim')
    axes.set_xlabel('x [m]')
    axes.set_ylabel('y [m]')


def _draw_tracking(axes: Axes, trace: Trace, styles: Mapping[str, LineStyle]) -> None:
    name = trace.channel.upper()
    axes.axhline(0.0, color='#333333', linewidth=0.8)
    for column, style in styles.items():
        if column in trace.predicted:
            error = trace.errors.get(column, trace.measured - trace.predicted[column])
            most = float(np.max(np.abs(error[np.isfinite(error)]), initial=0.0))
            axes.plot(trace.times, error, label=f'|{name}| ≤ {most:.3g} m', **style.drawn)
    axes.set_ylabel(f'{trace.channel} error [m]')
    axes.margins(x=0.01)
    axes.legend(loc='best', frameon=True, framealpha=0.8, edgecolor='none')


def draw_intervals(axes: Axes, numbers: Sequence[tuple[str, str, float, float, float]]) -> None:
    """
    Draw 95 % intervals relative to their estimates.

    Parameters
    ----------
    axes : matplotlib Axes
        Where to draw; a row for each number.
    numbers : sequence of (str, str, float, float, float)
        Name, unit, estimate, low and high of each.

    """
    for row, (_, _, value, low, high) in enumerate(numbers):
        scale = max(abs(value), 1e-12)
        axes.plot([100.0 * (low - value) / scale, 100.0 * (high - value) / scale], [row, row],
                  color=PALETTE[0][0], linewidth=3.0)
        axes.plot(0.0, row, 'o', color=PALETTE[0][0], markersize=6)
    axes.axvline(0.0, color='#333333', linewidth=0.8)
    axes.set_yticks(range(len(numbers)), [
        f'{name.replace("_", " ")} = {with_unit(value, unit, 4)}'
        for name, unit, value, _, _ in numbers])
    axes.invert_yaxis()
    axes.set_xlabel('95 % interval about the estimate [%]')


def chart_picture(chart: Chart) -> Figure:
    """
    Draw a chart of lines.

    Parameters
    ----------
    chart : Chart
        Lines, with the titles of the axes.

    Returns
    -------
    matplotlib Figure

    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(PICTURE):
        figure = Figure(figsize=(9.0, 3.6), layout='constrained')
        axes = figure.subplots()
        for place, one in enumerate(chart.lines):
            shade = PALETTE[place % len(PALETTE)][0]
            if one.spread is not None:
                axes.fill_between(one.x, one.y - one.spread, one.y + one.spread, color=shade,
                                  alpha=0.2, linewidth=0.0)
            axes.plot(one.x, one.y, '.' if one.dots else '-', color=shade, markersize=3.0,
                      linewidth=1.3, label=one.label)
        if chart.logarithmic:
            axes.set_yscale('log')
        axes.set_xlabel(chart.x_title)
        axes.set_ylabel(chart.y_title)
        axes.margins(x=0.01)
        if len(chart.lines) > 1:
            axes.legend()
    return figure
