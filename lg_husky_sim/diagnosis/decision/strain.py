# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Recalibrated parameters that are beyond what was assumed of them before the fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TYPE_CHECKING

from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.reporting.words import digits_apart, number
from scipy.special import ndtr, ndtri

if TYPE_CHECKING:
    from lg_husky_sim.diagnosis.evidence.evidence import Fit


@dataclass(frozen=True)
class Strained:
    """
    A parameter that a fit put outside the 95 % interval of its prior, or at a bound.

    Parameters
    ----------
    name, unit : str
    nominal, value : float
        Before the fit, and after it [unit].
    least, most : float
        95 % interval of the prior, as factors of the nominal value.
    deviations : float
        Distance from nominal in standard deviations of the prior.
    at_bound : bool
        Whether it ended at a bound of the parameter.

    """

    name: str
    unit: str
    nominal: float
    value: float
    least: float
    most: float
    deviations: float
    at_bound: bool = False

    @property
    def factor(self) -> float:
        """Return the value over the nominal one."""
        return self.value / self.nominal

    @property
    def words(self) -> str:
        """Name, factor and tolerance, such as ``mass ×1.21 (tolerance ×0.907 to ×1.1)``."""
        bound = ', at its bound' if self.at_bound else ''
        digits = max(digits_apart(1.0, self.factor, self.factor),
                     digits_apart(1.0, self.least, self.most))
        factor, least, most = (number(one, digits)
                               for one in (self.factor, self.least, self.most))
        return (f'{self.name.replace("_", " ")} ×{factor} (tolerance ×{least} to ×{most}'
                f'{bound})')

    def data(self) -> dict[str, Any]:
        """Return it as plain data for JSON."""
        return {'name': self.name, 'unit': self.unit, 'nominal': self.nominal,
                'value': self.value, 'factor': self.factor,
                'tolerance_factors': [self.least, self.most],
                'prior_deviations': self.deviations, 'at_bound': self.at_bound}


def strained(fit: Fit) -> tuple[Strained, ...]:
    """
    Return the parameters of the robot that a fit puts beyond their tolerances, worst first.

    Parameters
    ----------
    fit : Fit
        Its priors are those of the recalibration: the tolerances of the model.

    Returns
    -------
    tuple of Strained
        Outside the central 95 % of the prior, or at a bound. None where a robot of these
        tolerances may well be so: of k parameters one is outside with a probability of up to
        0.05 k, so that the worst must be outside ``1 - 0.05/k`` (Bonferroni) or at a bound.

    """
    found = []
    point, beyond = fit.point, setting('two_sided')
    count = sum(one.kind == 'model' for one in point.unknowns)
    worst = -float(ndtri(ndtr(-beyond) / max(count, 1)))
    for unknown, place, distance in zip(point.unknowns, point.places.tolist(),
                                        point.prior_residuals.tolist(), strict=True):
        bound = min(place - unknown.lower, unknown.upper - place) < 1e-6
        if unknown.kind != 'model' or not (abs(distance) > beyond or bound):
            continue
        nominal = unknown.value(unknown.centre)
        least, most = (unknown.value(unknown.centre + sign * beyond * unknown.deviation) / nominal
                       for sign in (-1.0, 1.0))
        found.append(Strained(unknown.name, point.numbers.entry(unknown.name).unit, nominal,
                              unknown.value(place), least, most, distance, bound))
    if not any(one.at_bound or abs(one.deviations) > worst for one in found):
        return ()
    return tuple(sorted(found, key=lambda one: -abs(one.deviations)))


def relieves(without: Fit, within: Fit) -> bool:
    """
    Return whether a robot that its tolerances do not allow is one that they do, with an effect.

    What models and logs are always off by explains little of the readings, and so does an effect
    that the robot's numbers have taken the place of: but these leave their tolerances by it.

    Parameters
    ----------
    without, within : Fit
        Without the effect and with it.

    """
    return bool(strained(without)) and not strained(within)


def implausible_words(found: Sequence[Strained], added: bool) -> tuple[str, ...]:
    """
    Return the sentence on implausible parameters of the model that is the answer, or none.

    Parameters
    ----------
    found : sequence of Strained
        What strains the recalibrated model alone, and no longer with the finding, speaks for the
        finding and is no warning.
    added : bool
        Whether a finding was added to the recalibrated model.

    Returns
    -------
    tuple of str

    """
    if not found:
        return ()
    which = 'the recalibrated model with the finding' if added else 'the recalibrated model'
    return (f'{which} is implausible beside its nominal: '
            f'{", ".join(one.words for one in found)}; either the model is not one of this '
            'robot, or these numbers stand for physics that it lacks',)
