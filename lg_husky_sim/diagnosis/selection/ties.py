# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
When two hypotheses are not told apart by the data.

By the margin, since no law is exact, or by Vuong's statistic: the sum of the differences of their
log likelihoods over blocks of time, against the deviation of such a sum.
"""

from __future__ import annotations

import math

from lg_husky_sim.diagnosis.evidence import student
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.signals import FloatArray
import numpy as np


def gains_of(base: Fit, other: Fit) -> FloatArray:
    """Return what each reading is likelier under the other fit, shape (n,) [nats]."""
    return student.costs(base.whitened) - student.costs(other.whitened)


def is_near(evidence: Evidence, best: Fit, other: Fit, difference: float, gain: float) -> bool:
    """
    Return whether two fits are not told apart.

    Parameters
    ----------
    evidence : Evidence
        Under whose noise both were fitted.
    best, other : Fit
        Of two hypotheses, the better one first.
    difference : float
        Of their scores [nats].
    gain : float
        Of the best [nats].

    Returns
    -------
    bool

    """
    if difference < setting('near_margin') * gain:
        return True
    gains = gains_of(other, best)
    blocks, place = [], 0
    for whitener in evidence.whiteners:
        frame = whitener.frame
        times = frame.times[frame.order]
        own = gains[place:place + times.size]
        place += times.size
        index = ((times - times[0]) / setting('block')).astype(np.int64)
        blocks.append(np.bincount(index, weights=own))
    sums = np.concatenate(blocks)
    return difference < setting('near_z') * float(np.std(sums)) * math.sqrt(sums.size)
