# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A fit as files: the model, and beside it the report as text, JSON and one page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
import json
import math
import os
from pathlib import Path

from lg_husky_sim.comparison.outcome import RANKED
from lg_husky_sim.comparison.replay import replay
from lg_husky_sim.comparison.scatter import scatter_notes
from lg_husky_sim.comparison.traces import error_table, Predicted, traces_of
from lg_husky_sim.errors import SettingsError
from lg_husky_sim.folders import check_ours, check_unchanged, check_writable, scratch_beside
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import BEGINNING, ModelFile, save_model
from lg_husky_sim.identification.profile import LEVEL, Profile
from lg_husky_sim.identification.result import Estimated, FitResult, SCHEMA
from lg_husky_sim.identification.start_states import HEAD, summary
from lg_husky_sim.recording import Segment
from lg_husky_sim.reporting.data import (
    Advice,
    BEFORE,
    ErrorRow,
    ErrorTable,
    FITTED,
    Headline,
    ParameterRow,
    Provenance,
    ReportData,
)
from lg_husky_sim.reporting.page import page
from lg_husky_sim.reporting.sections import Cell, Chart, Line, Section, Table, Tone
from lg_husky_sim.reporting.words import (
    capitalised,
    change,
    number,
    plural,
    QUANTITIES,
    quantity,
    quantity_with_unit,
    SIGN,
    with_unit,
)
from lg_husky_sim.reporting.write import drawn, view_of
from lg_husky_sim.signals import FloatArray
import numpy as np

#: How the name of a model file may end.
ENDINGS = ('.yaml', '.yml')


def report_paths(out: Path) -> tuple[Path, ...]:
    """
    Return the files of a fit: the model, and the report as text, JSON and HTML.

    Parameters
    ----------
    out : pathlib.Path
        The model file; ends in .yaml or .yml.

    Raises
    ------
    SettingsError
        If it does not, nothing can be written there, or something is there that is no earlier
        fit or a changed model.

    """
    if out.suffix not in ENDINGS:
        raise SettingsError(f'{out}: a model file ends in .yaml or .yml')
    check_writable(out)
    text, data, html = (out.with_suffix(end) for end in ('.txt', '.json', '.html'))
    check_ours(data, f'{{\n "schema": "{SCHEMA}"')
    # Beside the JSON of a fit they are the fit's; a model file without one is of a person.
    if data.is_file():
        check_unchanged(out, BEGINNING)
    else:
        check_ours(out, '')
    for path in (text, html):
        if path.is_dir() or not data.is_file():
            check_ours(path, '')
    return out, text, data, html


@contextmanager
def files_together(paths: Sequence[Path]) -> Iterator[Mapping[Path, Path]]:
    """
    Write several files, all or none.

    Parameters
    ----------
    paths : sequence of pathlib.Path
        In one folder, which is made.

    Yields
    ------
    mapping of pathlib.Path to pathlib.Path
        Where to write each; they are moved into place when the block ends without an exception.

    """
    with scratch_beside(paths[0]) as scratch:
        places = {path: scratch / path.name for path in paths}
        yield places
        for path, place in places.items():
            os.replace(place, path)


def write_fit(result: FitResult, segments: Sequence[Segment], before: ModelFile, out: Path,
              provenance: Provenance | None = None, advice: Sequence[Advice] = (),
              ) -> tuple[Path, ...]:
    """
    Write a fit, all files or none.

    Parameters
    ----------
    result : FitResult
        Fitted model with its estimates.
    segments : sequence of Segment
        That were fitted.
    before : ModelFile
        The model to show beside the fitted one.
    out : pathlib.Path
        Model file; the report's files stand beside it.
    provenance : Provenance, optional
        Of what files and versions the report is made.
    advice : sequence of Advice
        What to change, from what still differs from the fitted model.

    Returns
    -------
    tuple of pathlib.Path
        Model, text, JSON, HTML. A picture that cannot be drawn is a note on the page.

    Raises
    ------
    SettingsError
        If a name cannot be used.

    """
    paths = report_paths(out)
    with files_together(paths) as places:
        model, text, data, html = (places[path] for path in paths)
        save_model(result.model, model)
        text.write_text(str(result) + '\n', encoding='utf-8')
        data.write_text(json.dumps(result.data(), indent=1, ensure_ascii=False,
                                   allow_nan=False) + '\n',
                        encoding='utf-8')
        report = replace(report_data(result, segments, before, provenance),
                         advice=(*_load(out), *advice))
        images, captions, failures = drawn(report)
        html.write_text(page(report, view_of(report), images, captions, failures),
                        encoding='utf-8', errors='replace')
    return paths


def report_data(result: FitResult, segments: Sequence[Segment], before: ModelFile,
                provenance: Provenance | None = None) -> ReportData:
    """
    Return a fit as the values of a report.

    Parameters
    ----------
    result : FitResult
        Fitted model with its estimates.
    segments : sequence of Segment
        That were fitted.
    before : ModelFile
        The model to show beside the fitted one.
    provenance : Provenance, optional
        Of what files and versions the report is made.

    Returns
    -------
    ReportData

    """
    columns = (BEFORE, FITTED)
    plants = {label: compile_model(model.structure).at(model.parameters)
              for label, model in ((BEFORE, before), (FITTED, result.model))}
    parts: list[Predicted] = [
        (segment, {label: replay(plant, segment) for label, plant in plants.items()})
        for segment in segments]
    residuals = ErrorTable('Residuals of the fit', tuple(
        ErrorRow(quantity_with_unit(one.name), {BEFORE: one.before, FITTED: one.after})
        for one in result.channels), columns, compared=columns, note=(
            'Root mean squares of what the fit minimises: the pose is set back to the measured '
            'one every few seconds.'))
    replayed = error_table('Driven by the commands alone', parts, columns, compared=columns)
    sections = [*_certainty(result), Section('As text', verbatim=str(result), folded=True)]
    return ReportData(
        f'Model fitted to {", ".join(result.recordings)}', _headline(result, replayed), columns,
        ((BEFORE, 'the model as it was given'), (FITTED, 'with the estimates above')),
        traces_of(parts, columns), (replayed, residuals), sections=tuple(sections),
        parameters=tuple(_parameter(one, result.model) for one in result.estimates),
        parameters_first=True,
        notes=(f'Errors are {SIGN}; x is ahead and y to the left of the robot as it stood at the '
               'start of the recording.', *[result.held] * bool(result.held),
               *result.undetermined, *_scatter(replayed, segments)),
        provenance=provenance or Provenance())


def _scatter(table: ErrorTable, segments: Sequence[Segment]) -> tuple[str, ...]:
    # What of the forward speed's error no model is to blame for.
    name = quantity_with_unit('forward')
    known = [value for row in table.rows if row.name == name for value in row.values.values()
             if math.isfinite(value)]
    return scatter_notes(segments, min(known)) if known else ()


def _headline(result: FitResult, table: ErrorTable) -> Headline:
    bound = sum(1 for one in result.estimates if _parameter(one, result.model).at_bound)
    warnings = [*[result.loss] * bool(result.loss), *result.warnings]
    count = plural(len(result.estimates), 'parameter')
    if not result.converged:
        return Headline(f'Not converged: {count} of {plural(len(result.recordings), "recording")}',
                        Tone.BAD, _facts(result, bound), (), tuple(warnings))
    return Headline(f'{count} estimated from {plural(len(result.recordings), "recording")}',
                    Tone.BAD if bound else Tone.PLAIN if warnings else Tone.GOOD,
                    (*_gain(table), *_facts(result, bound)),
                    (), tuple(warnings))


def _load(out: Path) -> tuple[Advice, ...]:
    return (Advice('The fitted model', (
        f'Load it: `ros2 run lg_husky_sim sim_node --ros-args -p model:={out.name}`.',
        f'Or give it to the other verbs, such as `lg_husky diagnose REC --model {out.name}`.')),)


def _gain(table: ErrorTable) -> tuple[tuple[str, str], ...]:
    # The most telling error there is, before and after.
    rows = {row.name: row.values for row in table.rows}
    for key in RANKED:
        values = rows.get(quantity_with_unit(key), {})
        before, after = (values.get(name, math.nan) for name in (BEFORE, FITTED))
        if math.isfinite(before) and math.isfinite(after):
            unit = QUANTITIES[key][1]
            return ((f'{capitalised(quantity(key))} error', f'{number(before)} → '
                     f'{with_unit(after, unit)} ({change(before, after)})'),)
    return ()


def _facts(result: FitResult, bound: int) -> tuple[tuple[str, str], ...]:
    return (('Method', f'{result.method.value}, seed {result.seed}'),
            ('Simulations', f'{result.evaluations} in {result.seconds:.1f} s'),
            ('Converged', 'yes' if result.converged else 'no'),
            ('At their bounds', str(bound)))


def _parameter(one: Estimated, model: ModelFile) -> ParameterRow:
    least = most = math.nan
    if not one.nuisance and one.name in model.parameters:
        entry = model.parameters.entry(one.name)
        least, most = entry.lower, entry.upper
    span = most - least
    edge = math.isfinite(span) and min(one.value - least, most - one.value) <= 1e-6 * span
    # Bounds of physics, decades away, say nothing about where an estimate lies.
    far = not math.isfinite(span) or span > 20.0 * max(one.high - one.low, abs(one.value), 1e-300)
    return ParameterRow(one.name, one.unit, one.start, one.value, one.low, one.high,
                        math.nan if far else least, math.nan if far else most, edge)


def _certainty(result: FitResult) -> list[Section]:
    names = [one.name.replace('_', ' ') for one in result.estimates]
    tables = []
    if len(names) > 1:
        tables.append(Table(('correlation', *names), tuple(
            (name, *(Cell(f'{value:+.2f}'.replace('-', '−'), abs(float(value)))
                     for value in row[:place]), *('' for _ in row[place:]))
            for place, (name, row) in enumerate(zip(names, result.correlation, strict=True)))))
    sections = []
    if tables:
        sections.append(Section('Correlation of the estimates', tables=tuple(tables), folded=True))
    if result.start_states:
        sections.append(Section('States at the start of the segments', tables=(
            Table(HEAD, summary(result.start_states)),)))
    charts = [profile_chart(one) for one in result.profiles]
    if charts:
        sections.append(Section('Likelihood profiles', charts=tuple(charts)))
    if len(result.history):
        sections.append(Section('Convergence of the search', charts=(
            convergence_chart(result.history),)))
    return sections


def profile_chart(one: Profile) -> Chart:
    """Return a likelihood profile with its 95 % level as a chart."""
    level = np.full(one.values.size, LEVEL)
    return Chart(f'profile_{one.name}', f'Rise of the cost as {one.name.replace("_", " ")} is '
                 f'held; 95 % interval {number(one.low, 4)} to {number(one.high, 4)}',
                 (Line('profile', one.values, one.rise), Line('95 %', one.values, level)),
                 one.name.replace('_', ' '), 'rise of the cost [nats]')


def convergence_chart(history: FloatArray, name: str = 'convergence') -> Chart:
    """
    Return the paper's Fig. 12: best and mean cost of each generation.

    Parameters
    ----------
    history : numpy.ndarray, shape (n_generations + 1, 2)
        Best and mean cost [m].
    name : str
        Of the picture's file, without its ending.

    Returns
    -------
    Chart

    """
    generations = np.arange(len(history), dtype=np.float64)
    best, mean = (number(float(value), 4) for value in history[-1])
    return Chart(name, f"Convergence of the search (the paper's Fig. 12): best {best} m, "
                 f'mean {mean} m',
                 (Line('best', generations, history[:, 0]),
                  Line('mean of the population', generations, history[:, 1], dots=True)),
                 'generation', 'objective of eq. (23) [m]', logarithmic=True)
