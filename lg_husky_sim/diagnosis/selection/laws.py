# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a further effect gains where the laws of those that were found may be off.

The form of no law is exact: a dead band that is soft leaves something that looks like another
effect. With the readings c that the effects found add to what is simulated without them, whitened,
their laws may be off by::

    c (t) sum of a_qk hat_k(q(t)),   a_qk from a normal distribution of deviation s

at each of the quantities q that a law may depend on: speeds and their senses, accelerations,
currents, time; one of the commands, on what the whole robot does, not on what one side does. What
else they may be off by is a part b of their change at each reading, of any sign. So the
innovations e have the covariance ``I + s^2 M M' + b^2 diag(c^2)`` with these columns M, and of
what a further effect gains by the change d of the readings that it makes, there is left::

    (d' V e)^2 / (d' V d)  over  (d' e)^2 / (d' d),   V = (I + s^2 M M' + b^2 diag(c^2))^-1

where the numbers of the robot are projected out of all of them. Errors of sensors are exact. What
begins at a time or a place may act always, all the same: what it would change elsewhere is one
more column of M, with the deviation 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.evidence.observation import probe_times
from lg_husky_sim.diagnosis.evidence.point import Point
from lg_husky_sim.diagnosis.hypotheses.hat_functions import hats
from lg_husky_sim.diagnosis.hypotheses.hypothesis import Hypothesis, with_effects
from lg_husky_sim.diagnosis.hypotheses.smooth_efforts import quantities
from lg_husky_sim.diagnosis.selection.screening import Projection
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.husky.effects import Subsystem
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Quantities that any law may depend on otherwise than it says,
WHOLE = ('forward', 'yaw', 'acceleration', 'time')
#: and those of the sides, that one of the commands does not depend on.
SIDES = tuple(f'{name}_{side}' for name in (
    'wheel_rate', 'sense_wheel_rate', 'wheel_acceleration', 'driving_current')
    for side in ('left', 'right'))


@dataclass(frozen=True, eq=False)
class Laws:
    """
    The laws of the effects that were found.

    Parameters
    ----------
    plain : Point
        The model without effects.
    found : sequence of Hypothesis
        In the order of adoption; their numbers come last.

    """

    plain: Point
    found: Sequence[Hypothesis]

    def gains_left(self, evidence: Evidence, base: Fit, others: Sequence[Fit],
                   gains: Sequence[float]) -> list[float]:
        """
        Return what each further effect gains where these laws may be off.

        Parameters
        ----------
        evidence : Evidence
            Drives, and the noise under which the fits were made.
        base : Fit
            With what was found.
        others : sequence of Fit
            With one more effect each.
        gains : sequence of float
            What each gains if they are exact [nats].

        Returns
        -------
        list of float
            [nats]

        """
        parts = {h.effect.kind.subsystem for h in self.found} - {Subsystem.SENSOR}
        if not parts or not others:
            return list(gains)
        point = with_effects(self.plain, base.point, [
            h for h in self.found if h.effect.kind.subsystem is Subsystem.SENSOR])
        try:
            without = evidence.residuals(evidence.predict(point))
        except LgHuskyError:
            # It runs away without them: there is nothing that they could be a part of.
            return list(gains)
        made = without - base.whitened
        columns = np.hstack([self._elsewhere(evidence, base), setting('law_off') * made[
            :, None] * _shapes(evidence, base, WHOLE if parts == {Subsystem.COMMAND} else (
                *WHOLE, *SIDES))])
        trust = 1.0 / np.sqrt(1.0 + (setting('form_off') * made) ** 2)
        exact, loose = Projection(base), Projection(replace(
            base, whitened=trust * base.whitened, jacobian=trust[:, None] * base.jacobian))
        columns *= trust[:, None]

        def left(change: FloatArray) -> float:
            # The part of its gain.
            normal, slope = exact.problem(change[:, None])
            if slope[0] <= 0.0 or normal[0, 0] <= 0.0:
                return 1.0
            return min(_gain(loose, trust * change, columns) / (
                float(slope[0]) ** 2 / float(normal[0, 0])), 1.0)
        return [left(base.whitened - other.whitened) * gain
                for other, gain in zip(others, gains, strict=True)]

    def _elsewhere(self, evidence: Evidence, base: Fit) -> FloatArray:
        # What those that begin somewhere would do if they acted always, shape (n, 0 or 1).
        if all(h.onset is None or h.effect.kind.needs_onset for h in self.found):
            return np.zeros((base.whitened.size, 0))
        always = with_effects(self.plain, base.point, [
            h if h.effect.kind.needs_onset else h.at(None) for h in self.found])
        try:
            return np.asarray(
                base.whitened - evidence.residuals(evidence.predict(always)))[:, None]
        except LgHuskyError:
            # It runs away where it acts always: it does not.
            return np.zeros((base.whitened.size, 0))


def _shapes(evidence: Evidence, base: Fit, names: Sequence[str]) -> FloatArray:
    # The hat functions of some quantities at the time of each innovation, shape (n, k).
    known = quantities(evidence, evidence.motions(base.point, True))
    count, found = int(setting('law_knots')), []
    for name in names:
        pooled = np.concatenate([one[name] for one in known])
        low, high = float(np.min(pooled)), float(np.max(pooled))
        found.append(np.concatenate([hats(np.interp(
            whitener.frame.times[whitener.frame.order], probe_times(whitener.frame.drive),
            one[name]), low, high, count)
            for one, whitener in zip(known, evidence.whiteners, strict=True)]))
    return np.hstack(found)


def _gain(projection: Projection, change: FloatArray, columns: FloatArray) -> float:
    # Twice what a change gains beside columns of unit deviation [nats].
    normal, slope = projection.problem(np.column_stack([change, columns]))
    taken = np.linalg.solve(normal[1:, 1:] + np.eye(columns.shape[1]), normal[1:, 0])
    own, left = normal[0, 0] - normal[0, 1:] @ taken, max(slope[0] - slope[1:] @ taken, 0.0)
    return float(left ** 2 / own)
