# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Recalibrated parameters that are beyond what was assumed of them before the fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TYPE_CHECKING

from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.reporting.words import number

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
        """The value over the nominal one."""
        return self.value / self.nominal

    @property
    def words(self) -> str:
        """Name, factor and tolerance, such as ``wheel damping ×15 (tolerance ×0.1 to ×11)``."""
        bound = ', at its bound' if self.at_bound else ''
        return (f'{self.name.replace("_", " ")} ×{number(self.factor, 2)} (tolerance '
                f'×{number(self.least, 2)} to ×{number(self.most, 2)}{bound})')

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
        Outside the central 95 % of the prior, or at a bound.
    """
    found = []
    point, beyond = fit.point, setting('two_sided')
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
    return tuple(sorted(found, key=lambda one: -abs(one.deviations)))


def implausible_words(plain: Sequence[Strained], final: Sequence[Strained], added: bool
                      ) -> tuple[str, ...]:
    """
    Return the sentence on implausible parameters, or none.

    Parameters
    ----------
    plain, final : sequence of Strained
        Of the recalibrated model, and of the one with the finding.
    added : bool
        Whether the two models differ.

    Returns
    -------
    tuple of str
    """
    def listed(found: Sequence[Strained]) -> str:
        return ', '.join(one.words for one in found)
    if not plain and not (added and final):
        return ()
    if not plain:
        text = f'the model with the finding is implausible beside its nominal: {listed(final)}'
    else:
        text = f'the recalibrated model is implausible beside its nominal: {listed(plain)}'
        if added:
            text += f'; with the finding: {listed(final)}' if final else (
                '; with the finding, all parameters are within their tolerances')
    return (f'{text}; either the model is not one of this robot, or these numbers stand for '
            'physics that it lacks',)
