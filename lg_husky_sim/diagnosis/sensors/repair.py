# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Faults of sensors that are taken off before any model is fitted.

A gyro with the wrong sign, or a stream that is late by more than a body can be, would be taken for
physics by every number of the model. The search therefore begins with them in the model, and
refines their numbers with the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from lg_husky_sim.diagnosis.conclusion import estimates
from lg_husky_sim.diagnosis.evidence.evidence import Fit
from lg_husky_sim.diagnosis.evidence.point import Point
from lg_husky_sim.diagnosis.hypotheses.hypothesis import Hypothesis
from lg_husky_sim.diagnosis.result import Estimate, Finding
from lg_husky_sim.diagnosis.sensors.faults import Fault
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.diagnosis.wording import in_words
from lg_husky_sim.errors import ParameterError
from lg_husky_sim.husky.network import on_side
from scipy.special import ndtr, ndtri

#: What the statement of such a fault ends in.
UNMODELLED = 'No model of the robot is needed to see it.'


def certain(found: Sequence[Fault]) -> tuple[Fault, ...]:
    """
    Return the faults that a search begins with.

    Parameters
    ----------
    found : sequence of Fault
        All that the sensors show.

    Returns
    -------
    tuple of Fault
        All that the catalogue has if a sign or a stamp is wrong; none otherwise, since factors
        and offsets are in no one's way.

    """
    named = [f for f in found if f.effect is not None and f.number is not None]
    gross = any(f.number is not None and (
        f.number.unit == 's' or (f.number.unit == '1' and f.number.value < 0.0)) for f in named)
    return tuple(named) if gross else ()


def begun_with(start: Point, found: Sequence[Fault]) -> tuple[Point, tuple[Fault, ...]]:
    """
    Return a point with faults in it.

    Parameters
    ----------
    start : Point
        Model without the faults, and how its log is read.
    found : sequence of Fault
        Of :func:`certain`.

    Returns
    -------
    Point
    tuple of Fault
        Those that it has: a model holds no two of one kind.

    """
    put = []
    for fault in found:
        if fault.effect is None or fault.number is None:
            continue
        numbers = {fault.number.name: fault.number.value}
        try:
            start = Hypothesis(fault.effect, (numbers,)).point(start, numbers)
        except ParameterError:
            continue
        if fault.number.unit == 's':
            start = _expected(start, fault.number)
        put.append(fault)
    return start, tuple(put)


def _expected(point: Point, number: Estimate) -> Point:
    # How late one stream is against the others is what the streams say. What all are late, which
    # a base that answers late may bring about, would go into it otherwise.
    known = (number.high - number.low) / (2.0 * float(ndtri(0.975)))
    spread = max(known, setting('stamp_offset'))
    return replace(point, unknowns=tuple(
        replace(u, centre=number.value, deviation=spread) if u.name == number.name else u
        for u in point.unknowns))


def fault_findings(found: Sequence[Fault], fit: Fit | None = None) -> tuple[Finding, ...]:
    """
    Return faults as findings.

    Parameters
    ----------
    found : sequence of Fault
        With an effect of the catalogue.
    fit : Fit, optional
        With the faults in it, for their numbers; else those of the streams are given.

    Returns
    -------
    tuple of Finding

    """
    gains = [0.5 * f.certainty ** 2 for f in found]
    total = sum(gains) or 1.0
    made = []
    for fault, gain in zip(found, gains, strict=True):
        if fault.effect is None or fault.number is None:
            continue
        numbers: tuple[Estimate, ...] = (fault.number,)
        statement = f'{fault.statement}.'
        if fit is not None:
            numbers = estimates(fit, [fault.number.name], fit.point.numbers)
            statement += (' The fit of all streams at once, which this answer takes, gives '
                          f'{in_words(numbers)}.')
        kind = fault.effect.kind
        made.append(Finding(
            fault.effect.id, fault.effect.side, kind.subsystem.value,
            on_side(kind.elements, fault.effect.side), 'everywhere', None, numbers, gain,
            2.0 * float(ndtr(-fault.certainty)),
            min(1.0, gain / total), (), f'{statement} {UNMODELLED}'))
    return tuple(made)
