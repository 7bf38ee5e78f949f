# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings compared with models and rivals: numbers, as a table and as JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math

from lg_husky_sim.comparison.metrics import (
    channel_errors,
    measured_channels,
    pooled,
    SquareSum,
    Tracking,
    tracking,
    UNITS,
)
from lg_husky_sim.comparison.models import NamedPlant
from lg_husky_sim.comparison.replay import replay
from lg_husky_sim.comparison.rival import rival_prediction
from lg_husky_sim.comparison.scatter import counts, scatter_note, scatter_of
from lg_husky_sim.errors import CommandError, RecordingError
from lg_husky_sim.recording import Recording, Segment, segments, windows
from lg_husky_sim.recording.names import printable
from lg_husky_sim.reporting.words import quantity_with_unit
from lg_husky_sim.signals import TimeSeries
import numpy as np

SCHEMA = 'lg_husky_sim/comparison/1'
#: Quantities by which models are ranked, the first that was recorded: what a robot is for.
RANKED = ('position', 'wheel_speed', 'yaw_rate', 'forward')


@dataclass(frozen=True, eq=False)
class SegmentOutcome:
    """
    One segment beside its predictions.

    Parameters
    ----------
    segment : Segment
    predictions : mapping of str to TimeSeries
        Columns of the simulator by the label of the model or rival.
    errors : mapping of str to mapping of str to SquareSum
        By label, then by channel.
    tracks : mapping of str to Tracking
        By label; empty without a recorded pose.

    """

    segment: Segment
    predictions: Mapping[str, TimeSeries]
    errors: Mapping[str, Mapping[str, SquareSum]]
    tracks: Mapping[str, Tracking]


@dataclass(frozen=True, eq=False)
class RecordingOutcome:
    """A recording with the outcome of each of its segments."""

    recording: Recording
    segments: tuple[SegmentOutcome, ...]

    def errors(self, label: str) -> dict[str, SquareSum]:
        """Return the errors of one model, pooled over the segments."""
        return pooled(part.errors.get(label, {}) for part in self.segments)

    def bounds(self, label: str) -> tuple[float, float]:
        """Return the largest |X| and |Y| of the segments [m]; NaN without a pose."""
        each = [part.tracks[label].bounds for part in self.segments if label in part.tracks]
        known = [pair for pair in each if all(map(math.isfinite, pair))]
        if not known:
            return math.nan, math.nan
        return max(pair[0] for pair in known), max(pair[1] for pair in known)

    def scatter(self) -> float:
        """Return the scatter of the forward speed [m/s] where errors are mostly that; else 0."""
        speeds = [one['forward'] for one in (measured_channels(part.segment)
                                             for part in self.segments) if 'forward' in one]
        errors = [self.errors(name) for name in labels([self])]
        known = [one['forward'].rmse for one in errors if 'forward' in one]
        if not speeds or not known:
            return 0.0
        scatter = scatter_of(np.concatenate([one.times for one in speeds]),
                             np.concatenate([one.column('forward') for one in speeds]))
        return scatter if counts(scatter, min(known)) else 0.0

    def remarks(self) -> list[str]:
        """Return what to know of the recording and of its errors, in sentences."""
        scatter = self.scatter()
        return [*self.recording.notes, *self.gaps(), *[scatter_note(scatter)] * bool(scatter)]

    def gaps(self) -> list[str]:
        """Return a sentence for each model or rival whose errors are over a part of the drive."""
        counts = {name: {channel: one.count for channel, one in self.errors(name).items()}
                  for name in labels([self])}
        most = {channel: max(count.get(channel, 0) for count in counts.values())
                for count in counts.values() for channel in count}
        shares = {name: min((n / most[channel] for channel, n in count.items() if most[channel]),
                            default=1.0) for name, count in counts.items()}
        # A sample or two at the ends is no part of a drive.
        return [f'the errors of {name} cover only a part of the drive, as little as {share:.0%} '
                'of the '
                'samples of the others' for name, share in shares.items() if share < 0.99]


def compare_recording(
    recording: Recording, plants: Sequence[NamedPlant], rival: tuple[str, Recording] | None = None,
    horizon: float = 0.0,
) -> RecordingOutcome:
    """
    Replay a recording's commands through models, from the state at each segment's start.

    Parameters
    ----------
    recording : Recording
        With a stream ``command`` and something measured.
    plants : sequence of NamedPlant
        Models to replay the commands through, with their labels.
    rival : tuple of str and Recording, optional
        Label and recording of the same drive by another simulator (or on another day), put
        beside the models.
    horizon : float
        Start anew from what was measured after so many seconds; 0 only at gaps.

    Returns
    -------
    RecordingOutcome

    Raises
    ------
    RecordingError
        If it has no commands, or the rival recorded nothing in any of its segments.
    CommandError
        If it has no segment to compare.

    """
    recording.stream('command')
    parts = segments(recording)
    if horizon:
        parts = tuple(window for part in parts for window in windows(part, horizon))
    if not parts or not {'wheels', 'imu', 'pose'} & set(recording.streams):
        raise CommandError(
            f'recording {recording.name} has nothing to compare: its streams '
            f'({", ".join(recording.streams)}) must be commands and wheels, imu or pose, and '
            'overlap without a gap')
    beside: list[dict[str, TimeSeries]] = [{} for _ in parts] if rival is None else _beside(
        parts, recording, *rival)
    return RecordingOutcome(recording, tuple(
        _segment(part, plants, own) for part, own in zip(parts, beside, strict=True)))


def _beside(parts: Sequence[Segment], recording: Recording, label: str, rival: Recording
            ) -> list[dict[str, TimeSeries]]:
    # The rival in each segment; in none of those in which it recorded nothing, but in some.
    found: list[dict[str, TimeSeries]] = []
    failure: RecordingError | None = None
    for part in parts:
        try:
            found.append({label: rival_prediction(rival, recording, part)})
        except RecordingError as error:
            found.append({})
            failure = error
    if failure is not None and not any(found):
        raise failure
    return found


def _segment(part: Segment, plants: Sequence[NamedPlant], beside: Mapping[str, TimeSeries]
             ) -> SegmentOutcome:
    predictions = {**{named.label: replay(named.plant, part) for named in plants}, **beside}
    errors = {label: channel_errors(part, series) for label, series in predictions.items()}
    tracks = {label: tracking(part, series) for label, series in predictions.items()
              if 'pose' in part.streams and np.any(np.isfinite(series.column('x')))}
    return SegmentOutcome(part, predictions, errors, tracks)


def labels(outcomes: Sequence[RecordingOutcome]) -> tuple[str, ...]:
    """Return the labels of all models and rivals, in order."""
    return tuple(dict.fromkeys(
        label for outcome in outcomes for part in outcome.segments for label in part.predictions))


def closest(outcomes: Sequence[RecordingOutcome], names: Sequence[str]) -> str:
    """Return the model of some that is closest to the recordings; the first if none is known."""
    errors = {name: pooled(outcome.errors(name) for outcome in outcomes) for name in names}
    for channel in RANKED:
        known = {name: own[channel].rmse for name, own in errors.items() if channel in own}
        if known:
            return min(known, key=lambda name: known[name])
    return names[0]


def text_table(outcomes: Sequence[RecordingOutcome]) -> str:
    """
    Return the comparison as text: root mean square errors, then the paper's bounds.

    Parameters
    ----------
    outcomes : sequence of RecordingOutcome
        One for each recording.

    Returns
    -------
    str
        Lines of at most some 100 characters for up to five models.

    """
    names = labels(outcomes)
    width = max(10, *(len(name) for name in names)) + 2
    lines: list[str] = []
    for outcome in outcomes:
        total = sum(part.segment.duration for part in outcome.segments)
        count = len(outcome.segments)
        lines += [f'{outcome.recording.name}: {total:.1f} s in {count} '
                  f'segment{"s" if count != 1 else ""}',
                  f'  {"root mean square error":<28}' + ''.join(f'{n:>{width}}' for n in names)]
        errors = {name: outcome.errors(name) for name in names}
        for channel in UNITS:
            if any(channel in errors[name] for name in names):
                cells = ''.join(f'{_cell(errors[name].get(channel)):>{width}}' for name in names)
                lines.append(f'  {quantity_with_unit(channel):<28}{cells}')
        if any(part.tracks for part in outcome.segments):
            lines.append(f'  {"largest tracking error":<28}')
            bounds = {name: outcome.bounds(name) for name in names}
            for place, axis in enumerate(('|X| [m]', '|Y| [m]')):
                cells = ''.join(f'{_number(bounds[name][place]):>{width}}' for name in names)
                lines.append(f'  {axis:<28}{cells}')
        lines += [f'  note: {note}' for note in outcome.remarks()]
        lines.append('')
    return '\n'.join(lines)


def as_json(
    outcomes: Sequence[RecordingOutcome], plants: Sequence[NamedPlant], horizon: float = 0.0,
    settings: Mapping[str, float] | None = None,
) -> dict[str, object]:
    """Return the comparison as plain data, schema ``lg_husky_sim/comparison/1``."""
    names = labels(outcomes)
    everything = {
        name: pooled(part.errors.get(name, {}) for outcome in outcomes
                     for part in outcome.segments)
        for name in names}
    return {
        'schema': SCHEMA,
        'horizon_s': horizon or None,
        'settings': dict(settings or {}),
        'units': dict(UNITS),
        'models': [{'label': named.label, 'path': named.path, 'about': named.model.about,
                    'parameters': dict(named.model.parameters)} for named in plants],
        'overall': {name: {'rmse': _rmse(everything[name])} for name in names},
        'recordings': [{
            'name': outcome.recording.name,
            'path': printable(outcome.recording.path),
            'notes': outcome.remarks(),
            'results': {name: {'rmse': _rmse(outcome.errors(name)),
                               'samples': {channel: one.count for channel, one
                                           in outcome.errors(name).items()},
                               'bounds_m': _bounds(outcome.bounds(name))} for name in names},
            'segments': [{
                'index': index, 'start_s': part.segment.start, 'end_s': part.segment.end,
                'results': {name: {
                    'rmse': _rmse(part.errors[name]),
                    'bounds_m': _bounds(part.tracks[name].bounds)
                    if name in part.tracks else None} for name in part.predictions},
            } for index, part in enumerate(outcome.segments)],
        } for outcome in outcomes],
    }


def _rmse(errors: Mapping[str, SquareSum]) -> dict[str, float | None]:
    return {name: _finite(value.rmse) for name, value in errors.items()}


def _bounds(pair: tuple[float, float]) -> dict[str, float | None]:
    return {'x': _finite(pair[0]), 'y': _finite(pair[1])}


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _cell(value: SquareSum | None) -> str:
    return _number(value.rmse) if value is not None else '–'


def _number(value: float) -> str:
    return f'{value:.4f}' if math.isfinite(value) else '–'
