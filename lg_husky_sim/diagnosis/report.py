# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The report of a diagnosis: one page that needs nothing else, and its pictures as files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math
from pathlib import Path
import re
from typing import Any, TYPE_CHECKING

from lg_husky_sim.comparison.figures import line_styles, trajectory_figure
from lg_husky_sim.comparison.metrics import tracking
from lg_husky_sim.comparison.replay import replay
from lg_husky_sim.diagnosis.diagnose import Case
from lg_husky_sim.diagnosis.figures import (
    before_after_figure,
    channel_rows,
    graph_figure,
    intervals_figure,
    labels_of,
    new_elements,
    rivals_figure,
)
from lg_husky_sim.diagnosis.figures_where import effort_figure, where_figure
from lg_husky_sim.diagnosis.held_out import errors, LONGEST, plant_of
from lg_husky_sim.diagnosis.locate import locate, Located
from lg_husky_sim.diagnosis.planning import named_drive
from lg_husky_sim.diagnosis.result import Estimate, Finding, Verdict
from lg_husky_sim.husky.effects import effect_kind
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import ModelFile
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.identification.pages import check_extras, Picture, picture
from lg_husky_sim.recording import Segment, windows
import numpy as np

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Rows of the tables of errors: key and words.
ERRORS = (('position_rmse_m', 'position [m]'), ('wheel_speed_rmse', 'wheel speed [rad/s]'),
          ('yaw_rate_rmse', 'yaw rate [rad/s]'), ('forward_rmse', 'forward speed [m/s]'),
          ('max_abs_x_m', 'largest |X| [m]'), ('max_abs_y_m', 'largest |Y| [m]'))
#: Most rows of the table of mismatches.
MOST = 20
#: Factor of a law that is switched off (no Stribeck share).
_ABSENT = re.compile(r'\(1\+\(0\.0\)\*exp\([^*]*\*\*2\)\)\*')
_WORDS = {Verdict.NOTHING_MISSING: 'Nothing is missing',
          Verdict.KNOWN: 'Something is missing, and it has a name',
          Verdict.UNKNOWN: 'Something is missing, and it is none of the known effects'}


@dataclass(frozen=True)
class Change:
    """A row of a table of errors before and after."""

    name: str
    before: str
    after: str
    change: str
    better: bool


def write_report(folder: Path, case: Case, headline: str) -> tuple[Path, ...]:
    """
    Write report.html and the pictures.

    Parameters
    ----------
    folder : pathlib.Path
        An existing folder.
    case : Case
    headline : str
        The answer in one sentence.

    Returns
    -------
    tuple of pathlib.Path
        The pictures.

    Raises
    ------
    MissingExtraError
        If matplotlib or jinja2 is not installed.
    """
    check_extras()
    located = locate(case.search.observations, case.search.plain)
    pictures = _pictures(case, located)
    for one in pictures.values():
        (folder / f'{one.name}.png').write_bytes(one.png)
    (folder / 'report.html').write_text(page(case, located, pictures, headline),
                                        encoding='utf-8')
    return tuple(folder / f'{one.name}.png' for one in pictures.values())


def _pictures(case: Case, located: Located) -> dict[str, Picture]:
    diagnosis = case.diagnosis
    structure = diagnosis.model.structure
    culprits = {f.subsystem for f in diagnosis.findings}
    with_it = labels_of(case)[1].replace('_', ' ')
    found: dict[str, Picture] = {}

    def keep(key: str, figure: Figure | None, caption: str) -> None:
        if figure is not None:
            found[key] = picture(figure, caption, key)

    keep('before_after', before_after_figure(case, located),
         'The channel in which it shows most: measured, as the recalibrated model has it'
         + (f', and {with_it}.' if labels_of(case)[1] != labels_of(case)[0] else '.')
         + ' Below, what is left.')
    keep('where', where_figure(located, culprits, structure.onset),
         'How much of what the recalibrated model leaves a missing effort in each part of the '
         'robot would explain, over time' + (
             ', and of each part relative to the best one; the named part is red. Parts that act '
             'through the same balance light up together.' if located.certain else
             ': nothing beyond what healthy recordings leave.') + ' Below: the commands.')
    keep('effort', effort_figure(located),
         'The missing effort that fits best, as a smoother sees it (band: two standard '
         'deviations), and the quantity that it goes with; points are moments, the line their '
         'mean.')
    keep('trajectory', _trajectory(case),
         'The way driven, and as both models predict it from the commands alone.')
    elements = [e for f in diagnosis.findings for e in f.elements]
    added = new_elements(diagnosis.plain_model.structure, structure)[1]
    keep('graph', graph_figure(diagnosis.plain_model.structure, structure, elements),
         'The linear graph of the robot' + (
             '; branches that the finding touches are red' if elements else '') + (
             f', new ones dashed: {", ".join(added)}.' if added else '.'))
    keep('rivals', rivals_figure(case),
         'What was tried, and how much better each predicts data that were not fitted.')
    keep('intervals', intervals_figure(case),
         'What the recalibration moved, together with what was found.')
    return found


def _plant(model: ModelFile) -> Plant:
    return compile_model(model.structure).at(model.parameters)


def _trajectory(case: Case) -> Figure | None:
    # The stretch of the recordings in which the predicted way changes most.
    models = {labels_of(case)[0]: plant_of(case.search.plain)}
    if labels_of(case)[1] not in models:
        models[labels_of(case)[1]] = _plant(case.diagnosis.model)
    whole = case.search.observations
    best: tuple[float, Segment, dict[str, Any]] | None = None
    for segment in case.segments:
        if 'pose' not in segment.streams:
            continue
        long = segment.duration > 1.5 * LONGEST
        for part in (windows(segment, LONGEST)[:3] if long else (segment,)):
            tracks = {label: tracking(part, replay(whole.plant_in(plant, part.recording), part))
                      for label, plant in models.items()}
            sums = [track.absolute_sum for track in tracks.values()]
            gain = sums[0] - sums[-1] if len(sums) > 1 else sums[0]
            if math.isfinite(gain) and (best is None or gain > best[0]):
                best = (gain, part, tracks)
    if best is None:
        return None
    names = tuple(models)
    styles = line_styles(names)
    if len(names) > 1:
        styles = {names[0]: styles[names[1]], names[1]: styles[names[0]]}
    return trajectory_figure(best[1], best[2], styles,
                             best[1].recording[:40].replace('$', r'\$'))


def changes(before: Mapping[str, float], after: Mapping[str, float]) -> list[Change]:
    """Return a table of errors before and after."""
    rows = []
    for key, words in ERRORS:
        if key in before and key in after:
            change = 100.0 * (after[key] / before[key] - 1.0) if before[key] > 0.0 else 0.0
            rows.append(Change(words, f'{before[key]:.4g}', f'{after[key]:.4g}',
                               f'{change:+.0f} %', change < -5.0))
    return rows


def six_numbers(case: Case) -> list[dict[str, str]]:
    """Return the paper's form for each recording: largest |X| and |Y|, before and after."""
    plain, final = plant_of(case.search.plain), _plant(case.diagnosis.model)
    whole = case.search.observations
    rows = []
    for name in dict.fromkeys(s.recording for s in case.segments):
        parts = [s for s in case.segments if s.recording == name]
        before, after = (errors(whole.plant_in(plant, name), parts) for plant in (plain, final))
        if 'max_abs_x_m' in before and 'max_abs_x_m' in after:
            rows.append({'name': name, **{
                f'{axis}_{when}': f'{values[f"max_abs_{axis}_m"]:.3f}'
                for axis in 'xy' for when, values in (('before', before), ('after', after))}})
    return rows


def new_terms(case: Case) -> list[str]:
    """
    Return what the new elements add to the state equations, as text.

    Parameters
    ----------
    case : Case

    Returns
    -------
    list of str
        One line for each new source's law, and for each state equation it enters.
    """
    model = case.diagnosis.model
    graph, added = new_elements(case.diagnosis.plain_model.structure, model.structure)
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
        law = _ABSENT.sub('', law)
        lines.append(f'{branch.name} = {law}')
        column = space.g[:, names.index(branch.name)]
        large = float(np.max(np.abs(column), initial=0.0))
        lines.extend(f'    d/dt {state} = … {value:+.4g} · {branch.name}'
                     for state, value in zip(regime.numeric.states, column[:len(
                         regime.numeric.states)], strict=True)
                     if abs(value) > 1e-9 * max(large, 1e-300))
    return lines


def page(case: Case, located: Located, pictures: Mapping[str, Picture], headline: str) -> str:
    """
    Return the page; every text in it is escaped.

    Parameters
    ----------
    case : Case
    located : Located
    pictures : mapping of str to Picture
    headline : str

    Returns
    -------
    str
        HTML that needs no other file.
    """
    from jinja2 import Environment, PackageLoader
    environment = Environment(
        loader=PackageLoader('lg_husky_sim.diagnosis', '.'), autoescape=True,
        trim_blocks=True, lstrip_blocks=True)
    diagnosis, search = case.diagnosis, case.search
    per_channel = channel_rows(search.observations, search.plain.solution.predicted,
                               case.fit.solution.predicted)
    return environment.get_template('report.html.j2').render(
        title='Diagnosis of ' + ', '.join(dict.fromkeys(s.recording for s in case.segments)),
        verdict=diagnosis.verdict.value, verdict_words=_WORDS[diagnosis.verdict],
        headline=headline, confidence=f'{100.0 * diagnosis.confidence:.0f} %',
        findings=[_finding(f) for f in diagnosis.findings], pictures=pictures,
        held_out=changes(diagnosis.held_out_plain, diagnosis.held_out_augmented),
        fitted=changes(diagnosis.plain, diagnosis.augmented),
        six=six_numbers(case), channels=[
            {'name': name, 'before': f'{before:.4g}', 'after': f'{after:.4g}',
             'change': f'{change:+.0f} % ({low:+.0f} to {high:+.0f})', 'better': high < 0.0}
            for name, before, after, change, low, high in per_channel],
        groups=_groups(case), mismatch=diagnosis.mismatch[:MOST],
        left_out=max(0, len(diagnosis.mismatch) - MOST),
        parts=[(name, f'{100.0 * share:.0f} %') for name, share in located.strengths.items()]
        if located.certain else [],
        recalibration=[_number(e, case.nominal.parameters[e.name])
                       for e in diagnosis.recalibration],
        changed=labels_of(case)[0] != labels_of(case)[1], terms=new_terms(case),
        remaining=diagnosis.remaining, notes=diagnosis.notes,
        recordings=_recordings(case.segments))


def _groups(case: Case) -> list[dict[str, Any]]:
    # What cannot be told apart; for the first group, the drive that would, computed.
    plain = case.diagnosis.plain_model
    return [{'effects': one.effects, 'sensors': one.sensors, 'manoeuvres': one.manoeuvres,
             'drive': named_drive(one.effects, plain.structure, plain.parameters)
             if place == 0 else ''}
            for place, one in enumerate(case.diagnosis.indistinguishable)]


def _finding(finding: Finding) -> dict[str, Any]:
    known = finding.effect != 'unknown'
    return {'finding': finding,
            'title': effect_kind(finding.effect).title if known else 'an unknown effect',
            'numbers': [_number(e, None) for e in finding.parameters],
            'gain': f'{finding.held_out_gain:.0f}',
            'share': f'{100.0 * min(max(finding.share, 0.0), 1.0):.0f} %',
            'rivals': [(r.effect, r.side, f'{r.held_out_gain:.0f}') for r in finding.rivals]}


def _number(one: Estimate, nominal: float | None) -> dict[str, str]:
    unit = '' if one.unit == '1' else one.unit
    return {'name': one.name, 'value': f'{one.value:.4g}', 'unit': unit,
            'low': f'{one.low:.4g}', 'high': f'{one.high:.4g}',
            'nominal': '' if nominal is None else f'{nominal:.4g}'}


def _recordings(segments: Sequence[Segment]) -> list[tuple[str, str]]:
    names = dict.fromkeys(s.recording for s in segments)
    return [(name, f'{sum(s.duration for s in segments if s.recording == name):.0f} s')
            for name in names]
