# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Nav2, unmodified, in a room with two pillars, and what asks it to drive.

With bt_navigator and the behaviours, and with velocity smoother and collision monitor, where they
are installed, without them where they are not; its parameters are in `stack.yaml`. Its loops are
timed by the system's clock: they are made faster by `speed`, and a node in lock step makes its
steps when Nav2 has sent a command, however long that takes on a busy machine.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib import import_module
from importlib.util import find_spec
import math
from pathlib import Path
import signal
import time
from typing import Any

from lg_husky_sim.ros import api
from lg_husky_sim.ros.conversions import pose_from_msg
from lg_husky_sim.ros.simulation_node import SimNode
from lg_husky_sim.signals import BodyTwist, Pose
from lg_husky_sim.testing.live import Probe
import pytest
import yaml

PARAMETERS = Path(__file__).resolve().parents[4] / 'config' / 'nav2.yaml'
PRESET = 'clearpath_jazzy'
STACK = Path(__file__).with_name('stack.yaml')
#: Packages of the programs that plan and drive, and of those that decide what is done next.
PACKAGES = {'map_server': 'nav2_map_server', 'planner_server': 'nav2_planner',
            'controller_server': 'nav2_controller'}
DECIDING = {'behavior_server': 'nav2_behaviors', 'bt_navigator': 'nav2_bt_navigator'}
#: Of those through which all commands go, in this order, on their way to the base.
CHAIN = {'velocity_smoother': 'nav2_velocity_smoother',
         'collision_monitor': 'nav2_collision_monitor'}
MANAGER = {'lifecycle_manager': 'nav2_lifecycle_manager'}
#: Packages of plug-ins that `stack.yaml` names.
PLUGINS = ('nav2_navfn_planner', 'nav2_rotation_shim_controller',
           'nav2_regulated_pure_pursuit_controller')
#: The behaviour tree, and what it says of how often it plans anew, by the system's clock.
TREE, REPLANNING = 'navigate_to_pose_w_replanning_and_recovery.xml', 'RateController hz="{:.1f}"'
#: Inner side of the room from its middle, cells, and the pillars' corners [m].
WALL, CELL = 6.0, 0.05
PILLARS = ((1.5, 1.5, 2.0, 2.0), (-2.5, -2.0, -1.5, -1.5))
#: Longest drive to a goal [s of simulated time], the same by the clock, and Nav2's start.
PATIENCE, WALL_PATIENCE, STARTED = 120.0, 600.0, 40.0
#: Its manager waits 2 s for each answer and then gives up: on a busy machine it is started again.
STARTS = 3
#: Longest wait for the answer of a service, and for a program to end [s].
ANSWERED, ENDED = 2.0, 15.0
#: action_msgs/GoalStatus.
SUCCEEDED = 4

Goal = tuple[float, float, float]


def to_pillars(x: float, y: float) -> float:
    """Return the distance from the nearest pillar [m]."""
    return min(math.hypot(max(left - x, 0.0, x - right), max(low - y, 0.0, y - high))
               for left, low, right, high in PILLARS)


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


def write_tree(folder: Path, speed: float) -> Path:
    """Write bt_navigator's own behaviour tree, with its only time by the clock at a speed."""
    share = import_module('ament_index_python.packages').get_package_share_directory
    text = (Path(share(DECIDING['bt_navigator'])) / 'behavior_trees' / TREE).read_text()
    assert REPLANNING.format(1.0) in text
    path = folder / TREE
    path.write_text(text.replace(REPLANNING.format(1.0), REPLANNING.format(speed)))
    return path


def write_stack(folder: Path, nodes: dict[str, str], speed: float, frequency: float | None
                ) -> Path:
    """
    Write Nav2's parameters; its loops run by the system's clock, so they follow the speed.

    Not so `max_angular_accel`: it is also what Nav2 brakes by, and must be the robot's. Nav2 then
    raises the yaw rate more slowly by the speed.
    """
    stack = yaml.safe_load(STACK.read_text(encoding='utf-8'))
    values = {name: part['ros__parameters'] for name, part in stack.items()
              if 'ros__parameters' in part}
    values['lifecycle_manager']['node_names'] = list(nodes)
    values['map_server']['yaml_filename'] = str(write_room(folder))
    controller = values['controller_server']
    for name in ('controller_frequency', 'failure_tolerance', 'costmap_update_timeout'):
        controller[name] *= speed
    controller['FollowPath']['transform_tolerance'] *= speed
    for name in ('local_costmap', 'global_costmap'):
        costmap = stack[name][name]['ros__parameters']
        costmap['update_frequency'] *= speed
        costmap['transform_tolerance'] *= speed
    for name in ('cycle_frequency', 'transform_tolerance'):
        values['behavior_server'][name] *= speed
    if 'bt_navigator' in nodes:
        values['bt_navigator']['default_nav_to_pose_bt_xml'] = str(write_tree(folder, speed))
    if frequency is not None:
        controller['controller_frequency'] = frequency
    path = folder / 'stack.yaml'
    path.write_text(yaml.safe_dump(stack), encoding='utf-8')
    return path


class LockStep:
    """
    A node in the test's process that makes some steps with each command.

    By the clock until it is paused; then also where no command has come for some time, by which
    Nav2 is not left waiting for a time that does not go on.
    """

    def __init__(self, probe: Probe, every: float, held: float, model: str = '') -> None:
        """Make it; `every` steps of 20 ms with a command or after `held` seconds without."""
        given = yaml.safe_load(PARAMETERS.read_text(encoding='utf-8'))['/**']['ros__parameters']
        self.node = SimNode('lockstep', parameter_overrides=[
            api.parameter(name, value)
            for name, value in (given | {'preset': PRESET, 'model': model}).items()])
        self.every, self.held = every, held
        self.heard: list[tuple[BodyTwist, Pose]] = []
        self.poses: list[Pose] = []
        self.due, self.left, self.last = False, 0.0, time.monotonic()
        take = self.node.engine.command

        def taken(twist: BodyTwist) -> bool:
            self.due = True
            self.heard.append((twist, self.node.reading.pose))
            return take(twist)
        self.node.engine.command = taken  # type: ignore[method-assign]
        self.executor = probe._executor
        self.executor.add_node(self.node)

    def close(self) -> None:
        """Leave the graph."""
        self.executor.remove_node(self.node)
        self.node.destroy_node()

    def step(self) -> None:
        """Make the steps that are due."""
        if not self.node.paused or not (
                self.due or time.monotonic() - self.last > self.held):
            return
        self.due, self.last = False, time.monotonic()
        self.left += self.every
        self.node.advance(int(self.left))
        self.left -= int(self.left)
        self.poses.append(self.node.reading.pose)


class Navigator:
    """What asks Nav2 to drive, and where the robot truly went."""

    def __init__(self, probe: Probe, lock_step: LockStep | None) -> None:
        """Listen to the truth, and make clients of Nav2's actions."""
        self.probe = probe
        self.lock_step = lock_step
        # One message, so that the last is no older than what else is heard.
        self.truth = probe.listen('nav_msgs/msg/Odometry', '/ground_truth', 1)
        actions = import_module('nav2_msgs.action')
        self.kinds = {'compute_path_to_pose': actions.ComputePathToPose,
                      'follow_path': actions.FollowPath,
                      'navigate_to_pose': actions.NavigateToPose}
        client = import_module('rclpy.action').ActionClient
        self.clients = {name: client(probe.node, kind, name) for name, kind in self.kinds.items()}
        node: Any = probe.node
        self.asked = import_module('std_srvs.srv').Trigger
        self.manager = node.create_client(self.asked, 'lifecycle_manager/is_active')
        #: Whether bt_navigator is there, whether commands go through velocity smoother and
        #: collision monitor, and how often the behaviours had to help.
        self.deciding = self.chained = False
        self.recoveries = 0

    def close(self) -> None:
        """Leave the graph."""
        for client in self.clients.values():
            client.destroy()
        node: Any = self.probe.node
        node.destroy_client(self.manager)

    def now(self) -> float:
        """Return the simulated time [s]."""
        if self.lock_step:
            return self.lock_step.node.reading.time
        stamp = self.truth[-1].header.stamp
        return float(stamp.sec + 1e-9 * stamp.nanosec)

    def where(self) -> Pose:
        """Return the true pose."""
        if self.lock_step:
            return self.lock_step.node.reading.pose
        return pose_from_msg(self.truth[-1].pose.pose)

    def rest(self, seconds: float) -> None:
        """Let some simulated time go by [s]."""
        end = self.now() + seconds

        def over() -> bool:
            if self.lock_step:
                self.lock_step.due = True
                self.lock_step.step()
            return self.now() >= end
        self.probe.until(over, WALL_PATIENCE)

    def to_pillars(self, x: float, y: float) -> float:
        """Return the distance of a place from the nearest pillar [m]."""
        return to_pillars(x, y)

    def clearance(self) -> float:
        """Return how near a pillar or wall was since this was last asked [m]."""
        poses = [pose_from_msg(one.pose.pose) for one in self.truth]
        self.truth[:-1] = []
        if self.lock_step:
            poses, self.lock_step.poses = self.lock_step.poses, []
        return min(min(to_pillars(pose.x, pose.y), WALL - abs(pose.x), WALL - abs(pose.y))
                   for pose in poses)

    def wait(self, future: Any) -> Any:
        """Return what a future brings, or None after some simulated time."""
        begun = self.now()

        def over() -> bool:
            if self.lock_step:
                self.lock_step.step()
            return bool(future.done()) or self.now() - begun > PATIENCE
        self.probe.until(over, WALL_PATIENCE)
        return future.result() if future.done() else None

    def ask(self, name: str, feedback: Any = None, **values: Any) -> Any:
        """Return what an action of Nav2 ends with, or None if it is refused or does not end."""
        # A goal that is sent before the two have found each other is lost.
        if not self.probe.until(self.clients[name].server_is_ready, STARTED):
            return None
        handle = self.wait(self.clients[name].send_goal_async(
            self.kinds[name].Goal(**values), feedback_callback=feedback))
        if handle is None or not handle.accepted:
            return None
        answer = self.wait(handle.get_result_async())
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

    def follow(self, path: Any) -> bool:
        """Follow a path; return whether Nav2 says that its end is reached."""
        answer = self.ask('follow_path', path=path, controller_id='FollowPath',
                          goal_checker_id='goal_checker', progress_checker_id='progress_checker')
        return answer is not None and answer.status == SUCCEEDED

    def navigate(self, goal: Goal) -> bool:
        """Let bt_navigator drive to a goal; return whether it says that it is reached."""
        helped = [0]

        def heard(message: Any) -> None:
            helped[0] = max(helped[0], message.feedback.number_of_recoveries)
        answer = self.ask('navigate_to_pose', feedback=heard, pose=self.pose(goal))
        self.recoveries += helped[0]
        return answer is not None and answer.status == SUCCEEDED

    def drive(self, goal: Goal) -> bool:
        """Drive to a goal; return whether Nav2 says that it is reached."""
        if self.deciding:
            return self.navigate(goal)
        # Once more where that failed.
        return any((path := self.plan(goal)) is not None and self.follow(path) for _ in range(2))

    def started(self) -> bool:
        """Wait until the lifecycle manager has made all nodes active; return whether it has."""
        def active() -> bool:
            if not self.manager.service_is_ready():
                return False
            # Asked again: what is sent before the two have found each other is lost.
            future = self.manager.call_async(self.asked.Request())
            return self.probe.until(future.done, ANSWERED) and bool(future.result().success)
        return self.probe.until(active, STARTED)

    def forget(self) -> None:
        """Wait until a lifecycle manager that has ended is known to be gone."""
        self.probe.until(lambda: not self.manager.service_is_ready(), ENDED)


def installed(nodes: dict[str, str]) -> dict[str, str]:
    """Return nodes with their packages, or none where any of these is not installed."""
    if find_spec('ament_index_python') is None:
        return {}
    packages = import_module('ament_index_python.packages').get_packages_with_prefixes()
    return nodes if set(nodes.values()) <= set(packages) else {}


@pytest.fixture
def nav2(probe: Probe, run: Callable[..., Any], program: Callable[[str, str], Path],
         tmp_path: Path) -> Iterator[Callable[..., Navigator]]:
    """Return a starter of Nav2 beside a node that runs."""
    # Looked for before the test starts anything: without them it is skipped.
    for name, package in (PACKAGES | MANAGER).items():
        program(package, name)
    for name in PLUGINS:
        program(name, '')
    made: list[Navigator] = []

    def start_all(speed: float = 1.0, frequency: float | None = None, whole: bool = True,
                  lock_step: LockStep | None = None) -> Navigator:
        # The smoother repeats commands by the system's clock, which a lock step must not follow.
        chain = {} if lock_step else installed(CHAIN)
        nodes = PACKAGES | chain | (installed(DECIDING) if whole else {})
        commands = 'cmd_vel_nav' if chain else 'platform/cmd_vel'
        programs = [program(package, name) for name, package in (nodes | MANAGER).items()]
        stack = write_stack(tmp_path, nodes, speed, frequency)
        made.append(Navigator(probe, lock_step))
        made[-1].deciding = set(DECIDING) <= set(nodes)
        made[-1].chained = bool(chain)
        assert probe.until(lambda: made[-1].truth)
        for _ in range(STARTS):
            running = [run(path, '--ros-args', '--params-file', stack,
                           '-r', f'cmd_vel:={commands}') for path in programs]
            if made[-1].started():
                return made[-1]
            for process in running:
                process.send_signal(signal.SIGINT)
            for process in running:
                process.wait(ENDED)
            made[-1].forget()
        raise AssertionError('Nav2 did not start')

    yield start_all
    for one in made:
        one.close()


@pytest.fixture
def lock_step(probe: Probe) -> Iterator[Callable[..., LockStep]]:
    """Return a maker of a node in lock step."""
    made: list[LockStep] = []

    def make(*words: Any, **options: Any) -> LockStep:
        made.append(LockStep(probe, *words, **options))
        return made[-1]

    yield make
    for one in made:
        one.close()
