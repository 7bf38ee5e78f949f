# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Which joint is a wheel, and on which side."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
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

WRAP = math.pi + 1e-6
"""No angle that wraps is larger [rad]."""

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


def chosen_sides(names: Sequence[str], joints: tuple[tuple[str, ...], tuple[str, ...]]
                 ) -> Sides | None:
    """Return the places of joints chosen for each side; None if one side has none."""
    left, right = (tuple(place for place, name in enumerate(names) if name in side)
                   for side in joints)
    return (left, right) if left and right else None


@lru_cache(maxsize=256)
def _sides(names: tuple[str, ...], count: int) -> Sides | None:
    if not names:
        return NAMELESS.get(count)
    driven = [(place, name.lower()) for place, name in enumerate(names) if _driven(name)]
    if named_wheels(names):
        driven = [(place, name) for place, name in driven if 'wheel' in name]
    left = tuple(place for place, name in driven if _side(name) == 'left')
    right = tuple(place for place, name in driven if _side(name) == 'right')
    return (left, right) if left and right else None


@lru_cache(maxsize=256)
def named_wheels(names: tuple[str, ...]) -> bool:
    """Say whether a joint is called a wheel; then those that are not are none."""
    return any('wheel' in name.lower() for name in names if _driven(name))


def passed_over(names: Iterable[str]) -> list[str]:
    """
    Return joints that might be taken for wheels where others are called so.

    Parameters
    ----------
    names : iterable of str
        Joints of all messages of a topic, some of them called wheels.

    Returns
    -------
    list of str
        Those with a side that are not called wheels, such as a gripper's, and wheels without a
        side; sorted.

    """
    return sorted(name for name in names
                  if _driven(name) and ('wheel' in name.lower()) != bool(_side(name.lower())))


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
    wraps = (angles.size > 0 and float(np.max(np.abs(angles))) <= WRAP
             and bool(np.any(np.abs(np.diff(angles, axis=0)) > np.pi)))
    result: FloatArray = np.unwrap(angles, axis=0) if wraps else angles
    return result


def unwrapped_means(
    turned: Sequence[tuple[Mapping[str, float], Mapping[str, float]]],
) -> FloatArray | None:
    """
    Average the angles of each side after each joint was unwrapped by itself.

    Front and rear wheels wrap at different moments, so their mean jumps by pi at each.

    Parameters
    ----------
    turned : sequence of two mappings of str to float
        Angles [rad] of the left and of the right joints, one entry a message.

    Returns
    -------
    numpy.ndarray, shape (n, 2), or None
        Left and right [rad], NaN where no value is there; None where the joints of a side wrap
        together or not at all, so that nothing is to be mended.

    """
    means, apart = np.full((len(turned), 2), np.nan), False
    for side in (0, 1):
        joints = sorted({joint for entry in turned for joint in entry[side]})
        angles = np.array([[entry[side].get(joint, math.nan) for joint in joints]
                           for entry in turned], dtype=np.float64).reshape(len(turned), -1)
        there = np.isfinite(angles)
        if np.any(np.abs(angles[there]) > WRAP):
            return None
        turns = np.zeros(angles.shape)
        for column in range(len(joints)):
            rows = there[:, column]
            raw = angles[rows, column]
            turns[rows, column] = np.rint((np.unwrap(raw) - raw) / (2.0 * np.pi))
        most = np.max(np.where(there, turns, -np.inf), axis=1, initial=-np.inf)
        least = np.min(np.where(there, turns, np.inf), axis=1, initial=np.inf)
        apart = apart or bool(np.any(most > least))
        count = np.count_nonzero(there, axis=1)
        total = np.sum(np.where(there, angles + 2.0 * np.pi * turns, 0.0), axis=1)
        means[count > 0, side] = total[count > 0] / count[count > 0]
    return means if apart else None


def _driven(name: str) -> bool:
    return not any(word in name.lower() for word in NOT_DRIVEN)


def _side(name: str) -> str:
    """Return 'left', 'right' or an empty string."""
    tokens = set(re.split(r'[^a-z0-9]+', name))
    left = 'left' in name or bool(tokens & LEFT_TOKENS)
    right = 'right' in name or bool(tokens & RIGHT_TOKENS)
    if left == right:
        return ''
    return 'left' if left else 'right'
