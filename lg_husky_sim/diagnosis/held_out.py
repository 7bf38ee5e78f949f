# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Errors of models on recordings, and on recordings that were not fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math

from lg_husky_sim.comparison.metrics import channel_errors, pooled, SquareSum, tracking
from lg_husky_sim.comparison.replay import replay
from lg_husky_sim.diagnosis.evidence.base_clock import ticked_as
from lg_husky_sim.diagnosis.evidence.drives import drive_of
from lg_husky_sim.diagnosis.evidence.evidence import evidence_of
from lg_husky_sim.diagnosis.selection.search import Search
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.recording import Segment, windows


def stretches_of(segment: Segment) -> tuple[Segment, ...]:
    """Return a segment, cut where it is too long to be driven without a new start."""
    longest = setting('longest_stretch')
    return tuple(windows(segment, longest)) if segment.duration > 1.5 * longest else (segment,)


def errors(plant: Plant, segments: Sequence[Segment], names: Sequence[str] = ()
           ) -> dict[str, float]:
    """
    Return root mean square errors of a plant that is driven with the recorded commands.

    Parameters
    ----------
    plant : Plant
        Robot to drive, taken as it is in each segment's recording.
    segments : sequence of Segment
        Measured stretches, with their commands.
    names : sequence of str, optional
        Of all recordings in the order in which they were made, whichever of them are here: an
        effect that begins in one of them is absent in those before it.

    Returns
    -------
    dict of str to float
        position_rmse_m, yaw_rate_rmse [rad/s], wheel_speed_rmse [rad/s], forward_rmse [m/s],
        and the paper's bounds max_abs_x_m and max_abs_y_m; those that were measured.

    """
    parts: list[Mapping[str, SquareSum]] = []
    bounds: list[tuple[float, float]] = []
    earlier = () if plant.onset is None else plant.onset.before(names)
    for segment in segments:
        for stretch in stretches_of(segment):
            prediction = replay(plant.in_recording(stretch.recording, earlier), stretch)
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
        Of one recording or several, in the order of time.

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
        if segment.duration < setting('shortest_split'):
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


def held_out_errors(found: Search, parts: Sequence[Segment]
                    ) -> tuple[dict[str, float], dict[str, float]]:
    """
    Return the errors of both models on data that neither was fitted to.

    Parameters
    ----------
    found : Search
        With the fits of the plain model and of the one with all that was adopted.
    parts : sequence of Segment
        Of all recordings; to be split into those to fit and those to hold out.

    Returns
    -------
    dict of str to float
        Recalibrated on the other data only.
    dict of str to float
        With what was found, its numbers from the other data.

    """
    train, test = split(parts)
    drives = [ticked_as(d, found.evidence.drives) for d in map(drive_of, train) if d is not None]
    if not drives or not test:
        return {}, {}
    results = []
    for fit in (found.plain, found.final):
        evidence = evidence_of(drives, found.evidence.names, fit.point, found.evidence.noise,
                               found.evidence.pool)
        results.append(errors(evidence.fit(fit.point, rounds=3).point.plant, test,
                              found.evidence.names))
    return results[0], results[1]
