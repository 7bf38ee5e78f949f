# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
One stream against another: factor, lateness and offset, without a model of the robot.

Two streams that see the same motion are related over any window [a, b] by::

    change of the reference = factor * (change of the source, late by d) + offset * (b - a)

A gyro and the heading of a pose see the same yaw rate, with a factor of one. Wheels see the speed
with their rolling radius as the factor, and the yaw rate with that over the effective track.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from lg_husky_sim.diagnosis.evidence.drives import are_derived
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.recording import Segment
from lg_husky_sim.recording.wheels import unwrapped
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray

#: Stamps with the integral of what a stream measures.
Way = tuple[FloatArray, FloatArray]


@dataclass(frozen=True)
class Number:
    """An estimate with its 95 % interval."""

    value: float
    low: float
    high: float

    @property
    def deviation(self) -> float:
        """Its standard deviation."""
        return (self.high - self.low) / (2.0 * setting('two_sided'))

    def is_off(self, value: float, by: float) -> bool:
        """Return whether it is off a value by more than something, beyond doubt."""
        apart = abs(self.value - value) - by
        return apart > setting('beyond_doubt') * self.deviation


@dataclass(frozen=True)
class Relation:
    """
    What one stream says of another.

    Parameters
    ----------
    quantity : str
        ``yaw rate`` or ``speed``.
    source, reference : str
        Streams: imu, wheels or pose.
    factor : Number
        Reference over source [1, or m for wheels against a speed or their difference].
    late : Number
        How much later the source's stamps are than the reference's [s].
    offset : Number
        What the reference reads more where the source reads zero [m/s or rad/s].
    explained : float
        Share of the reference's motion that the source explains, 0 to 1.
    interval : float
        Longest of the two streams' usual intervals [s].
    seconds : float
        That were compared.
    """

    quantity: str
    source: str
    reference: str
    factor: Number
    late: Number
    offset: Number
    explained: float
    interval: float
    seconds: float


def _integral(times: FloatArray, rates: FloatArray) -> Way:
    steps = 0.5 * (rates[1:] + rates[:-1]) * np.diff(times)
    return times, np.concatenate([[0.0], np.cumsum(steps)])


def _heading(part: Segment) -> Way | None:
    pose = part.streams.get('pose')
    return None if pose is None else (pose.times, np.unwrap(pose.column('heading')))


def _advance(part: Segment) -> Way | None:
    # The way along the heading.
    pose = part.streams.get('pose')
    if pose is None:
        return None
    heading = np.unwrap(pose.column('heading'))
    middle = 0.5 * (heading[1:] + heading[:-1])
    steps = (np.cos(middle) * np.diff(pose.column('x'))
             + np.sin(middle) * np.diff(pose.column('y')))
    return pose.times, np.concatenate([[0.0], np.cumsum(steps)])


def _turned(part: Segment) -> Way | None:
    imu = part.streams.get('imu')
    return None if imu is None else _integral(imu.times, imu.column('yaw_rate'))


def _wheels(part: Segment) -> tuple[FloatArray, FloatArray] | None:
    # Stamps and angles of both sides: counted ones where rates were only made of them.
    rates, angles = part.streams.get('wheels'), part.streams.get('wheel_angles')
    if angles is not None and len(angles) and (rates is None or are_derived(rates, angles)):
        return angles.times, np.column_stack([
            unwrapped(angles.column(side)) for side in ('left', 'right')])
    return None if rates is None else (rates.times, np.column_stack([
        _integral(rates.times, rates.column(side))[1] for side in ('left', 'right')]))


def _apart(part: Segment) -> Way | None:
    # By how much the right wheels turn further than the left ones.
    wheels = _wheels(part)
    return None if wheels is None else (wheels[0], wheels[1][:, 1] - wheels[1][:, 0])


def _mean(part: Segment) -> Way | None:
    wheels = _wheels(part)
    return None if wheels is None else (wheels[0], wheels[1].mean(axis=1))


#: What is compared: quantity, source, reference, and the integrals of both.
_PAIRS = (
    ('yaw rate', 'imu', 'pose', _turned, _heading),
    ('yaw rate', 'wheels', 'imu', _apart, _turned),
    ('yaw rate', 'wheels', 'pose', _apart, _heading),
    ('speed', 'wheels', 'pose', _mean, _advance),
)


@dataclass(frozen=True, eq=False)
class _Windows:
    # Pairs of integrals over all segments, and the windows in which they are compared. A speed has
    # no offset: on a drive at one speed it would take the factor's place.

    ways: tuple[tuple[Way, Way, FloatArray], ...]
    offset: bool

    def rows(self, late: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray,
                                         NDArray[np.int64]]:
        """Return changes of reference and source, lengths, slopes by lateness, and blocks."""
        columns: list[tuple[FloatArray, ...]] = []
        blocks, first = [], 0
        half = 0.5 * setting('late_step')
        for (times, way), (own, rolled), edges in self.ways:
            change = np.diff(np.interp(edges, times, way))
            at = [np.interp(edges + late + shift, own, rolled) for shift in (-half, 0.0, half)]
            columns.append((change, np.diff(at[1]), np.diff(edges),
                            np.diff(at[2] - at[0]) / (2.0 * half)))
            block = ((edges[:-1] - edges[0]) / setting('relation_block')).astype(np.int64) + first
            first = int(block[-1]) + 1
            blocks.append(block)
        reference, source, span, slope = (np.concatenate(c) for c in zip(*columns, strict=True))
        return reference, source, span, slope, np.concatenate(blocks)


def relations(parts: Sequence[Segment]) -> tuple[Relation, ...]:
    """
    Compare every stream with every other one that sees the same motion.

    Parameters
    ----------
    parts : sequence of Segment

    Returns
    -------
    tuple of Relation
        Of the streams that were recorded, moved enough and together for long enough.
    """
    found = []
    for quantity, source, reference, own, other in _PAIRS:
        one = _relation(parts, quantity, (source, reference), own, other)
        if one is not None:
            found.append(one)
    return tuple(found)


def _relation(parts: Sequence[Segment], quantity: str, names: tuple[str, str],
              own: Callable[[Segment], Way | None], other: Callable[[Segment], Way | None]
              ) -> Relation | None:
    reach, span = setting('latest'), setting('relation_window')
    ways, intervals = [], []
    for part in parts:
        source, reference = own(part), other(part)
        if source is None or reference is None or min(source[0].size, reference[0].size) < 4 or (
                not np.all(np.isfinite(source[1])) or not np.all(np.isfinite(reference[1]))):
            continue
        start = max(source[0][0], reference[0][0]) + reach
        end = min(source[0][-1], reference[0][-1]) - reach
        edges = np.arange(start, end, span)
        if edges.size > 2:
            ways.append((reference, source, edges))
            intervals.append(max(float(np.median(np.diff(t))) for t, _ in (source, reference)))
    seconds = sum(float(e[-1] - e[0]) for _, _, e in ways)
    if seconds < setting('least_compared'):
        return None
    windows = _Windows(tuple(ways), quantity != 'speed')
    if _moved(windows, quantity, names[0]) < setting('least_moved'):
        return None
    steps = round(reach / setting('late_step'))
    late = min((setting('late_step') * k for k in range(-steps, steps + 1)),
               key=lambda at: _disagreement(windows, at))
    return _refined(windows, late, quantity, names, max(intervals), seconds)


def _moved(windows: _Windows, quantity: str, source: str) -> float:
    # Seconds in which the source moves.
    _, change, span, _, _ = windows.rows(0.0)
    least = setting('least_wheel_motion' if source == 'wheels' else 'least_yaw_rate')
    del quantity
    return float(np.sum(span[np.abs(change) > least * span]))


def _robust(table: FloatArray, reference: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    # Coefficients, what they leave, and weights: single jumps of a pose do not count.
    weight = np.ones(reference.size)
    best: FloatArray = np.zeros(table.shape[1])
    # At rest nothing is left at all: weights shall not be those of rounding.
    least = max(setting('least_spread') * float(np.sqrt(np.mean(reference ** 2))),
                float(np.finfo(float).tiny))
    for _ in range(int(setting('reweighted'))):
        best = np.asarray(np.linalg.lstsq(
            table * weight[:, None], reference * weight, rcond=None)[0], dtype=np.float64)
        left = reference - table @ best
        wide = max(_spread(left), least)
        weight = 1.0 / np.sqrt(1.0 + (left / (setting('outlier') * wide)) ** 2)
    return best, reference - table @ best, weight


def _spread(values: FloatArray) -> float:
    # The median deviation, as a standard deviation of a normal distribution.
    return float(np.median(np.abs(values)) / setting('median_of_normal'))


def _disagreement(windows: _Windows, late: float) -> float:
    # Absolute, not squared: jumps of a pose shall not choose the lateness.
    reference, source, span, _, _ = windows.rows(late)
    _, left, _ = _robust(np.column_stack([source, span * windows.offset]), reference)
    return float(np.mean(np.abs(left)))


def _refined(windows: _Windows, late: float, quantity: str, names: tuple[str, str],
             interval: float, seconds: float) -> Relation:
    # Gauss-Newton on the lateness with the two coefficients; covariance of blocks (sandwich).
    begun = late
    for _ in range(int(setting('late_rounds'))):
        reference, source, span, slope, blocks = windows.rows(late)
        span = span * windows.offset
        best, left, weight = _robust(np.column_stack([source, span]), reference)
        table = np.column_stack([source, span, best[0] * slope])
        move = np.linalg.lstsq(table * weight[:, None], left * weight, rcond=None)[0][2]
        late = float(np.clip(late + move, begun - setting('late_step'),
                             begun + setting('late_step')))
    reference, source, span, slope, blocks = windows.rows(late)
    span = span * windows.offset
    best, left, weight = _robust(np.column_stack([source, span]), reference)
    table = np.column_stack([source, span, best[0] * slope])
    square = weight ** 2
    normal = np.linalg.pinv((table * square[:, None]).T @ table)
    scores = np.zeros((int(blocks[-1]) + 1, 3))
    np.add.at(scores, blocks, table * (square * left)[:, None])
    covariance = normal @ (scores.T @ scores) @ normal
    half = setting('two_sided') * np.sqrt(np.maximum(np.diag(covariance), 0.0))

    def number(value: float, place: int) -> Number:
        return Number(value, value - float(half[place]), value + float(half[place]))
    total = float(np.sum(square * reference ** 2))
    explained = 1.0 - float(np.sum(square * left ** 2)) / total if total > 0.0 else 0.0
    return Relation(quantity, *names, number(float(best[0]), 0), number(late, 2),
                    number(float(best[1]), 1), explained, interval, seconds)


def by_names(found: Sequence[Relation]) -> Mapping[tuple[str, str, str], Relation]:
    """Return relations by quantity, source and reference."""
    return MappingProxyType({(r.quantity, r.source, r.reference): r for r in found})
