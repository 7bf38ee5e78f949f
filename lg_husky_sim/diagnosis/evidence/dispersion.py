# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
How much larger than of white innovations gains are by chance, and what of one happened once.

Innovations that are not quite white make a gain larger by chance: by the ratio of the variance of
its score ``c' e``, estimated from blocks of time that are independent of each other (sandwich), to
the variance ``c' c`` of white ones.
"""

from __future__ import annotations

import itertools

from lg_husky_sim.diagnosis.evidence import student
from lg_husky_sim.diagnosis.evidence.evidence import Evidence
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.signals import FloatArray
import numpy as np


def dispersion(evidence: Evidence, whitened: FloatArray, columns: FloatArray) -> float:
    """
    Return by how much twice a gain exceeds chi-square on the mean.

    Parameters
    ----------
    evidence : Evidence
        Says which innovations lie in one block of time.
    whitened : numpy.ndarray, shape (n,)
        Innovations of all drives, in the order of time.
    columns : numpy.ndarray, shape (n, k)
        Whitened derivatives by the numbers of the hypothesis.

    Returns
    -------
    float
        At least what Student's t makes of white innovations.

    """
    scores = whitened * student.weights(whitened)
    sums = np.array([scores[part] @ columns[part] for part in _blocks(evidence, setting('block'))])
    meat = sums.T @ sums
    scale = np.sqrt(np.maximum(np.einsum('ij,ij->j', columns, columns), 1e-300))
    bread = columns.T @ columns / np.outer(scale, scale)
    ratio = np.trace(np.linalg.pinv(bread, rcond=1e-9) @ (meat / np.outer(scale, scale)))
    found: float = max(setting('inflation'), float(ratio) / columns.shape[1])
    return found


def accident(evidence: Evidence, before: FloatArray, after: FloatArray) -> float:
    """
    Return what innovations gain in the one stretch of time in which they gain most.

    Parameters
    ----------
    evidence : Evidence
        Says which innovations lie in one stretch of time.
    before, after : numpy.ndarray, shape (n,)
        Innovations of all drives, in the order of time.

    Returns
    -------
    float
        [nats]

    """
    gains = student.costs(before) - student.costs(after)
    return max(0.0, *(float(np.sum(gains[part])) for part in _blocks(
        evidence, setting('accident'))))


def _blocks(evidence: Evidence, length: float) -> list[slice]:
    # Stretches of so many seconds of each drive.
    found, place = [], 0
    for whitener in evidence.whiteners:
        frame = whitener.frame
        times = frame.times[frame.order]
        block = ((times - times[0]) / length).astype(np.int64)
        edges = place + np.append(np.flatnonzero(np.diff(block, prepend=-1)), times.size)
        found += [slice(int(first), int(last)) for first, last in itertools.pairwise(edges)]
        place += times.size
    return found
