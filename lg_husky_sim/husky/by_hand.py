# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Parameters that a person gives: numbers with what is known of them, and bounds that follow.

As in lmfit, a plain number changes the value alone, and what goes with it (bounds, whether it
varies) can be given by name and stays as it was otherwise. Other than there, a value beyond
its bounds is not moved onto the bound: either the bound moves, or the value is refused.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
import math

from lg_husky_sim.errors import ParameterError
from lg_husky_sim.husky.parameters import number_of, Parameter, Parameters
from lg_husky_sim.husky.robot_size import HUSKY, RobotSize, size_of
from lg_husky_sim.husky.together import check_together
from lg_husky_sim.settings import numbers
from lg_husky_sim.yaml_files import shown

BY_HAND = 'set by hand'
"""Source of a parameter whose giver tells none."""

SIZES = ('mass', 'wheel_radius', 'track', 'supply_voltage')
"""What the size of a robot is read from: their bounds are those of robots at large."""

MOST_NAMES = 3
"""So many names are listed; of more, their number is said."""


@dataclass(frozen=True)
class Number:
    """
    A number of a robot with what is known of it; what is left out stays as in the model.

    Parameters
    ----------
    value : float, optional
        In the SI unit of the parameter.
    tolerance : float, optional
        One relative standard deviation: 0.02 where it is known to 2 %, 0 where it is exact.
    lower, upper : float, optional
        Bounds of estimates, in the unit of the parameter.
    source : str, optional
        Where it comes from, such as ``'scales'`` or ``'data sheet'``.
    free : bool, optional
        Whether ``identify`` estimates it unless told otherwise.

    Raises
    ------
    ParameterError
        If something is no finite number, or the tolerance is negative.

    """

    value: float | None = None
    tolerance: float | None = None
    lower: float | None = None
    upper: float | None = None
    source: str = ''
    free: bool | None = None

    def __post_init__(self) -> None:
        """Check each number by itself; the model checks them against each other."""
        for name in ('value', 'tolerance', 'lower', 'upper'):
            given = getattr(self, name)
            if given is not None:
                object.__setattr__(self, name, _finite(name, given))
        if self.tolerance is not None and self.tolerance < 0.0:
            raise ParameterError(f'tolerance = {self.tolerance:g} is negative')
        if not isinstance(self.source, str):
            raise ParameterError(f'source = {shown(self.source)} is not a text')
        if self.free not in (None, True, False):
            raise ParameterError(f'free = {shown(self.free)} is neither True nor False')


def _finite(name: str, value: object, unit: str = '') -> float:
    number = number_of(name, value)
    if not math.isfinite(number):
        raise ParameterError(f'{name} = {number:g}{unit} is not a finite number')
    return number


def bounds_of(nominal: Parameter, value: float, robot: RobotSize = HUSKY,
              given: Number | None = None) -> tuple[float, float]:
    """
    Return the bounds of a value that a person gives.

    Parameters
    ----------
    nominal : Parameter
        Of the robot whose bounds are known.
    value : float
        Of the same parameter of another robot [its unit].
    robot : RobotSize
        The other robot's size, over that of the first.
    given : Number, optional
        Bounds that go before.

    Returns
    -------
    lower, upper : float
        In proportion to the robot; moved where the value is a little beyond.

    Raises
    ------
    ParameterError
        If the value has the wrong sign, or is far beyond the bounds.

    """
    words = f'{nominal.name} = {value:g} {nominal.unit}'
    # A bound of zero is one of sign, and cannot move.
    if value < 0.0 <= nominal.lower or value <= 0.0 < nominal.lower:
        raise ParameterError(f'{words} is {"not positive" if nominal.lower else "negative"}')
    factor = 1.0 if nominal.name in SIZES else robot.factor(nominal.unit)
    lower, upper = factor * nominal.lower, factor * nominal.upper
    reach = setting('reach')
    if given is not None and given.lower is not None:
        lower = given.lower
    elif value < lower:
        if lower > reach * value:
            raise ParameterError(_far(words, 'below its lower', lower, nominal, robot))
        lower = value / reach
    if given is not None and given.upper is not None:
        upper = given.upper
    elif value > upper:
        if value > reach * upper:
            raise ParameterError(_far(words, 'above its upper', upper, nominal, robot))
        upper = value * reach
    return lower, upper


def _far(words: str, side: str, bound: float, nominal: Parameter, robot: RobotSize) -> str:
    # A slip in a size of the robot shows in what is in proportion to it.
    sizes = {} if nominal.name in SIZES else robot.sizes(nominal.unit)
    beside = ' and '.join(f"{size:.3g} times the Husky's {name}" for name, size in sizes.items())
    why = f' (in proportion to {beside})' if robot != HUSKY and beside else ''
    return (f'{words} is {side} bound {bound:.3g}{why} by more than a factor of '
            f'{setting("reach"):g}; if {"all of this" if why else "it"} is right, give it a bound '
            'of its own')


@cache
def _settings() -> Mapping[str, float]:
    return numbers('parameters.yaml', 'lg_husky_sim/parameters/1')


def setting(name: str) -> float:
    """Return one number of ``config/parameters.yaml`` [its unit there]."""
    return _settings()[name]


def with_numbers(parameters: Parameters, own: Collection[str],
                 settings: Mapping[str, float | Number]) -> Parameters:
    """
    Return parameters with what a person gives of them.

    Parameters
    ----------
    parameters : Parameters
        With the values and bounds before.
    own : collection of str
        Names of the robot's own ones: their bounds are in proportion to it and move. Those of
        effects stay.
    settings : mapping of str to float or Number
        Values by name, in the parameter's unit, or numbers with bounds.

    Raises
    ------
    ParameterError
        If a name is unknown, or a number none that the robot can have.

    """
    given = {}
    for name, number in settings.items():
        unit = f' {parameters.entry(name).unit}'
        given[name] = number if isinstance(number, Number) else Number(
            _finite(name, number, unit))
    values = {**parameters, **{name: number.value for name, number in given.items()
                               if number.value is not None}}
    for name in given:
        if name in own:
            bounds_of(parameters.entry(name), values[name], HUSKY, Number(
                lower=values[name], upper=values[name]))
    robot = size_of(values, parameters) if not given.keys().isdisjoint(SIZES) else HUSKY
    found = Parameters(tuple(
        _given(entry, values[entry.name], robot if entry.name in own else None,
               given.get(entry.name)) for entry in parameters.entries))
    check_together(values, {entry.name: entry.unit for entry in parameters.entries}, given,
                   [name for name, one in given.items()
                    if one.lower is not None or one.upper is not None])
    return found


def _given(entry: Parameter, value: float, robot: RobotSize | None, number: Number | None
           ) -> Parameter:
    if number is None:
        if robot is None or robot == HUSKY:
            return entry
        factor = 1.0 if entry.name in SIZES else robot.factor(entry.unit)
        return replace(entry, lower=min(factor * entry.lower, value),
                       upper=max(factor * entry.upper, value))
    if robot is not None:
        lower, upper = bounds_of(entry, value, robot, number)
    else:
        lower = entry.lower if number.lower is None else number.lower
        upper = entry.upper if number.upper is None else number.upper
    same = number.value is None
    return replace(
        entry, value=value, lower=lower, upper=upper,
        tolerance=entry.tolerance if number.tolerance is None else number.tolerance,
        source=number.source or (entry.source if same else BY_HAND),
        free=entry.free if number.free is None else number.free,
        low=entry.low if same else None, high=entry.high if same else None)


def other_robot(one: Parameters, other: Parameters) -> bool:
    """Return whether wheels or track are farther from those of the first than their tolerance."""
    return any(abs(other[name] - one[name]) > setting('other_robot') * one.entry(
        name).tolerance * one[name] for name in ('wheel_radius', 'track'))


def about_of(about: str, before: Parameters, after: Parameters) -> str:
    """
    Return the line that says of a model where it comes from, after numbers are given.

    Parameters
    ----------
    about : str
        Before.
    before, after : Parameters
        Without and with them.

    Returns
    -------
    str
        Of another robot, only its size; otherwise what it was, and what was set by hand.

    """
    new = [e for e, old in zip(after.entries, before.entries, strict=True)
           if (e.value, e.source) != (old.value, old.source)]
    if not _said(new):
        return about
    if other_robot(before, after):
        return (f'robot of {after["mass"]:g} kg, wheel radius {after["wheel_radius"]:g} m, '
                f'track {after["track"]:g} m; {_said(after.entries)}')
    told = _said(before.entries)
    if told and about.endswith(told):
        return about.removesuffix(told) + _said(after.entries)
    return '; '.join(text for text in (about, _said(new)) if text)


def _said(entries: Sequence[Parameter]) -> str:
    names = [e.name for e in entries if e.source == BY_HAND]
    listed = ', '.join(names) if len(names) <= MOST_NAMES else f'{len(names)} parameters'
    return f'{listed} {BY_HAND}' if names else ''
