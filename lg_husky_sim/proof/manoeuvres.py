# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Command scripts of the trial: what a person with a gamepad, or a test script, would drive."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Rng = np.random.Generator
Leg = tuple[float, float, float]

REST = 1.5
GRID = 0.01
AXIS_STEPS = 127
TURN = 0.541
MOST = 0.93
"""Largest forward + TURN × yaw command [m/s]: 24 V at a gain of 1.07 s/m."""


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
    moving_start
        Seconds before the recorder is switched on (0: it starts at rest).

    """

    name: str
    times: Vector
    commands: Vector
    moving_start: float = 0.0

    @property
    def duration(self) -> float:
        """Length [s]."""
        return float(self.times[-1])


def _sign(rng: Rng) -> float:
    return 1.0 if rng.random() < 0.5 else -1.0


def _circle(rng: Rng, speed: float) -> list[Leg]:
    yaw = float(rng.uniform(0.35, 0.6)) * _sign(rng)
    straight = float(rng.uniform(3.0, 5.0))
    return [(straight, speed, 0.0), (2.0 * math.pi / abs(yaw), speed, yaw),
            (straight, speed, 0.0)]


def _s_bend(rng: Rng, speed: float) -> list[Leg]:
    yaw = float(rng.uniform(0.4, 0.8)) * _sign(rng)
    bend = float(rng.uniform(1.8, 2.6)) / abs(yaw)
    return [(3.0, speed, 0.0), (bend, speed, yaw), (2.0, speed, 0.0),
            (2.0 * bend, speed, -yaw), (2.0, speed, 0.0), (bend, speed, yaw),
            (3.0, speed, 0.0)]


def _obstacle(rng: Rng, speed: float) -> list[Leg]:
    yaw = float(rng.uniform(0.6, 1.0)) * _sign(rng)
    bend = float(rng.uniform(0.8, 1.3)) / abs(yaw)
    slow = 0.6 * speed
    return [(4.0, speed, 0.0), (bend, slow, yaw), (2.5, speed, 0.0), (2.0 * bend, slow, -yaw),
            (2.5, speed, 0.0), (bend, slow, yaw), (2.0, speed, 0.0), (1.5, 0.0, 0.0),
            (bend, slow, -yaw), (3.0, speed, 0.0)]


def _stop_go(rng: Rng, speed: float) -> list[Leg]:
    legs: list[Leg] = []
    for part in (0.35, 1.0, -0.5, 0.7, -1.0, 0.25):
        legs.append((float(rng.uniform(2.5, 4.0)), part * speed, 0.0))
        if rng.random() < 0.7:
            legs.append((1.2, 0.0, 0.0))
    return legs


def _spin(rng: Rng, speed: float) -> list[Leg]:
    legs: list[Leg] = []
    for part in (0.3, -0.6, 1.0, -1.0, 0.5, -0.25):
        legs.append((float(rng.uniform(2.5, 4.0)), 0.0, part * float(rng.uniform(0.7, 1.3))))
        if rng.random() < 0.6:
            legs.append((1.0, 0.0, 0.0))
    return legs


def _mix(rng: Rng, speed: float) -> list[Leg]:
    legs: list[Leg] = []
    for _ in range(12):
        forward = float(rng.uniform(-0.5, 1.0)) * speed if rng.random() < 0.85 else 0.0
        yaw = float(rng.uniform(-1.0, 1.0)) if rng.random() < 0.7 else 0.0
        legs.append((float(rng.uniform(1.0, 4.0)), forward, yaw))
    return legs


def _steps(rng: Rng, speed: float) -> list[Leg]:
    return [(6.0, float(rng.uniform(-0.6, 1.0)) * speed, float(rng.uniform(-1.0, 1.0)))
            for _ in range(6)]


def _square(rng: Rng, speed: float) -> list[Leg]:
    yaw = float(rng.uniform(0.5, 0.9)) * _sign(rng)
    legs: list[Leg] = []
    for _ in range(4):
        legs += [(float(rng.uniform(2.0, 4.0)), speed, 0.0), (0.6, 0.0, 0.0),
                 (0.5 * math.pi / abs(yaw), 0.0, yaw), (0.6, 0.0, 0.0)]
    return legs


def _staircase(rng: Rng, speed: float) -> list[Leg]:
    yaw = float(rng.uniform(0.3, 0.9)) * _sign(rng)
    up = [(2.0, speed * k / 5.0, 0.0) for k in range(1, 6)]
    turns = [(2.0, 0.5 * speed, yaw * k / 4.0) for k in (1, 2, 3, 4, 2, 0, -2, -4)]
    return [*up, *reversed(up), *turns, (1.0, 0.0, 0.0), *((t, -v, y) for t, v, y in up[:3])]


_SCRIPTS: dict[str, Callable[[Rng, float], list[Leg]]] = {
    'circle': _circle, 's_bend': _s_bend, 'obstacle': _obstacle, 'stop_go': _stop_go,
    'spin': _spin, 'mix': _mix, 'steps': _steps, 'square': _square, 'staircase': _staircase}
# Drives are drawn from these: each set begins with something that goes forward and turns.
SETS = {
    'paper': (('circle',), ('s_bend',), ('obstacle',)),
    'joystick': (('joystick',), ('joystick',), ('joystick', 'spin')),
    'full': (('circle', 's_bend', 'figure8'), ('stop_go', 'mix', 'joystick'),
             ('spin', 'obstacle', 'chirp', 'square', 'staircase')),
    'steps': (('steps',), ('mix',), ('stop_go', 'staircase')),
}


def _goals(legs: list[Leg], rng: Rng, hand: float) -> Vector:
    """Sample legs every `GRID`, as a hand that never holds quite still."""
    ends = np.cumsum([leg[0] for leg in legs])
    times = np.arange(int(ends[-1] / GRID)) * GRID
    which = np.minimum(np.searchsorted(ends, times, side='right'), len(legs) - 1)
    goal = np.array([[leg[1], leg[2]] for leg in legs])[which]
    wobble = rng.standard_normal((len(legs), 2)) * hand
    result: Vector = np.where(goal != 0.0, goal * (1.0 + wobble[which]), 0.0)
    return result


def _joystick(rng: Rng, seconds: float, speed: float) -> Vector:
    """Return a thumb that wanders, holds, lets go and turns round, every `GRID`."""
    from scipy.signal import lfilter
    count = int(seconds / GRID)
    goal = np.zeros((count, 2))
    at = 0
    while at < count:
        length = int(float(rng.uniform(0.4, 3.0)) / GRID)
        draw = float(rng.random())
        if draw > 0.12:
            forward = float(np.clip(rng.normal(0.55, 0.5), -0.8, 1.0)) * speed
            yaw = float(np.clip(rng.normal(0.0, 0.55), -1.2, 1.2))
            goal[at:at + length] = (0.0 if draw > 0.9 else forward, yaw)
        at += length
    lag = math.exp(-GRID / float(rng.uniform(0.05, 0.25)))
    thumb = lfilter([1.0 - lag], [1.0, -lag], goal, axis=0)
    thumb[np.abs(thumb) < 0.02] = 0.0
    result: Vector = thumb
    return result


def _chirp(rng: Rng, seconds: float, speed: float) -> Vector:
    times = np.arange(int(seconds / GRID)) * GRID
    low, high = float(rng.uniform(0.05, 0.12)), float(rng.uniform(0.8, 2.0))
    phase = 2.0 * math.pi * (low * times + 0.5 * (high - low) * times ** 2 / seconds)
    forward = speed * (0.5 + 0.4 * np.sin(phase))
    yaw = 0.6 * np.sin(1.37 * phase + float(rng.uniform(0.0, 6.0)))
    which = int(rng.integers(3))
    return np.column_stack([forward, yaw if which != 1 else 0.0 * yaw])


def _figure8(rng: Rng, seconds: float, speed: float) -> Vector:
    times = np.arange(int(seconds / GRID)) * GRID
    rate = float(rng.uniform(0.18, 0.4))
    yaw = float(rng.uniform(0.5, 0.9)) * np.sin(rate * times * _sign(rng))
    return np.column_stack([np.full(times.size, speed), yaw])


def _content(name: str, rng: Rng, seconds: float) -> Vector:
    """Return the commands of a manoeuvre that goes on for `seconds`, every `GRID`."""
    speed = float(rng.uniform(0.45, 0.95))
    rest = np.zeros((int(REST / GRID), 2))
    if name in _SCRIPTS:
        legs: list[Leg] = []
        while sum(leg[0] for leg in legs) < seconds:
            legs += [*_SCRIPTS[name](rng, speed), (float(rng.uniform(0.5, 2.0)), 0.0, 0.0)]
        body = _goals(legs, rng, 0.03)[:int(seconds / GRID)]
    else:
        body = {'joystick': _joystick, 'chirp': _chirp, 'figure8': _figure8}[name](
            rng, seconds, speed)
    return np.concatenate([rest, body, rest])


def script(name: str, rng: Rng, rate: float = 20.0, ramp: float = math.inf,
           seconds: float = 45.0, gamepad: bool = False, moving_start: float = 0.0) -> Manoeuvre:
    """
    Return one manoeuvre with its own speeds and angles.

    Parameters
    ----------
    name
        Any of the names in `SETS`.
    rng
        Where the speeds come from.
    rate
        Publishing rate [Hz].
    ramp
        Steepest change [m/s², rad/s²]; infinite for steps.
    seconds
        Length of what is recorded, with rest at both ends.
    gamepad
        An axis has 127 steps.
    moving_start
        Seconds driven before the recorder is switched on.

    """
    total = seconds + moving_start
    goal = _content(name, rng, max(total - 2.0 * REST, 5.0))
    if math.isfinite(ramp):
        shaped = np.zeros_like(goal)
        most = ramp * GRID
        for k in range(1, goal.shape[0]):
            shaped[k] = shaped[k - 1] + np.clip(goal[k] - shaped[k - 1], -most, most)
        goal = shaped
    if gamepad:
        full = np.array([1.0, 1.2])
        goal = np.round(goal / full * AXIS_STEPS) / AXIS_STEPS * full
    # No drive asks for more than the supply has: a clipped voltage is an effect of its own.
    asked = np.abs(goal[:, 0]) + TURN * np.abs(goal[:, 1])
    goal = goal * np.minimum(1.0, MOST / np.maximum(asked, MOST))[:, None]
    times = np.arange(int(goal.shape[0] * GRID * rate)) / rate
    which = np.minimum((times / GRID + 1e-6).astype(int), goal.shape[0] - 1)
    return Manoeuvre(name, times, goal[which], moving_start)


@dataclass(frozen=True)
class Driver:
    """Who drives: publishing rate [Hz], steepest change [m/s²], gamepad, length [s]."""

    rate: float
    ramp: float
    gamepad: bool
    shortest: float
    longest: float
    moving: float

    def script(self, name: str, rng: Rng) -> Manoeuvre:
        """Return one manoeuvre by this driver."""
        seconds = float(np.exp(rng.uniform(np.log(self.shortest), np.log(self.longest))))
        before = float(rng.uniform(2.0, 7.0)) if rng.random() < self.moving else 0.0
        return script(name, rng, self.rate, self.ramp, seconds, self.gamepad, before)


def driver(rng: Rng, rate: float, seconds: tuple[float, float], moving: float) -> Driver:
    """Draw a driver who publishes at `rate` [Hz]."""
    steps = rng.random() < 0.35
    return Driver(rate, math.inf if steps else float(np.exp(rng.uniform(0.2, 2.0))),
                  bool(rng.random() < 0.5), seconds[0], seconds[1], moving)


def drive(kind: str, who: Driver, rng: Rng, left_out: frozenset[str],
          count: int = 3) -> tuple[Manoeuvre, ...]:
    """Return `count` manoeuvres of a set of `SETS`, without those that are left out."""
    slots = SETS[kind]
    names = []
    for k in range(count):
        names.append(str(rng.choice([n for n in slots[k % len(slots)] if n not in left_out])))
    return tuple(who.script(name, rng) for name in names)
