# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Nav2's planner, controller and costmaps, unmodified, with the node in place of Gazebo.

NavFn plans in a room with two pillars, regulated pure pursuit drives, both costmaps take the
node's scan, and map to odom is the node's; the test asks for plans and for their pursuit, as
bt_navigator does, which is not run. Nav2's loops are timed by the system's clock, so that a drive
at `speed` times simulated time needs them that much faster; its parameters are in
`nav2_stack.yaml`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from importlib import import_module
import math
from pathlib import Path
from random import Random
from typing import Any

from lg_husky_sim.ros import api
from lg_husky_sim.ros.conversions import pose_from_msg
from lg_husky_sim.ros.simulation_node import SimNode
from lg_husky_sim.signals import BodyTwist, Pose
from lg_husky_sim.testing.live import LiveHusky, Probe
import pytest
import yaml

PARAMETERS = Path(__file__).resolve().parents[3] / 'config' / 'nav2.yaml'
STACK = Path(__file__).with_name('nav2_stack.yaml')
#: Packages of the programs.
PACKAGES = {'map_server': 'nav2_map_server', 'planner_server': 'nav2_planner',
            'controller_server': 'nav2_controller'}
MANAGER = {'lifecycle_manager': 'nav2_lifecycle_manager'}
#: Inner side of the room from its middle, cells, and the pillars' corners [m].
WALL, CELL = 6.0, 0.05
PILLARS = ((1.5, 1.5, 2.0, 2.0), (-2.5, -2.0, -1.5, -1.5))
#: Goals: how many are tried at which time factor, how many must be reached, from which seed.
SEED = 20
#: Goals are this far from the middle at most, and from a pillar at least [m]: half the robot's
#: diagonal, 0.6 m, with room to turn.
REACH, APART = 5.0, 1.1
#: Half the robot's width: nothing of the room may be nearer to its middle [m].
HALF_WIDTH = 0.335
#: SimpleGoalChecker's tolerances, with what the robot still moves, as it does not ask for rest:
#: from 1 rad/s, the controller's limit, it turns by 0.5 rad until it stops with the preset's
#: 1 rad/s².
NEAR, ALIGNED = 0.25 + 0.05, 0.25 + 0.5
#: Longest drive to a goal [s of simulated time], the same by the clock, and wait for Nav2's start.
PATIENCE, WALL_PATIENCE, STARTED = 120.0, 600.0, 120.0
#: Longest wait for the answer of a service [s].
ANSWERED = 5.0
#: action_msgs/GoalStatus and lifecycle_msgs/State.
SUCCEEDED, ACTIVE = 4, 3
#: In lock step: a goal with nothing on the way, Nav2's commands per second of the clock, slow
#: enough for all that follows from one to come before the next, and steps of 20 ms for each.
CLEAR, SLOW, EVERY = (3.5, -2.5, -0.5), 2.0, 10

Goal = tuple[float, float, float]


def to_pillars(x: float, y: float) -> float:
    """Return the distance from the nearest pillar [m]."""
    return min(math.hypot(max(left - x, 0.0, x - right), max(low - y, 0.0, y - high))
               for left, low, right, high in PILLARS)


def goals(count: int) -> list[Goal]:
    """Return random goals where a robot can stand."""
    random = Random(SEED)
    found: list[Goal] = []
    while len(found) < count:
        x, y = (random.uniform(-REACH, REACH) for _ in range(2))
        heading = random.uniform(-math.pi, math.pi)
        if to_pillars(x, y) > APART:
            found.append((x, y, heading))
    return found


def write_room(folder: Path) -> Path:
    """Write the room as map_server reads it."""
    count = round(2.0 * WALL / CELL) + 2
    edge = -WALL - CELL

    def taken(row: int, column: int) -> bool:
        x, y = (edge + CELL * (place + 0.5) for place in (column, row))
        return {0, count - 1} & {row, column} != set() or to_pillars(x, y) == 0.0
    rows = [bytes(0 if taken(row, column) else 254 for column in range(count))
            for row in reversed(range(count))]
    (folder / 'room.pgm').write_bytes(b'P5\n%d %d\n255\n' % (count, count) + b''.join(rows))
    path = folder / 'room.yaml'
    path.write_text(yaml.safe_dump({
        'image': 'room.pgm', 'mode': 'trinary', 'resolution': CELL, 'origin': [edge, edge, 0.0],
        'negate': 0, 'occupied_thresh': 0.65, 'free_thresh': 0.25}), encoding='utf-8')
    return path


def write_stack(folder: Path, room: Path, nodes: list[str], speed: float,
                frequency: float | None) -> Path:
    """Write Nav2's parameters; its loops run by the system's clock, so they follow the speed."""
    stack = yaml.safe_load(STACK.read_text(encoding='utf-8'))
    stack['lifecycle_manager']['ros__parameters']['node_names'] = nodes
    stack['map_server']['ros__parameters']['yaml_filename'] = str(room)
    controller = stack['controller_server']['ros__parameters']
    for name in ('controller_frequency', 'failure_tolerance', 'costmap_update_timeout'):
        controller[name] *= speed
    controller['FollowPath']['transform_tolerance'] *= speed
    # Its step of the yaw rate is this over the frequency, and so the same as at speed 1.
    controller['FollowPath']['max_angular_accel'] *= speed
    for name in ('local_costmap', 'global_costmap'):
        costmap = stack[name][name]['ros__parameters']
        costmap['update_frequency'] *= speed
        costmap['transform_tolerance'] *= speed
    if frequency is not None:
        controller['controller_frequency'] = frequency
    path = folder / 'stack.yaml'
    path.write_text(yaml.safe_dump(stack), encoding='utf-8')
    return path


class Navigator:
    """What asks Nav2 to drive, and where the robot truly went."""

    def __init__(self, probe: Probe) -> None:
        """Listen to the truth, and make clients of Nav2's actions."""
        self.probe = probe
        self.truth = probe.listen('nav_msgs/msg/Odometry', '/ground_truth', 500)
        self.truth.clear()
        actions = import_module('nav2_msgs.action')
        self.kinds = {'compute_path_to_pose': actions.ComputePathToPose,
                      'follow_path': actions.FollowPath}
        client = import_module('rclpy.action').ActionClient
        self.clients = {name: client(probe.node, kind, name) for name, kind in self.kinds.items()}

    def close(self) -> None:
        """Leave the graph."""
        for client in self.clients.values():
            client.destroy()

    def now(self) -> float:
        """Return the simulated time [s]."""
        stamp = self.truth[-1].header.stamp
        return float(stamp.sec + 1e-9 * stamp.nanosec)

    def where(self) -> Pose:
        """Return the true pose."""
        return pose_from_msg(self.truth[-1].pose.pose)

    def wait(self, future: Any, each: Callable[[], object] = bool) -> Any:
        """Return what a future brings, or None after some simulated time; act meanwhile."""
        begun = self.now()

        def over() -> bool:
            each()
            return bool(future.done()) or self.now() - begun > PATIENCE
        self.probe.until(over, WALL_PATIENCE)
        return future.result() if future.done() else None

    def ask(self, name: str, each: Callable[[], object] = bool, **values: Any) -> Any:
        """Return what an action of Nav2 ends with, or None if it is refused or does not end."""
        # A goal that is sent before the two have found each other is lost.
        if not self.probe.until(self.clients[name].server_is_ready, STARTED):
            return None
        handle = self.wait(self.clients[name].send_goal_async(self.kinds[name].Goal(**values)))
        if handle is None or not handle.accepted:
            return None
        answer = self.wait(handle.get_result_async(), each)
        if answer is None:
            self.wait(handle.cancel_goal_async())
        return answer

    def pose(self, goal: Goal) -> Any:
        """Return a goal as a message."""
        made = import_module('geometry_msgs.msg').PoseStamped()
        made.header.frame_id = 'map'
        made.pose.position.x, made.pose.position.y = goal[:2]
        made.pose.orientation.z = math.sin(0.5 * goal[2])
        made.pose.orientation.w = math.cos(0.5 * goal[2])
        return made

    def plan(self, goal: Goal) -> Any:
        """Return the path to a goal, or None."""
        answer = self.ask('compute_path_to_pose', goal=self.pose(goal), planner_id='GridBased')
        return None if answer is None or answer.status != SUCCEEDED else answer.result.path

    def follow(self, path: Any, each: Callable[[], object] = bool) -> bool:
        """Follow a path; return whether Nav2 says that its end is reached."""
        answer = self.ask('follow_path', each, path=path, controller_id='FollowPath',
                          goal_checker_id='goal_checker', progress_checker_id='progress_checker')
        return answer is not None and answer.status == SUCCEEDED

    def drive(self, goal: Goal) -> tuple[bool, float]:
        """Plan and follow, and once more where that failed; return whether, and the seconds."""
        begun = self.now()
        done = any((path := self.plan(goal)) is not None and self.follow(path) for _ in range(2))
        return done, self.now() - begun

    def ready(self, nodes: Iterable[str]) -> bool:
        """Wait until the lifecycle manager has made all nodes active."""
        state = import_module('lifecycle_msgs.srv').GetState
        node: Any = self.probe.node
        clients = [node.create_client(state, f'{name}/get_state') for name in nodes]

        def active(client: Any) -> bool:
            if not client.service_is_ready():
                return False
            future = client.call_async(state.Request())
            return self.probe.until(future.done, ANSWERED) and (
                future.result().current_state.id == ACTIVE)
        return self.probe.until(lambda: all(map(active, clients)), STARTED)


@pytest.fixture
def nav2(probe: Probe, run: Callable[..., Any], program: Callable[[str, str], Path],
         tmp_path: Path) -> Iterator[Callable[..., Navigator]]:
    """Return a starter of Nav2."""
    made: list[Navigator] = []

    def start_all(nodes: dict[str, str], speed: float = 1.0, frequency: float | None = None
                  ) -> Navigator:
        programs = [program(package, name) for name, package in (nodes | MANAGER).items()]
        made.append(Navigator(probe))
        stack = write_stack(tmp_path, write_room(tmp_path), list(nodes), speed, frequency)
        for path in programs:
            run(path, '--ros-args', '--params-file', stack, '-r', 'cmd_vel:=platform/cmd_vel')
        return made[-1]

    yield start_all
    for one in made:
        one.close()


@pytest.mark.realtime
@pytest.mark.parametrize(('speed', 'count', 'reached'), [(1.0, 4, 4), (4.0, 50, 49)])
def test_goals_in_a_room_are_reached(
        probe: Probe, start: Callable[..., LiveHusky], nav2: Callable[..., Navigator],
        speed: float, count: int, reached: int) -> None:
    """Where Nav2 says so the robot truly is, and on the way it is in no pillar or wall."""
    navigator = nav2(PACKAGES, speed)
    start(arguments=('--params-file', str(PARAMETERS)), speed=speed,
          preset='clearpath_jazzy').ready(navigator.truth)
    assert navigator.ready(PACKAGES)
    taken, missed, least = [], [], math.inf
    for place, goal in enumerate(goals(count)):
        navigator.truth[:-1] = []
        done, seconds = navigator.drive(goal)
        probe.spin(1.0 / speed)
        end = navigator.where()
        least = min([least, *(
            min(to_pillars(pose.x, pose.y), WALL - abs(pose.x), WALL - abs(pose.y))
            for pose in (pose_from_msg(one.pose.pose) for one in navigator.truth))])
        left = math.dist((end.x, end.y), goal[:2])
        turn = math.remainder(end.heading - goal[2], math.tau)
        print(f'{place}: {goal[0]:.2f} {goal[1]:.2f} {goal[2]:.2f}: {done}, {seconds:.1f} s, '
              f'{left:.2f} m and {turn:.2f} rad from it')
        if done and left < NEAR and abs(turn) < ALIGNED:
            taken.append(seconds)
        else:
            missed.append(goal)
    print(f'figure: at {speed:g} times: {len(taken)} of {count} goals, mean '
          f'{sum(taken) / max(len(taken), 1):.1f} s, longest {max(taken, default=0.0):.1f} s, '
          f'never nearer than {least:.2f} m')
    assert len(taken) >= reached, missed
    assert least > HALF_WIDTH


class LockStep:
    """A node in the test's process that makes some steps with each command, and no others."""

    def __init__(self, probe: Probe) -> None:
        """Make it; it runs by the clock until the first drive."""
        self.probe = probe
        given = yaml.safe_load(PARAMETERS.read_text(encoding='utf-8'))['/**']['ros__parameters']
        self.node = SimNode('lockstep', parameter_overrides=[
            api.parameter(name, value)
            for name, value in (given | {'preset': 'clearpath_jazzy'}).items()])
        self.due = 0
        self.heard: list[tuple[BodyTwist, Pose]] = []
        take = self.node.engine.command

        def taken(twist: BodyTwist) -> bool:
            self.due += 1
            self.heard.append((twist, self.node.reading.pose))
            return take(twist)
        self.node.engine.command = taken  # type: ignore[method-assign]
        probe._executor.add_node(self.node)

    def close(self) -> None:
        """Leave the graph."""
        self.probe._executor.remove_node(self.node)
        self.node.destroy_node()

    def step(self) -> None:
        """Make the steps of a command that has come."""
        if self.due:
            self.due -= 1
            self.node.advance(EVERY)


@pytest.mark.realtime
def test_a_path_is_followed_twice_alike_in_lock_step(
        probe: Probe, nav2: Callable[..., Navigator]) -> None:
    """
    Controller, costmap and node, bit for bit: each command of Nav2 is followed by 0.2 s.

    The plan is made once. What plans again (the behaviour tree) and what costmaps hold depends on
    the system's clock in Nav2 itself, so the way is clear of obstacles.
    """
    navigator = nav2(PACKAGES, frequency=SLOW)
    node = LockStep(probe)
    try:
        assert probe.until(lambda: navigator.truth)
        assert navigator.ready(PACKAGES)
        path = navigator.plan(CLEAR)
        assert path is not None
        # Of no time, since time begins anew before it is followed.
        for one in (path, *path.poses):
            one.header.stamp.sec = one.header.stamp.nanosec = 0
        node.node.pause(True)
        drives = []
        for _ in range(2):
            # Of time as well: what is left of a period depends on it in the last bit.
            node.node.reset(time=True)
            node.node.advance(EVERY)
            probe.spin(1.0)
            node.heard.clear()
            node.due = 0
            assert navigator.follow(path, node.step)
            # The zero that comes last, at about the same time.
            probe.spin(1.0)
            drives.append(list(node.heard))
        first, second = drives
        print(f'figure: {len(first)} commands in lock step, twice alike: {first == second}')
        assert len(first) > 30
        assert math.dist((first[-1][1].x, first[-1][1].y), CLEAR[:2]) < NEAR
        assert first == second
    finally:
        node.close()
