# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Sizes that no robot has together: centimetres, grams and slips that lie within all bounds.

Each check is a ratio of parameters with a least or a largest value in ``config/parameters.yaml``.
A robot that is meant to be so gets a bound of its own, as for a single value.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cache

from lg_husky_sim.errors import ParameterError
from lg_husky_sim.settings import numbers


@dataclass(frozen=True)
class _Ratio:
    # A ratio of parameters, with the names of the least and the largest value that are allowed.
    formula: str
    unit: str
    names: tuple[str, ...]
    value: Callable[..., float]
    least: str
    most: str


_RATIOS = (
    _Ratio('wheel_radius / track', '', ('wheel_radius', 'track'),
           lambda radius, track: radius / track, '', 'radius_most'),
    _Ratio('yaw_inertia / (mass (track² + wheelbase²))', '',
           ('yaw_inertia', 'mass', 'track', 'wheelbase'),
           lambda inertia, mass, track, base: inertia / (mass * (track ** 2 + base ** 2)),
           'inertia_least', 'inertia_most'),
    _Ratio('mass / (track wheelbase wheel_radius)', ' kg/m³',
           ('mass', 'track', 'wheelbase', 'wheel_radius'),
           lambda mass, track, base, radius: mass / (track * base * radius),
           'density_least', 'density_most'))


@cache
def _limits() -> Mapping[str, float]:
    return numbers('parameters.yaml', 'lg_husky_sim/parameters/1')


def check_together(values: Mapping[str, float], units: Mapping[str, str],
                   given: Collection[str], bounded: Collection[str]) -> None:
    """
    Refuse sizes that each may be right, but not together.

    Parameters
    ----------
    values : mapping of str to float
        Parameters of a robot, all positive.
    units : mapping of str to str
        Their units.
    given : collection of str
        Names of those that a person gives; what holds none of them is not looked at.
    bounded : collection of str
        Names of those that have bounds of their own; what holds one of them is right.

    Raises
    ------
    ParameterError
        For the first ratio that is beyond what it may be.

    """
    limits = _limits()
    for one in _RATIOS:
        if set(one.names).isdisjoint(given) or not set(one.names).isdisjoint(bounded):
            continue
        ratio = one.value(*(values[name] for name in one.names))
        least, most = limits.get(one.least, 0.0), limits[one.most]
        if not least <= ratio <= most:
            allowed = f'above {most:g}' if ratio > most else f'below {least:g}'
            told = [f'{name} = {values[name]:g} {units[name]}' for name in one.names]
            raise ParameterError(
                f'{", ".join(told[:-1])} and {told[-1]} are no robot together: {one.formula} = '
                f'{ratio:.3g}{one.unit} is {allowed}{one.unit}; write them in SI units (m, kg), '
                'or if they are right, give one of them a bound of its own')
