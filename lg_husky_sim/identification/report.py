# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A fit as files: the model, and beside it the report as text, JSON and one page."""

from __future__ import annotations

from collections.abc import Sequence
import json
from pathlib import Path

from lg_husky_sim.comparison.figures import line_styles, responses_figure, trajectory_figure
from lg_husky_sim.comparison.metrics import tracking
from lg_husky_sim.comparison.replay import replay
from lg_husky_sim.errors import SettingsError
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import ModelFile, save_model
from lg_husky_sim.identification.pages import (
    files_together,
    page,
    Picture,
    picture,
    Section,
    Table,
)
from lg_husky_sim.identification.pictures import (
    certainty_figure,
    convergence_figure,
    profile_figure,
)
from lg_husky_sim.identification.result import FitResult
from lg_husky_sim.identification.start_states import HEAD, summary
from lg_husky_sim.recording import Segment

#: Longest time that one picture shows [s].
LONGEST = 60.0
#: Segments with pictures.
SHOWN = 3


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
        If it does not, or a folder is there.
    """
    if out.suffix not in ('.yaml', '.yml'):
        raise SettingsError(f'{out}: a model file ends in .yaml or .yml')
    paths = (out, *(out.with_suffix(end) for end in ('.txt', '.json', '.html')))
    for path in paths:
        if path.is_dir():
            raise SettingsError(f'{path} is a folder; choose another name')
    return paths


def write_fit(result: FitResult, segments: Sequence[Segment], before: ModelFile, out: Path
              ) -> tuple[Path, ...]:
    """
    Write a fit, all files or none.

    Parameters
    ----------
    result : FitResult
    segments : sequence of Segment
        That were fitted.
    before : ModelFile
        The model to show beside the fitted one.
    out : pathlib.Path
        Model file; the report's files stand beside it.

    Returns
    -------
    tuple of pathlib.Path
        Model, text, JSON, HTML.

    Raises
    ------
    SettingsError
        If a name cannot be used.
    """
    paths = report_paths(out)
    pictures = fit_pictures(result, segments, before)
    with files_together(paths) as places:
        model, text, data, html = (places[path] for path in paths)
        save_model(result.model, model)
        text.write_text(str(result) + '\n', encoding='utf-8')
        data.write_text(json.dumps(result.data(), indent=1, ensure_ascii=False,
                                   allow_nan=False) + '\n',
                        encoding='utf-8')
        html.write_text(page('Model fitted to recordings', _intro(result),
                             _sections(result, pictures)), encoding='utf-8')
    return paths


def fit_pictures(result: FitResult, segments: Sequence[Segment], before: ModelFile
                 ) -> list[Picture]:
    """
    Draw the longest segments before and after, the certainty and the convergence.

    Parameters
    ----------
    result : FitResult
    segments : sequence of Segment
    before : ModelFile

    Returns
    -------
    list of Picture
    """
    plants = {label: compile_model(model.structure).at(model.parameters)
              for label, model in (('before', before), ('fitted', result.model))}
    styles = line_styles(('fitted', 'before'), rivals=('before',))
    made = []
    ranked = sorted(range(len(segments)), key=lambda k: (-segments[k].duration, k))[:SHOWN]
    for index in sorted(ranked):
        segment = segments[index]
        title = f'{segment.recording}, segment {segment.index}'
        series = {label: replay(plant, segment) for label, plant in plants.items()}
        made.append(picture(responses_figure(segment, series, styles, title, LONGEST),
                            f'{title}: measured and simulated responses'))
        if 'pose' in segment.streams:
            tracks = {label: tracking(segment, one) for label, one in series.items()}
            made.append(picture(trajectory_figure(segment, tracks, styles, title, LONGEST),
                                f'{title}: trajectory and tracking error'))
    made.append(picture(certainty_figure(result),
                        'Intervals of the estimates and their correlation'))
    if result.profiles:
        made.append(picture(profile_figure(result.profiles), 'Likelihood profiles'))
    if len(result.history):
        made.append(picture(convergence_figure(result.history),
                            "Convergence of the search (the paper's Fig. 12)"))
    return made


def _intro(result: FitResult) -> list[str]:
    state = 'converged' if result.converged else 'not converged'
    return [f'{", ".join(result.recordings)}. Method {result.method.value}, seed {result.seed}, '
            f'{result.evaluations} simulations in {result.seconds:.2f} s, {state}.']


def _sections(result: FitResult, pictures: Sequence[Picture]) -> list[Section]:
    estimates = Table(
        ('parameter', 'value', '95 % low', '95 % high', 'before', 'unit'),
        [(one.name, f'{one.value:.5g}', f'{one.low:.5g}', f'{one.high:.5g}',
          f'{one.start:.5g}', one.unit) for one in result.estimates])
    channels = Table(
        ('root mean square of measured − simulated', 'before', 'fitted', 'unit', 'values'),
        [(c.name, f'{c.before:.4g}', f'{c.after:.4g}', c.unit, str(c.count))
         for c in result.channels])
    tables = [estimates]
    if result.start_states:
        tables.append(Table(HEAD, summary(result.start_states)))
    # Those of the parameters come last: certainty, then profiles and convergence if there are.
    last = len(pictures) - 1 - bool(result.profiles) - bool(len(result.history))
    sections = [Section('Agreement', tables=[channels], pictures=pictures[:last])]
    if result.warnings:
        sections.append(Section('Warnings', points=result.warnings, warning=True))
    sections.append(Section(
        'Parameters', tables=tables, points=result.undetermined,
        pictures=pictures[last:]))
    sections.append(Section('As text', verbatim=str(result)))
    return sections
