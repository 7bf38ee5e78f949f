# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether a recording is of the robot that a model is of, by what its wheels and body say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from lg_husky_sim.diagnosis.evidence.evidence import Fit
from lg_husky_sim.diagnosis.sensors.relations import by_names, Relation
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.parameters import Parameters


@dataclass(frozen=True)
class Difference:
    """
    Something in which a robot differs from every robot that a model can be of.

    Parameters
    ----------
    subsystem : str
        As of a finding.
    elements : tuple of str
        Of the linear graph.
    regime, statement : str
    certainty : float
        How many standard deviations it is beyond its tolerance.
    numbers : mapping of str to float
        Parameters that the robot has instead.
    on_ground : bool
        Whether the robot moves as its wheels turn.
    """

    subsystem: str
    elements: tuple[str, ...]
    regime: str
    statement: str
    certainty: float
    numbers: Mapping[str, float] = field(default_factory=dict)
    on_ground: bool = True


def differences(found: Sequence[Relation], parameters: Parameters) -> tuple[Difference, ...]:
    """
    Say in what a robot differs from the model's, before any fit.

    Parameters
    ----------
    found : sequence of Relation
    parameters : Parameters
        Of the model.

    Returns
    -------
    tuple of Difference
    """
    known = by_names(found)
    speed = known.get(('speed', 'wheels', 'pose'))
    if speed is None:
        return ()
    radius, rolls = parameters['wheel_radius'], speed.factor
    off = (abs(rolls.value) - radius) / max(rolls.deviation, 1e-12)
    if max(abs(rolls.low), abs(rolls.high)) < setting('no_ground') * radius:
        return (Difference(
            'traction', ('B_FL', 'B_RL', 'B_FR', 'B_RR'), 'wherever the wheels turn',
            'There is no ground reaction: the wheels turn as commanded and the robot stays where '
            f'it is ({rolls.value:.3f} m per radian where a wheel of {radius:g} m rolls that '
            'far). The wheels are off the ground, or the pose is not that of this robot', abs(off),
            on_ground=False),)
    # One that moves less may slip, which the model can do: a fit has to say what that would take.
    if speed.explained < setting('least_explained') or rolls.value < radius or not rolls.is_off(
            radius, setting('other_radius') * radius):
        return ()
    return (Difference(
        'traction', (), 'wherever the wheels turn',
        f'its wheels roll {rolls.value:.3f} m ({rolls.low:.3f} to {rolls.high:.3f}) per radian '
        f'where those of the model roll {radius:.3f} m', abs(off),
        {'wheel_radius': rolls.value}),)


def impossible(fit: Fit, parameters: Parameters) -> tuple[Difference, ...]:
    """
    Say which numbers a fit needs that no robot of the model can have.

    Parameters
    ----------
    fit : Fit
    parameters : Parameters
        Nominal.

    Returns
    -------
    tuple of Difference
        One for all of them, or none.
    """
    most = setting('impossible')
    load = fit.point.structure.robot.factor('kg') * setting('largest_load')
    numbers = fit.point.numbers
    said, certainty = [], 0.0
    for unknown, residual in zip(fit.point.unknowns, fit.point.prior_residuals, strict=True):
        name = unknown.name
        if unknown.kind == 'log':
            continue
        words = f'{name.replace("_", " ")} {numbers[name]:.3g}{_unit(numbers, name)}'
        if unknown.kind == 'model' and abs(residual) > most:
            said.append(f'{words} where the model has {parameters[name]:.3g}')
            certainty = max(certainty, abs(float(residual)))
        elif unknown.kind == 'effect' and numbers.entry(name).unit == 'kg' and (
                numbers[name] > load):
            said.append(f'{words} where it carries at most {load:g} kg')
            certainty = max(certainty, most)
    if not said:
        return ()
    return (Difference(
        'drivetrain', (), 'everywhere',
        'to follow it, the model would need parameters that no such robot has '
        f'({"; ".join(said)})',
        certainty),)


def _unit(parameters: Parameters, name: str) -> str:
    unit = parameters.entry(name).unit
    return '' if unit == '1' else f' {unit}'
