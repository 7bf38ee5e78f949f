# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Half of the commanded steps to fit, the other half to judge.

Every segment is simulated throughout, so that a held-out step begins in the state that the model
itself has reached, transients included; only what is scored is divided.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
import itertools

from lg_husky_sim.identification.problem import Channel, FitSegment, Observations
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np
from numpy.typing import NDArray

#: A change of the command below this is no new step [m/s, rad/s].
CHANGE = 1e-6
#: A command that holds for less is no step of its own: it belongs to a ramp [s].
SHORTEST = 1.0


@dataclass(frozen=True)
class Step:
    """
    A time in which the command stays the same.

    Parameters
    ----------
    segment : int
        Number of the segment in its observations.
    start, end : float
        On the recording's clock [s].

    """

    segment: int
    start: float
    end: float


def steps_of(data: Observations) -> tuple[Step, ...]:
    """
    Find the commanded steps.

    Parameters
    ----------
    data : Observations
        Segments with their commands.

    Returns
    -------
    tuple of Step
        In order; commands that hold for less than :data:`SHORTEST` join the step before them.

    """
    found = []
    for number, segment in enumerate(data.segments):
        edges = _edges(segment.commands, segment.start, segment.start + _length(segment))
        found += [Step(number, float(a), float(b))
                  for a, b in itertools.pairwise(edges)]
    return tuple(found)


def _length(segment: FitSegment) -> float:
    ends = (float(c.times[-1]) for c in segment.channels)
    return max(ends, default=segment.start) - segment.start


def _edges(commands: TimeSeries, start: float, end: float) -> FloatArray:
    changed = np.any(np.abs(np.diff(commands.values, axis=0)) > CHANGE, axis=1)
    times = commands.times[1:][changed]
    kept = [start]
    for here, following in zip(times, [*times[1:], end], strict=True):
        if start < here < end and following - here >= SHORTEST and here - kept[-1] >= SHORTEST:
            kept.append(float(here))
    return np.array([*kept, end])


def alternate_steps(data: Observations) -> tuple[Observations, Observations]:
    """
    Return the values of every other step, and those of the rest.

    Parameters
    ----------
    data : Observations
        To be divided.

    Returns
    -------
    fitted, held_out : Observations
        Both simulate the same segments.

    """
    steps = steps_of(data)
    return (within(data, steps[0::2]), within(data, steps[1::2]))


def within(data: Observations, steps: Sequence[Step]) -> Observations:
    """
    Return the values that lie in some of the steps; increments by the end of their window.

    A channel of which less than a handful is left in a segment is left out there.

    Parameters
    ----------
    data : Observations
        To be chosen from.
    steps : sequence of Step
        As :func:`steps_of` finds them; other values are left out.

    """
    segments = []
    for number, segment in enumerate(data.segments):
        own = [step for step in steps if step.segment == number]
        channels = tuple(_picked(channel, own) for channel in segment.channels)
        segments.append(replace(segment, channels=tuple(c for c in channels if c.values.size > 3)))
    return Observations(tuple(segments))


def _picked(channel: Channel, steps: Sequence[Step]) -> Channel:
    use: NDArray[np.bool_] = np.zeros(channel.times.size, dtype=bool)
    for step in steps:
        use |= (channel.times > step.start) & (channel.times <= step.end)
    return Channel(channel.name, channel.times[use], channel.values[use], channel.begins[use])
