# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Goals in a room by Nav2, unmodified, with the node in place of Gazebo.

NavFn plans, rotation shim and regulated pure pursuit drive, both costmaps take the node's scan,
map to odom is the node's, and bt_navigator and the behaviours decide. Where those two are not
installed, the test asks for plans and for their pursuit, and once more where that failed. By the
clock, commands go through velocity smoother and collision monitor, where those are installed.
"""

from __future__ import annotations

from collections.abc import Callable
import math
from pathlib import Path
from random import Random
from typing import Any

from lg_husky_sim.testing.live import LiveHusky
import pytest

PARAMETERS = Path(__file__).resolve().parents[4] / 'config' / 'nav2.yaml'
#: Goals by the clock, and as fast as Nav2 goes: how many, and how many must be reached.
SEED, LIVE, GOALS, REACHED = 20, 10, 50, 49
#: How much faster Nav2's loops are made at most, steps of 20 ms for each of its commands, of which
#: 20 come in a second of simulated time, and how long it may send none until time goes on [s].
SPEED, EVERY, HELD = 4.0, 2.5, 0.1
#: Goals are this far from the middle at most, and from a pillar at least [m]: half the robot's
#: diagonal, 0.6 m, with room to turn.
REACH, APART = 5.0, 1.1
#: Half the robot's width: nothing of the room may be nearer to its middle [m].
HALF_WIDTH = 0.335
#: The goal checker's tolerances [m, rad], with what the robot still moves: at most 0.25 rad/s
#: (`rot_stopped_velocity`), in a dead time of 0.1 s and then braked with 1 rad/s².
NEAR, ALIGNED = 0.25 + 0.05, 0.25 + 0.06

Goal = tuple[float, float, float]


def goals(count: int, apart: Callable[[float, float], float]) -> list[Goal]:
    """Return random goals where a robot can stand."""
    random = Random(SEED)
    found: list[Goal] = []
    while len(found) < count:
        x, y = (random.uniform(-REACH, REACH) for _ in range(2))
        heading = random.uniform(-math.pi, math.pi)
        if apart(x, y) > APART:
            found.append((x, y, heading))
    return found


def drive(navigator: Any, count: int, title: str) -> int:
    """Drive to goals; return how many Nav2 and the truth say are reached. Nothing is hit."""
    taken: list[float] = []
    least, most = math.inf, [0.0, 0.0]
    for place, goal in enumerate(goals(count, navigator.to_pillars)):
        begun = navigator.now()
        done = navigator.drive(goal)
        seconds = navigator.now() - begun
        ends = [navigator.where()]
        navigator.rest(1.0)
        ends.append(navigator.where())
        least = min(least, navigator.clearance())
        off = [(math.dist((end.x, end.y), goal[:2]),
                math.remainder(end.heading - goal[2], math.tau)) for end in ends]
        print(f'{place}: {goal[0]:.2f} {goal[1]:.2f} {goal[2]:.2f}: {done}, {seconds:.1f} s',
              ', '.join(f'{left:.2f} m and {turn:.2f} rad from it' for left, turn in off))
        if done and all(left < NEAR and abs(turn) < ALIGNED for left, turn in off):
            taken.append(seconds)
            most = [max(most[0], off[1][0]), max(most[1], abs(off[1][1]))]
    print(f'figure: {title}{", with smoother and collision monitor" if navigator.chained else ""}'
          f'{"" if navigator.deciding else ", without bt_navigator"}: '
          f'{len(taken)} of {count} goals, mean {sum(taken) / max(len(taken), 1):.1f} s, longest '
          f'{max(taken, default=0.0):.1f} s; at most {most[0]:.2f} m and {most[1]:.2f} rad from '
          f'them, {navigator.recoveries} recoveries, never nearer than {least:.2f} m')
    assert least > HALF_WIDTH
    return len(taken)


@pytest.mark.realtime
@pytest.mark.parametrize('kind', ['paper', 'real'])
def test_goals_are_reached_by_the_clock(
        start: Callable[..., LiveHusky], nav2: Callable[..., Any], real_husky: Path, kind: str
        ) -> None:
    """With a node in a process of its own, where Nav2 says so the robot truly is and stays."""
    start(arguments=('--params-file', str(PARAMETERS)), preset='clearpath_jazzy',
          model=str(real_husky) if kind == 'real' else '')
    assert drive(nav2(), LIVE, f'{kind}, by the clock') == LIVE


@pytest.mark.realtime
@pytest.mark.parametrize('kind', ['paper', 'real'])
def test_fifty_goals_are_reached_as_fast_as_nav2_goes(
        nav2: Callable[..., Any], lock_step: Callable[..., Any], real_husky: Path, kind: str
        ) -> None:
    """Each command of Nav2 is followed by its period: a busy machine takes longer, no more."""
    held = lock_step(EVERY, HELD, model=str(real_husky) if kind == 'real' else '')
    navigator = nav2(SPEED, lock_step=held)
    held.node.pause(True)
    assert drive(navigator, GOALS, f'{kind}, as fast as Nav2 goes') >= REACHED
