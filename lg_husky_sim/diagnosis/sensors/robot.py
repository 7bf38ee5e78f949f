# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether a recording is of the robot that a model is of, by what its wheels and body say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from lg_husky_sim.diagnosis.evidence.evidence import Fit
from lg_husky_sim.diagnosis.sensors.faults import Fault, unit_of
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
    comparable : bool
        Whether another base may be fitted to it: its wheels move it, and its streams are of one
        robot.

    """

    subsystem: str
    elements: tuple[str, ...]
    regime: str
    statement: str
    certainty: float
    numbers: Mapping[str, float] = field(default_factory=dict)
    comparable: bool = True


def differences(found: Sequence[Relation], parameters: Parameters) -> tuple[Difference, ...]:
    """
    Say in what a robot differs from the model's, before any fit.

    Parameters
    ----------
    found : sequence of Relation
        Comparisons of the streams with each other; speed of wheels and pose tells most.
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
    sides = [one.factor for key, one in known.items() if key[1] in ('left wheels', 'right wheels')]
    if speed.explained < setting('least_explained') and sum(
            max(abs(one.low), abs(one.high)) for one in (sides or [rolls])) < (
                setting('no_ground') * radius):
        return (Difference(
            'traction', ('B_FL', 'B_RL', 'B_FR', 'B_RR'), 'wherever the wheels turn',
            'There is no ground reaction: the wheels turn as commanded and the robot stays where '
            f'it is ({rolls.value:.3f} m per radian where a wheel of {radius:g} m rolls that '
            'far). The wheels are off the ground, or the pose is not that of this robot', abs(off),
            comparable=False),)
    if rolls.value <= 0.0:
        return ()  # the wrong sign is a fault of a sensor
    unit = unit_of(rolls.value / radius)
    if unit is not None and speed.explained > setting('proportional'):
        return (Difference(
            'sensor', ('joint_states',), 'wherever the wheels turn',
            f'The wheels roll {rolls.value:.2g} m per radian where those of the model roll '
            f'{radius:.3g} m: their rates are in {unit} (a JointState has them in rad/s), or the '
            'wheel radius of the model is wrong',
            abs(off), comparable=False),)
    # One that moves less may slip, which the model can do: a fit has to say what that would take.
    # But what slips by a resistance does not do so in proportion.
    smaller = rolls.value < (1.0 - setting('largest_slip')) * radius and (
        speed.explained > setting('proportional'))
    larger = rolls.value >= radius and rolls.is_off(radius, setting('other_radius') * radius)
    if speed.explained < setting('least_explained') or not (smaller or larger):
        return ()
    return (Difference(
        'traction', (), 'wherever the wheels turn',
        f'its wheels roll {rolls.value:.3f} m ({rolls.low:.3f} to {rolls.high:.3f}) per radian '
        f'where those of the model roll {radius:.3f} m', abs(off),
        {'wheel_radius': rolls.value}),)


def misread(found: Sequence[Fault]) -> tuple[Difference, ...]:
    """Return the faults of sensors with which no model can be compared, as differences."""
    elements = {'wheels': 'joint_states', 'pose': 'tf'}
    return tuple(Difference(
        'sensor', (elements.get(one.stream, one.stream),), 'everywhere', one.statement,
        one.certainty, comparable=False) for one in found if one.effect is None and one.stream)


def impossible(fit: Fit, parameters: Parameters) -> tuple[Difference, ...]:
    """
    Say which numbers a fit needs that no robot of the model can have.

    Parameters
    ----------
    fit : Fit
        Of the model, perhaps with effects, to the recordings.
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
