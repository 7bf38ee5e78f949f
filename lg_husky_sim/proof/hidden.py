# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What hidden effects are built upon, and what they change; how strongly is drawn here."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
import math

from lg_husky_sim.proof.settings import settings
import numpy as np

Rng = np.random.Generator


@dataclass(frozen=True)
class Setting:
    """
    What an effect is built upon.

    Attributes
    ----------
    fields
        The robot before this effect.
    size
        How strong, in the unit of `config/blind_trial.yaml` (effects).
    most_forward, most_yaw, most_volts
        Largest command [m/s], [rad/s] and voltage [V] of the manoeuvres.
    steepest
        Largest change of the command [m/s² or rad/s²].
    squared_current, peak_current
        Integral of i² over the longest manoeuvre, and largest |i|, without the effect, the
        larger of both sides [A²·s], [A].
    drawn_charge
        What the manoeuvre that draws most takes from the battery, without the effect [A·s].
    seconds
        Length of the longest manoeuvre [s].
    streams
        Sensors that are recorded: of 'wheels', 'imu', 'pose'.
    left_out
        Forms of effects that may not be drawn, 'effect form'.

    """

    fields: Mapping[str, float]
    size: float
    most_forward: float
    most_yaw: float
    most_volts: float
    steepest: float = 20.0
    squared_current: float = 400.0
    peak_current: float = 20.0
    drawn_charge: float = 20.0
    seconds: float = 60.0
    streams: tuple[str, ...] = ('wheels', 'imu', 'pose')
    left_out: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Change:
    """
    A hidden effect, drawn.

    Attributes
    ----------
    fields, command, senses
        New values of fields of the robot, `CommandPath` and `Faults` entries.
    side
        'left', 'right', 'both' or 'none'.
    parameters, form
        For the answer: the true size, name to value (SI), and the functional form, in words.
    gusts
        Force of the wind [N] (it is a disturbance, not a field).

    """

    fields: Mapping[str, float] = field(default_factory=dict)
    command: Mapping[str, float] = field(default_factory=dict)
    senses: Mapping[str, float | str] = field(default_factory=dict)
    side: str = 'none'
    parameters: Mapping[str, float] = field(default_factory=dict)
    form: str = ''
    gusts: float = 0.0


Builder = Callable[[Setting, Rng], Change]


def logarithmic(rng: Rng, low: float, high: float) -> float:
    """Draw a number evenly in its logarithm."""
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def size_of(effect: str, level: int, rng: Rng) -> float:
    """Draw the size of an effect that is weak (0), medium (1) or strong (2)."""
    low, high = settings()['effects'][effect]['sizes'][level]
    return logarithmic(rng, float(low), float(high))


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
