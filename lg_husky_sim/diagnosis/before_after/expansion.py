# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The likelihood of recordings as quadratics, about the sets' fits or about a hypothesis' own mode.

With residuals e and their derivatives J at z, whitened, a recording's negative log likelihood is::

    |e + J (x - z)|^2 / 2 = x' J'J x / 2 - (J'J z - J'e)' x + |e - J z|^2 / 2
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

from lg_husky_sim.diagnosis.before_after.drives import Drive
from lg_husky_sim.diagnosis.before_after.evidence import Evidence, Quadratic
from lg_husky_sim.diagnosis.before_after.fitting import Prior
from lg_husky_sim.diagnosis.before_after.prediction import Base, jacobian, residual
from lg_husky_sim.diagnosis.before_after.whitening import Noise
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray


def quadratic(base: Base, drive: Drive, noise: Noise, z: FloatArray, prior: Prior, after: bool
              ) -> Quadratic:
    """Return the quadratic of a drive about a point on the scale of the estimates."""
    rows, columns = jacobian(base, drive, z, prior.free)
    e, j = noise.white(rows), noise.white(columns)
    curvature, slope = j.T @ j, j.T @ e
    return Quadratic(drive.recording, after, curvature, curvature @ z - slope,
                     0.5 * float(e @ e) - float(z @ slope) + 0.5 * float(z @ curvature @ z))


@dataclass(frozen=True, eq=False)
class Expansion:
    """
    Finds what a hypothesis makes likeliest, and expands the likelihood about that.

    Parameters
    ----------
    base : Base
    prior : Prior
    noise : Noise
    drives : sequence of Drive
        Of both sets.
    fits : tuple of numpy.ndarray, shape (n,)
        Before, after and of all recordings, on the scale of the estimates.
    pool : ThreadPoolExecutor
    """

    base: Base
    prior: Prior
    noise: Noise
    drives: Sequence[Drive]
    fits: tuple[FloatArray, FloatArray, FloatArray]
    pool: ThreadPoolExecutor

    def evidence(self, linear: Evidence, changed: NDArray[np.intp]) -> float:
        """
        Return the log evidence of a hypothesis, at the end of damped Newton steps.

        They begin where the linear solution, or one of the sets' fits, is likeliest. What is
        returned is sure: about the point that was reached, be it the mode or not.

        Parameters
        ----------
        linear : Evidence
            By quadratics about the sets' fits.
        changed : numpy.ndarray of int
            Which parameters differ after.

        Returns
        -------
        float
            [nats]
        """
        index = np.flatnonzero(self.prior.free)
        old, new, common = (z[index] for z in self.fits)
        shift = (new - old)[changed]
        at, modes = linear.modes(changed)
        begins = [(at, [self._inside(place) for place in modes])]
        for shared, moved in ((old, 0.0 * shift), (new, -shift), (common, -0.5 * shift)):
            at = np.concatenate([shared, shift])
            at[changed] += moved
            begins.append((at, [linear.level(at, changed, q.after) for q in linear.quadratics]))
        at, places = min(begins, key=lambda one: self._energy(linear, changed, *one))
        energy = self._energy(linear, changed, at, places)
        best = -float(np.inf)
        for _ in range(int(self.base.settings.fit['renewals'])):
            near = self._about(linear, places)
            best = max(best, near.evidence_at(changed, at, places))
            aim, modes = near.modes(changed)
            reached, share = energy, 1.0
            while share > self.base.settings.fit['least_step']:
                there = at + share * (aim - at)
                near_by = [self._inside(a + share * (b - a)) for a, b in zip(
                    places, modes, strict=True)]
                reached = self._energy(linear, changed, there, near_by)
                if reached < energy:
                    break
                share *= 0.25
            gained = energy - reached
            if not gained > self.base.settings.fit['enough']:
                break
            at, places, energy = there, near_by, reached
        else:
            best = max(best, self._about(linear, places).evidence_at(changed, at, places))
        return best

    def _inside(self, place: FloatArray) -> FloatArray:
        index = np.flatnonzero(self.prior.free)
        lower, upper = self.base.bounds()
        return np.clip(place, lower[index], upper[index])

    def _full(self, place: FloatArray) -> FloatArray:
        z = np.array(self.prior.mean)
        z[self.prior.free] = place
        return z

    def _energy(self, linear: Evidence, changed: NDArray[np.intp], at: FloatArray,
                places: Sequence[FloatArray]) -> float:
        # Negative log posterior by simulation.
        known = dict(zip((q.recording for q in linear.quadratics), places, strict=True))

        def cost(drive: Drive) -> float:
            white = self.noise.white(residual(self.base, drive, self._full(
                known[drive.recording])))
            return 0.5 * float(white @ white)
        total = linear.strain(changed, at, places) + sum(self.pool.map(cost, self.drives))
        return total if np.isfinite(total) else float(np.inf)

    def _about(self, linear: Evidence, places: Sequence[FloatArray]) -> Evidence:
        known = {q.recording: (self._full(place), q.after)
                 for q, place in zip(linear.quadratics, places, strict=True)}

        def one(drive: Drive) -> Quadratic:
            z, after = known[drive.recording]
            return quadratic(self.base, drive, self.noise, z, self.prior, after)
        index = np.flatnonzero(self.prior.free)
        return replace(linear, quadratics=[
            q.among(index) for q in joined(list(self.pool.map(one, self.drives)))])


def joined(parts: Sequence[Quadratic]) -> list[Quadratic]:
    """Return the sums over the stretches of each recording, which share its deviation."""
    found: dict[str, Quadratic] = {}
    for part in parts:
        there = found.get(part.recording)
        found[part.recording] = part if there is None else Quadratic(
            part.recording, part.after, there.curvature + part.curvature,
            there.slope + part.slope, there.cost + part.cost)
    return list(found.values())
