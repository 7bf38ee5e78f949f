# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Hypotheses that were fitted: their gains, what of these counts, and which of them is best."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
import math

from lg_husky_sim.diagnosis.decision.adoption import chance_of
from lg_husky_sim.diagnosis.evidence.dispersion import accident, dispersion
from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.hypotheses.hypothesis import Hypothesis, negligible, Numbers
from lg_husky_sim.diagnosis.selection.laws import Laws


@dataclass(frozen=True, eq=False)
class Tried:
    """
    A hypothesis that was fitted.

    Parameters
    ----------
    hypothesis : Hypothesis
    fit : Fit
        None goes on from here: see :attr:`light`.
    gain : float
        What it lowers the cost of the base by, under one noise [nats].
    count : int
        Number of readings.

    """

    hypothesis: Hypothesis
    fit: Fit
    gain: float
    count: int

    @property
    def score(self) -> float:
        """Gain less half the logarithm of the number of readings for each number it costs."""
        return self.gain - 0.5 * self.hypothesis.size * math.log(self.count)

    @property
    def light(self) -> Tried:
        """
        Return the same with what others are compared with of its fit, and no more.

        Derivatives are as large as all the rest; of its own numbers, they tell how its gain is
        dispersed.
        """
        own = self.fit.jacobian[:, -len(self.hypothesis.free):]
        return replace(self, fit=replace(self.fit, slopes=(), jacobian=own.copy()))


def numbers_of(tried: Tried) -> Numbers:
    """Return the numbers of a fitted effect by name."""
    values = tried.fit.point.values
    return {p.name: values[p.name] for p in tried.hypothesis.free}


def is_negligible(tried: Tried, jitter: Mapping[str, float]) -> bool:
    """Return whether a fitted effect is :func:`negligible` in a log whose stamps jitter so."""
    return negligible(tried.hypothesis, tried.fit.point.values, jitter)


@dataclass(frozen=True, eq=False)
class Ranking:
    """
    What the gains of fitted hypotheses are worth.

    Parameters
    ----------
    evidence : Evidence
        Drives, and the noise under which the fits were made.
    base : Fit
        Without a further effect.
    laws : Laws or None
        Of what was found before.
    starts : int
        Number of hypotheses and starts that were looked at.

    """

    evidence: Evidence
    base: Fit
    laws: Laws | None
    starts: int

    def ordered(self, tried: Sequence[Tried]) -> list[Tried]:
        """Return fitted hypotheses, best first; negligible ones come last."""
        lost = dict(zip(tried, self._lost(tried), strict=True))
        return sorted(tried, key=lambda t: (is_negligible(t, self.evidence.noise.values),
                                            lost[t] - t.score))

    def chance(self, best: Tried) -> float:
        """Return how likely what counts of such a gain is on a robot that lacks nothing."""
        if is_negligible(best, self.evidence.noise.values):
            return 1.0
        return self._chance_of(best, best.gain - self._lost([best])[0])

    def rough_chance(self, best: Tried) -> float:
        """Return the same of all of a gain: a fit that is not finished may gain far more."""
        return self._chance_of(best, best.gain)

    def _chance_of(self, best: Tried, gain: float) -> float:
        own = best.fit.jacobian[:, -len(best.hypothesis.free):]
        return chance_of(gain, best.hypothesis, self.starts, self.evidence,
                         dispersion(self.evidence, best.fit.whitened, own))

    def _lost(self, tried: Sequence[Tried]) -> list[float]:
        # What of its gain each has by an accident, or by what the laws of others are off by.
        gains = [t.gain for t in tried]
        left = gains if self.laws is None else self.laws.gains_left(
            self.evidence, self.base, [t.fit for t in tried], gains)
        return [accident(self.evidence, self.base.whitened, t.fit.whitened) + t.gain - own
                for t, own in zip(tried, left, strict=True)]
