# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Figures of an answer: before and after, rivals, intervals, the marked graph."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from lg_husky_sim.comparison.figures import COLOURS, MEASURED, STYLE
from lg_husky_sim.diagnosis.diagnose import Case
from lg_husky_sim.diagnosis.everyday import named_rounds
from lg_husky_sim.diagnosis.locate import Located
from lg_husky_sim.diagnosis.result import Estimate, Verdict
from lg_husky_sim.diagnosis.rounds import Round
from lg_husky_sim.husky.model import Structure
from lg_husky_sim.identification.problem import Observations, Slice, UNITS
from lg_husky_sim.linear_graph import Branch, LinearGraph
from lg_husky_sim.signals import FloatArray
import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PLAIN, AUGMENTED, GREY = COLOURS[1], COLOURS[0], '#333333'
#: Names of the channels in words.
CHANNEL_WORDS = {
    'wheel_left': 'left wheel rate', 'wheel_right': 'right wheel rate',
    'yaw_rate': 'yaw rate (gyro)', 'advance': 'forward speed (pose)',
    'turn': 'yaw rate (pose)'}
#: Longest stretch that is shown of a signal [s].
VIEW = 30.0


def telling_slice(case: Case, final: FloatArray, located: Located) -> Slice:
    """Return the channel of a piece in which the answer, or the lack of one, shows most."""
    observations, search = case.search.observations, case.search
    names = {segment.recording for segment in case.segments}
    own = [s for s in observations.slices
           if observations.pieces[s.piece].recording in names and s.last - s.first > 5]
    if case.diagnosis.verdict is Verdict.KNOWN:
        before = (observations.measured - search.plain.solution.predicted) ** 2
        drop = before - (observations.measured - final) ** 2
        spread = {name: float(np.var(observations.measured[observations.channel_mask(name)]))
                  for name in observations.channels}
        fast = [s for s in own if s.channel not in ('advance', 'turn')] or own
        return max(fast, key=lambda s: float(np.sum(drop[s.first:s.last]))
                   / (s.last - s.first) ** 0.5 / max(spread[s.channel], 1e-9))
    gains = located.gains()
    return max(own, key=lambda s: gains.get(
        (observations.pieces[s.piece].recording, observations.pieces[s.piece].index, s.channel),
        0.0))


def _window(times: FloatArray, drop: FloatArray) -> tuple[float, float]:
    # The stretch of VIEW with the largest drop.
    if times[-1] - times[0] <= VIEW:
        return float(times[0]), float(times[-1])
    total = np.concatenate([[0.0], np.cumsum(drop)])
    last = np.searchsorted(times, times + VIEW, side='right')
    first = int(np.argmax(total[last] - total[:-1]))
    start = min(float(times[first]), float(times[-1]) - VIEW)
    return start, start + VIEW


def labels_of(case: Case) -> tuple[str, str]:
    """Return what the two models are called in pictures."""
    names = ' + '.join(f.effect for f in case.diagnosis.findings)
    if case.diagnosis.verdict is Verdict.UNKNOWN:
        structure = case.diagnosis.model.structure
        names = '' if structure == case.search.plain.structure else (
            'the nearest entry' if structure == case.search.final.structure else 'the description')
    return 'recalibrated model', f'with {names}' if names else 'recalibrated model'


def before_after_figure(case: Case, located: Located) -> Figure:
    """
    Draw the channel in which the answer shows most, measured, before and after.

    Parameters
    ----------
    case : Case
    located : Located

    Returns
    -------
    matplotlib Figure
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    search, observations = case.search, case.search.observations
    predicted = case.fit.solution.predicted
    one = telling_slice(case, predicted, located)
    part = slice(one.first, one.last)
    times, measured = observations.times[part], observations.measured[part]
    plain, final = search.plain.solution.predicted[part], predicted[part]
    start, end = _window(times, (measured - plain) ** 2 - (measured - final) ** 2)
    shown = (times >= start) & (times <= end)
    before, after = labels_of(case)
    known = before != after
    with rc_context(STYLE):
        figure = Figure(figsize=(9.0, 5.0), layout='constrained')
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(1.7, 1.0))
        for axes, offset in ((upper, np.zeros(times.size)), (lower, measured)):
            sign = 1.0 if axes is upper else -1.0
            if axes is upper:
                axes.plot(times[shown], measured[shown], color=GREY, linewidth=2.6, alpha=0.4,
                          label=MEASURED)
            axes.plot(times[shown], sign * (plain - offset)[shown], color=PLAIN, linewidth=1.3,
                      label=before)
            if known:
                axes.plot(times[shown], sign * (final - offset)[shown], color=AUGMENTED,
                          linewidth=1.3, label=after)
        lower.axhline(0.0, color=GREY, linewidth=0.8)
        unit = UNITS[one.channel]
        upper.set_ylabel(unit)
        lower.set_ylabel(f'measured − model\n[{unit}]')
        lower.set_xlabel('time [s]')
        lower.margins(x=0.01)
        words = CHANNEL_WORDS[one.channel]
        name = observations.pieces[one.piece].recording
        upper.set_title(f'{words[0].upper()}{words[1:]}, {_short(name)}')
        onset = case.diagnosis.model.structure.onset
        if onset is not None and onset.kind.value == 'time' and (
                onset.recording in ('', name)) and start < onset.value < end:
            for axes in (upper, lower):
                axes.axvline(onset.value, color='#d40000', linewidth=1.2, linestyle='--',
                             label='onset')
        figure.legend(*upper.get_legend_handles_labels(), loc='outside lower center', ncol=4)
    return figure


def _short(text: str, most: int = 48) -> str:
    plain = text.replace('$', r'\$')
    return plain if len(plain) <= most else plain[:most - 1] + '…'


def rivals_figure(case: Case) -> Figure | None:
    """
    Draw the held-out gains of what was tried, a panel for each round.

    Parameters
    ----------
    case : Case

    Returns
    -------
    matplotlib Figure or None
        None where nothing was tried.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    rounds = [one for one in case.search.rounds if one.rivals]
    if not rounds:
        return None
    columns = min(len(rounds), 2)
    rows = -(-len(rounds) // columns)
    most = max(len(one.rivals) for one in rounds)
    with rc_context({**STYLE, 'axes.grid': False}):
        figure = Figure(figsize=(9.0, rows * (1.2 + 0.32 * most)), layout='constrained')
        grid = figure.subplots(rows, columns, squeeze=False).flat
        for axes in grid[len(rounds):]:
            axes.set_axis_off()
        for axes, (number, one) in zip(grid, enumerate(rounds), strict=False):
            _draw_round(axes, one)
            axes.set_title(f'Round {number + 1}: {_outcome(case, one)}')
    return figure


def _outcome(case: Case, one: Round) -> str:
    # What became of a round's best candidate.
    if not one.adopted:
        return 'nothing adopted'
    if case.diagnosis.verdict is Verdict.UNKNOWN:
        return 'nearest, but not its name'
    return 'adopted' if one in named_rounds(case.search) else 'too little to be missing'


def _draw_round(axes: Axes, one: Round) -> None:
    names = []
    for rival in one.rivals:
        parts = [p for p in (rival.effect.side, rival.effect.shape)
                 if p not in ('', 'none', 'both')]
        names.append(', '.join([rival.effect.id, *parts])
                     + ('' if rival.onset is None else ' (late)'))
    gains = [rival.held_out for rival in one.rivals]
    chosen = [one.adopted and i == 0 for i in range(len(gains))]
    top = max(*gains, 1.0)
    floor = -0.3 * top  # a much worse one would hide the others
    axes.barh(range(len(gains)), [max(gain, floor) for gain in gains],
              color=[AUGMENTED if on else '#b8c0cc' for on in chosen])
    for row, gain in enumerate(gains):
        axes.text(max(gain, 0.0) + 0.02 * top, row, f'{gain:.0f}', va='center', fontsize=8.0)
    axes.set_yticks(range(len(gains)), names)
    for label, on in zip(axes.get_yticklabels(), chosen, strict=True):
        label.set_fontweight('bold' if on else 'normal')
    axes.invert_yaxis()
    axes.set_xlim(floor if min(gains) < 0.0 else 0.0, 1.25 * top)
    axes.locator_params(axis='x', nbins=4)
    axes.axvline(0.0, color=GREY, linewidth=0.8)
    axes.set_xlabel('held-out gain [nats]')


def intervals_figure(case: Case) -> Figure | None:
    """
    Draw the intervals of the recalibrated parameters relative to their nominal values.

    Parameters
    ----------
    case : Case

    Returns
    -------
    matplotlib Figure or None
        None where nothing was recalibrated.
    """
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    nominal = case.nominal.parameters
    numbers = [e for e in case.diagnosis.recalibration if nominal[e.name]]
    if not numbers:
        return None
    with rc_context(STYLE):
        figure = Figure(figsize=(9.0, 1.1 + 0.3 * len(numbers)), layout='constrained')
        axes = figure.subplots()
        for row, one in enumerate(numbers):
            _interval(axes, row, one, nominal[one.name], nominal.entry(one.name).tolerance)
        axes.axvline(0.0, color=GREY, linewidth=0.8)
        axes.set_yticks(range(len(numbers)), [
            f'{e.name.replace("_", " ")} = {e.value:.4g}{"" if e.unit == "1" else " " + e.unit}'
            for e in numbers])
        axes.invert_yaxis()
        axes.set_xscale('symlog', linthresh=10.0)
        axes.xaxis.set_major_formatter(lambda value, _: f'{value:+g} %' if value else '0')
        axes.set_xlabel('change from the nominal value, with its 95 % interval; '
                        'grey: tolerance of the nominal value')
    return figure


def _interval(axes: Axes, row: int, one: Estimate, nominal: float, tolerance: float) -> None:
    low, value, high = (100.0 * (number / nominal - 1.0)
                        for number in (one.low, one.value, one.high))
    wide = 100.0 * min(tolerance, 1.0)
    axes.plot([-wide, wide], [row, row], color='#c9ced6', linewidth=9.0, solid_capstyle='butt')
    axes.plot([low, high], [row, row], color=AUGMENTED, linewidth=2.4)
    axes.plot(value, row, 'o', color=AUGMENTED, markersize=5.5)


def new_elements(plain: Structure, final: Structure) -> tuple[LinearGraph, tuple[str, ...]]:
    """
    Return the graph with what was found, and the branches that it has more.

    Parameters
    ----------
    plain, final : Structure

    Returns
    -------
    LinearGraph
    tuple of str
    """
    graph = final.network().graph
    before = set(plain.network().graph.names)
    return graph, tuple(branch.name for branch in graph.branches if branch.name not in before)


def _drawn(graph: LinearGraph, added: Sequence[str]) -> tuple[LinearGraph, tuple[str, ...]]:
    # New branches under names that are short enough to be drawn: T_new_L, E_new_1.
    fresh: list[Branch] = []
    for branch in graph.branches:
        if branch.name in added:
            graph = graph.without(branch.name)
            end = branch.name.rsplit('_', 1)[-1]
            short = f'{branch.name[0]}_new' + (f'_{end}' if len(end) <= 2 else '')
            taken = {*graph.names, *(other.name for other in fresh)}
            if short in taken:
                short = next(f'{short}_{n}' for n in range(2, len(taken) + 3)
                             if f'{short}_{n}' not in taken)
            fresh.append(replace(branch, name=short))
    return graph.with_branches(*fresh), tuple(branch.name for branch in fresh)


def graph_figure(plain: Structure, final: Structure, elements: Sequence[str]) -> Figure:
    """
    Draw the linear graph, suspected branches marked and new elements dashed.

    Parameters
    ----------
    plain, final : Structure
        Without and with what was found.
    elements : sequence of str
        Suspected elements; those that are none of the graph are passed over.

    Returns
    -------
    matplotlib Figure
    """
    from lg_husky_sim.linear_graph.drawing import draw_graph
    from lg_husky_sim.linear_graph.layout import layout
    from matplotlib.figure import Figure

    graph, added = _drawn(*new_elements(plain, final))
    blocks = layout(graph)
    width = max(max(block.x + block.width for block in blocks), 7.0) + 1.0
    height = -min(block.y for block in blocks) + 2.8
    figure = Figure(figsize=(width * 0.5, height * 0.5))
    axes = figure.add_axes((0.01, 0.01, 0.98, 0.98))
    known = set(graph.names)
    draw_graph(axes, graph, culprits=[e for e in elements if e in known and e not in added],
               new=added)
    return figure


def channel_rows(observations: Observations, plain: FloatArray, final: FloatArray
                 ) -> list[tuple[str, float, float, float, float, float]]:
    """
    Return root mean square residuals of each channel with the change's interval.

    Parameters
    ----------
    observations : Observations
    plain, final : numpy.ndarray, shape (n_values,)
        Predictions.

    Returns
    -------
    list of tuple
        Words, plain, augmented, change in per cent, and the ends of its 95 % interval from
        resampling blocks of 5 s, within which residuals may be correlated as they like.
    """
    rng = np.random.default_rng(0)
    rows = []
    for name in observations.channels:
        sums: dict[tuple[int, int], FloatArray] = {}
        for one in observations.slices:
            if one.channel != name:
                continue
            part = slice(one.first, one.last)
            blocks = np.floor(observations.times[part] / 5.0).astype(np.int64)
            squares = [(observations.measured[part] - p[part]) ** 2 for p in (plain, final)]
            for block in np.unique(blocks):
                inside = blocks == block
                sums[one.piece, int(block)] = np.array(
                    [float(np.sum(s[inside])) for s in squares] + [float(np.sum(inside))])
        table = np.array(list(sums.values()))
        if not table.size:
            continue
        whole = np.sqrt(table.sum(axis=0)[:2] / table[:, 2].sum())
        picks = rng.integers(0, len(table), (400, len(table)))
        drawn = table[picks].sum(axis=1)
        ratio = np.sqrt(drawn[:, 1] / np.maximum(drawn[:, 0], 1e-300))
        low, high = np.quantile(ratio, (0.025, 0.975))
        change = float(whole[1] / max(whole[0], 1e-300))
        rows.append((f'{CHANNEL_WORDS[name]} [{UNITS[name]}]', float(whole[0]), float(whole[1]),
                     100.0 * (change - 1.0), 100.0 * (float(low) - 1.0),
                     100.0 * (float(high) - 1.0)))
    return rows
