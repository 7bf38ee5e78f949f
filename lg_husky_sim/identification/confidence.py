# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
How well a fit knows its parameters: covariance, intervals, and what the data cannot determine.

The covariance is a sandwich: the curvature of the whitened residuals around their scatter, summed
over blocks of time, so that correlation that the whitening left within a block is counted. A
block's sum weighs by what it really contributed, not by what white noise would.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import itertools

from lg_husky_sim.identification.least_squares import Problem, Solution, Unknown
from lg_husky_sim.identification.settings import setting
from lg_husky_sim.reporting.words import plus_minus
from lg_husky_sim.signals import FloatArray
import numpy as np
from scipy.special import ndtri, stdtrit

#: Share of the largest eigenvalue of the curvature below which a direction counts as untouched by
#: the data: a million times less certain than the best one.
FLAT = 1e-12
_MECHANICAL = {'wheel_damping', 'yaw_damping', 'mass', 'yaw_inertia', 'wheel_inertia'}
_MOTOR = {'torque_constant', 'motor_resistance', 'motor_inductance', 'gear_ratio'}
_KINEMATIC = {'wheel_radius', 'track', 'turn_ratio'}
_SUPPLY = {'command_gain', 'supply_voltage'}


@dataclass(frozen=True, eq=False)
class Confidence:
    """
    Uncertainty of a fit in its varied quantities (logarithms of most parameters).

    Parameters
    ----------
    unknowns : tuple of Unknown
        Those that all segments share; the others follow them.
    covariance, correlation : numpy.ndarray, shape (n_unknowns, n_unknowns)
        Of the varied quantities.
    condition : float
        Of the correlation matrix of the curvature: large where combinations are undetermined.
    blocks : int
        Blocks of time that the scatter was summed over.
    low, high : numpy.ndarray, shape (n_unknowns,)
        95 % intervals of the values.
    inflation : numpy.ndarray, shape (n_unknowns,)
        Variance over that of white residuals of unit size.
    local : tuple of Unknown
        Corrections of the starts of single segments.
    local_deviations : numpy.ndarray, shape (n_local,)
        Their standard deviations.

    """

    unknowns: tuple[Unknown, ...]
    covariance: FloatArray
    correlation: FloatArray
    condition: float
    blocks: int
    low: FloatArray
    high: FloatArray
    inflation: FloatArray
    local: tuple[Unknown, ...]
    local_deviations: FloatArray

    @property
    def deviations(self) -> FloatArray:
        """Return the standard deviations of the varied quantities."""
        root: FloatArray = np.sqrt(np.diag(self.covariance))
        return root


def _block_sums(problem: Problem, slope: FloatArray, white: FloatArray) -> FloatArray:
    # Score of each block of time, all channels together, shape (n_blocks, n_unknowns).
    observations = problem.observations
    number = np.zeros(white.size, dtype=np.int64)
    for one in observations.slices:
        part = slice(one.first, one.last)
        start = observations.segments[one.segment].start
        number[part] = one.segment * 1_000_000 + (
            (observations.times[part] - start) / setting('block')).astype(np.int64)
    _, place = np.unique(number, return_inverse=True)
    scores = np.zeros((int(place.max(initial=0)) + 1, slope.shape[1]))
    np.add.at(scores, place, slope * white[:, None])
    return scores


def confidence(problem: Problem, solution: Solution) -> Confidence:
    """
    Return the uncertainty of a solution.

    Parameters
    ----------
    problem : Problem
        With the metric of the last pass.
    solution : Solution
        End of a search, with its derivatives.

    Returns
    -------
    Confidence
        Variances are the larger of the curvature's and of the sandwich's, the latter widened by
        Student's t, so that few blocks do not feign accuracy.

    """
    observations, metric, layout = problem.observations, problem.metric, problem.layout
    white = metric.whiten(observations, observations.measured - solution.predicted)
    packed = metric.whiten(observations, solution.jacobian)
    priors = np.array([0.0 if np.isinf(u.deviation) else u.deviation ** -2
                       for u in solution.unknowns])
    # Starts of single segments follow the unknowns that all share, and cost them certainty.
    curvature, slope, follow, alone = layout.eliminate(
        layout.gram(packed) + np.diag(priors), packed)
    count = slope.shape[1]
    unknowns = tuple(solution.unknowns[i] for i in layout.shared)
    size = np.sqrt(np.maximum(np.diag(curvature), 1e-30))
    shape = curvature / np.outer(size, size)
    eigenvalues, axes = np.linalg.eigh(shape) if count else (np.ones(1), np.ones((0, 1)))
    condition = float(eigenvalues[-1] / max(eigenvalues[0], 1e-16))
    # A direction that the data do not touch is open up to the bounds, and not known exactly.
    bread = axes / np.maximum(eigenvalues, FLAT * eigenvalues[-1]) @ axes.T / np.outer(size, size)
    scores = _block_sums(problem, slope, white)
    blocks = scores.shape[0]
    meat = scores.T @ scores * blocks / max(blocks - 1, 1)
    level = max(float(np.mean(white ** 2)), 0.25)
    plain = bread * level
    sandwich = bread @ meat @ bread
    # The scatter of few blocks is itself uncertain: Student's t widens it, and only it.
    normal = float(ndtri(0.5 + 0.5 * setting('interval_level')))
    student = float(stdtrit(max(blocks - count, 1), 0.5 + 0.5 * setting('interval_level')))
    variances = np.maximum(np.diag(sandwich) * (student / normal) ** 2, np.diag(plain))
    lift = np.sqrt(variances / np.maximum(np.diag(plain), 1e-300))
    covariance = plain * np.outer(lift, lift)
    deviations = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    reach = normal * deviations
    varied = [u.varied(solution.values[u.name]) for u in unknowns]
    low = [u.value(v - r) for u, v, r in zip(unknowns, varied, reach, strict=True)]
    high = [u.value(v + r) for u, v, r in zip(unknowns, varied, reach, strict=True)]
    local = np.sqrt(alone * level + np.einsum('pij,jk,pik->pi', follow, covariance, follow))
    return Confidence(unknowns, covariance, covariance / np.outer(
        deviations, deviations), condition, blocks, np.array(low), np.array(high),
        variances / np.maximum(np.diag(bread), 1e-300),
        tuple(solution.unknowns[i] for i in layout.own.ravel()), local.ravel())


def separators(names: Sequence[str]) -> str:
    """Return which sensor or manoeuvre would separate parameters, in words."""
    group = set(names)
    if group <= _MECHANICAL:
        return 'weighing the robot or a motor current sensor would separate them'
    if group & _MOTOR and group <= _MOTOR | _MECHANICAL | _SUPPLY:
        return 'a motor current sensor would separate them'
    if group & _SUPPLY and group <= _SUPPLY | _MECHANICAL:
        return 'a voltage or current sensor would separate them'
    if group & _KINEMATIC:
        return 'measuring the wheel radius and the track would separate them'
    return 'a drive with other speeds, stops and turns on the spot would separate them'


def _relative(name: str, unknown: Unknown, deviation: float, value: float) -> float:
    return deviation if unknown.logarithmic else deviation / max(abs(value), 1e-12)


def undetermined(result: Confidence, values: FloatArray) -> tuple[str, ...]:
    """
    Say in words which parameters the data leave open, alone or together.

    Parameters
    ----------
    result : Confidence
        Covariance and correlation of the estimates.
    values : numpy.ndarray, shape (n_unknowns,)
        Estimates.

    Returns
    -------
    tuple of str
        One sentence each; empty where every parameter is known by itself.

    """
    said: list[str] = []
    deviations = result.deviations
    reach = float(ndtri(0.5 + 0.5 * setting('interval_level')))
    names = [u.name for u in result.unknowns]
    relative = [_relative(n, u, float(d), float(v)) for n, u, d, v in zip(
        names, result.unknowns, deviations, values, strict=True)]
    for i, j in itertools.combinations(range(len(names)), 2):
        both = result.unknowns[i].logarithmic and result.unknowns[j].logarithmic
        correlation = float(result.correlation[i, j])
        if not both or abs(correlation) < setting('known_together'):
            continue
        sign = 1.0 if correlation > 0.0 else -1.0
        variance = (result.covariance[i, i] + result.covariance[j, j]
                    - 2.0 * sign * result.covariance[i, j])
        joint = float(np.sqrt(max(variance, 0.0)))
        if joint * setting('combination_gain') > min(relative[i], relative[j]):
            continue
        if reach * max(relative[i], relative[j]) < setting('well_determined'):
            continue
        # The less certain one over the other reads as B_H/B.
        first, second = names[j], names[i]
        form = f'{first}/{second}' if sign > 0.0 else f'{first}·{second}'
        amount = (values[j] / values[i]) if sign > 0.0 else values[j] * values[i]
        said.append(
            f'only {form} = {amount:.4g} is well determined ({_width(reach * joint)}), '
            f'{names[i]} and {names[j]} alone only to {_width(reach * relative[i])} and '
            f'{_width(reach * relative[j])} (correlation {correlation:+.3f}); '
            f'{separators((names[i], names[j]))}')
    covered = ' '.join(said)
    for place, (name, spread) in enumerate(zip(names, relative, strict=True)):
        if reach * spread > setting('poorly_determined') and name not in covered:
            said.append(f'{name} is hardly determined by these data: '
                        f'{result.low[place]:.3g} to {result.high[place]:.3g}')
    return tuple(said)


def _width(reach: float) -> str:
    # Half the width of an interval of a logarithm.
    return plus_minus(reach) if reach < 1.0 else f'a factor of {np.exp(min(reach, 50)):.2g}'
