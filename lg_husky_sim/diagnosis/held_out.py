# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Errors of models on recordings, and on recordings that were not fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
import math

from lg_husky_sim.comparison.metrics import channel_errors, pooled, SquareSum, tracking
from lg_husky_sim.comparison.replay import replay
from lg_husky_sim.diagnosis.fits import first_metric, Fit, fit_structure
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.identification.noise import Metric
from lg_husky_sim.identification.problem import Observations, observations
from lg_husky_sim.recording import Segment, windows

#: Longest stretch that is driven without a new start [s].
LONGEST = 60.0
#: Shortest segment that is split into a fitted and a held-out half [s].
SPLIT = 8.0


def plant_of(fit: Fit) -> Plant:
    """Return the plant of a fit."""
    return compile_model(fit.structure).at(fit.parameters)


def errors(plant: Plant, segments: Sequence[Segment]) -> dict[str, float]:
    """
    Return root mean square errors of a plant that is driven with the recorded commands.

    Parameters
    ----------
    plant : Plant
    segments : sequence of Segment

    Returns
    -------
    dict of str to float
        position_rmse_m, yaw_rate_rmse [rad/s], wheel_speed_rmse [rad/s], forward_rmse [m/s],
        and the paper's bounds max_abs_x_m and max_abs_y_m; those that were measured.
    """
    parts: list[Mapping[str, SquareSum]] = []
    bounds: list[tuple[float, float]] = []
    for segment in segments:
        stretches = windows(segment, LONGEST) if segment.duration > 1.5 * LONGEST else (segment,)
        for stretch in stretches:
            prediction = replay(plant, stretch)
            parts.append(channel_errors(stretch, prediction))
            if 'pose' in stretch.streams:
                bounds.append(tracking(stretch, prediction).bounds)
    total = pooled(parts)
    found = {key: total[name].rmse for key, name in (
        ('position_rmse_m', 'position'), ('yaw_rate_rmse', 'yaw_rate'),
        ('wheel_speed_rmse', 'wheel_speed'), ('forward_rmse', 'forward')) if name in total}
    known = [b for b in bounds if all(map(math.isfinite, b))]
    if known:
        found['max_abs_x_m'] = max(b[0] for b in known)
        found['max_abs_y_m'] = max(b[1] for b in known)
    return found


def split(segments: Sequence[Segment]) -> tuple[tuple[Segment, ...], tuple[Segment, ...]]:
    """
    Split segments into a part to fit and a part to hold out.

    Parameters
    ----------
    segments : sequence of Segment

    Returns
    -------
    tuple of Segment
        To fit: every other recording, or the first half of every segment of a single one.
    tuple of Segment
        To hold out.
    """
    names = list(dict.fromkeys(s.recording for s in segments))
    if len(names) > 1:
        kept = {name for i, name in enumerate(names) if i % 2 == 0}
        return (tuple(s for s in segments if s.recording in kept),
                tuple(s for s in segments if s.recording not in kept))
    first, second = [], []
    for segment in segments:
        if segment.duration < SPLIT:
            first.append(segment)
            continue
        middle = 0.5 * (segment.start + segment.end)
        first.append(_cut(segment, segment.start, middle))
        second.append(_cut(segment, middle, segment.end))
    return tuple(first), tuple(second)


def _cut(segment: Segment, start: float, end: float) -> Segment:
    parts = windows(segment, max(end - start, 1e-6))
    near = min(parts, key=lambda part: abs(part.start - start))
    return near


def refitted(fit: Fit, nominal: Parameters, train: Observations, metric: Metric) -> Fit:
    """
    Refit a structure to some of the data.

    Parameters
    ----------
    fit : Fit
        On all data.
    nominal : Parameters
    train : Observations
        What to fit now.
    metric : Metric
        Of all data: its correlations are kept.

    Returns
    -------
    Fit
        The given one where the refit cannot be evaluated.
    """
    white = first_metric(train, train.predict(plant_of(fit)))
    weighted = replace(white, filters=metric.filters, parts=metric.parts)
    sizes = {**fit.parameters, **fit.solution.values}
    again = fit_structure(train, fit.structure, nominal, weighted, fit.solution.values, sizes,
                          steps=4, polish=False)
    return again or fit


def held_out_errors(plain: Fit, final: Fit, nominal: Parameters, segments: Sequence[Segment],
                    metric: Metric, momentary: bool = False
                    ) -> tuple[dict[str, float], dict[str, float]]:
    """
    Return the errors of both models on data that neither was fitted to.

    Parameters
    ----------
    plain, final : Fit
        Recalibrated only, and with what was found.
    nominal : Parameters
    segments : sequence of Segment
    metric : Metric
    momentary : bool
        Whether the wheel rates are those of the moment.

    Returns
    -------
    dict of str to float
        Of the plain model.
    dict of str to float
        Of the augmented model.
    """
    train, test = split(segments)
    if not train or not test:
        return {}, {}
    some = observations(train).read_as(momentary)
    pair = [errors(plant_of(refitted(fit, nominal, some, metric)), test)
            for fit in (plain, final)]
    return pair[0], pair[1]
