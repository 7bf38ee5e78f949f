# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
A robot that was described with a payload, as a robot with that mass.

What is loaded on it later is then a payload, and may press on the ground or not, whatever mass
described the robot before.
"""

from __future__ import annotations

from dataclasses import replace

from lg_husky_sim.diagnosis.fits import Fit
from lg_husky_sim.husky.parameters import Parameter, Parameters

#: What grows with the weight where contact is dry.
_OF_WEIGHT = ('wheel_damping', 'yaw_damping', 'traction_torque')


def weighed(fit: Fit) -> Fit:
    """
    Return a fit whose payload, if it has one, is a part of its mass and inertia.

    Parameters
    ----------
    fit : Fit

    Returns
    -------
    Fit
        The same robot with the same prediction.
    """
    effect = next((e for e in fit.structure.effects if e.id == 'payload'), None)
    if effect is None:
        return fit
    numbers = fit.parameters
    values = {'mass': numbers['mass'] + numbers['payload_mass'],
              'yaw_inertia': numbers['yaw_inertia'] + numbers['payload_inertia']}
    if effect.shape == 'ground':
        weight = values['mass'] / numbers['mass']
        values |= {name: numbers[name] * weight for name in _OF_WEIGHT if name in numbers}
    gone = {p.name for p in effect.parameters()}
    solution = {name: value for name, value in fit.solution.values.items() if name not in gone}
    return replace(
        fit, structure=replace(fit.structure, effects=tuple(
            e for e in fit.structure.effects if e != effect)),
        parameters=Parameters(tuple(
            _at(entry, values) for entry in numbers.entries if entry.name not in gone)),
        solution=replace(fit.solution, values={
            **solution, **{name: value for name, value in values.items() if name in solution}}))


def centred(nominal: Parameters, fit: Fit) -> Parameters:
    """Return nominal numbers with those of the weight as a fit has them."""
    return nominal.with_entries(*(
        _at(nominal.entry(name), fit.parameters)
        for name in ('mass', 'yaw_inertia', *_OF_WEIGHT) if name in nominal))


def _at(entry: Parameter, values: dict[str, float] | Parameters) -> Parameter:
    if entry.name not in values:
        return entry
    value = values[entry.name]
    return replace(entry, value=value, low=None, high=None, lower=min(entry.lower, value),
                   upper=max(entry.upper, value))
