# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Which joint is a wheel, and on which side."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
import math
import re

from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray

LEFT_TOKENS = frozenset({'l', 'fl', 'rl', 'bl', 'ml', 'lf', 'lr', 'lb'})
RIGHT_TOKENS = frozenset({'r', 'fr', 'rr', 'br', 'mr', 'rf', 'rb'})
NOT_DRIVEN = ('caster', 'steer', 'arm', 'gripper', 'finger', 'flipper')
NAMELESS = {2: ((0,), (1,)), 4: ((0, 2), (1, 3))}
"""Left and right places without names: left, right; or front then rear, each left, right."""

Sides = tuple[tuple[int, ...], tuple[int, ...]]


def wheel_sides(names: Sequence[str], count: int) -> Sides | None:
    """
    Find the wheels of each side in a joint state.

    Parameters
    ----------
    names : sequence of str
        Joint names in any order, such as ``front_left_wheel`` or ``rear_right_wheel_joint``.
    count : int
        Number of values, used where there are no names: 2 are left and right; 4 are front left,
        front right, rear left, rear right.

    Returns
    -------
    tuple of two tuples of int, or None
        Places of the left and of the right wheels; None if one side has none.
    """
    return _sides(tuple(names), count)


@lru_cache(maxsize=256)
def _sides(names: tuple[str, ...], count: int) -> Sides | None:
    if not names:
        return NAMELESS.get(count)
    driven = [(place, name.lower()) for place, name in enumerate(names)
              if not any(word in name.lower() for word in NOT_DRIVEN)]
    if any('wheel' in name for _, name in driven):
        driven = [(place, name) for place, name in driven if 'wheel' in name]
    left = tuple(place for place, name in driven if _side(name) == 'left')
    right = tuple(place for place, name in driven if _side(name) == 'right')
    return (left, right) if left and right else None


def side_means(values: Sequence[float] | FloatArray, sides: Sides) -> tuple[float, float]:
    """
    Average front and rear of each side; NaN values are left out.

    Parameters
    ----------
    values : sequence of float
        One value a joint; too short a sequence counts as missing.
    sides : tuple
        As `wheel_sides` returns it.

    Returns
    -------
    tuple of float
        Left and right; NaN where no value is there.
    """
    count = len(values)
    if not count:
        return math.nan, math.nan
    means = []
    for places in sides:
        there = [value for value in (float(values[p]) for p in places if p < count)
                 if math.isfinite(value)]
        means.append(sum(there) / len(there) if there else math.nan)
    return means[0], means[1]


def rates_from_angles(
    times: FloatArray, angles: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """
    Derive wheel rates from wheel angles.

    Parameters
    ----------
    times : numpy.ndarray, shape (n,)
        Stamps [s], increasing.
    angles : numpy.ndarray, shape (n, 2)
        Wheel angles [rad]; jumps of a count that wraps at ±pi are taken out.

    Returns
    -------
    times : numpy.ndarray, shape (n - 1,)
        Middles of the intervals [s], for a difference is the mean rate over its interval.
    rates : numpy.ndarray, shape (n - 1, 2)
        Wheel rates [rad/s].
    """
    steps = np.diff(times)
    rates: NDArray[np.float64] = np.diff(unwrapped(angles), axis=0) / steps[:, None]
    return times[:-1] + 0.5 * steps, rates


def unwrapped(angles: FloatArray) -> FloatArray:
    """
    Take out the jumps of angles kept within ±pi; others are returned as they are.

    Parameters
    ----------
    angles : numpy.ndarray, shape (n, k)
        Angles [rad].

    Returns
    -------
    numpy.ndarray, shape (n, k)
    """
    wraps = (angles.size > 0 and float(np.max(np.abs(angles))) <= np.pi + 1e-6
             and bool(np.any(np.abs(np.diff(angles, axis=0)) > np.pi)))
    result: FloatArray = np.unwrap(angles, axis=0) if wraps else angles
    return result


def _side(name: str) -> str:
    """Return 'left', 'right' or an empty string."""
    tokens = set(re.split(r'[^a-z0-9]+', name))
    left = 'left' in name or bool(tokens & LEFT_TOKENS)
    right = 'right' in name or bool(tokens & RIGHT_TOKENS)
    if left == right:
        return ''
    return 'left' if left else 'right'
