# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The report of a change: the later recordings replayed through the robot before and after."""

from __future__ import annotations

from dataclasses import replace

from lg_husky_sim.comparison.replay import replay
from lg_husky_sim.comparison.traces import error_table, Predicted, recording_tables, traces_of
from lg_husky_sim.diagnosis.before_after.diagnose_change import ChangeCase
from lg_husky_sim.diagnosis.held_out import errors, split, stretches_of
from lg_husky_sim.diagnosis.report import report_data
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import ModelFile
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.reporting.data import (
    ErrorRow,
    ErrorTable,
    NOMINAL,
    Provenance,
    RECALIBRATED,
    ReportData,
    WITH_FINDING,
)
from lg_husky_sim.reporting.sections import Section, Table
from lg_husky_sim.reporting.words import number, quantity_with_unit

_ABOUT = {NOMINAL: 'the model as it was given',
          RECALIBRATED: 'the linear graph with a wheel-speed loop, fitted to the recordings '
                        'before the change',
          WITH_FINDING: 'the same, fitted to the recordings after it'}


def change_report(case: ChangeCase, provenance: Provenance | None = None) -> ReportData:
    """
    Return the report of a change.

    Parameters
    ----------
    case : ChangeCase
        The diagnosis, with the segments it was made of.
    provenance : Provenance, optional
        Of what files and versions the report is made.

    Returns
    -------
    ReportData

    """
    diagnosis = case.diagnosis
    plants = {NOMINAL: _plant(case.nominal), RECALIBRATED: _plant(diagnosis.plain_model)}
    if diagnosis.findings:
        plants[WITH_FINDING] = _plant(diagnosis.model)
    columns = tuple(plants)
    parts: list[Predicted] = [
        (stretch, {label: replay(plant, stretch) for label, plant in plants.items()})
        for segment in case.segments for stretch in stretches_of(segment)]
    pair = (columns[-2], columns[-1])
    _, test = split(case.segments)
    known = {NOMINAL: errors(plants[NOMINAL], test), RECALIBRATED: diagnosis.held_out_plain,
             WITH_FINDING: diagnosis.held_out_augmented}
    rows = tuple(ErrorRow(quantity_with_unit(key), {
        name: known[name][key] for name in columns if key in known[name]})
        for key in diagnosis.held_out_plain)
    tables = [
        ErrorTable('Held-out later recordings', rows, columns, True, pair,
                   'Root mean square errors, driven by the commands alone.'),
        replace(error_table('All later recordings', parts, columns, compared=pair))]
    if len({s.recording for s in case.segments}) > 1:
        tables += [replace(table, title=f'Recording {table.title}', folded=True)
                   for table in recording_tables(parts, columns, pair)]
    data = report_data(
        diagnosis, list(dict.fromkeys(s.recording for s in case.segments)),
        traces_of(parts, columns), tables, sections=(_both_fits(case),), provenance=provenance,
        changed=True)
    return replace(data, about=tuple((name, _ABOUT[name]) for name in columns))


def _plant(model: ModelFile) -> Plant:
    return compile_model(model.structure).at(model.parameters)


def _both_fits(case: ChangeCase) -> Section:
    base = case.loop.base
    values = zip(base.settings.quantities, base.values(case.loop.before),
                 base.values(case.loop.after), strict=True)
    rows = tuple((q.meaning, number(float(before), 4), number(float(after), 4),
                  '' if q.unit == '1' else q.unit) for q, before, after in values)
    return Section('The base robot, fitted to each set alone', (
        'Part of the difference between these fits is what the recordings leave undetermined; the '
        'finding is what must differ if everything else stays the same.',), tables=(
        Table(('quantity', 'before', 'after', 'unit'), rows),), folded=True)
