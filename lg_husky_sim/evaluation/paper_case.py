# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Calibrate on one manoeuvre, predict the others: the paper's section IV on any case."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

from lg_husky_sim.comparison.metrics import Tracking, tracking
from lg_husky_sim.comparison.replay import replay
from lg_husky_sim.comparison.rival import rival_prediction
from lg_husky_sim.diagnosis.prediction_errors import assess, Assessment
from lg_husky_sim.errors import CommandError
from lg_husky_sim.evaluation.cases import Case
from lg_husky_sim.evaluation.settings import extensions
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import ModelFile, packaged
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.identification.estimate import estimate, STARTS
from lg_husky_sim.identification.options import with_effects
from lg_husky_sim.identification.result import FitResult, Method
from lg_husky_sim.recording import Recording, Segment, segments
from lg_husky_sim.signals import TimeSeries

GENETIC = 'LG, genetic algorithm'
SQUARES = 'LG, least squares'
BASE = 'LG and base, least squares'
NOMINAL = "LG, paper's numbers"
GIVEN = 'LG, given numbers'


@dataclass(frozen=True, eq=False)
class Drive:
    """
    One manoeuvre with what was predicted of it.

    Parameters
    ----------
    name : str
    held_out : bool
        Whether it was not used to calibrate.
    segment : Segment
    predictions : mapping of str to TimeSeries
        By label.
    tracks : mapping of str to Tracking
        By label.

    """

    name: str
    held_out: bool
    segment: Segment
    predictions: Mapping[str, TimeSeries]
    tracks: Mapping[str, Tracking]

    def bounds(self, label: str) -> tuple[float, float]:
        """Return the largest absolute errors in x and y [m]."""
        return self.tracks[label].bounds


@dataclass(frozen=True, eq=False)
class CaseResult:
    """
    A case, calibrated and judged.

    Parameters
    ----------
    case : Case
    fits : mapping of str to FitResult
        The paper's genetic algorithm, least squares on all outputs, and the same with what the
        base does to a command.
    drives : tuple of Drive

    """

    case: Case
    fits: Mapping[str, FitResult]
    drives: tuple[Drive, ...]

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of all predictions, in order."""
        return tuple(self.drives[0].tracks)

    @cached_property
    def what_to_change(self) -> Assessment:
        """How the drives differ from the closest calibrated model, and what to change for it."""
        judged = [drive for drive in self.drives if drive.held_out] or list(self.drives)
        label = min(self.fits, key=lambda label: max(max(drive.bounds(label)) for drive in judged))
        return assess([(drive.segment, drive.predictions[label]) for drive in self.drives], label,
                      self.fits[label].model.parameters)


def evaluate_case(case: Case, model: ModelFile, seed: int, starts: int = STARTS, jobs: int = 1,
                  tell: Callable[[str], None] | None = None) -> CaseResult:
    """
    Calibrate on the first manoeuvre and predict all of them.

    Parameters
    ----------
    case : Case
        Recordings by manoeuvre; the first one is to calibrate on.
    model : ModelFile
        To start from.
    seed : int
        Of the searches.
    starts : int
        Of each least-squares estimation.
    jobs : int
        Processes to use.
    tell : callable, optional
        Called with a word on every step of the fits.

    Returns
    -------
    CaseResult

    Raises
    ------
    CommandError
        If a recording has no usable segment with a pose.

    """
    names = list(case.recordings)
    parts = {name: _longest(case.recordings[name]) for name in names}
    fits = {label: estimate(model, [parts[names[0]]], method=method, seed=seed, starts=starts,
                            jobs=jobs, progress=tell)
            for label, method in ((GENETIC, Method.GENETIC), (SQUARES, Method.LEAST_SQUARES))}
    extended = with_effects(model, extensions()['manoeuvres'].effects)
    fits[BASE] = estimate(extended, [parts[names[0]]], baseline=model, seed=seed, starts=starts,
                          jobs=jobs, progress=tell)
    plants = {label: compile_model(fit.model.structure).at(fit.model.parameters)
              for label, fit in fits.items()}
    papers = dict(model.parameters) == dict(packaged().parameters)
    plants[NOMINAL if papers else GIVEN] = compile_model(model.structure).at(model.parameters)
    return CaseResult(case, fits, tuple(
        _drive(case, name, parts[name], plants, held_out=name != names[0]) for name in names))


def _longest(recording: Recording) -> Segment:
    parts = [part for part in segments(recording) if 'pose' in part.streams]
    if not parts:
        raise CommandError(f'recording {recording.name} has no segment with commands and a pose')
    return max(parts, key=lambda part: part.duration)


def _drive(case: Case, name: str, part: Segment, plants: Mapping[str, Plant], *, held_out: bool
           ) -> Drive:
    predictions = {label: replay(plant, part) for label, plant in plants.items()}
    if name in case.rivals:
        predictions[case.rival_label] = rival_prediction(
            case.rivals[name], case.recordings[name], part)
    tracks = {label: tracking(part, series) for label, series in predictions.items()}
    return Drive(name, held_out, part, predictions, tracks)
