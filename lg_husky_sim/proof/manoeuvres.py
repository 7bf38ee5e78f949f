# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Command scripts of the trial: what a person with a gamepad would drive."""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Leg = tuple[float, float, float]

REST = 1.5
SETS = ('paper', 'full', 'drive-like')


@dataclass(frozen=True)
class Manoeuvre:
    """
    A named command script.

    Attributes
    ----------
    name
        What it is.
    times
        Publishing times [s], shape (n,).
    commands
        Forward [m/s] and yaw [rad/s] command, shape (n, 2).

    """

    name: str
    times: Vector
    commands: Vector

    @property
    def duration(self) -> float:
        """Length [s]."""
        return float(self.times[-1])


def _circle(rng: np.random.Generator, speed: float) -> list[Leg]:
    yaw = float(rng.uniform(0.35, 0.6)) * _sign(rng)
    straight = float(rng.uniform(3.0, 5.0))
    return [(straight, speed, 0.0), (2.0 * math.pi / abs(yaw), speed, yaw),
            (straight, speed, 0.0)]


def _s_bend(rng: np.random.Generator, speed: float) -> list[Leg]:
    yaw = float(rng.uniform(0.4, 0.8)) * _sign(rng)
    bend = float(rng.uniform(1.8, 2.6)) / abs(yaw)
    return [(3.0, speed, 0.0), (bend, speed, yaw), (2.0, speed, 0.0),
            (2.0 * bend, speed, -yaw), (2.0, speed, 0.0), (bend, speed, yaw),
            (3.0, speed, 0.0)]


def _obstacle(rng: np.random.Generator, speed: float) -> list[Leg]:
    yaw = float(rng.uniform(0.6, 1.0)) * _sign(rng)
    bend = float(rng.uniform(0.8, 1.3)) / abs(yaw)
    slow = 0.6 * speed
    return [(4.0, speed, 0.0), (bend, slow, yaw), (2.5, speed, 0.0), (2.0 * bend, slow, -yaw),
            (2.5, speed, 0.0), (bend, slow, yaw), (2.0, speed, 0.0), (1.5, 0.0, 0.0),
            (bend, slow, -yaw), (3.0, speed, 0.0)]


def _stop_go(rng: np.random.Generator, speed: float) -> list[Leg]:
    legs: list[Leg] = []
    for part in (0.35, 1.0, -0.5, 0.7, -1.0, 0.25):
        legs.append((float(rng.uniform(2.5, 4.0)), part * speed, 0.0))
        if rng.random() < 0.7:
            legs.append((1.2, 0.0, 0.0))
    return legs


def _spin(rng: np.random.Generator, speed: float) -> list[Leg]:
    legs: list[Leg] = []
    for part in (0.3, -0.6, 1.0, -1.0, 0.5, -0.25):
        legs.append((float(rng.uniform(2.5, 4.0)), 0.0, part))
        if rng.random() < 0.6:
            legs.append((1.0, 0.0, 0.0))
    return legs


def _mix(rng: np.random.Generator, speed: float) -> list[Leg]:
    legs: list[Leg] = []
    total = 0.0
    while total < 50.0:
        time = float(rng.uniform(1.0, 4.0))
        forward = float(rng.uniform(-0.5, 1.0)) * speed if rng.random() < 0.85 else 0.0
        yaw = float(rng.uniform(-1.0, 1.0)) if rng.random() < 0.7 else 0.0
        legs.append((time, forward, yaw))
        total += time
    return legs


def _steps(rng: np.random.Generator, speed: float) -> list[Leg]:
    return [(6.0, float(rng.uniform(-0.6, 1.0)) * speed, float(rng.uniform(-1.0, 1.0)))
            for _ in range(12)]


_SCRIPTS = {'circle': _circle, 's_bend': _s_bend, 'obstacle': _obstacle,
            'stop_go': _stop_go, 'spin': _spin, 'mix': _mix, 'steps': _steps}
_CONTENT = {'paper': ('circle', 's_bend', 'obstacle'),
            'full': ('circle', 's_bend', 'obstacle', 'stop_go', 'spin', 'mix'),
            'drive-like': ('steps', 'steps')}


def _sign(rng: np.random.Generator) -> float:
    return 1.0 if rng.random() < 0.5 else -1.0


def _shape(legs: list[Leg], rate: float, ramp: float, rng: np.random.Generator,
           hand: float) -> tuple[Vector, Vector]:
    """Sample the legs at `rate` [Hz], with a gamepad's ramp [m/s², rad/s²]."""
    legs = [(REST, 0.0, 0.0), *legs, (2.0, 0.0, 0.0)]
    ends = np.cumsum([leg[0] for leg in legs])
    count = int(ends[-1] * rate) + 1
    times = np.arange(count) / rate
    which = np.minimum(np.searchsorted(ends, times, side='right'), len(legs) - 1)
    goal = np.array([[leg[1], leg[2]] for leg in legs])[which]
    if hand > 0.0:
        wobble = rng.standard_normal((len(legs), 2)) * hand
        goal = np.where(goal != 0.0, goal * (1.0 + wobble[which]), 0.0)
    if not math.isfinite(ramp):
        return times, goal
    shaped = np.zeros_like(goal)
    most = ramp / rate
    for k in range(1, count):
        shaped[k] = shaped[k - 1] + np.clip(goal[k] - shaped[k - 1], -most, most)
    return times, shaped


def script(name: str, rng: np.random.Generator, rate: float = 20.0,
           ramp: float = math.inf) -> Manoeuvre:
    """
    Return one manoeuvre with its own speeds and angles.

    Parameters
    ----------
    name
        'circle', 's_bend', 'obstacle', 'stop_go', 'spin', 'mix' or 'steps'.
    rng
        Where the speeds come from.
    rate
        Publishing rate [Hz].
    ramp
        Steepest change [m/s², rad/s²]; infinite for steps.

    """
    speed = float(rng.uniform(0.5, 0.95))
    times, commands = _shape(_SCRIPTS[name](rng, speed), rate, ramp, rng, 0.03)
    return Manoeuvre(name, times, commands)


def drive(kind: str, rng: np.random.Generator) -> tuple[Manoeuvre, ...]:
    """
    Return the manoeuvres of one set: 'paper', 'full' or 'drive-like'.

    Rate and ramp are those of one robot and one driver, drawn once.
    """
    rate = float(rng.choice([10.0, 20.0, 20.0, 30.0, 50.0]))
    ramp = math.inf if rng.random() < 0.4 else float(rng.uniform(1.5, 6.0))
    return tuple(script(name, rng, rate, ramp) for name in _CONTENT[kind])


def again(kind: str, like: tuple[Manoeuvre, ...],
          rng: np.random.Generator) -> tuple[Manoeuvre, ...]:
    """Return another such set, by the robot and the driver of `like`."""
    rate, ramp = _driver(like)
    return tuple(script(name, rng, rate, ramp) for name in _CONTENT[kind])


def held_out(kind: str, like: tuple[Manoeuvre, ...],
             rng: np.random.Generator) -> tuple[Manoeuvre, ...]:
    """Return two fresh manoeuvres of the same kind that no diagnosis sees."""
    rate, ramp = _driver(like)
    names = {'paper': ('s_bend', 'obstacle'), 'full': ('mix', 'obstacle'),
             'drive-like': ('steps',)}[kind]
    return tuple(script(name, rng, rate, ramp) for name in names)


def _driver(like: tuple[Manoeuvre, ...]) -> tuple[float, float]:
    """Return the rate [Hz] and the steepest change [m/s², rad/s²] of manoeuvres."""
    rate = 1.0 / float(like[0].times[1] - like[0].times[0])
    steepest = max(float(np.abs(np.diff(m.commands, axis=0)).max()) for m in like) * rate
    return rate, math.inf if steepest > 8.0 else steepest
