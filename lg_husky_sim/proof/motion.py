# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""How a hidden robot moves, with and without its effects, and by how much that shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
import math

from lg_husky_sim.proof import manoeuvres, robots, sensors, world
from lg_husky_sim.proof.engine import integrate_engine
from lg_husky_sim.proof.integrate import COLUMNS, Gate, integrate, ROUGH_PERIOD
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Pose = tuple[float, float, float]

# Channel noise by which differences are made comparable: rad/s, rad/s, m/s.
_SCALES = {'wheel_left': 0.05, 'wheel_right': 0.05, 'yaw_rate': 0.01, 'forward': 0.02}

# Noise levels that an effect must move some channel by: over a recording of 40 s it is
# worth a nat then, and nobody could find less.
LEAST_TRACE = 0.03


@dataclass(frozen=True)
class Hidden:
    """A robot with and without its effects, and when they hold."""

    robot: robots.Robot
    fields: dict[str, float]
    command: sensors.CommandPath
    senses: sensors.Senses
    gusts: float
    world: str = 'g1'
    onset: str = 'none'
    onset_recording: int = 0
    onset_time: float = 0.0
    onset_x: float = 0.0


def demand_of(fields: Mapping[str, float], path: sensors.CommandPath,
              drive: manoeuvres.Manoeuvre, rng: np.random.Generator | None) -> Vector:
    """Return what the driver is asked for, `sensors.demanded`."""
    commands = sensors.received(drive, path, rng)
    return sensors.demanded(commands, path, fields['loop'] > 0.5, 0.1651,
                            2.0 * fields['half_track'])


def gates(hidden: Hidden, index: int | None) -> tuple[Gate, float]:
    """Return the gate and the `since` of recording `index` (None: held out)."""
    if hidden.onset == 'place':
        return Gate('place', hidden.onset_x, 0.3), -1.0
    if hidden.onset == 'time' and index is not None:
        if index < hidden.onset_recording:
            return Gate('time', math.inf), math.inf
        if index == hidden.onset_recording:
            return Gate('time', hidden.onset_time), hidden.onset_time
    return Gate(), -1.0


def run(hidden: Hidden, drive: manoeuvres.Manoeuvre, pose: Pose, index: int | None,
        rng: np.random.Generator | None, with_effect: bool = True) -> Vector:
    """
    Return the motion of one manoeuvre (`integrate`).

    Without `rng` there is no roughness, no lost command and no wind: the best that any
    model could know.
    """
    gate, since = gates(hidden, index)
    move = integrate_engine if hidden.world == 'g2' else integrate
    robot = hidden.robot
    fields = hidden.fields if with_effect else robot.fields
    path = replace(hidden.command, since=since, own=robot.command.limits) if with_effect \
        else robot.command
    off, on = world.vector(robot.fields), world.vector(fields)
    demand = demand_of(fields, path, drive, rng)
    rough = np.zeros((2, 5))
    if rng is not None:
        rough = robots.roughness(robot.floor, drive, rng)
        if with_effect and hidden.gusts > 0.0:
            still = move(off, on, gate, demand, rough, pose)
            headings = np.interp(np.arange(rough.shape[0]) * ROUGH_PERIOD, still[:, 0],
                                 still[:, COLUMNS.index('heading')])
            rough = rough + robots.gusts(hidden.gusts, headings, rng)
    if with_effect and gate.kind == 'time' and math.isinf(gate.at):
        return move(off, off, Gate(), demand, rough, pose)
    return move(off, on, gate, demand, rough, pose)


def visibility(hidden: Hidden, drives: Sequence[manoeuvres.Manoeuvre],
               poses: Sequence[Pose]) -> dict[str, float]:
    """Return by how many noise levels the effect moves each channel, without any refit."""
    squares = dict.fromkeys(_SCALES, 0.0)
    rows = 0
    for index, (drive, pose) in enumerate(zip(drives, poses, strict=True)):
        with_it = run(hidden, drive, pose, index, None)
        without = run(hidden, drive, pose, index, None, with_effect=False)
        rows += with_it.shape[0]
        for name, scale in _SCALES.items():
            k = COLUMNS.index(name)
            squares[name] += float((((with_it[:, k] - without[:, k]) / scale) ** 2).sum())
    return {name: math.sqrt(value / rows) for name, value in squares.items()}
