# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Write what a diagnosis found: JSON, model files, text, report."""

from __future__ import annotations

import json
from pathlib import Path

from lg_husky_sim.diagnosis.before_after.diagnose_change import ChangeCase
from lg_husky_sim.diagnosis.before_after.report import change_report
from lg_husky_sim.diagnosis.diagnose import Case
from lg_husky_sim.diagnosis.report import headline as page_headline
from lg_husky_sim.diagnosis.report import unexplained_sensors
from lg_husky_sim.diagnosis.report_of_case import case_report
from lg_husky_sim.diagnosis.result import Diagnosis, diagnosis_data, Verdict
from lg_husky_sim.husky.model_file import save_model
from lg_husky_sim.reporting.data import Provenance, RECALIBRATED, WITH_FINDING
from lg_husky_sim.reporting.words import quantity_with_unit
from lg_husky_sim.reporting.write import write_report

#: File that marks a folder of this kind.
MARKER = 'diagnosis.json'
_ROWS = tuple((key, quantity_with_unit(key)) for key in (
    'position_rmse_m', 'wheel_speed_rmse', 'yaw_rate_rmse', 'forward_rmse', 'max_abs_x_m',
    'max_abs_y_m'))


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


def error_table(diagnosis: Diagnosis) -> list[tuple[str, str, str, str, str]]:
    """Return rows of errors: name, plain, augmented, held-out plain, held-out augmented."""
    columns = (diagnosis.plain, diagnosis.augmented, diagnosis.held_out_plain,
               diagnosis.held_out_augmented)
    return [(label, *(f'{c[key]:.4g}' if key in c else '-' for c in columns))  # type: ignore[misc]
            for key, label in _ROWS if any(key in c for c in columns)]


def summary_text(diagnosis: Diagnosis, changed: bool = False) -> str:
    """
    Return the answer as text.

    Parameters
    ----------
    diagnosis : Diagnosis
    changed : bool
        Whether the question was what changed between recordings.

    Returns
    -------
    str
        Headline, findings, competing effects, what cannot be told apart, errors before and after.
    """
    lines = [f'{headline(diagnosis, changed)} (confidence {diagnosis.confidence:.2f})',
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
    lines += _error_lines(diagnosis)
    if diagnosis.fits:
        lines.append(f'  remaining: {diagnosis.remaining}')
    lines.extend(f'  sensors compared with each other: {text}'
                 for text in unexplained_sensors(diagnosis))
    lines.extend(f'  note: {note}' for note in diagnosis.notes)
    return '\n'.join(lines)


def _error_lines(diagnosis: Diagnosis) -> list[str]:
    # Without a second column of the same numbers where nothing was added.
    shown = (RECALIBRATED,) if diagnosis.model == diagnosis.plain_model else (
        RECALIBRATED, WITH_FINDING)
    places = [*range(len(shown)), *range(2, 2 + len(shown))]
    wide = 13 * len(shown)
    lines = [f'  {"error on":22}{"all data:":>{wide}}  {"held-out data:":>{max(wide, 15)}}',
             f'  {"":22}' + f'{"".join(f"{name:>13}" for name in shown)}  ' * 2]
    for label, *cells in error_table(diagnosis):
        texts = [f'{cells[place]:>13}' for place in places]
        lines.append(f'  {label:22}{"".join(texts[:len(shown)])}  {"".join(texts[len(shown):])}')
    return lines


def write_files(folder: Path, case: Case | ChangeCase, with_report: bool = True,
                provenance: Provenance | None = None) -> str:
    """
    Write the files of a diagnosis, results first.

    Parameters
    ----------
    folder : pathlib.Path
        An empty folder.
    case : Case or ChangeCase
    with_report : bool
        Whether to write report.html and the pictures too.
    provenance : Provenance, optional

    Returns
    -------
    str
        Why there is no report, if one was asked for and cannot be made; empty otherwise.
    """
    diagnosis = case.diagnosis
    save_model(diagnosis.model, folder / 'model.yaml')
    save_model(diagnosis.plain_model, folder / 'plain.yaml')
    (folder / 'diagnosis.txt').write_text(
        summary_text(diagnosis, isinstance(case, ChangeCase)) + '\n', encoding='utf-8')
    (folder / MARKER).write_text(
        json.dumps(diagnosis_data(diagnosis), indent=1, ensure_ascii=False, allow_nan=False)
        + '\n', encoding='utf-8')
    if with_report:
        try:
            write_report(change_report(case, provenance) if isinstance(case, ChangeCase)
                         else case_report(case, provenance), folder)
        except Exception as error:  # the answer is worth more than its report
            return f'report.html could not be made: {type(error).__name__}: {error}'
    return ''
