# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Fifty goals with the law of Nav2's regulated pure pursuit, in lock step with the node's engine.

Not Nav2: its law and its numbers, written down here; in an empty map the plan is a straight line.
"""

from __future__ import annotations

import math
from pathlib import Path
from random import Random

from lg_husky_sim.ros.engine import Reading
from lg_husky_sim.signals import BodyTwist
from lg_husky_sim.testing.lockstep import LockStepHusky
import pytest

GOALS, REACHED, REPEATED, SEED = 50, 49, 5, 20
#: Steps of 20 ms from one command to the next: Nav2's `controller_frequency` of 20 Hz, rounded up.
EVERY = 3
PERIOD = 0.02 * EVERY
#: RegulatedPurePursuitController's own defaults (Nav2 1.3), and the limits that docs/ros.md names.
DESIRED, LOOKAHEAD, APPROACH, SLOWEST = 0.5, 0.6, 0.6, 0.05
TURNING, TURNING_ACCELERATION, TURN_FROM = 1.0, 1.0, 0.785
SMALLEST_RADIUS, REGULATED_SLOWEST = 0.9, 0.25
#: SimpleGoalChecker's tolerances; a goal that takes longer is not reached.
NEAR, ALIGNED, PATIENCE = 0.25, 0.25, 90.0

Goal = tuple[float, float, float]


def turned(angle: float, yaw: float) -> float:
    """Return the yaw rate that turns by an angle, as `rotateToHeading` does."""
    sign = math.copysign(1.0, angle)
    step = TURNING_ACCELERATION * PERIOD
    rate = min(max(sign * TURNING, yaw - step), yaw + step)
    return sign * min(abs(rate), math.sqrt(2.0 * TURNING_ACCELERATION * abs(angle)))


class Pursuit:
    """The controller on the way from where the robot stands to one goal."""

    def __init__(self, reading: Reading, goal: Goal) -> None:
        """Plan a straight line."""
        self.start = reading.pose.x, reading.pose.y
        self.goal = goal
        self.close = False

    def carrot(self, x: float, y: float) -> tuple[float, float]:
        """Return the point of the plan at the lookahead distance."""
        (ax, ay), (bx, by, _) = self.start, self.goal
        length = math.dist((ax, ay), (bx, by))
        ux, uy = (bx - ax) / length, (by - ay) / length
        along = (x - ax) * ux + (y - ay) * uy
        aside = (y - ay) * ux - (x - ax) * uy
        ahead = math.sqrt(max(LOOKAHEAD**2 - aside**2, 0.0))
        where = min(max(along, 0.0) + ahead, length)
        return ax + where * ux, ay + where * uy

    def done(self, reading: Reading) -> bool:
        """Return whether the goal is reached; its place stays reached, as with `stateful`."""
        pose = reading.pose
        self.close = self.close or math.dist((pose.x, pose.y), self.goal[:2]) < NEAR
        return self.close and abs(
            math.remainder(self.goal[2] - pose.heading, math.tau)) < ALIGNED

    def command(self, reading: Reading) -> BodyTwist:
        """Return the velocity command for a pose, as `computeVelocityCommands` does."""
        pose, yaw = reading.pose, reading.wheel_twist.yaw
        if self.close:
            return BodyTwist(0.0, turned(math.remainder(self.goal[2] - pose.heading, math.tau),
                                         yaw))
        x, y = self.carrot(pose.x, pose.y)
        angle = math.remainder(math.atan2(y - pose.y, x - pose.x) - pose.heading, math.tau)
        if abs(angle) > TURN_FROM:
            return BodyTwist(0.0, turned(angle, yaw))
        curvature = 2.0 * math.sin(angle) / math.dist((x, y), (pose.x, pose.y))
        forward = DESIRED
        if abs(curvature) * SMALLEST_RADIUS > 1.0:
            forward = max(DESIRED / (abs(curvature) * SMALLEST_RADIUS), REGULATED_SLOWEST)
        left = math.dist((pose.x, pose.y), self.goal[:2])
        if left < APPROACH:
            forward = max(min(forward, DESIRED * left / APPROACH), SLOWEST)
        return BodyTwist(forward, forward * curvature)


def drive(husky: LockStepHusky, goals: int) -> tuple[list[float], list[Reading]]:
    """Drive to some goals; return the seconds to each that was reached and the last readings."""
    random = Random(SEED)
    taken, ends = [], []
    for _ in range(goals):
        pursuit = Pursuit(husky.reading, (random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0),
                                          random.uniform(-math.pi, math.pi)))
        begun = husky.reading.time
        while not (reached := pursuit.done(husky.reading)) and (
                husky.reading.time - begun < PATIENCE):
            command = pursuit.command(husky.reading)
            for _ in range(EVERY):
                husky.step(command)
        if reached:
            taken.append(husky.reading.time - begun)
        ends.append(husky.reading)
    return taken, ends


@pytest.mark.parametrize('kind', ['paper', 'real'])
def test_fifty_goals_are_reached_and_twice_alike(real_husky: Path, kind: str) -> None:
    """At least 49 of 50 with either model; the first five again are the same bit for bit."""
    model = str(real_husky) if kind == 'real' else ''
    settings: dict[str, object] = {'preset': 'clearpath_jazzy', 'model': model}
    taken, ends = drive(LockStepHusky(**settings), GOALS)
    print(f'{kind}: {len(taken)} of {GOALS} goals, mean {sum(taken) / len(taken):.1f} s, '
          f'longest {max(taken):.1f} s')
    assert len(taken) >= REACHED
    again = drive(LockStepHusky(**settings), REPEATED)
    assert again == (taken[:REPEATED], ends[:REPEATED])
