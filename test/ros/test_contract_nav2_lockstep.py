# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""One navigation over the middleware in lock step (row 59): all that Nav2 hears, at each stamp."""

from __future__ import annotations

import bisect
import itertools
import math
from typing import Any, NamedTuple

from lg_husky_sim import Husky
from lg_husky_sim.errors import SettingsError
from lg_husky_sim.resources import config_path
from lg_husky_sim.ros import api
from lg_husky_sim.ros.conversions import pose_from_msg
from lg_husky_sim.ros.navigation import compose
from lg_husky_sim.ros.simulation_node import SimNode
from lg_husky_sim.signals import FloatArray, Pose
from lg_husky_sim.testing.live import Probe
from lg_husky_sim.yaml_files import read_yaml
import numpy as np
import pytest

SECOND, STEP = 10**9, 20_000_000
#: Steps from one command to the next: Nav2's `controller_frequency` of 20 Hz, rounded down.
EVERY = 3
#: Steps of 20 ms between two scans of 10 Hz.
SCAN = 5
#: Walls of the room's inner side [m], and its cells.
WALL, CELL = 5.0, 0.1
START = Pose(-2.0, 1.0, 0.5)
#: What a localisation finds out on the way [m], once, at this command.
CORRECTION, CORRECTED = 0.15, 40
#: SimpleGoalChecker's `xy_goal_tolerance` and what RegulatedPurePursuitController declares.
NEAR, DESIRED, LOOKAHEAD, TURN_FROM = 0.25, 0.5, 0.6, 0.785
GOAL = (2.0, -1.5)
LATCHED = api.QoSProfile(depth=1, durability=api.DurabilityPolicy.TRANSIENT_LOCAL)
BEST_EFFORT = api.QoSProfile(depth=50, reliability=api.ReliabilityPolicy.BEST_EFFORT)


class Heard(NamedTuple):
    """What was published during a navigation, in order; stamps in nanoseconds."""

    clock: list[int]
    odometry: list[tuple[int, Pose, float]]
    truth: list[tuple[int, Pose]]
    outer: list[tuple[int, Pose]]
    inner: list[tuple[int, Pose]]
    scans: list[tuple[int, bytes]]
    #: Pose in the map that the controller saw before each command.
    seen: list[Pose]
    #: Stamp of the step after which the map was moved.
    corrected: int
    #: Stamp of each odom to base_link, and the newest one of map to odom that was there by then.
    reach: list[tuple[int, int]]


def stamp(time: Any) -> int:
    """Return a stamp [ns]."""
    return int(time.sec) * SECOND + int(time.nanosec)


def transforms(messages: list[Any], parent: str, child: str) -> list[tuple[int, Pose]]:
    """Return stamps and poses of one transform."""
    found = []
    for one in itertools.chain.from_iterable(message.transforms for message in messages):
        if (one.header.frame_id, one.child_frame_id) == (parent, child):
            place = one.transform.translation
            turn = one.transform.rotation
            found.append((stamp(one.header.stamp),
                          Pose(place.x, place.y, 2.0 * math.atan2(turn.z, turn.w))))
    return found


def look_up(samples: list[tuple[int, Pose]], when: int) -> Pose:
    """Return a transform at a stamp as tf2's cache does: linear between the neighbours."""
    stamps = [one[0] for one in samples]
    place = bisect.bisect_right(stamps, when) - 1
    before, pose = samples[place]
    if before == when:
        return pose
    after, other = samples[place + 1]
    part = (when - before) / (after - before)
    turn = math.remainder(other.heading - pose.heading, math.tau)
    return Pose(pose.x + part * (other.x - pose.x), pose.y + part * (other.y - pose.y),
                pose.heading + part * turn)


def reach(messages: list[Any]) -> list[tuple[int, int]]:
    """Return the stamp of each odom to base_link, and the newest of map to odom before it."""
    found, newest = [], -1
    for message in messages:
        for when, _ in transforms([message], 'map', 'odom'):
            newest = max(newest, when)
        found += [(when, newest) for when, _ in transforms([message], 'odom', 'base_link')]
    return found


class Stack:
    """The ends of a navigation stack, and a node in the same process that steps when told to."""

    def __init__(self, probe: Probe, **values: Any) -> None:
        """Listen, then make the node with the parameters that the docs give."""
        self.probe = probe
        listen = probe.listen
        self.clock = listen('rosgraph_msgs/msg/Clock', '/clock', 500)
        self.odometry = listen('nav_msgs/msg/Odometry', '/platform/odom', 500)
        self.truth = listen('nav_msgs/msg/Odometry', '/ground_truth', 500)
        self.tf = listen('tf2_msgs/msg/TFMessage', '/tf', 500)
        self.scans = listen('sensor_msgs/msg/LaserScan', '/sensors/lidar2d_0/scan', BEST_EFFORT)
        self.lists = (self.clock, self.odometry, self.truth, self.tf, self.scans)
        self.map, self._map = probe.talk('nav_msgs/msg/OccupancyGrid', '/map', LATCHED)
        self.pose, self._pose = probe.talk(
            'geometry_msgs/msg/PoseWithCovarianceStamped', '/initialpose')
        self.command, self._command = probe.talk(
            'geometry_msgs/msg/TwistStamped', '/platform/cmd_vel', api.QoSProfile(depth=1))
        given = read_yaml(config_path('nav2.yaml'), SettingsError)['/**']['ros__parameters']
        self.node = SimNode('lockstep', parameter_overrides=[
            api.parameter(name, value) for name, value in {
                **given, 'preset': 'clearpath_jazzy', 'start_paused': True,
                'sensor_noise': True, 'scan_stddev': 0.001, **values}.items()])
        probe._executor.add_node(self.node)
        self.taken = 0
        take = self.node.engine.command

        def counted(twist: Any) -> bool:
            self.taken += 1
            return take(twist)
        self.node.engine.command = counted  # type: ignore[method-assign]

    def close(self) -> None:
        """Leave the graph."""
        self.probe._executor.remove_node(self.node)
        self.node.destroy_node()

    def say_map(self) -> None:
        """Publish the room as map_server does."""
        count = round(2.0 * WALL / CELL) + 2
        message = self._map()
        message.header.frame_id = 'map'
        message.info.resolution, message.info.width, message.info.height = CELL, count, count
        message.info.origin.position.x = message.info.origin.position.y = -WALL - CELL
        message.data = [100 if {0, count - 1} & {row, column} else 0
                        for row in range(count) for column in range(count)]
        self.map.publish(message)

    def say_pose(self, pose: Pose) -> None:
        """Correct the pose as a localisation or RViz does, and wait until it is known."""
        before = self.node.navigation._world
        message = self._pose()
        message.header.frame_id = 'map'
        message.pose.pose.position.x, message.pose.pose.position.y = pose.x, pose.y
        message.pose.pose.orientation.z = math.sin(0.5 * pose.heading)
        message.pose.pose.orientation.w = math.cos(0.5 * pose.heading)
        self.pose.publish(message)
        assert self.probe.until(lambda: self.node.navigation._world != before)

    def say_command(self, forward: float, yaw: float) -> None:
        """Command with the stamp of /clock, and wait until it has come."""
        message = self._command()
        message.header.stamp = self.clock[-1].clock
        message.twist.linear.x, message.twist.angular.z = forward, yaw
        wanted = self.taken + 1
        self.command.publish(message)
        assert self.probe.until(lambda: self.taken == wanted)

    def step(self, count: int) -> None:
        """Let the node make steps, and wait until all that it published has come."""
        told: list[bool] = []
        self.node.advance(count, told.append)
        # A bunch of steps ends after 20 ms of the wall; the rest follows.
        assert self.probe.until(lambda: told == [True])
        self.hear()

    def hear(self) -> None:
        """Wait until all that was published has come."""
        now = round(self.node.reading.time * SECOND)
        # Of the scans, each one that was due since time began.
        due = now - now % (SCAN * STEP)
        assert self.probe.until(lambda: all(
            messages and stamp(getattr(messages[-1], 'clock', None)
                               or messages[-1].header.stamp) == when
            for messages, when in ((self.clock, now), (self.odometry, now), (self.truth, now),
                                   (self.scans, due)))
            and transforms(self.tf[-2:], 'odom', 'base_link')[-1:]
            and transforms(self.tf[-2:], 'odom', 'base_link')[-1][0] == now
            and transforms(self.tf[-2:], 'map', 'odom')[-1:]
            and transforms(self.tf[-2:], 'map', 'odom')[-1][0] == now + STEP - 1)

    def ready(self, before: int) -> None:
        """Wait until each end is connected, make some steps, and begin time anew."""
        self.say_map()
        assert self.probe.until(lambda: self.pose.get_subscription_count() > 0
                                and self.command.get_subscription_count() > 0
                                and self.node.navigation._map is not None)
        # Any number of steps: what follows a reset of time does not depend on what was before.
        while not all(self.lists):
            self.node.advance(2)
            self.probe.spin(0.02)
        self.step(before)
        self.node.reset(time=True)
        self.hear()
        self.probe.spin(0.05)
        for messages in self.lists:
            messages.clear()
        self.say_pose(START)
        self.step(SCAN)

    def in_map(self) -> Pose:
        """Return where the newest transforms show the robot in the map."""
        return compose(transforms(self.tf[-2:], 'map', 'odom')[-1][1],
                       transforms(self.tf[-2:], 'odom', 'base_link')[-1][1])

    def navigate(self, before: int) -> Heard:
        """Pursue a goal by the curvature to a point at the lookahead distance."""
        self.ready(before)
        seen: list[Pose] = []
        corrected = 0
        while True:
            pose = self.in_map()
            left = math.dist((pose.x, pose.y), GOAL)
            if left < NEAR:
                break
            assert len(seen) < 600
            if len(seen) == CORRECTED:
                corrected = stamp(self.clock[-1].clock)
                self.say_pose(Pose(pose.x, pose.y + CORRECTION, pose.heading))
            seen.append(pose)
            angle = math.remainder(
                math.atan2(GOAL[1] - pose.y, GOAL[0] - pose.x) - pose.heading, math.tau)
            if abs(angle) > TURN_FROM:
                self.say_command(0.0, math.copysign(1.0, angle))
            else:
                ahead = min(LOOKAHEAD, left)
                self.say_command(DESIRED, DESIRED * 2.0 * math.sin(angle) / ahead)
            self.step(EVERY)
        return Heard(
            # While paused, the time is said again and again for who joins late; zero too.
            [when for when, _ in itertools.groupby(stamp(one.clock) for one in self.clock)
             if when > 0],
            [(stamp(one.header.stamp), pose_from_msg(one.pose.pose), one.twist.twist.linear.x)
             for one in self.odometry],
            [(stamp(one.header.stamp), pose_from_msg(one.pose.pose)) for one in self.truth],
            transforms(self.tf, 'map', 'odom'), transforms(self.tf, 'odom', 'base_link'),
            [(stamp(one.header.stamp), np.asarray(one.ranges, np.float32).tobytes())
             for one in self.scans], seen, corrected, reach(self.tf))


def to_walls(pose: Pose, angles: FloatArray) -> FloatArray:
    """Return the ranges in the room, by geometry."""
    found = []
    for angle in angles + pose.heading:
        cos, sin = math.cos(angle), math.sin(angle)
        found.append(min((math.copysign(WALL, part) - place) / part if part else math.inf
                         for place, part in ((pose.x, cos), (pose.y, sin))))
    return np.asarray(found)


@pytest.fixture(scope='module', params=['paper', 'real'])
def twice(request: pytest.FixtureRequest, probe: Probe, tmp_path_factory: pytest.TempPathFactory
          ) -> tuple[Heard, Heard]:
    """Navigate twice: with the paper's model, and as a real Husky whose tf is of its wheels."""
    values: dict[str, object] = {}
    if request.param == 'real':
        path = tmp_path_factory.mktemp('model') / 'real.yaml'
        robot = Husky().replacing(wheel_radius=0.158)
        robot = robot.with_effect('command_latency', latency=0.1)
        robot = robot.with_effect('command_slew', shape='both', slew_forward=1.0, slew_yaw=1.0)
        robot.with_effect('yaw_scrub_coulomb', yaw_coulomb_moment=8.0).save(str(path))
        values = {'model': str(path), 'tf_source': 'wheels'}
    runs = []
    for before in (SCAN, 2 * SCAN + 2):
        stack = Stack(probe, **values)
        try:
            runs.append(stack.navigate(before))
        finally:
            stack.close()
    return runs[0], runs[1]


def test_a_navigation_is_the_same_bit_for_bit(twice: tuple[Heard, Heard]) -> None:
    """Every message, with noise; however many steps were made before time began anew."""
    first, second = twice
    # Compared here, as pytest would take long to show how such lists differ.
    differ = [name for name in Heard._fields if getattr(first, name) != getattr(second, name)]
    assert not differ
    assert len(first.seen) > 100


def test_time_and_streams_have_no_gap(twice: tuple[Heard, Heard]) -> None:
    """One of each stream a step, a scan every tenth of a second, map to odom held until next."""
    heard = twice[0]
    steps = list(range(heard.clock[0], heard.clock[-1] + 1, STEP))
    assert heard.clock == steps
    for stream in (heard.odometry, heard.truth, heard.inner):
        assert [one[0] for one in stream] == steps
    # Said at once, and not with the next step, where the map is moved while time stands.
    moved = [0, *steps, heard.corrected]
    assert [one[0] for one in heard.outer] == [
        one + later for one in sorted(moved) for later in (0, STEP - 1)]
    assert [one[0] for one in heard.scans] == [one for one in steps if one % (SCAN * STEP) == 0]


def test_each_scan_shows_the_room_from_where_the_frames_are(twice: tuple[Heard, Heard]) -> None:
    """Looked up at its own stamp, the laser is where it truly was; ranges follow by geometry."""
    heard, worst = twice[0], 0.0
    truth = dict(heard.truth)
    angles = np.asarray(-math.pi + 0.0261 * np.arange(240), dtype=np.float64)
    # A later one of the same stamp counts, as in tf2.
    outer = sorted(heard.outer, key=lambda one: one[0])
    for when, ranges in heard.scans:
        if when == heard.corrected:
            # The map was moved after this scan.
            continue
        pose = compose(look_up(outer, when), look_up(heard.inner, when))
        if when < heard.corrected:
            true = compose(START, truth[when])
            assert math.dist((pose.x, pose.y), (true.x, true.y)) < 1e-9
            assert math.remainder(pose.heading - true.heading, math.tau) == pytest.approx(
                0.0, abs=1e-9)
        apart = np.frombuffer(ranges, np.float32) - to_walls(pose, angles)
        worst = max(worst, float(np.abs(apart).max()))
    # Noise of 1 mm on 240 rays, no drift of the wheels: 0.13 m with transforms a step late.
    assert worst < 0.006


def test_the_newest_step_can_be_looked_up_at_once(twice: tuple[Heard, Heard]) -> None:
    """As nav2_loopback_sim and AMCL see to by dating map to odom ahead."""
    heard = twice[0]
    assert [one[0] for one in heard.reach] == [one[0] for one in heard.inner]
    assert all(newest >= when for when, newest in heard.reach)


def test_odometry_says_the_speed_with_which_its_pose_moves(twice: tuple[Heard, Heard]) -> None:
    """Twist in the base's frame, a mean of two steps; accelerations are within 1 m/s²."""
    for (_, a, _), (_, b, speed) in itertools.pairwise(twice[0].odometry):
        moved = ((b.x - a.x) * math.cos(b.heading) + (b.y - a.y) * math.sin(b.heading)) / 0.02
        assert speed == pytest.approx(moved, abs=0.05)


def test_a_correction_moves_the_robot_in_the_map_and_not_in_odom(
        twice: tuple[Heard, Heard]) -> None:
    """The controller sees the correction with its next command, and the odometry no jump."""
    heard = twice[0]
    jumps = [math.dist((a.x, a.y), (b.x, b.y)) for a, b in itertools.pairwise(heard.seen)]
    assert int(np.argmax(jumps)) == CORRECTED
    assert max(jumps) == pytest.approx(CORRECTION, abs=0.04)
    assert max(math.dist((a.x, a.y), (b.x, b.y)) for (_, a), (_, b) in itertools.pairwise(
        heard.inner)) < 0.015
