# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""How a hidden robot moves, with and without its effects."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
import math

from lg_husky_sim.proof import robots, world
from lg_husky_sim.proof.commands import CommandPath, demanded, received, Sent
from lg_husky_sim.proof.conventions import Conventions
from lg_husky_sim.proof.integrate import (
    COLUMNS,
    Floor,
    Gate,
    integrate,
    ROUGH_PERIOD,
    smooth_floor,
    STEP,
)
from lg_husky_sim.proof.manoeuvres import Manoeuvre
from lg_husky_sim.proof.sensors import Faults
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Pose = tuple[float, float, float]


@dataclass(frozen=True)
class Hidden:
    """
    A robot with and without its effects, and when they hold.

    `onset`: 'none', 'time' (from `onset_time` [s] of recording `onset_recording` on) or
    'place' (where x is beyond `onset_x` [m] in the direction `onset_sign`).
    """

    robot: robots.Robot
    fields: dict[str, float]
    command: CommandPath
    faults: Faults
    gusts: float = 0.0
    world: str = 'g1'
    onset: str = 'none'
    onset_recording: int = 0
    onset_time: float = 0.0
    onset_x: float = 0.0
    onset_sign: float = 1.0
    onset_width: float = 0.2


def gates(hidden: Hidden, index: int | None) -> tuple[Gate, float]:
    """Return the gate and the `since` of recording `index` (None: an effect always on)."""
    if hidden.onset == 'place':
        return Gate('place', hidden.onset_x, hidden.onset_width, hidden.onset_sign), -1.0
    if hidden.onset == 'time' and index is not None:
        if index < hidden.onset_recording:
            return Gate('time', math.inf), math.inf
        if index == hidden.onset_recording:
            return Gate('time', hidden.onset_time, hidden.onset_width), hidden.onset_time
    return Gate(), -1.0


def alone(hidden: Hidden) -> Hidden:
    """Return the robot without its effects."""
    return replace(hidden, fields=hidden.robot.fields, command=hidden.robot.command,
                   faults=Faults(), gusts=0.0, onset='none')


def run(hidden: Hidden, drive: Manoeuvre, sent: Sent, how: Conventions, pose: Pose,
        index: int | None, ground: Floor | None = None, rng: np.random.Generator | None = None,
        step: float = STEP) -> Vector:
    """
    Return the motion of one manoeuvre (`integrate`).

    Parameters
    ----------
    hidden
        The robot.
    drive, sent
        Its manoeuvre, and what became of its messages.
    how
        The conventions: the base may have a clock of its own.
    pose
        x, y [m] and heading [rad] at the start.
    index
        Number of the recording, which decides on onsets; None: the effect is always on.
    ground
        The floor; smooth by default.
    rng
        Where gusts of wind come from; none without it.
    step
        Largest step [s].

    """
    gate, since = gates(hidden, index)
    seconds = drive.duration
    path = replace(hidden.command, since=since, own=hidden.robot.command.limits)
    arrivals, commands = received(sent, path, how.link, seconds)
    demand = demanded(commands, path, hidden.fields)
    off, on = world.vector(hidden.robot.fields), world.vector(hidden.fields)
    if gate.kind == 'time' and math.isinf(gate.at):
        off, on, gate = off, off, Gate()
    ground = ground or smooth_floor()
    move = _engine(hidden.world, step)
    if hidden.gusts > 0.0 and rng is not None:
        still = move(off, on, gate, arrivals, demand, ground, seconds, pose)
        times = np.arange(int(seconds / ROUGH_PERIOD) + 1) * ROUGH_PERIOD
        headings = np.interp(times, still[:, 0], still[:, COLUMNS.index('heading')])
        rough = np.broadcast_to(ground.rough, (times.size, 5)) \
            if ground.rough.shape[0] == 1 else ground.rough[:times.size]
        ground = Floor(rough + robots.gusts(hidden.gusts, headings, rng)[:rough.shape[0]],
                       ground.waves)
    return move(off, on, gate, arrivals, demand, ground, seconds, pose)


def _engine(name: str, step: float) -> Callable[..., Vector]:
    """Return what moves a robot of a world."""
    engine = {'g2': 'mujoco', 'g4': 'bullet'}.get(name)
    if engine is not None:
        from lg_husky_sim.proof.engine import integrate_engine
        return partial(integrate_engine, engine)
    return partial(integrate, step=step)
