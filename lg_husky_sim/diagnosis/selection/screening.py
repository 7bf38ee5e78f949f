# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
A first look at every hypothesis: one simulation a start, the numbers of the base let free.

With the whitened innovations e of a fit, its Jacobian J and the change c that an effect makes of
the simulated readings, the gain of ``c`` is what the linear problem ``e = J d + c s`` with the
priors of the base loses in cost.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.hypotheses.hypothesis import (
    Hypothesis,
    neutral_of,
    Numbers,
    proportional,
)
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.signals import FloatArray
import numpy as np


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
        Linear estimate of what it lowers the cost by [nats].
    columns : numpy.ndarray, shape (n, m)
        Whitened changes, the base projected out.
    """

    hypothesis: Hypothesis
    numbers: Numbers
    gain: float
    columns: FloatArray


class Projection:
    """
    What is left of whitened columns when the numbers of the base may move.

    Parameters
    ----------
    fit : Fit
        Of the base.
    """

    def __init__(self, fit: Fit) -> None:
        nu = setting('student')
        self._root = np.sqrt((nu + 1.0) / (nu + fit.whitened ** 2))
        rows = fit.jacobian * self._root[:, None]
        stacked = np.vstack([rows, np.diag(fit.point.weights)])
        self._base, _ = np.linalg.qr(stacked)
        self._count = fit.whitened.size
        target = np.concatenate([self._root * fit.whitened, -fit.point.strain])
        self.target: FloatArray = target - self._base @ (self._base.T @ target)

    def apply(self, columns: FloatArray) -> FloatArray:
        """Return columns with the base projected out, priors as further rows."""
        stacked = np.zeros((self._base.shape[0], columns.shape[1]))
        stacked[:self._count] = columns * self._root[:, None]
        left: FloatArray = stacked - self._base @ (self._base.T @ stacked)
        return left

    def gain(self, left: FloatArray, free: Sequence[bool]) -> tuple[float, FloatArray]:
        """
        Return the gain of projected columns [nats] and their coefficients.

        Parameters
        ----------
        left : numpy.ndarray, shape (n, m)
        free : sequence of bool
            Whether a coefficient may have any value; others stay near the size that was
            simulated, since such numbers do not act in proportion.
        """
        normal = left.T @ left
        slope = left.T @ self.target
        size = np.sqrt(np.diag(normal))
        if not np.all(np.isfinite(size)) or np.any(size <= 1e-9):
            return 0.0, np.zeros(left.shape[1])
        scaled = normal / np.outer(size, size) + 1e-9 * np.eye(size.size)
        coefficients = np.linalg.solve(scaled, slope / size) / size
        low, high = setting('least_factor'), setting('most_factor')
        kept = np.where(np.asarray(free, dtype=np.bool_), coefficients,
                        np.clip(coefficients, low, high))
        return float(kept @ slope - 0.5 * kept @ normal @ kept), kept


def look(evidence: Evidence, fit: Fit, pool: Sequence[Hypothesis]) -> list[Look]:
    """
    Look at every hypothesis once.

    Parameters
    ----------
    evidence : Evidence
    fit : Fit
        Of the base.
    pool : sequence of Hypothesis

    Returns
    -------
    list of Look
        The best start of each, in the order of the linear gain.
    """
    projection = Projection(fit)

    def change(task: tuple[Hypothesis, Numbers]) -> list[FloatArray] | None:
        hypothesis, numbers = task
        try:
            predicted = evidence.predict(hypothesis.point(fit.point, numbers))
        except LgHuskyError:
            return None
        return [a - b for a, b in zip(predicted, fit.predicted, strict=True)]

    tasks = [(h, group) for h in pool for group in h.trials()]
    flat = [(h, numbers) for h, group in tasks for numbers in group]
    changes = iter(list(evidence.pool.map(change, flat)))
    best: dict[str, Look] = {}
    for hypothesis, group in tasks:
        columns = [next(changes) for _ in group]
        if any(c is None or not all(np.all(np.isfinite(p)) for p in c) for c in columns):
            continue
        stacked = [np.column_stack([c[d] for c in columns if c is not None])
                   for d in range(len(evidence.drives))]
        left = projection.apply(evidence.whiten(stacked))
        gain, coefficients = projection.gain(left, in_proportion(hypothesis, group))
        if hypothesis.label not in best or gain > best[hypothesis.label].gain:
            best[hypothesis.label] = Look(
                hypothesis, begin(hypothesis, group, coefficients), gain, left)
    return sorted(best.values(), key=lambda one: -one.gain)


def in_proportion(hypothesis: Hypothesis, group: Sequence[Numbers]) -> list[bool]:
    """Return for each column of a group whether its number acts in proportion."""
    flags = [proportional(p) for p in hypothesis.free]
    return flags if len(group) == len(flags) else [all(flags)]


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
        if parameter.lower >= 0.0 and parameter.name not in ('gyro_factor', 'encoder_factor'):
            value = start * float(factor)
        found[parameter.name] = min(max(value, parameter.lower), parameter.upper)
    return found
