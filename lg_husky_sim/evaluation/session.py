# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What `lg_husky evaluate` does: cases and steps, as one page with its tables and pictures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
import json
from pathlib import Path
from typing import Any

from lg_husky_sim.comparison.traces import recording_tables, traces_of
from lg_husky_sim.evaluation import case_report
from lg_husky_sim.evaluation.cases import Case, engine_case, recorded_case, synthetic_case
from lg_husky_sim.evaluation.paper_case import CaseResult, evaluate_case
from lg_husky_sim.evaluation.real import (
    evaluate_steps,
    LABELS,
    steps_data,
    steps_table,
    StepsResult,
)
from lg_husky_sim.folders import result_folder
from lg_husky_sim.husky.model_file import ModelFile, save_model
from lg_husky_sim.recording import named_apart, read_recording, TopicMap
from lg_husky_sim.reporting.data import Headline, Provenance, ReportData
from lg_husky_sim.reporting.sections import Section
from lg_husky_sim.reporting.words import SIGN
from lg_husky_sim.reporting.write import write_report

MARKER = 'evaluation.json'
SCHEMA = 'lg_husky_sim/evaluation/1'


@dataclass(frozen=True)
class Request:
    """
    What is asked of an evaluation.

    Parameters
    ----------
    cases : tuple of str
        ``synthetic``, ``engine``.
    calibrate, held_out, rivals, steps : tuple of str
        Recordings.
    model : ModelFile
    seed, starts, jobs : int
    topics : TopicMap or None

    """

    cases: tuple[str, ...]
    calibrate: tuple[str, ...]
    held_out: tuple[str, ...]
    rivals: tuple[str, ...]
    steps: tuple[str, ...]
    model: ModelFile
    seed: int = 0
    starts: int = 6
    jobs: int = 1
    topics: TopicMap | None = None


@dataclass(frozen=True, eq=False)
class Evaluation:
    """
    What an evaluation found.

    Parameters
    ----------
    text : str
        The tables, and what to change.
    data : mapping of str to Any
        The content of evaluation.json.

    """

    text: str
    data: Mapping[str, Any]


def _cases(request: Request) -> list[Case]:
    made = [{'synthetic': synthetic_case, 'engine': engine_case}[name](request.seed)
            for name in request.cases]
    if request.calibrate:
        made.append(recorded_case(request.calibrate, request.held_out, request.rivals,
                                  request.topics))
    return made


def run_evaluation(request: Request, out: Path, tell: Callable[[str], None],
                   provenance: Provenance | None = None) -> Evaluation:
    """
    Evaluate and write the folder, whole or not at all.

    Parameters
    ----------
    request : Request
        What to evaluate, with which model and how.
    out : pathlib.Path
        Gets index.html, evaluation.json, evaluation.txt, the pictures and the fitted models.
    tell : callable
        Called with a word after each unit of work.
    provenance : Provenance, optional
        Of what files and versions the page is made.

    Returns
    -------
    Evaluation

    """
    read, = named_apart([read_recording(path, request.topics) for path in request.steps])
    results = [evaluate_case(case, request.model, request.seed, request.starts, request.jobs,
                             tell) for case in _cases(request)]
    steps = [evaluate_steps(recording, request.model, request.seed, request.starts, request.jobs,
                            tell=tell) for recording in read]
    texts = [*map(case_report.text, results), *map(steps_text, steps)]
    text = '\n\n\n'.join(texts)
    data: dict[str, Any] = {'schema': SCHEMA, 'seed': request.seed,
                            'cases': [case_report.data(result) for result in results],
                            'steps': [steps_data(result) for result in steps]}
    with result_folder(out, MARKER) as folder:
        for result in results:
            for kind, fit in zip(('ga', 'least_squares', 'base'), result.fits.values(),
                                 strict=True):
                save_model(fit.model, folder / f'{result.case.name}_{kind}.yaml')
        for result_of_steps in steps:
            name = result_of_steps.recording.strip('/').replace('/', '_')
            save_model(result_of_steps.extended.model, folder / f'{name}.yaml')
        (folder / 'evaluation.txt').write_text(text + '\n', encoding='utf-8')
        (folder / MARKER).write_text(json.dumps(data, indent=1, ensure_ascii=False,
                                                allow_nan=False) + '\n',
                                     encoding='utf-8')
        write_report(report_data(request, results, steps, provenance), folder, 'index.html',
                     pictured=0)
    return Evaluation(text, data)


def report_data(request: Request, results: Sequence[CaseResult], steps: Sequence[StepsResult],
                made_of: Provenance | None = None) -> ReportData:
    """
    Return an evaluation as the values of a report.

    Parameters
    ----------
    request : Request
        What was evaluated, with which model and how.
    results : sequence of CaseResult
        One for each case.
    steps : sequence of StepsResult
        One for each recording of steps.
    made_of : Provenance, optional
        Of what files and versions the report is made.

    Returns
    -------
    ReportData

    """
    columns = tuple(dict.fromkeys(label for result in results for label in result.labels))
    said = [line for result in results for line in case_report.verdict(result)[:1]]
    closest = [name if len(results) == 1 else f'{name} ({result.case.name})' for result in results
               if (name := case_report.closest(result))]
    assessed = [*((result.case.name, result.what_to_change) for result in results),
                *((result.recording, result.what_to_change) for result in steps)]
    facts = [('Cases', ', '.join(result.case.name for result in results) or 'none'),
             ('Seed', str(request.seed))]
    if steps:
        facts.append(('Recordings of steps', str(len(steps))))
    return ReportData(
        "The paper's evaluation, redone",
        Headline('Closest on held-out drives: ' + '; '.join(closest) if closest
                 else "The paper's evaluation, redone", facts=tuple(facts),
                 sentences=tuple(said)),
        columns, tuple((name, case_report.ABOUT[name]) for name in columns
                       if name in case_report.ABOUT),
        traces=tuple(trace for result in results for trace in traces_of(
            case_report.parts_of(result), columns)),
        errors=(*map(case_report.papers_numbers, results), *(
            replace(table, folded=True) for result in results for table in recording_tables(
                case_report.parts_of(result), result.labels))),
        advice=tuple(advice for name, assessment in assessed
                     for advice in assessment.advice(name if len(assessed) > 1 else '')),
        sections=(*map(case_report.section, results), *map(_steps_section, steps)),
        notes=(f'Errors are {SIGN}; x is ahead and y to the left of the robot as it stood at the '
               'start.',),
        files=((MARKER, 'has all numbers'), ('evaluation.txt', 'has the tables')),
        provenance=made_of or Provenance())


def steps_text(result: StepsResult) -> str:
    """Return a recording's table and the estimates of its last model as text."""
    return (f'{result.recording}: {result.steps} steps, every other one fitted\n\n'
            f'{case_report.as_text(steps_table(result))}\n\n{LABELS[-1]}:\n{result.extended}\n\n'
            f'{result.what_to_change}')


def _steps_section(result: StepsResult) -> Section:
    return Section(f'{result.recording}: {result.steps} steps, every other one fitted',
                   points=tuple(result.extended.undetermined), tables=(steps_table(result),),
                   verbatim=str(result.extended))
