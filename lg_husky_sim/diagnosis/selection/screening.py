# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
A first look at every hypothesis: one simulation a start, the numbers of the base let free.

With the whitened innovations e of a fit, its Jacobian J and the change c that an effect makes of
the simulated readings, the gain of ``c`` is what the linear problem ``e = J d + c s`` with the
priors of the base loses in cost, each innovation with the weight that its size leaves it.

Innovations far beyond their noise have next to none: what acts for moments (a limit just below
what a robot reaches) has no weight where it acts. The gain is at least what the cost itself loses,
the numbers of the base as they are, by s from a few reweighted steps::

    s <- argmin sum w (e - c s)^2,  w = (nu + 1) / (nu + (e - c s)^2)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

from lg_husky_sim.diagnosis.evidence import student
from lg_husky_sim.diagnosis.evidence.bounded_step import held
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.evidence.products import normal_matrix, row_slices
from lg_husky_sim.diagnosis.evidence.unknowns import NEUTRAL
from lg_husky_sim.diagnosis.hypotheses.hypothesis import (
    Hypothesis,
    negligible,
    neutral_of,
    Numbers,
    proportional,
)
from lg_husky_sim.diagnosis.selection.reached import limits_reached, reached_of
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Of columns with the base, with the innovations and with each other.
Products = tuple[FloatArray, FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class Look:
    """
    A first look at a hypothesis.

    Parameters
    ----------
    hypothesis : Hypothesis
    numbers : mapping
        From where a fit may begin.
    gain : float
        Linear estimate of what it lowers the cost by [nats]; infinite for one that is fitted
        whatever it promises.

    """

    hypothesis: Hypothesis
    numbers: Numbers
    gain: float


class Projection:
    """
    What is left of whitened columns when the numbers of the base may move.

    Parameters
    ----------
    fit : Fit
        Of the base. Numbers that a bound keeps from moving on do not move: what they cannot take
        is left.

    """

    def __init__(self, fit: Fit) -> None:
        count = fit.whitened.size
        root = np.sqrt(student.weights(fit.whitened))
        stacked = np.vstack([fit.jacobian * root[:, None], np.diag(fit.point.weights)])
        base, _ = np.linalg.qr(stacked[:, ~held(fit.point.places, fit.descent, *fit.point.bounds)])
        target = np.concatenate([root * fit.whitened, -fit.point.prior_residuals])
        target -= base @ (base.T @ target)
        self._weights = root * root
        self._base = np.ascontiguousarray((base[:count] * root[:, None]).T)
        self._target = root * target[:count]

    @property
    def target(self) -> FloatArray:
        """Weighted innovations that are left, shape (n,); times columns they are slopes."""
        found: FloatArray = self._target
        return found

    def problem(self, columns: FloatArray) -> tuple[FloatArray, FloatArray]:
        """
        Return the normal equations that are left.

        Parameters
        ----------
        columns : numpy.ndarray, shape (n, m)
            Whitened changes.

        Returns
        -------
        normal : numpy.ndarray, shape (m, m)
        slope : numpy.ndarray, shape (m,)

        """
        explained = self._base @ columns
        return (normal_matrix(columns, self._weights) - explained.T @ explained,
                self._target @ columns)

    def apart(self, columns: FloatArray, *, overwrite: bool = False) -> FloatArray:
        """Return what is left of the columns themselves, shape (n, m); in their place if asked."""
        explained, found = self._base @ columns, columns if overwrite else np.array(columns)
        for some in row_slices(len(columns)):
            found[some] -= (self._base.T[some] / self._weights[some, None]) @ explained
        return found

    def products(self, columns: FloatArray, top: int) -> Products:
        """
        Return the products of many sets of columns with the base and with each other.

        Parameters
        ----------
        columns : numpy.ndarray, shape (n, size, m)
            Whitened changes of some readings, m sets of them.
        top : int
            Which reading of the base is the first of them.

        Returns
        -------
        tuple of numpy.ndarray, shapes (k, size, m), (size, m), (size, size, m)
            They add up over the readings.

        """
        count, size, sets = columns.shape
        explained = np.zeros((len(self._base), size * sets))
        slope, normal = np.zeros(size * sets), np.zeros((size, size, sets))
        for some in row_slices(count):
            own = columns[some]
            flat, rows = own.reshape(len(own), -1), slice(top + some.start,
                                                          top + some.start + len(own))
            explained += self._base[:, rows] @ flat
            slope += self._target[rows] @ flat
            weighted = own * self._weights[rows, None, None]
            for i in range(size):
                for j in range(i + 1):
                    normal[i, j] += np.einsum('nm,nm->m', weighted[:, i], own[:, j])
        return explained.reshape(-1, size, sets), slope.reshape(size, sets), normal


def problems_of(products: Products) -> tuple[FloatArray, FloatArray]:
    """
    Return the normal equations of many sets of columns.

    Parameters
    ----------
    products : tuple of numpy.ndarray
        Over all readings, see :meth:`Projection.products`.

    Returns
    -------
    normal : numpy.ndarray, shape (m, size, size)
    slope : numpy.ndarray, shape (m, size)

    """
    explained, slope, products_of_two = products
    normal = np.array(products_of_two)
    for i in range(len(slope)):
        for j in range(i + 1):
            normal[i, j] -= np.einsum('km,km->m', explained[:, i], explained[:, j])
            normal[j, i] = normal[i, j]
    return normal.transpose(2, 0, 1), slope.T


def gain_of(normal: FloatArray, slope: FloatArray, limits: Sequence[tuple[float, float]]
            ) -> tuple[float, FloatArray]:
    """
    Return the gain of projected columns [nats] and their coefficients.

    Parameters
    ----------
    normal : numpy.ndarray, shape (m, m)
        Products of the projected columns with each other.
    slope : numpy.ndarray, shape (m,)
        Products of the projected columns with the innovations.
    limits : sequence of (float, float)
        Of each coefficient, see :func:`limits_of`.

    """
    size = np.sqrt(np.maximum(np.diag(normal), 0.0))
    if not np.all(np.isfinite(size)) or np.any(size <= setting('rounding')):
        return 0.0, np.ones(size.size)
    scaled = normal / np.outer(size, size) + 1e-9 * np.eye(size.size)
    coefficients = np.linalg.solve(scaled, slope / size) / size
    kept = np.clip(coefficients, *np.transpose(limits))
    inside = kept == coefficients
    if np.any(inside) and not np.all(inside):
        # The others make the best of what the limits leave.
        rest = slope[inside] / size[inside] - scaled[np.ix_(inside, ~inside)] @ (
            kept * size)[~inside]
        kept[inside] = np.clip(np.linalg.solve(scaled[np.ix_(inside, inside)], rest)
                               / size[inside], *np.transpose(limits)[:, inside])
    return float(kept @ slope - 0.5 * kept @ normal @ kept), kept


def settled(whitened: FloatArray, columns: FloatArray, start: FloatArray,
            limits: Sequence[tuple[float, float]]) -> tuple[float, FloatArray]:
    """
    Return what the cost itself loses by columns, and their coefficients.

    Parameters
    ----------
    whitened : numpy.ndarray, shape (n,)
        Innovations of the base, whose numbers stay as they are.
    columns : numpy.ndarray, shape (n, m)
        Whitened changes.
    start : numpy.ndarray, shape (m,)
        Coefficients to begin with, inside the limits.
    limits : sequence of (float, float)
        Of each coefficient, see :func:`limits_of`.

    Returns
    -------
    float
        [nats]
    numpy.ndarray, shape (m,)

    """
    low, high = np.transpose(limits)
    before, gain, best = student.cost(whitened), 0.0, start
    own = start
    for _ in range(int(setting('reweighted_looks'))):
        spent, normal, slope = student.reweighted(whitened, columns, own)
        promised = before - spent
        if promised > gain:
            gain, best = promised, own
        size = np.sqrt(np.maximum(np.diag(normal), 0.0))
        if not np.all(np.isfinite(size)) or np.any(size <= setting('rounding')):
            break
        own = np.clip(np.linalg.solve(
            normal / np.outer(size, size) + 1e-9 * np.eye(size.size),
            slope / size) / size, low, high)
    return gain, best


def look(evidence: Evidence, fit: Fit, pool: Sequence[Hypothesis]) -> list[Look]:
    """
    Look at every hypothesis once.

    Parameters
    ----------
    evidence : Evidence
        Drives, and the noise under which the base was fitted.
    fit : Fit
        Of the base.
    pool : sequence of Hypothesis
        Hypotheses to look at.

    Returns
    -------
    list of Look
        The best start of each, in the order of the linear gain.

    """
    projection = Projection(fit)
    reached = reached_of(evidence, fit)

    def tried(hypothesis: Hypothesis, group: Sequence[Numbers]) -> _Rung | None:
        columns = []
        for numbers in group:
            try:
                predicted = evidence.predict(hypothesis.point(fit.point, numbers))
            except LgHuskyError:
                return None
            columns.append([a - b for a, b in zip(predicted, fit.predicted, strict=True)])
        stacked = [np.column_stack(one) for one in zip(*columns, strict=True)]
        if not all(np.all(np.isfinite(one)) for one in stacked):
            return None
        changed = evidence.whiten(stacked)
        normal, slope = projection.problem(changed)
        limits = limits_of(hypothesis, group)
        gain, coefficients = gain_of(normal, slope, limits)
        for start in (coefficients, np.ones(len(coefficients))):
            own, there = settled(fit.whitened, changed, start, limits)
            if own > gain:
                gain, coefficients = own, there
        return _Rung(group, normal, slope, gain, coefficients)

    def seen(hypothesis: Hypothesis) -> Look | None:
        rungs = [one for group in hypothesis.trials()
                 if (one := tried(hypothesis, group)) is not None]
        if not rungs:
            return None
        rungs.sort(key=lambda one: one.strength)
        while (group := _weaker(hypothesis, rungs)) is not None and (
                one := tried(hypothesis, group)) is not None and (
                    one.strength < rungs[0].strength):
            rungs.insert(0, one)
        for group in limits_reached(hypothesis, reached):
            if (one := tried(hypothesis, group)) is not None:
                rungs.append(one)
        best = max(rungs, key=lambda one: one.gain)
        return Look(hypothesis, begin(hypothesis, best.group, best.coefficients), best.gain)
    found = [one for one in evidence.pool.map(seen, pool) if one is not None]
    return sorted(found, key=lambda one: -one.gain)


@dataclass(frozen=True, eq=False)
class _Rung:
    """A size at which an effect was tried."""

    group: Sequence[Numbers]
    normal: FloatArray
    slope: FloatArray
    gain: float
    coefficients: FloatArray

    @property
    def strength(self) -> float:
        return float(np.trace(self.normal))


def _weaker(hypothesis: Hypothesis, rungs: Sequence[_Rung]) -> list[Numbers] | None:
    # The ladder of sizes goes on below its weakest one as long as that is not too little to count
    # and the readings point that way and want less of it.
    if (len(rungs) < 2 or all(in_proportion(hypothesis, rungs[0].group))
            or all(negligible(hypothesis, one) for one in rungs[0].group)):
        return None
    first, second = rungs[0], rungs[1]
    if not np.all(np.isfinite(first.normal)):
        return None
    wanted = np.linalg.lstsq(first.normal, first.slope, rcond=1e-9)[0]
    if (0.5 * float(wanted @ first.slope) < setting('least_look')
            or np.min(wanted) >= setting('least_factor')):
        return None
    found: list[Numbers] = []
    for near, far in zip(first.group, second.group, strict=True):
        numbers = dict(near)
        for p in hypothesis.free:
            if near[p.name] * far[p.name] > 0.0:
                value = near[p.name] ** 2 / far[p.name]
                numbers[p.name] = min(max(value, p.lower), p.upper)
        found.append(numbers)
    return found if found != list(first.group) else None


def in_proportion(hypothesis: Hypothesis, group: Sequence[Numbers]) -> list[bool]:
    """Return for each column of a group whether its number acts in proportion."""
    flags = [proportional(p) for p in hypothesis.free]
    return flags if len(group) == len(flags) else [all(flags)]


def limits_of(hypothesis: Hypothesis, group: Sequence[Numbers]) -> list[tuple[float, float]]:
    """
    Return how far the coefficient of each column of a group may go.

    Parameters
    ----------
    hypothesis : Hypothesis
        The effect that the columns are changes by.
    group : sequence of mapping
        Numbers that each column was simulated with.

    Returns
    -------
    list of (float, float)
        Any that the bounds of a number allow, where it acts in proportion; others stay near the
        size that was simulated.

    """
    near = (setting('least_factor'), setting('most_factor'))
    flags = in_proportion(hypothesis, group)
    if len(flags) < len(hypothesis.free):
        return [(-math.inf, math.inf) if flag else near for flag in flags]
    return [(0.0 if p.linear else -math.inf, math.inf) if flag else near
            for p, flag in zip(hypothesis.free, flags, strict=True)]


def begin(hypothesis: Hypothesis, group: Sequence[Numbers], coefficients: FloatArray
          ) -> Numbers:
    """Return where the linear problem ends, for numbers that act in proportion; else the start."""
    found = {}
    for place, parameter in enumerate(hypothesis.free):
        numbers = group[place if len(group) > 1 else 0]
        start, neutral = numbers[parameter.name], neutral_of(parameter)
        factor = coefficients[place if len(group) > 1 else 0]
        if neutral is None or neutral == parameter.upper:
            found[parameter.name] = start
            continue
        value = neutral + float(factor) * (start - neutral)
        if parameter.lower >= 0.0 and parameter.name not in NEUTRAL:
            value = start * float(factor)
        found[parameter.name] = min(max(value, parameter.lower), parameter.upper)
    return found
