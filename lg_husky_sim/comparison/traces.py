# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Segments and their predictions as the traces and error tables of a report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math
from typing import TypeAlias

from lg_husky_sim.comparison.metrics import (
    channel_errors,
    channel_pairs,
    pooled,
    tracking,
    UNITS,
)
from lg_husky_sim.recording import Segment
from lg_husky_sim.reporting.data import ErrorRow, ErrorTable, Trace
from lg_husky_sim.reporting.words import quantity_with_unit
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np

#: A segment beside what each model predicts of it, by the model's column.
Predicted: TypeAlias = tuple[Segment, Mapping[str, TimeSeries]]
#: Signals of a page in their order; x and y make up the path.
CHANNELS = ('wheel_left', 'wheel_right', 'forward', 'yaw_rate', 'x', 'y')
#: A silence of so many usual steps, and at least so long, breaks a line [s].
SILENCE, LEAST_SILENCE = 3.0, 0.5
#: Length of a block of correlated errors [s], and draws of blocks for an interval.
BLOCK, DRAWS = 5.0, 400


def traces_of(parts: Sequence[Predicted], columns: Sequence[str]) -> tuple[Trace, ...]:
    """
    Return the traces of recordings.

    Parameters
    ----------
    parts : sequence of (Segment, mapping of str to TimeSeries)
        In order of time; columns of the simulator by model.
    columns : sequence of str
        Models in order.

    Returns
    -------
    tuple of Trace
        Recording by recording, the channels that were measured; segments follow each other with
        a gap in between. x is ahead and y to the left of the robot as it stood at the start of
        the recording's first segment, and their errors so at the start of each segment.

    """
    found = []
    for name in dict.fromkeys(segment.recording for segment, _ in parts):
        own = [(segment, predictions) for segment, predictions in parts
               if segment.recording == name]
        tables: dict[str, list[FloatArray]] = {}
        for segment, predictions in own:
            for channel, table in _segment_tables(segment, predictions, columns).items():
                if len(table):  # a segment may be too short for a slope, or between two samples
                    tables.setdefault(channel, []).append(table)
        joined = {channel: _joined(tables[channel]) for channel in CHANNELS if channel in tables}
        last = 2 + len(columns)
        _turn(joined, own, last)
        for channel, table in joined.items():
            predicted = {column: table[:, 2 + place] for place, column in enumerate(columns)
                         if np.isfinite(table[:, 2 + place]).any()}
            errors = dict(zip(columns, table[:, last:].T, strict=False))
            found.append(Trace(name, channel, table[:, 0], table[:, 1], predicted, errors=errors))
    return tuple(found)


def _segment_tables(segment: Segment, predictions: Mapping[str, TimeSeries],
                    columns: Sequence[str]) -> dict[str, FloatArray]:
    # Times, measured, and a column for each model, by channel; then the tracking errors.
    pairs = {name: channel_pairs(segment, predictions[name]) for name in columns
             if name in predictions}
    tables = {}
    for channel, (times, measured, _) in next(iter(pairs.values()), {}).items():
        missing = np.full(times.size, np.nan)
        tables[channel] = np.column_stack([times, measured, *(
            pairs[name][channel][2] if name in pairs else missing for name in columns)])
    if 'x' in tables:
        tracks = [tracking(segment, predictions[name]).error if name in pairs else
                  np.full((len(tables['x']), 2), np.nan) for name in columns]
        for place, channel in enumerate(('x', 'y')):
            tables[channel] = np.column_stack(
                [tables[channel], *(error[:, place] for error in tracks)])
    return tables


def _joined(tables: Sequence[FloatArray]) -> FloatArray:
    # One table, with a row of gaps between segments and in long silences.
    rows: list[FloatArray] = []
    for table in tables:
        if rows:
            rows.append(_gap(rows[-1][-1, 0], table[0, 0], table.shape[1]))
        steps = np.diff(table[:, 0])
        longest = max(LEAST_SILENCE, SILENCE * float(np.median(steps))) if steps.size else math.inf
        at = 0
        for place in (np.flatnonzero(steps > longest) + 1).tolist():
            rows += [table[at:place], _gap(table[place - 1, 0], table[place, 0], table.shape[1])]
            at = place
        rows.append(table[at:])
    return np.vstack(rows)


def _gap(before: float, after: float, width: int) -> FloatArray:
    row = np.full((1, width), np.nan)
    row[0, 0] = 0.5 * (before + after)
    return row


def _turn(tables: dict[str, FloatArray], own: Sequence[Predicted], last: int) -> None:
    # Turn the path into the frame of the robot as it stood at the first start.
    if 'x' not in tables:
        return
    for _, predictions in own:
        for series in predictions.values():
            there = np.flatnonzero(np.isfinite(series.column('x')))
            if there.size:
                x, y, heading = (float(series.column(name)[there[0]])
                                 for name in ('x', 'y', 'heading'))
                east, north = tables['x'][:, 1:last] - x, tables['y'][:, 1:last] - y
                tables['x'][:, 1:last] = np.cos(heading) * east + np.sin(heading) * north
                tables['y'][:, 1:last] = -np.sin(heading) * east + np.cos(heading) * north
                return


def error_table(title: str, parts: Sequence[Predicted], columns: Sequence[str], *,
                compared: tuple[str, str] | None = None, held_out: bool = False) -> ErrorTable:
    """
    Return root mean square errors and the paper's largest tracking errors.

    Parameters
    ----------
    title : str
        Heading of the table.
    parts : sequence of (Segment, mapping of str to TimeSeries)
        Measured stretches, each with its predictions by column.
    columns : sequence of str
        Models, in the order of the table.
    compared : tuple of str and str, optional
        Columns from and to which a change is given.
    held_out : bool
        Whether these are data that no model was fitted to.

    Returns
    -------
    ErrorTable

    """
    sums = {name: pooled(channel_errors(segment, predictions[name])
                         for segment, predictions in parts if name in predictions)
            for name in columns}
    intervals = {} if compared is None else change_intervals(parts, *compared)
    rows = [ErrorRow(quantity_with_unit(channel), {
        name: own[channel].rmse for name, own in sums.items() if channel in own},
        *intervals.get(channel, (math.nan, math.nan)))
        for channel in UNITS if any(channel in own for own in sums.values())]
    bounds = {name: [tracking(segment, predictions[name]).bounds
                     for segment, predictions in parts
                     if name in predictions and 'pose' in segment.streams] for name in columns}
    for axis, key in enumerate(('max_abs_x_m', 'max_abs_y_m')):
        values = {name: max((pair[axis] for pair in own if math.isfinite(pair[axis])),
                            default=math.nan) for name, own in bounds.items()}
        if any(map(math.isfinite, values.values())):
            rows.append(ErrorRow(quantity_with_unit(key), values))
    note = '' if not intervals else (
        f'In brackets its 95 % interval, from resampling blocks of {BLOCK:g} s, so that '
        'correlated errors count once.')
    return ErrorTable(title, tuple(rows), tuple(columns), held_out, compared, note)


def change_intervals(parts: Sequence[Predicted], before: str, after: str
                     ) -> dict[str, tuple[float, float]]:
    """
    Return 95 % intervals of how root mean square errors change from one model to another.

    Parameters
    ----------
    parts : sequence of (Segment, mapping of str to TimeSeries)
        Measured stretches, each with its predictions by column.
    before, after : str
        Columns.

    Returns
    -------
    dict of str to (float, float)
        Factors by channel, from resampling blocks of :data:`BLOCK`, within which errors may be
        correlated as they like; without channels that have one block only.

    """
    sums: dict[str, list[FloatArray]] = {}
    for segment, predictions in parts:
        if not {before, after} <= set(predictions):
            continue
        pairs = [channel_pairs(segment, predictions[name]) for name in (before, after)]
        blocks = {channel: _block_sums(times, measured - first, measured - pairs[1][channel][2])
                  for channel, (times, measured, first) in pairs[0].items()}
        for whole, halves in (('wheel_speed', ('wheel_left', 'wheel_right')),
                              ('position', ('x', 'y'))):
            if halves[0] in blocks:
                blocks[whole] = blocks[halves[0]] + blocks[halves[1]]
        for channel, table in blocks.items():
            sums.setdefault(channel, []).append(table)
    found = {}
    for channel, tables in sums.items():
        table = np.vstack(tables)
        if len(table) > 1:
            picks = np.random.default_rng(0).integers(0, len(table), (DRAWS, len(table)))
            drawn = table[picks].sum(axis=1)
            ratio = np.sqrt(drawn[:, 1] / np.maximum(drawn[:, 0], 1e-300))
            low, high = np.quantile(ratio, (0.025, 0.975))
            found[channel] = (float(low), float(high))
    return found


def _block_sums(times: FloatArray, before: FloatArray, after: FloatArray) -> FloatArray:
    # Sums of squares of both errors in each block, shape (n_blocks, 2).
    block = np.floor((times - times[0]) / BLOCK).astype(np.int64)
    known = np.isfinite(before) & np.isfinite(after)
    return np.column_stack([np.bincount(block, np.where(known, error, 0.0) ** 2)
                            for error in (before, after)])


def recording_tables(parts: Sequence[Predicted], columns: Sequence[str],
                     compared: tuple[str, str] | None = None) -> tuple[ErrorTable, ...]:
    """Return an error table for each recording, under its name."""
    names = dict.fromkeys(segment.recording for segment, _ in parts)
    return tuple(error_table(name, [one for one in parts if one[0].recording == name], columns,
                             compared=compared) for name in names)
