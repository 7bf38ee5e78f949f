# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
How large a robot is beside the Husky of ``config/husky.yaml``, whose sizes others stand for.

What is typical or negligible for a Husky (a load, a friction, a voltage) is so for another robot
in proportion. With mass times mu, lengths times lambda, voltages times nu and the same gravity,
motions that look alike take sqrt(lambda) of the time (Froude), so that a number of unit
``kg^a m^b s^c V^d`` is ``mu^a lambda^(b + c/2) nu^d`` times as large: a force mu, a torque
mu lambda, an inertia mu lambda^2. Speeds, rates and times follow from how a robot is used, and
those of electronics from none of its sizes: what has neither mass nor voltage in its unit stays
as it is, but for lengths.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
import math
import re

#: Exponents of kg, m, s and V in the units that the configuration uses; all others have none.
_UNITS = {'kg': (1, 0, 0, 0), 'm': (0, 1, 0, 0), 's': (0, 0, 1, 0), 'V': (0, 0, 0, 1),
          'N': (1, 1, -2, 0), 'A': (1, 2, -3, -1), 'Ω': (-1, -2, 3, 2), 'H': (-1, -2, 4, 2)}
_POWERS = {'': 1, '²': 2, '³': 3}


@dataclass(frozen=True)
class RobotSize:
    """
    Size of a robot, in parts of the Husky's.

    Parameters
    ----------
    mass, length, voltage : float
        Its mass, the geometric mean of wheel radius and track, its supply.

    """

    mass: float = 1.0
    length: float = 1.0
    voltage: float = 1.0

    def factor(self, unit: str) -> float:
        """Return how many times as large a number of this unit is as the Husky's."""
        mass, length, voltage = _powers(unit)
        return float(self.mass ** mass * self.length ** length * self.voltage ** voltage)

    def sizes(self, unit: str) -> dict[str, float]:
        """Return by name, in parts of the Husky's, the sizes that a unit's numbers follow."""
        told = {'mass': self.mass, 'length': self.length, 'supply voltage': self.voltage}
        return {name: size for (name, size), power in zip(
            told.items(), _powers(unit), strict=True) if power}


#: The robot itself.
HUSKY = RobotSize()
#: No number of a robot counts as farther from the Husky's than this factor: powers stay finite.
FARTHEST = 1e6


@cache
def _exponents(unit: str) -> tuple[int, int, int, int]:
    total = [0, 0, 0, 0]
    for place, part in enumerate(unit.split('/')):
        for name, power in re.findall('([A-Za-zΩ]+)([²³]?)', part):
            for k, exponent in enumerate(_UNITS.get(name, (0, 0, 0, 0))):
                total[k] += (1 if place == 0 else -1) * _POWERS[power] * exponent
    return total[0], total[1], total[2], total[3]


def _powers(unit: str) -> tuple[float, float, float]:
    # Of mass, length and voltage; times of electronics and of use follow from none of them.
    kg, m, s, volt = _exponents(unit)
    return (kg, m + 0.5 * s, volt) if kg or volt else (0, 0 if s else m, 0)


def size_of(robot: Mapping[str, float], husky: Mapping[str, float]) -> RobotSize:
    """
    Return the size of a robot.

    Parameters
    ----------
    robot, husky : mapping of str to float
        Parameters of its model, and of the packaged one.

    Returns
    -------
    RobotSize

    """
    def times(name: str) -> float:
        return min(max(robot[name] / husky[name], 1.0 / FARTHEST), FARTHEST)
    return RobotSize(times('mass'), math.sqrt(times('wheel_radius') * times('track')),
                     times('supply_voltage'))


def speeds_of(robot: Mapping[str, float], husky: Mapping[str, float]
              ) -> tuple[float, float, float]:
    """
    Return how fast a robot drives at the same share of its supply, in parts of the Husky.

    Parameters
    ----------
    robot, husky : mapping of str to float
        Parameters of its model, and of the packaged one.

    Returns
    -------
    forward, yaw, wheels : float
        Of forward speed, yaw rate and wheel rates.

    """
    forward = husky['command_gain'] / robot['command_gain']
    return (forward, forward * (husky['turn_ratio'] / robot['turn_ratio']),
            forward * (husky['wheel_radius'] / robot['wheel_radius']))
