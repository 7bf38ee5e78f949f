# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a further effect gains where the laws of those that were found may be off.

The form of no law is exact: a dead band that is soft leaves something that looks like another
effect. With the readings c that the effects found add to what is simulated without them, whitened,
their laws may be off by::

    c (t) sum of a_qk hat_k(q(t)),   a_qk from a normal distribution of deviation s

at each of the quantities q that a law may depend on: speeds and their senses, accelerations,
currents, time. So the innovations e have the covariance ``I + s^2 M M'`` with these columns M, and
of what a further effect gains by the change d of the readings that it makes, there is left::

    (d' V e)^2 / (d' V d)  over  (d' e)^2 / (d' d),   V = (I + s^2 M M')^-1

where the numbers of the robot are projected out of all of them. Whatever else a law may be off by:
a part b of the change that it makes, root mean square, gains b^2 of what all of the change gains
if innovations are normal, which is no further effect. Errors of sensors are exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from lg_husky_sim.diagnosis.evidence import student
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

#: Quantities that a law may depend on otherwise than it says.
ARGUMENTS = ('forward', 'yaw', 'acceleration', 'time', *(
    f'{name}_{side}' for name in (
        'wheel_rate', 'sense_wheel_rate', 'wheel_acceleration', 'driving_current')
    for side in ('left', 'right')))


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
        exact = [h for h in self.found if h.effect.kind.subsystem is Subsystem.SENSOR]
        if len(exact) == len(self.found) or not others:
            return list(gains)
        point = with_effects(self.plain, base.point, exact)
        try:
            without = evidence.residuals(evidence.predict(point))
        except LgHuskyError:
            # It runs away without them: there is nothing that they could be a part of.
            return list(gains)
        made = without - base.whitened
        columns = setting('law_off') * made[:, None] * _shapes(evidence, base)
        projection = Projection(base)
        whole = max(student.cost(without) - student.cost(base.whitened), 0.0)
        form = setting('form_off') ** 2 * whole
        return [_part_left(projection, base.whitened - other.whitened, columns) * gain - form
                for other, gain in zip(others, gains, strict=True)]


def _shapes(evidence: Evidence, base: Fit) -> FloatArray:
    # The hat functions of the quantities at the time of each innovation, shape (n, k).
    known = quantities(evidence, evidence.motions(base.point, True))
    count, found = int(setting('law_knots')), []
    for name in ARGUMENTS:
        pooled = np.concatenate([one[name] for one in known])
        low, high = float(np.min(pooled)), float(np.max(pooled))
        found.append(np.concatenate([hats(np.interp(
            whitener.frame.times[whitener.frame.order], probe_times(whitener.frame.drive),
            one[name]), low, high, count)
            for one, whitener in zip(known, evidence.whiteners, strict=True)]))
    return np.hstack(found)


def _part_left(projection: Projection, change: FloatArray, columns: FloatArray) -> float:
    normal, slope = projection.problem(np.column_stack([change, columns]))
    if slope[0] <= 0.0 or normal[0, 0] <= 0.0:
        return 1.0
    inner = normal[1:, 1:] + np.eye(columns.shape[1])
    taken = np.linalg.solve(inner, normal[1:, 0])
    own, left = normal[0, 0] - normal[0, 1:] @ taken, max(slope[0] - slope[1:] @ taken, 0.0)
    return float(min(left ** 2 / own / (slope[0] ** 2 / normal[0, 0]), 1.0))
