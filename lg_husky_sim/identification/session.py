# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What `lg_husky identify` does, as functions: all recordings together, or each on its own."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

from lg_husky_sim.errors import SettingsError
from lg_husky_sim.folders import check_folder
from lg_husky_sim.husky.model_file import ModelFile
from lg_husky_sim.identification.estimate import estimate, STARTS
from lg_husky_sim.identification.report import report_paths, write_fit
from lg_husky_sim.identification.result import FitResult, Method
from lg_husky_sim.identification.unknowns import check_profiles
from lg_husky_sim.parallel import run_tasks
from lg_husky_sim.recording import (
    named_apart,
    named_as_in,
    read_recording,
    Segment,
    segments,
    TopicMap,
)
from lg_husky_sim.reporting.data import Provenance
from lg_husky_sim.reporting.provenance import provenance

Look: TypeAlias = Callable[[Sequence[Segment], ModelFile, Collection[str]], tuple[str, ...]]
"""What is to be warned of in recordings, beside a model and unknowns that are estimated."""


@dataclass(frozen=True)
class Request:
    """
    What is asked of an identification.

    Parameters
    ----------
    model : ModelFile
        To be estimated, effects included.
    before : ModelFile
        To stand beside it, as it was given.
    method : Method
    free, nuisance, profiles : tuple of str
    seed, starts : int
    topics : TopicMap or None
    look : Look or None

    """

    model: ModelFile
    before: ModelFile
    method: Method = Method.LEAST_SQUARES
    free: tuple[str, ...] = ()
    nuisance: tuple[str, ...] = ()
    profiles: tuple[str, ...] = ()
    seed: int = 0
    starts: int = STARTS
    topics: TopicMap | None = None
    look: Look | None = None


def read_segments(request: Request, paths: Sequence[str]) -> list[Segment]:
    """
    Return the segments of several recordings, under the names by which the model knows them.

    Raises
    ------
    RecordingError
        If a recording cannot be read or is given twice.

    """
    onset = request.model.structure.onset
    read, = named_apart(named_as_in([read_recording(path, request.topics) for path in paths],
                                    () if onset is None else onset.recordings))
    return [segment for recording in read for segment in segments(recording)]


def _fit(request: Request, parts: Sequence[Segment], jobs: int, scheduler: str | None,
         tell: Callable[[str], None] | None) -> FitResult:
    return estimate(request.model, parts, method=request.method, free=request.free,
                    nuisance=request.nuisance, profiles=request.profiles, seed=request.seed,
                    starts=request.starts, jobs=jobs, scheduler=scheduler,
                    baseline=request.before, progress=tell)


def _made_of(paths: Sequence[str]) -> Provenance:
    return provenance([(Path(path).name, path) for path in paths])


@dataclass(frozen=True)
class _Task:
    request: Request
    path: str


def _fit_one(task: _Task) -> FitResult:
    request = task.request
    parts = read_segments(request, [task.path])
    result = _fit(request, parts, 1, None, None)
    said = request.look(parts, result.model, request.nuisance) if request.look else ()
    return replace(result, warnings=(*said, *result.warnings))


def fit_each(request: Request, paths: Sequence[str], out: Path, jobs: int = 1,
             scheduler: str | None = None, tell: Callable[[str], None] | None = None
             ) -> tuple[str, list[FitResult]]:
    """
    Fit every recording on its own, on processes here or on a cluster.

    Parameters
    ----------
    request : Request
        Model, free parameters and method of all fits.
    paths : sequence of str
        On a cluster, every worker must be able to read them.
    out : pathlib.Path
        Folder; gets NAME.yaml, .txt, .json and .html for each recording.
    jobs : int
        Processes to use.
    scheduler : str, optional
        Address of a Dask scheduler, in place of processes.
    tell : callable, optional
        Called with the word ``recording`` after each recording.

    Returns
    -------
    str
        A table of the estimates.
    list of FitResult

    Raises
    ------
    SettingsError
        If ``out`` is a file, a recording or cannot be written, two recordings would share a
        name, or one has that of another file.
    FitError
        If a profile is asked of what is not estimated.

    """
    check_folder(out)
    names = [Path(path).name for path in paths]
    if len(set(names)) != len(names):
        raise SettingsError('two recordings have one name; --each writes a file for each')
    for name in names:
        report_paths(out / f'{name}.yaml')
    check_profiles(request.model, request.free, request.nuisance, request.profiles)
    word = tell or (lambda text: None)
    # A worker of a cluster may work in another folder.
    tasks = [_Task(request, str(Path(path).absolute())) for path in paths]
    results = run_tasks(_fit_one, tasks, jobs, scheduler,
                        lambda: word('recording'))
    for name, path, result in zip(names, paths, results, strict=True):
        write_fit(result, read_segments(request, [path]), request.before, out / f'{name}.yaml',
                  _made_of([path]))
    return each_table(names, results), results


def each_table(names: Sequence[str], results: Sequence[FitResult]) -> str:
    """Return a table with one row a recording: estimates with half their intervals."""
    columns = [one.name for one in results[0].estimates]
    width = max([9, *(len(name) for name in names)])
    lines = [f'{"recording":<{width}}  ' + '  '.join(f'{c:>22}' for c in columns)]
    for name, result in zip(names, results, strict=True):
        cells = [f'{one.value:.5g} ± {0.5 * (one.high - one.low):.2g}'
                 for one in result.estimates]
        flag = '' if result.converged and not (result.warnings or result.losses) else (
            '  (see its report)')
        lines.append(f'{name:<{width}}  ' + '  '.join(f'{c:>22}' for c in cells) + flag)
    return '\n'.join(lines)
