# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Where a fit of a number begins that its likelihood leads to from nearby only.

Play, limits and delays act at one time or not: their likelihood has bends and several maxima, and
Gauss-Newton steps end beside where they begin. It is cheap to look at, for one number.
"""

from __future__ import annotations

import itertools
import math

from lg_husky_sim.diagnosis.evidence.evidence import Evidence
from lg_husky_sim.diagnosis.evidence.point import Point
from lg_husky_sim.diagnosis.hypotheses.hypothesis import Hypothesis, Numbers
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.errors import LgHuskyError


def narrowed(evidence: Evidence, hypothesis: Hypothesis, point: Point) -> Numbers | None:
    """
    Return the likeliest first number of an effect with all else as it is.

    The best of its starts and of the geometric means between neighbours, again and again.

    Parameters
    ----------
    evidence : Evidence
        Drives and noise by which the effect is judged.
    hypothesis : Hypothesis
        An effect with its free numbers and their starts.
    point : Point
        Of the base, without the effect.

    Returns
    -------
    mapping of str to float, or None
        None for effects with several numbers that begin at more than one size, or with fewer
        starts than tell a maximum.

    """
    name, *rest = (parameter.name for parameter in hypothesis.free)
    others = {one: hypothesis.starts[0][one] for one in rest}
    values = sorted({start[name] for start in hypothesis.starts})
    if len(values) < 3 or values[0] <= 0.0 or any(
            start[one] != others[one] for start in hypothesis.starts for one in rest):
        return None
    costs: dict[float, float] = {}

    def cost(value: float) -> float:
        if value not in costs:
            try:
                there = hypothesis.point(point, {name: value, **others})
                costs[value] = evidence.cost(evidence.residuals(evidence.predict(there)), there)
            except LgHuskyError:
                costs[value] = math.inf
        return costs[value]
    for _ in range(int(setting('narrowings'))):
        place = values.index(min(values, key=cost))
        values = values[max(place - 1, 0):place + 2]
        between = [math.sqrt(a * b) for a, b in itertools.pairwise(values)]
        values = sorted({*values, *between})
    return {name: min(values, key=cost), **others}
