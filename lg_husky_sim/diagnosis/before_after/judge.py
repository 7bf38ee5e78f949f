# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Which differences are beyond chance, by quadratics first and where these are renewed after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

from lg_husky_sim.diagnosis.before_after.evidence import Evidence, Solution
from lg_husky_sim.diagnosis.before_after.expansion import Expansion
import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc


class Weighed(Protocol):
    """What has a gain [nats] and a chance."""

    @property
    def gain(self) -> float: ...
    @property
    def chance(self) -> float: ...


@dataclass(frozen=True, eq=False)
class Claim:
    """
    That some parameters differ after.

    Parameters
    ----------
    changed : numpy.ndarray of int
        Their indices.
    tries : int
        Claims of which this is one.
    solution : Solution
        By quadratics about the sets' fits.
    gain : float
        Log evidence over that of no change [nats].
    chance : float
        Of such a shift, by this or any other claim, on a robot that has not changed.
    """

    changed: NDArray[np.intp]
    tries: int
    solution: Solution
    gain: float
    chance: float


@dataclass(frozen=True, eq=False)
class Judge:
    """
    Weighs claims.

    Parameters
    ----------
    evidence, common : Evidence
        By quadratics about the sets' fits, and about what fits all recordings best.
    expansion : Expansion
        Finds what a claim, or no change, makes likeliest.
    freedom : float
        Degrees of freedom of the deviations from recording to recording.
    numbers : mapping of str to float
        ``decision`` of the settings.
    """

    evidence: Evidence
    common: Evidence
    expansion: Expansion
    freedom: float
    numbers: Mapping[str, float]

    def claim(self, changed: NDArray[np.intp], tries: int) -> Claim:
        """Return the claim that these parameters differ, by quadratics."""
        solved = self.evidence.solve(changed)
        return self._less(Claim(changed, tries, solved, solved.evidence - self._nothing, 1.0), 0.0)

    def checked(self, claims: Sequence[Claim]) -> list[Claim]:
        """
        Return claims with what holds of their gains.

        Two fits that end on different summits look like a change. A claim beyond chance that may
        be the best holds if it is so about the common fit too, where there is one summit. As that
        may be far from both sets, it else gains no more than its evidence, about what it makes
        likeliest, has over that of no change, about what no change makes likeliest.

        Parameters
        ----------
        claims : sequence of Claim

        Returns
        -------
        list of Claim
            In the same order.
        """
        found = list(claims)
        best = 0.0
        for k in sorted(range(len(claims)), key=lambda k: -claims[k].gain):
            one = claims[k]
            if not is_beyond_chance(one, self.numbers):
                continue
            found[k] = self.about_nothing(one)
            if one.gain > best - max(self.numbers['tie'], self.numbers['near'] * best):
                if not self._holds_about_the_common_fit(one):
                    held = self.expansion.evidence(self.evidence, one.changed) - self._renewed
                    found[k] = self._less(one, one.gain - held)
                best = max(best, found[k].gain)
        return found

    def about_nothing(self, one: Claim) -> Claim:
        """Return a claim over no change about what that makes likeliest."""
        return self._less(one, self._renewed - self._nothing) if is_beyond_chance(
            one, self.numbers) else one

    def _holds_about_the_common_fit(self, one: Claim) -> bool:
        chance = one.tries * chance_of(self.common.solve(one.changed), self.freedom)
        return chance < self.numbers['false_alarm_rate']

    def _less(self, one: Claim, less: float) -> Claim:
        less = max(less, 0.0)
        return replace(one, gain=one.gain - less, chance=min(
            1.0, one.tries * chance_of(one.solution, self.freedom, less)))

    @cached_property
    def _nothing(self) -> float:
        return self.evidence.solve(np.zeros(0, dtype=np.intp)).evidence

    @cached_property
    def _renewed(self) -> float:
        return self.expansion.evidence(self.evidence, np.zeros(0, dtype=np.intp))


def is_beyond_chance(one: Weighed, numbers: Mapping[str, float]) -> bool:
    """Return whether something gains, by more than chance gives at the false-alarm rate."""
    return one.gain > 0.0 and one.chance < numbers['false_alarm_rate']


def chance_of(solved: Solution, freedom: float, less: float = 0.0) -> float:
    """
    Return how probable so large a shift is where nothing has changed.

    The deviations from recording to recording are themselves estimated, so that the shift d of k
    parameters with covariance C is judged by Fisher's distribution::

        P(F(k, freedom) > (d' C^-1 d - 2 less) / k)

    Parameters
    ----------
    solved : Solution
    freedom : float
        Degrees of freedom of the deviations.
    less : float
        What the expansions say too much [nats].

    Returns
    -------
    float
    """
    size = solved.shift.size
    square = float(solved.shift @ np.linalg.solve(solved.covariance, solved.shift)) - 2.0 * less
    return float(fdtrc(size, freedom, square / size))
