# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Fit on half of a recording's steps, predict the other half, beside three baselines."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
import math
from typing import Any

from lg_husky_sim.comparison.replay import replay
from lg_husky_sim.diagnosis.prediction_errors import assess, Assessment
from lg_husky_sim.errors import FitError
from lg_husky_sim.evaluation.baselines import (
    fit_kinematics,
    fit_lags,
    kinematic_predictor,
    lag_predictor,
    Predictor,
)
from lg_husky_sim.evaluation.settings import extensions
from lg_husky_sim.evaluation.steps import alternate_steps, steps_of
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import ModelFile, packaged
from lg_husky_sim.identification.estimate import estimate
from lg_husky_sim.identification.noise import scales
from lg_husky_sim.identification.options import with_effects
from lg_husky_sim.identification.problem import Observations, observations, UNITS
from lg_husky_sim.identification.result import FitResult
from lg_husky_sim.recording import Recording, Segment, segments
from lg_husky_sim.reporting.sections import Table
from lg_husky_sim.reporting.words import quantity
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray

#: Least number of steps of a recording that is divided.
FEWEST = 4
#: The forward speed is also judged by its average over this time [s].
AVERAGE = 2.0
AVERAGED = f'advance, mean over {AVERAGE:g} s'
LABELS = ("paper's numbers", 'kinematic, effective track', 'first-order lag and delay',
          'graph, B, B_H, c refitted', 'graph with the base')
#: In place of the first, where others than the paper's are given.
GIVEN = 'given numbers'


@dataclass(frozen=True, eq=False)
class StepsResult:
    """
    A recording's held-out steps, predicted by several models.

    Parameters
    ----------
    recording : str
    steps : int
        Commanded steps, every other one fitted.
    channels : tuple of str
    counts : tuple of int
        Held-out values of each channel.
    left_out : tuple of int
        Values of each channel that are jumps of the localisation, left out for all models.
    errors : mapping of str to tuple of float
        Root mean square of each channel by model [unit of the channel].
    refit, extended : FitResult
        The graph refitted, and with what the base does to a command.
    what_to_change : Assessment
        How the recording differs from the last of these, and what to change for it.

    """

    recording: str
    steps: int
    channels: tuple[str, ...]
    counts: tuple[int, ...]
    left_out: tuple[int, ...]
    errors: dict[str, tuple[float, ...]]
    refit: FitResult
    extended: FitResult
    what_to_change: Assessment


def evaluate_steps(recording: Recording, model: ModelFile, seed: int = 0, starts: int = 6,
                   jobs: int = 1, effects: Sequence[str] | None = None,
                   tell: Callable[[str], None] | None = None) -> StepsResult:
    """
    Fit on every other step and judge on the rest.

    Parameters
    ----------
    recording : Recording
        With commanded steps: at least :data:`FEWEST`.
    model : ModelFile
        With the paper's numbers, or another robot's nominal ones.
    seed, starts, jobs : int
        Seed of the fits, starts of each fit, and processes to use.
    effects : sequence of str, optional
        Added to the graph for the last model; those of ``config/evaluation.yaml`` by default.
    tell : callable, optional
        Called with a word on every step of the fits.

    Returns
    -------
    StepsResult

    Raises
    ------
    FitError
        If there are too few steps.

    """
    parts = segments(recording)
    whole = observations(parts)
    number = len(steps_of(whole))
    if number < FEWEST:
        raise FitError(f'recording {recording.name} has {number} commanded steps; dividing them '
                       f'needs at least {FEWEST}')
    fitted, held = alternate_steps(whole)
    refit = estimate(model, parts, data=fitted, seed=seed, starts=starts, jobs=jobs,
                     progress=tell)
    base = extensions()['steps']
    extended_model = with_effects(refit.model, base.effects if effects is None else effects)
    free = [name for name in base.free if name in extended_model.parameters]
    if 'loop_gain' in extended_model.parameters:
        extended_model = ModelFile(extended_model.structure, extended_model.parameters.replacing(
            {'loop_gain': 0.0, 'loop_integral': 0.0}), extended_model.about)
    extended = estimate(extended_model, parts, data=fitted, seed=seed, starts=starts, jobs=jobs,
                        free=free, baseline=model, progress=tell)
    papers = dict(model.parameters) == dict(packaged().parameters)
    predictors = dict(zip(LABELS if papers else (GIVEN, *LABELS[1:]), (
        _graph(model), kinematic_predictor(fit_kinematics(fitted, model.parameters)),
        lag_predictor(fit_lags(fitted)), _graph(refit.model), _graph(extended.model)),
        strict=True))
    predicted = {label: predict(held) for label, predict in predictors.items()}
    best = predicted[LABELS[-1]]
    use = scales(held, held.measured - best, best) > 0.0
    return StepsResult(
        recording.name, number, _rows(held),
        tuple(int(held.channel_mask(_channel(name)).sum()) for name in _rows(held)),
        tuple(int((held.channel_mask(_channel(name)) & ~use).sum()) for name in _rows(held)),
        {label: _errors(held, values, use) for label, values in predicted.items()},
        refit, extended, _what_to_change(parts, extended.model))


def _what_to_change(parts: Sequence[Segment], model: ModelFile) -> Assessment:
    plant = compile_model(model.structure).at(model.parameters)
    return assess([(part, replay(plant, part)) for part in parts], LABELS[-1], model.parameters)


def _rows(data: Observations) -> tuple[str, ...]:
    return (*data.channels, AVERAGED) if 'advance' in data.channels else data.channels


def _channel(row: str) -> str:
    return 'advance' if row == AVERAGED else row


def _graph(model: ModelFile) -> Predictor:
    plant = compile_model(model.structure).at(model.parameters)
    return lambda data: data.predict(plant)


def _errors(data: Observations, predicted: FloatArray, use: NDArray[np.bool_]
            ) -> tuple[float, ...]:
    error = data.measured - predicted
    found = [float(np.sqrt(np.mean(error[data.channel_mask(name) & use] ** 2)))
             for name in data.channels]
    if 'advance' in data.channels:
        found.append(_averaged(data, np.where(use, error, np.nan)))
    return tuple(found)


def _averaged(data: Observations, error: FloatArray) -> float:
    # Position noise of some centimetres drowns the speed of one window, not that of several.
    means = []
    for one in data.slices:
        if one.channel == 'advance':
            part, times = error[one.first:one.last], data.times[one.first:one.last]
            place = np.floor(times / AVERAGE)
            for bin_ in np.unique(place):
                inside = part[place == bin_]
                inside = inside[np.isfinite(inside)]
                if inside.size >= 5:
                    means.append(float(np.mean(inside)))
    return float(np.sqrt(np.mean(np.square(means)))) if means else float('nan')


def steps_table(result: StepsResult) -> Table:
    """Return the held-out errors of all models, one row a channel."""
    rows = []
    for place, name in enumerate(result.channels):
        words = name.replace(_channel(name), quantity(_channel(name)))
        rows.append((f'{words} [{UNITS[_channel(name)]}]',
                     *(f'{errors[place]:.3f}' for errors in result.errors.values()),
                     f'{result.counts[place]} ({result.left_out[place]})'))
    return Table((f'{result.recording}: held-out RMS', *result.errors,
                  'values (jumps left out)'), rows)


def steps_data(result: StepsResult) -> dict[str, Any]:
    """Return the result as plain data for JSON."""
    return {
        'recording': result.recording, 'steps': result.steps,
        'channels': list(result.channels), 'counts': list(result.counts),
        'left_out': list(result.left_out),
        'held_out_rms': {label: [value if math.isfinite(value) else None for value in values]
                         for label, values in result.errors.items()},
        'refit': result.refit.data(), 'extended': result.extended.data(),
        'what_to_change': result.what_to_change.data(),
    }
