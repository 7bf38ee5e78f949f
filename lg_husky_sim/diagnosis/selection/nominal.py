# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a fit has gone astray: the robot as it should be, to begin from anew."""

from __future__ import annotations

from lg_husky_sim.diagnosis.evidence.evidence import Fit
from lg_husky_sim.diagnosis.evidence.point import Point
from lg_husky_sim.diagnosis.evidence.unknowns import start_of
from lg_husky_sim.diagnosis.settings import setting
import numpy as np


def is_distorted(base: Fit) -> bool:
    """
    Return whether recalibrated numbers may have taken the place of something else.

    They are unlikely together, or a delay is as long as a log can be late.
    """
    point = base.point
    return 0.5 * float(np.sum(point.prior_residuals ** 2)) >= setting('distorted') or any(
        u.room > 0.0 and not u.lower < place < u.upper
        for u, place in zip(point.unknowns, point.places, strict=True))


def nominal_of(point: Point) -> Point:
    """Return the robot as it should be, with the effects of a point and read like it."""
    centres = start_of(point.unknowns)
    for place, unknown in enumerate(point.unknowns):
        if unknown.kind != 'model':
            centres[place] = point.places[place]
    return point.at(centres)
