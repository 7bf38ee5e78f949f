# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Channels that see the same motion: what one channel's residual says of another's.

A wheel that runs faster than predicted takes the base along, and a base that turns faster than
predicted does so for the gyro and for the pose alike. Such an error of the motion stands in
several channels; what is left of a channel after the others have been taken off is the error of
the relation between them: slip, a scale, a bias. There sensors and kinematics show at their own
noise, however wrong the motion was predicted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

from lg_husky_sim.identification.problem import Observations
from lg_husky_sim.identification.settings import setting
from lg_husky_sim.signals import FloatArray
import numpy as np
from scipy import sparse

#: Channels whose residual is taken off others, in this order: source, then weight in it.
SOURCES: Mapping[str, Mapping[str, Sequence[tuple[str, float]]]] = {
    'yaw_rate': {'wheels_turn': (('wheel_right', 0.5), ('wheel_left', -0.5))},
    'advance': {'wheels_mean': (('wheel_right', 0.5), ('wheel_left', 0.5))},
    'turn': {'gyro': (('yaw_rate', 1.0),),
             'wheels_turn': (('wheel_right', 0.5), ('wheel_left', -0.5))},
}


@dataclass(frozen=True, eq=False)
class Link:
    """
    One source of a channel, brought to the channel's stamps.

    Parameters
    ----------
    channel, source : str
    operator : scipy.sparse.csr_array, shape (n_values, n_values)
        Rows of other channels, and of segments without the source, are empty.

    """

    channel: str
    source: str
    operator: sparse.csr_array


@lru_cache(maxsize=8)
def links(observations: Observations) -> tuple[Link, ...]:
    """
    Return the links between the channels of observations.

    Parameters
    ----------
    observations : Observations
        Whose channels may have errors of one motion.

    Returns
    -------
    tuple of Link

    """
    size = observations.measured.size
    known = {(s.segment, s.channel): s for s in observations.slices}
    found = []
    for channel, sources in SOURCES.items():
        for source, members in sources.items():
            rows, columns, weights = [np.zeros(0)], [np.zeros(0)], [np.zeros(0)]
            for number, segment in enumerate(observations.segments):
                if any((number, name) not in known for name in (
                        channel, *(name for name, _ in members))):
                    continue
                target = known[number, channel]
                own = next(c for c in segment.channels if c.name == channel)
                for name, part in members:
                    other = next(c for c in segment.channels if c.name == name)
                    first = known[number, name].first
                    row, column, weight = averaging(other.times, own.begins, own.times)
                    rows.append(row + target.first)
                    columns.append(column + first)
                    weights.append(part * weight)
            if sum(w.size for w in weights):
                table = sparse.coo_array((np.concatenate(weights), (
                    np.concatenate(rows).astype(np.int64),
                    np.concatenate(columns).astype(np.int64))), shape=(size, size))
                found.append(Link(channel, source, sparse.csr_array(table)))
    return tuple(found)


def apart(observations: Observations, parts: Mapping[str, Mapping[str, float]],
          values: FloatArray) -> FloatArray:
    """
    Take off every channel what its sources say of it.

    Parameters
    ----------
    observations : Observations
        Whose values these are.
    parts : mapping of str to mapping of str to float
        By channel and source, as :func:`coefficients` gives it.
    values : numpy.ndarray, shape (n_values,) or (n_values, k)
        Residuals, or columns of derivatives.

    Returns
    -------
    numpy.ndarray
        Shape as given.

    """
    left = values
    for link in links(observations):
        part = parts.get(link.channel, {}).get(link.source, 0.0)
        if part:
            left = left - part * (link.operator @ values)
    return left


def averaging(times: FloatArray, begins: FloatArray, ends: FloatArray
              ) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Return the weights that average samples over intervals.

    Parameters
    ----------
    times : numpy.ndarray, shape (n,)
        Of the samples, ascending [s].
    begins, ends : numpy.ndarray, shape (m,)
        Of the intervals [s]; an interval of no length takes the value there.

    Returns
    -------
    numpy.ndarray, shape (k,)
        Number of the interval.
    numpy.ndarray, shape (k,)
        Number of the sample.
    numpy.ndarray, shape (k,)
        Its weight; the weights of an interval add up to one.

    """
    first = np.searchsorted(times, begins, side='left')
    last = np.searchsorted(times, ends, side='right')
    empty = last <= first
    # No sample inside: the two neighbours, linearly.
    middle = 0.5 * (begins + ends)
    right = np.clip(np.searchsorted(times, middle), 1, max(times.size - 1, 1))
    if times.size < 2:
        right = np.zeros_like(right)
    left = np.maximum(right - 1, 0)
    gap = np.maximum(times[right] - times[left], 1e-9)
    share = np.clip((middle - times[left]) / gap, 0.0, 1.0)
    counts = np.where(empty, 0, last - first)
    inside = np.repeat(np.arange(begins.size), counts)
    offset = np.arange(inside.size) - np.repeat(np.cumsum(counts) - counts, counts)
    alone = np.flatnonzero(empty)
    return (np.concatenate([inside, alone, alone]).astype(float),
            np.concatenate([first[inside] + offset, left[alone], right[alone]]).astype(float),
            np.concatenate([1.0 / counts[inside], 1.0 - share[alone], share[alone]]))


def coefficients(observations: Observations, residual: FloatArray, scale: FloatArray
                 ) -> dict[str, dict[str, float]]:
    """
    Estimate how much of each source stands in each channel.

    Parameters
    ----------
    observations : Observations
        Whose values these are.
    residual : numpy.ndarray, shape (n_values,)
        With everything projected out that could be physics.
    scale : numpy.ndarray, shape (n_values,)
        One over the standard deviation.

    Returns
    -------
    dict of str to dict of str to float
        By channel and source; a coefficient that explains nothing is near zero.

    """
    found, result = links(observations), {}
    for channel in SOURCES:
        own = [link for link in found if link.channel == channel]
        if not own:
            continue
        mask = observations.channel_mask(channel)
        weight = scale[mask]
        target = residual[mask] * weight
        columns = np.column_stack([(link.operator @ residual)[mask] * weight for link in own])
        wide = 1.4826 * float(np.median(np.abs(target))) + 1e-9
        kept = np.minimum(1.0, setting('clip') * wide / np.maximum(np.abs(target), 1e-12))
        target, columns = target * kept, columns * kept[:, None]
        gram = columns.T @ columns
        gram += setting('ridge') * np.diag(np.diag(gram)) + 1e-9 * np.eye(len(own))
        best = np.linalg.solve(gram, columns.T @ target)
        result[channel] = {link.source: float(b) for link, b in zip(own, best, strict=True)}
    return result
