# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The paper's table and figures of a case."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
import math
from typing import Any

from lg_husky_sim.comparison.traces import Predicted, traces_of
from lg_husky_sim.evaluation.engine import engine_config
from lg_husky_sim.evaluation.paper_case import (
    BASE,
    CaseResult,
    GENETIC,
    GIVEN,
    NOMINAL,
    SQUARES,
)
from lg_husky_sim.husky.by_hand import other_robot
from lg_husky_sim.husky.model_file import packaged
from lg_husky_sim.identification.paper import paper
from lg_husky_sim.identification.report import convergence_chart
from lg_husky_sim.reporting.data import ErrorRow, ErrorTable, Headline, ReportData
from lg_husky_sim.reporting.pictures import path_picture, responses_picture
from lg_husky_sim.reporting.sections import Chart, Drawing, Section, Table

PRINTED = 'printed in the paper'
#: Numbers of the paper's figures of trajectories, in the order of its manoeuvres.
FIRST_TRAJECTORY = 14
#: What the models of a case are, by label.
ABOUT = {
    GENETIC: "the paper's linear graph (LG), calibrated by its genetic algorithm",
    SQUARES: 'the same graph, calibrated by least squares',
    BASE: 'the graph with a wheel-speed loop and dead time, calibrated by least squares',
    NOMINAL: 'the graph with the numbers that the paper prints',
    GIVEN: 'the graph with the numbers of the model that is given'}


def table(result: CaseResult) -> Table:
    """
    Return the paper's six numbers: largest absolute errors in x and y of each manoeuvre [m].

    Parameters
    ----------
    result : CaseResult
        Of one case: its drives by manoeuvre, each predicted by all models.

    """
    reference = paper().tracking_error
    rows = []
    for drive in result.drives:
        for axis, letter in enumerate('XY'):
            cells = [f'{drive.bounds(label)[axis]:.4f}' for label in result.labels]
            stated = reference.get(drive.name)
            use = 'held out' if drive.held_out else 'calibration'
            rows.append((f'{drive.name} max |{letter}| ({use})', *cells,
                         f'{stated[axis]:.4f}' if stated else '–'))
    return Table(('largest tracking error [m]', *result.labels, PRINTED), rows)


def papers_numbers(result: CaseResult) -> ErrorTable:
    """Return the paper's six numbers as a table of errors."""
    reference = paper().tracking_error
    rows = []
    for drive in result.drives:
        for axis, letter in enumerate('XY'):
            values = {label: drive.bounds(label)[axis] for label in result.labels}
            if drive.name in reference:
                values[PRINTED] = reference[drive.name][axis]
            use = 'held out' if drive.held_out else 'calibration'
            rows.append(ErrorRow(f'{drive.name} |{letter}|, {use} [m]', values))
    return ErrorTable(f'{result.case.name}: largest tracking errors', tuple(rows),
                      (*result.labels, PRINTED))


def parameter_table(result: CaseResult) -> Table:
    """
    Return the estimates of both methods with their intervals, beside the paper's.

    Parameters
    ----------
    result : CaseResult
        Of one case: fits by both methods.

    """
    rows = []
    fitted = result.fits[SQUARES].model.parameters
    printed = {} if other_robot(packaged().parameters, fitted) else paper().search
    truth = engine_config()['truth'] if result.case.name == 'synthetic' else {}
    for one in result.fits[SQUARES].estimates:
        other = next(e for e in result.fits[GENETIC].estimates if e.name == one.name)
        known = printed.get(one.name)
        rows.append((
            f'{one.name} [{one.unit}]', f'{other.value:.5g}',
            f'{one.value:.5g} ({one.low:.4g} to {one.high:.4g})',
            f'{truth[one.name]:g}' if one.name in truth else '–',
            f'{known.result:g}' if known else '–'))
    return Table(('estimate', 'genetic algorithm', 'least squares (95 %)', 'truth', 'paper'), rows)


def closest(result: CaseResult) -> str:
    """Return the model with the smallest largest error on held-out drives; empty without one."""
    held = [drive for drive in result.drives if drive.held_out]
    return min(result.labels, key=lambda label: max(max(drive.bounds(label)) for drive in held)
               ) if held else ''


def verdict(result: CaseResult) -> list[str]:
    """
    Say who is closer to whom, and why.

    Parameters
    ----------
    result : CaseResult
        Of one case: its drives and fits.

    Returns
    -------
    list of str
        Sentences made of the case's own numbers.

    """
    said = []
    held = [drive for drive in result.drives if drive.held_out]
    rival = result.case.rival_label

    def worst(label: str) -> float:
        return max(max(drive.bounds(label)) for drive in held)
    if held:
        said.append(f'Largest held-out error, {result.case.name}: ' + '; '.join(
            f'{worst(label):.3f} m by {label}' for label in result.labels) + '.')
    known = [result.fits[label].values for label in (GENETIC, SQUARES)]
    ratio = [values['yaw_damping'] / values['wheel_damping'] for values in known
             if {'yaw_damping', 'wheel_damping'} <= set(values)]
    if len(ratio) == 2:
        said.append(
            f'B_H/B is {ratio[0]:.3g} by the genetic algorithm and {ratio[1]:.3g} by least '
            'squares; the position alone (eq. 23) says little about either damping by itself.')
    if rival in result.labels and held:
        closer = closest(result)
        config = engine_config()
        if result.case.name == 'engine':
            changed = ', '.join(
                f'{name} {config["nominal"][name]} → {value}'
                for name, value in config['robot'].items())
            said.append(
                f'Closest to the robot: {closer}. Robot and nominal engine have the same physics '
                'and '
                f'differ only in parameters ({changed}); the graph has simpler physics but was '
                'calibrated on the circle. An uncalibrated engine is not a reference: '
                'it lacks these parameter values, not physics.')
        elif result.case.name == 'synthetic':
            said.append(
                f'Closest to the robot: {closer}. Here the robot is the graph itself, so the '
                'error of the engine comes from different physics, dry sliding instead of '
                'viscous slip, and from different parameters.')
    return said


def recording_name(result: CaseResult, drive: str) -> str:
    """Return the name of a manoeuvre of a case on a page that has several cases."""
    return f'{result.case.name}: {drive}'


def parts_of(result: CaseResult) -> list[Predicted]:
    """Return the manoeuvres of a case with their predictions, under the names of the page."""
    return [(replace(drive.segment, recording=recording_name(result, drive.name)),
             drive.predictions) for drive in result.drives]


def figures(result: CaseResult) -> tuple[tuple[Chart, ...], tuple[Drawing, ...]]:
    """
    Return Figs. 12 to 16, to be drawn.

    Parameters
    ----------
    result : CaseResult
        Of one case: its drives and the history of the genetic algorithm.

    Returns
    -------
    tuple of Chart
        Fig. 12.
    tuple of Drawing
        Named fig13 to fig16; further manoeuvres go on counting.

    """
    case = result.case.name
    shown = tuple(label for label in result.labels if label not in (NOMINAL, GIVEN))
    data = ReportData(case, Headline(case), shown, traces=traces_of(parts_of(result), shown))
    first = result.drives[0]
    drawings = [Drawing(
        f'{case}_fig13',
        f'Fig. 13, {case}: wheel rates, forward speed and yaw rate, {first.name}',
        partial(responses_picture, data, recording_name(result, first.name)))]
    for number, drive in enumerate(result.drives, FIRST_TRAJECTORY):
        drawings.append(Drawing(
            f'{case}_fig{number}', f'Fig. {number}, {case}: path and tracking error, {drive.name}',
            partial(path_picture, data, recording_name(result, drive.name))))
    return (convergence_chart(result.fits[GENETIC].history, f'{case}_fig12'),), tuple(drawings)


def section(result: CaseResult) -> Section:
    """Return the case as a section of a page."""
    charts, drawings = figures(result)
    return Section(f'{result.case.name}: {result.case.about}', text=tuple(verdict(result)),
                   tables=(parameter_table(result),), charts=charts,
                   drawings=drawings)


def text(result: CaseResult) -> str:
    """Return the case as text."""
    parts = [f'{result.case.name}: {result.case.about}', as_text(table(result)),
             as_text(parameter_table(result)), *verdict(result), str(result.what_to_change)]
    return '\n\n'.join(parts)


def as_text(content: Table) -> str:
    """Return a table in fixed width, the first column to the left."""
    rows = [tuple(map(str, row)) for row in (content.head, *content.rows)]
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return '\n'.join('  '.join(
        cell.ljust(width) if k == 0 else cell.rjust(width)
        for k, (cell, width) in enumerate(zip(row, widths, strict=True))).rstrip()
        for row in rows)


def data(result: CaseResult) -> dict[str, Any]:
    """Return the case as plain data for JSON."""
    return {
        'case': result.case.name, 'about': result.case.about,
        'tracking_error': [{
            'manoeuvre': drive.name, 'held_out': drive.held_out,
            'bounds': {label: [value if math.isfinite(value) else None
                               for value in drive.bounds(label)] for label in result.labels},
            'paper': list(paper().tracking_error.get(drive.name, ())) or None}
            for drive in result.drives],
        'fits': {label: fit.data() for label, fit in result.fits.items()},
        'verdict': verdict(result),
        'what_to_change': result.what_to_change.data(),
    }
