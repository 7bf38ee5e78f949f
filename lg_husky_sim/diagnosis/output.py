# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Write what a diagnosis found: JSON, model files, text, report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
import json
from pathlib import Path

from lg_husky_sim.diagnosis.before_after.diagnose_change import ChangeCase
from lg_husky_sim.diagnosis.before_after.report import change_report
from lg_husky_sim.diagnosis.diagnose import Case
from lg_husky_sim.diagnosis.error_tables import error_tables, with_details, with_nominal
from lg_husky_sim.diagnosis.report import headline as page_headline
from lg_husky_sim.diagnosis.report import unexplained_sensors
from lg_husky_sim.diagnosis.report_of_case import case_report
from lg_husky_sim.diagnosis.result import Diagnosis, diagnosis_data, Verdict
from lg_husky_sim.husky.model_file import save_model
from lg_husky_sim.reporting.data import ErrorTable, Provenance, ReportData
from lg_husky_sim.reporting.page import change_words, error_cells
from lg_husky_sim.reporting.sections import Cell
from lg_husky_sim.reporting.write import write_report

#: File that marks a folder of this kind.
MARKER = 'diagnosis.json'


def headline(diagnosis: Diagnosis, changed: bool = False) -> str:
    """Return the answer in one sentence; `changed` if the question was what changed."""
    match diagnosis.verdict:
        case Verdict.NOTHING_MISSING:
            return ('No change found: the model of the earlier recordings explains the later ones.'
                    if changed else
                    'No missing physics found: the recalibrated model explains the recordings.')
        case Verdict.UNKNOWN if not diagnosis.fits:
            return f'{diagnosis.misfit}.'
        case Verdict.UNKNOWN:
            return ('Something has changed that is not in the catalogue.' if changed else
                    'Something is missing that is not in the catalogue.')
        case Verdict.KNOWN:
            return f'{page_headline(diagnosis, changed=changed).text}.'


def summary_text(diagnosis: Diagnosis, changed: bool = False) -> str:
    """
    Return the answer as text.

    Parameters
    ----------
    diagnosis : Diagnosis
        The answer, with its findings and errors.
    changed : bool
        Whether the question was what changed between recordings.

    Returns
    -------
    str
        Headline, findings, competing effects, what cannot be told apart, errors before and after.

    """
    answer = headline(diagnosis, changed).removesuffix('.')
    lines = [f'{answer} (confidence {diagnosis.confidence:.2f})',
             *(f'  warning: {text}' for text in diagnosis.warnings)]
    for finding in diagnosis.findings:
        name = '' if finding.effect == 'unknown' else f'{finding.effect}: '
        lines.append(f'  {name}{finding.statement}')
        evidence = f'gain {finding.held_out_gain:.0f} nats, {finding.chance}; ' if (
            finding.chance) else ''
        rivals = [f'{r.effect} {r.held_out_gain:.0f}' for r in finding.rivals
                  if r.held_out_gain > 0.0]
        if diagnosis.fits or rivals:
            lines.append(f'    {evidence}competing effects: '
                         f'{", ".join(rivals) or "none that predicts better"}')
    for group in diagnosis.indistinguishable:
        lines.append(f'  indistinguishable: {", ".join(group.effects)}; '
                     f'would separate them: {"; ".join((*group.sensors, *group.manoeuvres))}')
    lines += _error_lines(error_tables(diagnosis, changed))
    if diagnosis.fits:
        lines.append(f'  remaining: {diagnosis.remaining}')
    lines.extend(f'  sensors compared with each other: {text}'
                 for text in unexplained_sensors(diagnosis))
    lines.extend(f'  note: {note}' for note in diagnosis.notes)
    return '\n'.join(lines)


def _error_lines(tables: Sequence[ErrorTable]) -> list[str]:
    # The cells of the page, whose colours are words here; all tables have one set of columns.
    if not tables:
        return []
    shown = [(table.title.lower(), error_cells(table)) for table in tables]
    rows = [[title, *one.head[1:]] if row is None else [
        change_words(cell) if isinstance(cell, Cell) else cell for cell in row]
        for title, one in shown for row in (None, *one.rows)]
    first, *others = (max(map(len, column)) for column in zip(*rows, strict=True))
    lines = [f'  {name:{first}}' + ''.join(
        f'  {text:>{width}}' for text, width in zip(texts, others, strict=True))
        for name, *texts in rows]
    compared = tables[0].compared
    return [*lines, f'  change: from {compared[0]} to {compared[1]}'] if compared else lines


def write_files(folder: Path, case: Case | ChangeCase, with_report: bool = True,
                provenance: Provenance | None = None) -> str:
    """
    Write the files of a diagnosis, results first.

    Parameters
    ----------
    folder : pathlib.Path
        An empty folder.
    case : Case or ChangeCase
        The diagnosis, with the model in doubt and the segments it was made of.
    with_report : bool
        Whether to write report.html and the pictures too.
    provenance : Provenance, optional
        Of what files and versions the report is made.

    Returns
    -------
    str
        Why there is no report, if one was asked for and cannot be made; empty otherwise.

    """
    diagnosis = with_nominal(case.diagnosis, case.nominal, case.segments)
    save_model(diagnosis.model, folder / 'model.yaml')
    save_model(diagnosis.plain_model, folder / 'plain.yaml')
    (folder / 'diagnosis.txt').write_text(
        summary_text(diagnosis, isinstance(case, ChangeCase)) + '\n', encoding='utf-8')
    (folder / MARKER).write_text(
        json.dumps(diagnosis_data(diagnosis), indent=1, ensure_ascii=False, allow_nan=False)
        + '\n', encoding='utf-8')
    if with_report:
        try:
            write_report(_report(case, diagnosis, provenance), folder)
        except Exception as error:  # the answer is worth more than its report
            return f'report.html could not be made: {type(error).__name__}: {error}'
    return ''


def _report(case: Case | ChangeCase, diagnosis: Diagnosis, provenance: Provenance | None
            ) -> ReportData:
    if isinstance(case, Case):
        return case_report(case, provenance)
    data = change_report(case, provenance)
    return replace(data, errors=with_details(error_tables(diagnosis, True), data.errors))
