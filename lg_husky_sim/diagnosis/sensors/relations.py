# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
One stream against another: factor, lateness and offset, without a model of the robot.

Two streams that see the same motion are related over any window [a, b] by::

    change of the reference = factor * (change of the source, late by d) + offset * (b - a)

A gyro and the heading of a pose see the same yaw rate, with a factor of one. Wheels see the speed
with their rolling radius as the factor, and the yaw rate with that over the effective track; where
their mean does not see the speed, each side is related to it by itself, with half of that radius.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from lg_husky_sim.diagnosis.sensors.regression import Number, regression, Way
from lg_husky_sim.diagnosis.sensors.ways import (
    advance,
    commanded_turn,
    gyro,
    heading,
    mean_wheel,
    turned_left,
    turned_right,
    wheel_difference,
)
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.recording import Segment


@dataclass(frozen=True)
class Relation:
    """
    What one stream says of another.

    Parameters
    ----------
    quantity : str
        ``yaw rate`` or ``speed``.
    source, reference : str
        Streams: imu, wheels, pose or command; left wheels and right wheels.
    factor : Number
        Reference over source [1, or m for wheels against a speed, their difference against a
        yaw rate].
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


#: What is compared: quantity, source, reference, and the integrals of both.
_PAIRS = (
    ('yaw rate', 'imu', 'pose', gyro, heading),
    ('yaw rate', 'wheels', 'imu', wheel_difference, gyro),
    ('yaw rate', 'wheels', 'pose', wheel_difference, heading),
    ('speed', 'wheels', 'pose', mean_wheel, advance),
    ('yaw rate', 'command', 'imu', commanded_turn, gyro),
    ('yaw rate', 'command', 'pose', commanded_turn, heading),
)


def relations(parts: Sequence[Segment]) -> tuple[Relation, ...]:
    """
    Compare every stream with every other one that sees the same motion.

    Parameters
    ----------
    parts : sequence of Segment
        Stretches of all recordings, with their streams.

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
            if quantity == 'speed' and one.explained < setting('least_explained'):
                found += _sides(parts)
    return tuple(found)


def _sides(parts: Sequence[Segment]) -> list[Relation]:
    # Each side by itself, in one regression.
    pairs = [(reference, (left, right)) for part in parts
             if (reference := advance(part)) is not None
             and (left := turned_left(part)) is not None
             and (right := turned_right(part)) is not None]
    found = regression(pairs, 2 * (setting('least_wheel_motion'),), offset=False)
    return [] if found is None else [
        Relation('speed', source, 'pose', factor, found.late, found.offset, found.explained,
                 found.interval, found.seconds)
        for source, factor in zip(('left wheels', 'right wheels'), found.factors, strict=True)]


def _relation(parts: Sequence[Segment], quantity: str, names: tuple[str, str],
              own: Callable[[Segment], Way | None], other: Callable[[Segment], Way | None]
              ) -> Relation | None:
    pairs = [(reference, (source,)) for part in parts
             if (source := own(part)) is not None and (reference := other(part)) is not None]
    least = setting('least_wheel_motion' if names[0] == 'wheels' else 'least_yaw_rate')
    # A speed has no offset: on a drive at one speed it would take the factor's place.
    found = regression(pairs, (least,), offset=quantity != 'speed')
    return None if found is None else Relation(
        quantity, *names, found.factors[0], found.late, found.offset, found.explained,
        found.interval, found.seconds)


def by_names(found: Sequence[Relation]) -> Mapping[tuple[str, str, str], Relation]:
    """Return relations by quantity, source and reference."""
    return MappingProxyType({(r.quantity, r.source, r.reference): r for r in found})
