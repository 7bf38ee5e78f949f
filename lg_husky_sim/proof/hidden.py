# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What hidden effects are built upon, and what they change; how strongly is drawn here."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
import math

import numpy as np


@dataclass(frozen=True)
class Setting:
    """
    What an effect is built upon.

    Attributes
    ----------
    fields
        The robot before this effect.
    most_forward, most_yaw, most_volts
        Largest command [m/s], [rad/s] and voltage [V] of the manoeuvres.
    level
        0 weak, 1 medium, 2 strong.
    steepest
        Largest change of the command [m/s² or rad/s²].
    squared_current, peak_current
        Integral of i² over the longest manoeuvre, and largest |i|, without the effect, the
        larger of both sides [A²·s], [A].
    heavy
        The tyres have dry contact, so that turning takes several times the moment.

    """

    fields: Mapping[str, float]
    most_forward: float
    most_yaw: float
    most_volts: float
    level: int
    steepest: float = 20.0
    squared_current: float = 400.0
    peak_current: float = 20.0
    heavy: bool = False


@dataclass(frozen=True)
class Change:
    """
    A hidden effect, drawn.

    Attributes
    ----------
    fields, command, senses
        New values of `world.FIELDS`, `CommandPath` and `Senses` entries.
    side
        'left', 'right', 'both' or 'none'.
    parameters
        The true size, for the answer: name to value (SI).
    gusts
        Force of the wind [N] (it is a disturbance, not a field).

    """

    fields: Mapping[str, float] = field(default_factory=dict)
    command: Mapping[str, float] = field(default_factory=dict)
    senses: Mapping[str, float | str] = field(default_factory=dict)
    side: str = 'none'
    parameters: Mapping[str, float] = field(default_factory=dict)
    gusts: float = 0.0


Rng = np.random.Generator
Builder = Callable[[Setting, Rng], Change]


def draw(rng: Rng, s: Setting, *ranges: tuple[float, float]) -> float:
    """Draw a size, even in its logarithm, from the range of the severity."""
    low, high = ranges[s.level]
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def sign(rng: Rng) -> float:
    """Return -1 or 1."""
    return 1.0 if rng.random() < 0.5 else -1.0


def pick(rng: Rng, *choices: str) -> str:
    """Return one of the choices."""
    return str(rng.choice(list(choices)))


def sided(name: str, size: float, side: str) -> dict[str, float]:
    """Return a pair of fields with `size` on the sides that are hit."""
    return {f'{name}_left': size if side in ('left', 'both') else 0.0,
            f'{name}_right': size if side in ('right', 'both') else 0.0}
