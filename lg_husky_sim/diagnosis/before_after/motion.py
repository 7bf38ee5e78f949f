# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""How robots move in a drive, some side by side."""

from __future__ import annotations

from collections.abc import Sequence
import threading

from lg_husky_sim.diagnosis.before_after.base import Base
from lg_husky_sim.diagnosis.before_after.base_names import FIXED, OUTPUTS, ROBOT
from lg_husky_sim.diagnosis.before_after.base_robot import simulate
from lg_husky_sim.diagnosis.before_after.commands import accepted, spread
from lg_husky_sim.diagnosis.before_after.drives import Drive
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np
from numpy.typing import NDArray


class Memory(threading.local):
    """
    An array for each thread that is used again.

    Memory that was never used takes a third of the time of an integration.
    """

    def __init__(self) -> None:
        self._numbers = np.empty(0)

    def rows(self, *shape: int) -> FloatArray:
        """Return an array of any content; it is that of the last call."""
        count = int(np.prod(shape))
        if self._numbers.size < count:
            self._numbers = np.empty(count)
        return self._numbers[:count].reshape(shape)


def distinct(rows: FloatArray) -> tuple[list[list[float]], NDArray[np.intp]]:
    """
    Return the rows that differ, and which of them each one is.

    Of few rows, this takes a tenth of the time of `numpy.unique`.
    """
    found: dict[tuple[float, ...], int] = {}
    which = [found.setdefault(tuple(row), len(found)) for row in rows.tolist()]
    return [list(row) for row in found], np.array(which, dtype=np.intp)


def _accepted(base: Base, drive: Drive, robots: FloatArray, begin: FloatArray,
              commands: Sequence[TimeSeries]) -> FloatArray:
    # The command that each robot takes; most take the same.
    found = np.empty((drive.steps, 2, len(robots)))
    wheels = base.fixed[FIXED.index('wheel_radius')] * begin[3:]
    ahead, turning = 0.5 * (wheels[0] + wheels[1]), wheels[1] - wheels[0]
    values = [np.ascontiguousarray(one.values.T) for one in commands]
    sent = np.minimum(np.arange(len(robots)), len(commands) - 1)
    at = base.names.index
    for column, (axis, gain, now) in enumerate((
            ('forward', 'speed_gain', ahead), ('yaw', 'turn_width', turning))):
        how = robots[:, [at('dead_time'), at(f'limit_{axis}'), at(f'slew_{axis}'), at(gain)]]
        rows, which = distinct(np.column_stack([how, sent]))
        taken = np.empty((len(rows), drive.steps))
        for k, (late, most, slew, gain_here, number) in enumerate(rows):
            accepted(commands[int(number)].times, values[int(number)][column], late, most, slew,
                     now / gain_here, drive.start, base.settings.simulation['step'], taken[k])
        spread(taken, which, column, found)
    return found


def side_by_side(base: Base) -> int:
    """Return how many robots are simulated together at most."""
    return int(base.settings.simulation['lanes'])


def moved(base: Base, drive: Drive, robots: FloatArray, memory: Memory | None = None,
          commands: Sequence[TimeSeries] = ()) -> FloatArray:
    """
    Simulate a drive of some robots side by side.

    Parameters
    ----------
    base : Base
        Says how long a step is, and whether the wheels turn as measured.
    drive : Drive
        Its commands, or its measured wheel rates, move the robots.
    robots : numpy.ndarray, shape (m, n)
        Their parameters, in units; one, or as many as go together at most.
    memory : Memory, optional
        Where the motion is kept until this is called again.
    commands : sequence of TimeSeries
        What each robot is sent, if not what the drive holds.

    Returns
    -------
    numpy.ndarray, shape (n_steps + 1, n_outputs, n_lanes)
        In columns as `OUTPUTS`; the first m lanes are those of the robots.

    """
    step, at = base.settings.simulation['step'], base.names.index
    lanes = (0,) * (1 if len(robots) == 1 else side_by_side(base))
    robots = robots[np.minimum(np.arange(len(lanes)), len(robots) - 1)]
    out = (memory or Memory()).rows(drive.steps + 1, len(OUTPUTS), len(lanes))
    begin = np.repeat(drive.begin[:, None], len(lanes), axis=1)
    begin[0] = (robots[:, at('radius_left')] * begin[3]
                + robots[:, at('radius_right')] * begin[4]) / 2.0
    wheels, command = np.zeros((drive.steps + 1, 2, len(lanes))), np.zeros((1, 2, len(lanes)))
    if drive.wheels.times.size:
        # Where they are not followed, they only tell whether the robot stands.
        times = drive.start + step * np.arange(drive.steps + 1)
        late, which = distinct(robots[:, [at('wheels_late')]] * base.given)
        for column, values in enumerate(drive.wheels.values.T):
            read = np.column_stack([np.interp(times + one, drive.wheels.times, values)
                                    for (one,) in late])
            wheels[:, column] = read[:, which]
    if not base.given:
        command = _accepted(base, drive, robots, drive.begin, commands or [drive.command])
    simulate(np.ascontiguousarray(robots[:, :len(ROBOT)].T), base.fixed, step, command,
             drive.level, wheels, base.given, begin, lanes, out)
    return out
