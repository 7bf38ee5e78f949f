# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Likelihood profiles: how the cost rises as one parameter is held and the others follow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from lg_husky_sim.errors import FitError
from lg_husky_sim.identification.least_squares import Problem, Solution, solve
from lg_husky_sim.identification.settings import setting
from lg_husky_sim.signals import FloatArray
import numpy as np
from scipy.special import chdtri

#: Rise of the cost at the ends of a 95 % interval [nats].
LEVEL = 0.5 * float(chdtri(1, 0.05))
#: Most Jacobians for the others at each value.
STEPS = 8


@dataclass(frozen=True, eq=False)
class Profile:
    """
    Cost along one parameter, the others at their best.

    Parameters
    ----------
    name : str
    values, rise : numpy.ndarray, shape (n,)
        Held values [unit], and by how much the cost is above the least one [nats].
    low, high : float
        Where it crosses the 95 % level [unit]; infinite where it does not.

    """

    name: str
    values: FloatArray
    rise: FloatArray
    low: float
    high: float


def profile(problem: Problem, solution: Solution, name: str, deviation: float,
            inflation: float = 1.0, tell: Callable[[], None] | None = None) -> Profile:
    """
    Return the likelihood profile of one parameter.

    Parameters
    ----------
    problem : Problem
        That was solved, the parameter among its unknowns.
    solution : Solution
        Its end.
    name : str
        Of one of the unknowns.
    deviation : float
        Standard deviation of the varied quantity, for the distance of the values.
    inflation : float
        By how much correlated residuals widen the variance; the rise is divided by it.
    tell : callable, optional
        Called after each value.

    Returns
    -------
    Profile

    Raises
    ------
    FitError
        If the parameter was not estimated.

    """
    names = [u.name for u in problem.unknowns]
    if name not in names:
        raise FitError(f'no profile of {name!r}: it was not estimated '
                       f'(estimated: {", ".join(names)})')
    held = problem.unknowns[names.index(name)]
    others = [u for u in problem.unknowns if u.name != name]
    centre = held.varied(solution.values[name])
    reach, count = setting('profile_reach'), round(setting('profile_values'))
    shifts = np.linspace(-reach, reach, 2 * count + 1) * deviation
    values, costs = [], []
    for side in (shifts[count::-1], shifts[count + 1:]):
        start = dict(solution.values)
        for shift in side:
            value = held.value(centre + float(shift))
            fixed = Problem(problem.observations, problem.model, problem.parameters.replacing(
                {name: value}) if not held.extra else problem.parameters, problem.metric,
                [*others, replace(held, lower=value, upper=value)] if held.extra else others)
            end = solve(fixed, start, STEPS)
            values.append(value)
            costs.append(float('inf') if end is None else end.cost)
            if end is not None:
                start = dict(end.values)
            if tell is not None:
                tell()
    order = np.argsort(values)
    at, cost = np.array(values)[order], np.array(costs)[order]
    rise = (cost - np.min(cost)) / inflation
    best = int(np.argmin(rise))
    return Profile(name, at, rise, _crossing(at[best::-1], rise[best::-1], LEVEL, -np.inf),
                   _crossing(at[best:], rise[best:], LEVEL, np.inf))


def _crossing(values: FloatArray, rise: FloatArray, level: float, none: float) -> float:
    above = np.flatnonzero(rise > level)
    if not above.size:
        return none
    k = int(above[0])
    if k == 0 or not np.isfinite(rise[k]):
        return float(values[k])
    # Square roots are straight lines where the cost is a parabola.
    low, high = np.sqrt(rise[k - 1]), np.sqrt(rise[k])
    share = (np.sqrt(level) - low) / (high - low)
    return float(values[k - 1] + share * (values[k] - values[k - 1]))
