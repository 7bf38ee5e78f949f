# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The paper's table and figures of a case."""

from __future__ import annotations

from collections.abc import Sequence
import math
from typing import Any

from lg_husky_sim.comparison.figures import line_styles, responses_figure, trajectory_figure
from lg_husky_sim.evaluation.engine import engine_config
from lg_husky_sim.evaluation.paper_case import CaseResult, GENETIC, NOMINAL, SQUARES
from lg_husky_sim.identification.pages import Picture, picture, Section, Table
from lg_husky_sim.identification.paper import paper
from lg_husky_sim.identification.pictures import convergence_figure

#: Numbers of the paper's figures of trajectories, in the order of its manoeuvres.
FIRST_TRAJECTORY = 14


def table(result: CaseResult) -> Table:
    """
    Return the paper's six numbers: largest absolute errors in x and y of each manoeuvre [m].

    Parameters
    ----------
    result : CaseResult
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
    return Table(('largest tracking error [m]', *result.labels, 'printed in the paper'), rows)


def parameter_table(result: CaseResult) -> Table:
    """
    Return the estimates of both methods with their intervals, beside the paper's.

    Parameters
    ----------
    result : CaseResult
    """
    rows = []
    truth = engine_config()['truth'] if result.case.name == 'synthetic' else {}
    for one in result.fits[SQUARES].estimates:
        other = next(e for e in result.fits[GENETIC].estimates if e.name == one.name)
        known = paper().search.get(one.name)
        rows.append((
            f'{one.name} [{one.unit}]', f'{other.value:.5g}',
            f'{one.value:.5g} ({one.low:.4g} to {one.high:.4g})',
            f'{truth[one.name]:g}' if one.name in truth else '–',
            f'{known.result:g}' if known else '–'))
    return Table(('estimate', 'genetic algorithm', 'least squares (95 %)', 'truth', 'paper'), rows)


def verdict(result: CaseResult) -> list[str]:
    """
    Say who is closer to whom, and why.

    Parameters
    ----------
    result : CaseResult

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
        said.append('Largest held-out error: ' + ', '.join(
            f'{label} {worst(label):.3f} m' for label in result.labels) + '.')
    known = [result.fits[label].values for label in (GENETIC, SQUARES)]
    ratio = [values['yaw_damping'] / values['wheel_damping'] for values in known
             if {'yaw_damping', 'wheel_damping'} <= set(values)]
    if len(ratio) == 2:
        said.append(
            f'B_H/B is {ratio[0]:.3g} by the genetic algorithm and {ratio[1]:.3g} by least '
            'squares; the position alone (eq. 23) says little about either damping by itself.')
    if rival in result.labels and held:
        closer = min(result.labels, key=worst)
        config = engine_config()
        if result.case.name == 'engine':
            changed = ', '.join(
                f'{name} {config["nominal"][name]} → {value}'
                for name, value in config['robot'].items())
            said.append(
                f'Closest to the robot: {closer}. Robot and nominal engine obey one physics and '
                f'differ in numbers alone ({changed}); the graph has simpler physics but was '
                'calibrated on the circle. An engine that nobody calibrates is no reference: '
                'what it lacks is not physics but these numbers.')
        elif result.case.name == 'synthetic':
            said.append(
                f'Closest to the robot: {closer}. Here the robot is the graph itself, so the '
                "engine's distance is that between two kinds of physics, dry sliding against "
                'viscous slip, and between two sets of numbers.')
    return said


def figures(result: CaseResult) -> list[Picture]:
    """
    Draw Figs. 12 to 16.

    Parameters
    ----------
    result : CaseResult

    Returns
    -------
    list of Picture
        Named fig12 to fig16; further manoeuvres go on counting.
    """
    case = result.case.name
    shown = tuple(label for label in result.labels if label != NOMINAL)
    styles = line_styles(shown, rivals=(result.case.rival_label,))
    history = result.fits[GENETIC].history
    made = [picture(convergence_figure(history),
                    f'Fig. 12, {case}: the genetic algorithm converges', f'{case}_fig12')]
    first = result.drives[0]
    made.append(picture(
        responses_figure(first.segment, _kept(first.predictions, shown), styles,
                         f'{first.name} ({case})'),
        f'Fig. 13, {case}: wheel rates, linear and rotational velocity on the {first.name}',
        f'{case}_fig13'))
    for number, drive in enumerate(result.drives, FIRST_TRAJECTORY):
        made.append(picture(
            trajectory_figure(drive.segment, _kept(drive.tracks, shown), styles,
                              f'{drive.name} ({case})'),
            f'Fig. {number}, {case}: trajectory and tracking error, {drive.name}',
            f'{case}_fig{number}'))
    return made


def _kept(values: Any, labels: Sequence[str]) -> dict[str, Any]:
    return {label: values[label] for label in labels}


def section(result: CaseResult, pictures: Sequence[Picture]) -> Section:
    """Return the case as a section of a page."""
    return Section(f'{result.case.name}: {result.case.about}', text=verdict(result),
                   tables=[table(result), parameter_table(result)], pictures=pictures)


def text(result: CaseResult) -> str:
    """Return the case as text."""
    parts = [f'{result.case.name}: {result.case.about}', as_text(table(result)),
             as_text(parameter_table(result)), *verdict(result)]
    return '\n\n'.join(parts)


def as_text(content: Table) -> str:
    """Return a table in fixed width, the first column to the left."""
    rows = [tuple(content.head), *map(tuple, content.rows)]
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
    }
