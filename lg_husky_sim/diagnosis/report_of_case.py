# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The report of a case: its recordings replayed through three models, graph and efforts drawn."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
import re
from typing import TYPE_CHECKING

from lg_husky_sim.comparison.replay import replay
from lg_husky_sim.comparison.traces import error_table, Predicted, recording_tables, traces_of
from lg_husky_sim.diagnosis.diagnose import Case
from lg_husky_sim.diagnosis.error_tables import error_tables, with_details
from lg_husky_sim.diagnosis.held_out import stretches_of
from lg_husky_sim.diagnosis.hypotheses.smooth_efforts import BALANCES
from lg_husky_sim.diagnosis.localisation import Missing, missing_efforts, strengths
from lg_husky_sim.diagnosis.nameless import needed_evidence, WHERE
from lg_husky_sim.diagnosis.planning import named_drive
from lg_husky_sim.diagnosis.report import report_data
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.model_file import ModelFile
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.linear_graph import Branch, LinearGraph
from lg_husky_sim.recording import Segment
from lg_husky_sim.reporting.data import (
    NOMINAL,
    ParameterRow,
    Provenance,
    RECALIBRATED,
    ReportData,
    WITH_FINDING,
)
from lg_husky_sim.reporting.sections import Cell, Chart, Drawing, Line, Section, Table
import numpy as np

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Factor of a law that is switched off: no Stribeck share.
_ABSENT = re.compile(r'\(1\+\(0\.0\)\*exp\([^*]*\*\*2\)\)\*')
#: Term of a law whose factor is zero.
_ZERO = re.compile(r'[+-]?\(?0\.0\)?\*(sin|cos)\([^()]*\)|\+0\*\w*\([^()]*\)')


def case_report(case: Case, provenance: Provenance | None = None) -> ReportData:
    """
    Return the report of a case.

    Parameters
    ----------
    case : Case
        The diagnosis, with the search and the segments it was made of.
    provenance : Provenance, optional
        Of what files and versions the report is made.

    Returns
    -------
    ReportData

    """
    diagnosis = case.diagnosis
    plants = {NOMINAL: _plant(case.nominal)}
    if diagnosis.refitted:
        plants[RECALIBRATED] = case.search.plain.point.plant
    if diagnosis.added:
        plants[WITH_FINDING] = _plant(diagnosis.model)
    columns = tuple(plants)
    parts: list[Predicted] = [
        (stretch, {label: replay(_in(case, plant, stretch.recording), stretch)
                   for label, plant in plants.items()})
        for stretch in _stretches(case.segments)]
    pair = (columns[-2], columns[-1]) if len(columns) > 1 else None
    tables = [error_table('All data', parts, columns, compared=pair)]
    if len({s.recording for s in case.segments}) > 1:
        tables += [replace(table, title=f'Recording {table.title}', folded=True)
                   for table in recording_tables(parts, columns, pair)]
    return report_data(
        diagnosis, list(dict.fromkeys(s.recording for s in case.segments)),
        traces_of(parts, columns), with_details(error_tables(diagnosis), tables),
        _parameters(case) if diagnosis.refitted else (),
        shapes={(e.id, e.side): e.shape for e in diagnosis.model.structure.effects},
        sections=(*_tried('Where in the model', lambda: _where(case)),
                  *_tried('A more informative drive', lambda: _telling(case))),
        provenance=provenance)


def _tried(heading: str, build: Callable[[], tuple[Section, ...]]) -> tuple[Section, ...]:
    # A section that cannot be made is a line of the report, and no reason to lose the rest.
    try:
        return build()
    except LgHuskyError as error:
        return (Section(heading, (f'This cannot be shown: {error}.',)),)


def _in(case: Case, plant: Plant, recording: str) -> Plant:
    names = case.search.evidence.names
    earlier = plant.onset.before(names) if plant.onset is not None else ()
    return plant.in_recording(recording, earlier)


def _plant(model: ModelFile) -> Plant:
    return compile_model(model.structure).at(model.parameters)


def _stretches(segments: Sequence[Segment]) -> list[Segment]:
    # No longer than the errors of a diagnosis are taken over, each from its measured start.
    return [stretch for segment in segments for stretch in stretches_of(segment)]


def _parameters(case: Case) -> list[ParameterRow]:
    nominal, plain = case.nominal.parameters, case.search.plain.point
    bound = [u.name for u, place in zip(plain.unknowns, plain.places, strict=True)
             if min(place - u.lower, u.upper - place) < 1e-6]
    rows = []
    for one in case.diagnosis.recalibration:
        if one.name not in nominal:
            continue
        entry = nominal.entry(one.name)
        room = abs(entry.value) * entry.tolerance
        rows.append(ParameterRow(
            one.name, one.unit, entry.value, one.value, one.low, one.high,
            max(entry.lower, entry.value - room), min(entry.upper, entry.value + room),
            one.name in bound))
    return rows


def _where(case: Case) -> tuple[Section, ...]:
    diagnosis = case.diagnosis
    known = case.left.evidence is case.search.evidence and case.left.final is case.search.plain
    efforts = case.free if known else missing_efforts(case.search.evidence, case.search.plain)
    plain, final = diagnosis.plain_model.structure, diagnosis.model.structure
    elements = [e for f in diagnosis.findings for e in f.elements]
    added = new_elements(plain, final)[1]
    short = _short_names(*new_elements(plain, final))[1]
    named = ', '.join(f'{a} is {b}' for a, b in zip(short, added, strict=True))
    caption = 'The linear graph of the robot' + (
        '; branches that the finding acts on are red' if elements else '') + (
        f', new ones dashed: {named}.' if added else '.')
    tables, charts = [], []
    if any(e.evidence > needed_evidence(case.rest, efforts) for e in efforts):
        tables = [Table(('balance', 'relative evidence'), tuple(
            (name.replace('_', ' '), Cell(f'{100.0 * share:.0f} %', share))
            for name, share in strengths(efforts).items()))]
        charts = _efforts(efforts, strengths(efforts))
    terms = new_terms(diagnosis.model, plain)
    drawing = Drawing('graph', caption, lambda: _graph_figure(plain, final, elements))
    heading, text = 'New terms in the equations', '\n'.join(terms)
    if len(terms) > setting('terms_shown'):
        sections = [Section('Where in the model', drawings=(drawing,)),
                    Section(heading, verbatim=text, folded=True)]
    else:
        sections = [Section('Where in the model', text=(f'{heading}:',) if terms else (),
                            verbatim=text, drawings=(drawing,))]
    if charts:
        sections.append(Section(
            'The missing effort', (
                'The missing effort as a smoother estimates it, without assuming a law (band: two '
                'standard deviations).',), charts=tuple(charts)))
    if tables:
        sections.append(Section(
            'Evidence against each part of the robot', (
                'How well a smooth missing effort in each part alone would explain the residual '
                'of the recalibrated model, relative to the best part. Parts that act through the '
                'same balance get the same score.',), tables=tuple(tables), folded=True))
    return tuple(sections)


def _efforts(efforts: Sequence[Missing], shares: Mapping[str, float]) -> list[Chart]:
    # Of the best balance, in the drive where it is strongest; both sides of a wheel's torque, but
    # none that explains 0 %.
    best = max(efforts, key=lambda e: e.evidence).balance
    sides = [name for name in ('torque_left', 'torque_right')
             if round(100.0 * shares.get(name, 0.0)) > 0]
    wanted = sides if best.startswith('torque') else [best]
    charts = []
    for place, balance in enumerate(wanted):
        own = [e for e in efforts if e.balance == balance]
        one = max(own, key=lambda e: float(np.mean((e.values / np.maximum(
            e.deviations, 1e-12)) ** 2)))
        name, unit = WHERE[balance][0].removeprefix('a '), BALANCES[balance][4]
        charts.append(Chart(
            f'effort_{place + 1}', f'Missing {name}; recording {one.drive.recording}', (Line(
                name, one.times, one.values, 2.0 * one.deviations),), 'time [s]', f'[{unit}]'))
    return charts


def _telling(case: Case) -> tuple[Section, ...]:
    # The drive that would tell apart what these recordings cannot, computed.
    if not case.diagnosis.indistinguishable:
        return ()
    plain, first = case.diagnosis.plain_model, case.diagnosis.indistinguishable[0]
    drive = named_drive(first.effects, plain.structure, plain.parameters)
    names = ', '.join(f'`{name}`' for name in first.effects)
    return () if not drive else (Section('A more informative drive', (
        f'These recordings cannot tell {names} apart. By simulation, this drive can: {drive}. '
        '`lg_husky plan-drive` computes the best one and writes it as a command script.',)),)


def new_elements(plain: Structure, final: Structure) -> tuple[LinearGraph, tuple[str, ...]]:
    """Return the graph with what was found, and the branches that it has more."""
    graph = final.network().graph
    before = set(plain.network().graph.names)
    return graph, tuple(branch.name for branch in graph.branches if branch.name not in before)


def new_terms(model: ModelFile, plain: Structure) -> list[str]:
    """
    Return what the new elements add to the state equations, as text.

    Parameters
    ----------
    model : ModelFile
        With what was found.
    plain : Structure
        Without what was found: its elements are not new.

    Returns
    -------
    list of str
        One line for each new source's law, and for each state equation it enters.

    """
    graph, added = new_elements(plain, model.structure)
    regime = compile_model(model.structure).regimes[-1]
    space = compile_model(model.structure).at(model.parameters).sets[-1]
    names = list(regime.numeric.efforts)
    lines = []
    for branch in graph.branches:
        if branch.name not in added or branch.characteristic is None:
            continue
        law = branch.characteristic.law
        if law == 'table':
            law = f'table of {", ".join(branch.characteristic.of) or "the description"}'
        for place, variable in reversed(list(enumerate(branch.characteristic.of))):
            law = law.replace(f'z{place + 1}', variable)
        law = _ZERO.sub('', _ABSENT.sub('', law))
        lines.append(f'{branch.name} = {law}')
        column = space.g[:, names.index(branch.name)]
        large = float(np.max(np.abs(column), initial=0.0))
        lines.extend(f'    d/dt {state} = … {value:+.4g} · {branch.name}'
                     for state, value in zip(regime.numeric.states, column[:len(
                         regime.numeric.states)], strict=True)
                     if abs(value) > 1e-9 * max(large, 1e-300))
    return lines


def _short_names(graph: LinearGraph, added: Sequence[str]) -> tuple[LinearGraph, tuple[str, ...]]:
    # New sources under names that are short enough to be drawn: T_new_L, E_new_1. Other new
    # elements, such as an axle's inertia, keep theirs: laws read their variables by name.
    fresh: list[Branch] = []
    for branch in graph.branches:
        if branch.name in added and branch.characteristic is not None:
            graph = graph.without(branch.name)
            end = branch.name.rsplit('_', 1)[-1]
            short = f'{branch.name[0]}_new' + (f'_{end}' if len(end) <= 2 else '')
            taken = {*graph.names, *(other.name for other in fresh)}
            if short in taken:
                short = next(f'{short}_{n}' for n in range(2, len(taken) + 3)
                             if f'{short}_{n}' not in taken)
            fresh.append(replace(branch, name=short))
    kept = tuple(name for name in added if name in graph.names)
    return graph.with_branches(*fresh), (*kept, *(branch.name for branch in fresh))


def _graph_figure(plain: Structure, final: Structure, elements: Sequence[str]) -> Figure:
    from lg_husky_sim.linear_graph.drawing import draw_graph
    from lg_husky_sim.linear_graph.layout import layout
    from matplotlib.figure import Figure

    graph, added = _short_names(*new_elements(plain, final))
    blocks = layout(graph)
    width = max(max(block.x + block.width for block in blocks), 7.0) + 1.0
    height = -min(block.y for block in blocks) + 2.8
    figure = Figure(figsize=(width * 0.5, height * 0.5))
    axes = figure.add_axes((0.01, 0.01, 0.98, 0.98))
    known = set(graph.names)
    draw_graph(axes, graph, culprits=[e for e in elements if e in known and e not in added],
               new=added)
    return figure
