# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The errors of a diagnosis in three columns: one table for terminal, files, pages, notebooks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
import math

from lg_husky_sim.diagnosis.held_out import errors, split
from lg_husky_sim.diagnosis.result import Diagnosis
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import ModelFile
from lg_husky_sim.recording import Segment
from lg_husky_sim.reporting.data import (
    ErrorRow,
    ErrorTable,
    NOMINAL,
    RECALIBRATED,
    WITH_FINDING,
)
from lg_husky_sim.reporting.words import quantity_with_unit

_KEYS = ('position_rmse_m', 'wheel_speed_rmse', 'yaw_rate_rmse', 'forward_rmse', 'max_abs_x_m',
         'max_abs_y_m')


def with_nominal(diagnosis: Diagnosis, nominal: ModelFile, segments: Sequence[Segment],
                 names: Sequence[str] = ()) -> Diagnosis:
    """
    Return a diagnosis that knows the errors of the model as it was given.

    Parameters
    ----------
    diagnosis : Diagnosis
        One that knows them already stays as it is.
    nominal : ModelFile
        The model in doubt.
    segments : sequence of Segment
        Whose errors the diagnosis has.
    names : sequence of str
        Of all recordings in the order in which they were made.

    Returns
    -------
    Diagnosis

    """
    if diagnosis.nominal:
        return diagnosis
    plant = compile_model(nominal.structure).at(nominal.parameters)
    held_out = errors(plant, split(segments)[1], names) if diagnosis.held_out_plain else {}
    return replace(diagnosis, nominal=errors(plant, segments, names), held_out_nominal=held_out)


def error_tables(diagnosis: Diagnosis, changed: bool = False) -> tuple[ErrorTable, ...]:
    """
    Return the errors of the nominal, the recalibrated model and the one with the finding.

    Parameters
    ----------
    diagnosis : Diagnosis
        With the errors of its models, on all data and on held-out data.
    changed : bool
        Whether the question was what changed between recordings.

    Returns
    -------
    tuple of ErrorTable
        On held-out data, if there are any, and on all data; the last column only where
        something was added to the model, and the change is that to the last column. The nominal
        model alone where none describes the robot: a fit to that is no improvement.

    """
    how = ('' if changed or not diagnosis.refitted else
           ' The nominal model is not fitted; the others are fitted to the other half of the '
           'data.')
    sets = (('Held-out later recordings' if changed else 'Held-out data', True,
             f'Root mean square errors, driven by the commands alone.{how}',
             (diagnosis.held_out_nominal, diagnosis.held_out_plain, diagnosis.held_out_augmented)),
            ('All later recordings' if changed else 'All data', False, '',
             (diagnosis.nominal, diagnosis.plain, diagnosis.augmented)))
    return tuple(
        _table(title, held_out, note, dict(zip(
            (NOMINAL, RECALIBRATED, WITH_FINDING), columns, strict=True)), _shown(diagnosis))
        for title, held_out, note, columns in sets if columns[1])


def _shown(diagnosis: Diagnosis) -> tuple[str, ...]:
    # Without a second column of the same numbers where nothing was added.
    return (NOMINAL, *((RECALIBRATED,) if diagnosis.refitted else ()),
            *((WITH_FINDING,) if diagnosis.added else ()))


def _table(title: str, held_out: bool, note: str, known: Mapping[str, Mapping[str, float]],
           shown: Sequence[str]) -> ErrorTable:
    rows = tuple(ErrorRow(quantity_with_unit(key), {
        name: known[name][key] for name in shown if key in known[name]})
        for key in _KEYS if any(key in known[name] for name in shown))
    compared = (shown[-2], shown[-1]) if len(shown) > 1 else None
    return ErrorTable(title, rows, tuple(shown), held_out, compared, note)


def with_details(tables: Sequence[ErrorTable], detailed: Sequence[ErrorTable]
                 ) -> tuple[ErrorTable, ...]:
    """
    Return the tables of :func:`error_tables` with what the traces of a page tell beside them.

    Parameters
    ----------
    tables, detailed : sequence of ErrorTable
        Of the same models; those of one title belong together.

    Returns
    -------
    tuple of ErrorTable
        First the common ones, with the intervals of their changes and the further rows that
        the traces have, then the other detailed ones.

    """
    more = {one.title: one for one in detailed}
    merged = [_merged(table, more.pop(table.title)) if table.title in more else table
              for table in tables]
    return (*merged, *more.values())


def _merged(table: ErrorTable, detailed: ErrorTable) -> ErrorTable:
    common = {row.name: row for row in table.rows}
    rows = [replace(row, values=common.pop(row.name).values) if row.name in common else row
            for row in detailed.rows]
    intervals = any(map(math.isfinite, (end for row in rows for end in (row.low, row.high))))
    return replace(table, rows=(*rows, *common.values()),
                   note=' '.join(filter(None, (table.note, detailed.note if intervals else ''))))
