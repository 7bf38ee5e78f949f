# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What Nav2 takes from a simulator: map to odom, a scan, /initialpose, /clock (row 59)."""

from __future__ import annotations

from collections.abc import Callable
import itertools
import math
from pathlib import Path
from typing import Any

from lg_husky_sim.ros import api
from lg_husky_sim.ros.conversions import pose_from_msg
from lg_husky_sim.ros.navigation import compose, inverse
from lg_husky_sim.signals import Pose
from lg_husky_sim.testing.live import LiveHusky, Probe
import numpy as np
import pytest

#: What nav2_loopback_sim of Nav2's branch jazzy said with its defaults, recorded on ROS 2 Jazzy
#: with rmw_cyclonedds_cpp: its scan, and map to odom after odometry and initial pose.
RECORDED = {'angle_min': -math.pi, 'angle_max': math.pi, 'angle_increment': 0.0261,
            'time_increment': 0.0, 'scan_time': 0.1, 'range_min': 0.05, 'range_max': 30.0}
RAYS = 240
ODOMETRY = Pose(0.8453199875072845, 0.46180041388995174,
                2.0 * math.atan2(0.48161799451953136, 0.8763812568482879))
CORRECTED = Pose(-1.0, 4.0, -1.0)
MAP_TO_ODOM = Pose(-1.0633317373420343, 4.961152742592708,
                   2.0 * math.atan2(0.8428191095700724, -0.5381969421536229))
SENSOR = api.QoSProfile(depth=10, reliability=api.ReliabilityPolicy.BEST_EFFORT)
LATCHED = api.QoSProfile(depth=1, durability=api.DurabilityPolicy.TRANSIENT_LOCAL)


class Graph:
    """What a navigation stack would hear of a node, and say to it."""

    def __init__(self, probe: Probe, start: Callable[..., LiveHusky], **parameters: Any) -> None:
        """Listen first, then start the node in simulated time."""
        self.probe = probe
        self.tf = probe.listen('tf2_msgs/msg/TFMessage', '/tf', 100)
        self.static = probe.listen('tf2_msgs/msg/TFMessage', '/tf_static', LATCHED)
        self.scan = probe.listen('sensor_msgs/msg/LaserScan', '/scan', SENSOR)
        self.truth = probe.listen('nav_msgs/msg/Odometry', '/ground_truth')
        self.log = probe.listen('rcl_interfaces/msg/Log', '/rosout', 100)
        self.clock = probe.listen('rosgraph_msgs/msg/Clock', '/clock')
        self.pose, self._pose_type = probe.talk(
            'geometry_msgs/msg/PoseWithCovarianceStamped', '/initialpose')
        self.map, self._map_type = probe.talk('nav_msgs/msg/OccupancyGrid', '/map', LATCHED)
        self.reset, self._bool = probe.talk('std_msgs/msg/Bool', '/sim_node/reset')
        self.command, self._twist = probe.talk(
            'geometry_msgs/msg/Twist', '/husky_velocity_controller/cmd_vel')
        for heard in (self.tf, self.static, self.scan, self.truth, self.clock):
            heard.clear()
        self.husky = start(**{'publish_clock': True, 'publish_map_tf': True, **parameters})
        self.husky.ready(self.truth)
        # Each end is found by itself, on Fast DDS seconds apart; tf may come long after the truth.
        assert probe.until(lambda: self.pose.get_subscription_count() > 0
                           and self.command.get_subscription_count() > 0
                           and self.transform('odom', 'base_link') is not None)

    def transform(self, parent: str, child: str) -> tuple[Pose, int] | None:
        """Return the last transform between two frames and its stamp [ns]."""
        for message in reversed(self.tf):
            for one in reversed(message.transforms):
                if (one.header.frame_id, one.child_frame_id) == (parent, child):
                    place = one.transform
                    heading = 2.0 * math.atan2(place.rotation.z, place.rotation.w)
                    stamp = one.header.stamp.sec * 10**9 + one.header.stamp.nanosec
                    return Pose(place.translation.x, place.translation.y, heading), stamp
        return None

    def in_map(self) -> Pose:
        """Return where the transforms show the robot in the map."""
        outer, inner = self.transform('map', 'odom'), self.transform('odom', 'base_link')
        assert outer is not None
        assert inner is not None
        return compose(outer[0], inner[0])

    def say_pose(self, x: float, y: float, heading: float, frame: str = 'map') -> None:
        """Send an initial pose, as RViz does."""
        message = self._pose_type()
        message.header.frame_id = frame
        message.pose.pose.position.x, message.pose.pose.position.y = x, y
        message.pose.pose.orientation.z = math.sin(0.5 * heading)
        message.pose.pose.orientation.w = math.cos(0.5 * heading)
        self.pose.publish(message)

    def drive(self, forward: float, yaw: float, seconds: float) -> None:
        """Command for some seconds of the wall."""
        message = self._twist()
        message.linear.x, message.angular.z = forward, yaw
        for _ in range(round(seconds / 0.05)):
            self.command.publish(message)
            self.probe.spin(0.05)

    def say_map(self, cells: np.ndarray[Any, np.dtype[np.int8]], resolution: float, x: float,
                y: float, frame: str = 'map') -> None:
        """Send a map, as map_server does."""
        message = self._map_type()
        message.header.frame_id = frame
        message.info.resolution = resolution
        message.info.height, message.info.width = cells.shape
        message.info.origin.position.x, message.info.origin.position.y = x, y
        message.data = [int(value) for value in cells.ravel()]
        self.map.publish(message)

    def near(self, x: float, y: float, heading: float) -> bool:
        """Return whether the transforms show the robot there in the map."""
        pose = self.in_map()
        return (math.dist((pose.x, pose.y), (x, y)) < 1e-3
                and abs(math.remainder(pose.heading - heading, math.tau)) < 1e-3)


def test_a_correction_is_the_one_that_nav2_loopback_sim_makes() -> None:
    """The recorded exchange: odometry and initial pose give its map to odom."""
    ours = compose(CORRECTED, inverse(ODOMETRY))
    assert (ours.x, ours.y) == pytest.approx((MAP_TO_ODOM.x, MAP_TO_ODOM.y), abs=1e-12)
    assert math.remainder(ours.heading - MAP_TO_ODOM.heading, math.tau) == pytest.approx(
        0.0, abs=1e-12)


def test_initial_pose_moves_the_map_and_not_the_odometry(
        probe: Probe, start: Callable[..., LiveHusky]) -> None:
    """Row 59: as a localisation does; the robot drives on and its odometry does not jump."""
    graph = Graph(probe, start)
    assert probe.until(lambda: graph.transform('map', 'odom') is not None)
    assert graph.near(0.0, 0.0, 0.0)
    graph.drive(0.5, 0.5, 1.0)
    begun = len(graph.truth)
    graph.say_pose(5.0, -3.0, 2.0)
    assert probe.until(lambda: graph.in_map().x > 4.0)
    probe.spin(1.5)
    graph.say_pose(-1.0, 4.0, -1.0)
    assert probe.until(lambda: graph.near(-1.0, 4.0, -1.0))
    odometry = [pose_from_msg(message.pose.pose) for message in graph.truth[begun - 5:]]
    steps = [math.dist((a.x, a.y), (b.x, b.y)) for a, b in itertools.pairwise(odometry)]
    assert max(steps) < 0.02
    assert odometry[-1].x > 0.2
    # Held for a step and there before the other, so that no listener waits for this one.
    outer, inner = graph.transform('map', 'odom'), graph.transform('odom', 'base_link')
    assert outer is not None
    assert inner is not None
    assert outer[1] - inner[1] in (20_000_000 - 1, 40_000_000 - 1)
    graph.say_pose(0.0, 0.0, 0.0, frame='odom')
    assert probe.until(lambda: any("frame 'odom' is not 'map'" in m.msg for m in graph.log), 5.0)
    graph.reset.publish(graph._bool(data=False))
    assert probe.until(lambda: graph.near(0.0, 0.0, 0.0))


def test_the_map_follows_where_wheel_odometry_drifts(
        probe: Probe, start: Callable[..., LiveHusky]) -> None:
    """With tf from the wheels, map to base_link is the truth and odom to base_link is not."""
    graph = Graph(probe, start, tf_source='wheels')
    graph.say_pose(1.0, 2.0, 0.0)
    assert probe.until(lambda: graph.transform('map', 'odom') is not None and graph.near(1, 2, 0))
    graph.drive(0.3, 0.8, 3.0)

    def true() -> Pose:
        return pose_from_msg(graph.truth[-1].pose.pose)
    # At rest: a slow listener hears truth and transforms of different steps.
    assert probe.until(lambda: true().heading != 0.0 and abs(
        graph.truth[-1].twist.twist.angular.z) < 1e-6)
    assert probe.until(lambda: graph.near(1.0 + true().x, 2.0 + true().y, true().heading))
    shown = graph.transform('odom', 'base_link')
    assert shown is not None
    assert abs(shown[0].heading - true().heading) > 0.05


def test_a_free_scan_is_the_one_of_nav2_loopback_sim(
        probe: Probe, start: Callable[..., LiveHusky]) -> None:
    """Same fields, number of rays, rate and quality of service; the frame is on tf_static."""
    graph = Graph(probe, start, scan='free', scan_x=0.3, scan_heading=0.1)
    assert probe.until(lambda: len(graph.scan) > 12 and graph.static)
    last = graph.scan[-1]
    for name, value in RECORDED.items():
        assert getattr(last, name) == pytest.approx(value, rel=1e-6), name
    assert (last.header.frame_id, len(last.ranges), len(last.intensities)) == (
        'base_scan', RAYS, 0)
    assert np.isposinf(np.asarray(last.ranges)).all()
    stamps = [m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in graph.scan]
    assert {b - a for a, b in itertools.pairwise(stamps)} == {100_000_000}
    (mount,) = graph.static[-1].transforms
    assert (mount.header.frame_id, mount.child_frame_id) == ('base_link', 'base_scan')
    assert mount.transform.translation.x == pytest.approx(0.3)
    assert mount.transform.rotation.z == pytest.approx(math.sin(0.05))
    ends = probe.node.get_publishers_info_by_topic('/scan')
    assert [int(end.qos_profile.reliability) for end in ends] == [
        int(api.ReliabilityPolicy.BEST_EFFORT)]


def test_the_scan_sees_the_map_that_map_server_publishes(
        probe: Probe, start: Callable[..., LiveHusky]) -> None:
    """A room of 8 m by 6 m: walls where they are, also after /initialpose; late maps count."""
    graph = Graph(probe, start, scan='map', scan_use_inf=False)
    cells = np.zeros((60, 80), dtype=np.int8)
    cells[0] = cells[-1] = cells[:, 0] = cells[:, -1] = 100
    assert probe.until(lambda: len(graph.scan) > 2)
    assert set(graph.scan[-1].ranges) == {np.float32(29.9)}
    graph.say_map(cells, 0.0, 0.0, 0.0)
    assert probe.until(lambda: any('map refused: map resolution' in m.msg for m in graph.log))
    graph.say_map(cells, 0.1, -4.0, -3.0)
    assert probe.until(lambda: max(graph.scan[-1].ranges) < 10.0)
    ranges = graph.scan[-1].ranges
    # Ray 120 looks ahead by half a part of the increment, ray 60 to the right.
    assert ranges[120] == pytest.approx(3.9, abs=0.01)
    assert ranges[60] == pytest.approx(2.9, abs=0.01)
    graph.say_pose(2.0, 0.0, math.pi)
    assert probe.until(lambda: abs(graph.scan[-1].ranges[120] - 5.9) < 0.01)
    assert graph.scan[-1].ranges[0] == pytest.approx(1.9, abs=0.01)


def test_a_map_file_is_seen_from_the_first_scan_on_or_ends_the_node_in_one_line(
        probe: Probe, start: Callable[..., LiveHusky], tmp_path: Path) -> None:
    """As map_server's files are; a file that cannot be used is exit code 1."""
    (tmp_path / 'room.pgm').write_bytes(b'P5 9 9 255\n' + bytes(
        0 if row in (0, 8) or column in (0, 8) else 254
        for row in range(9) for column in range(9)))
    path = tmp_path / 'room.yaml'
    path.write_text('image: room.pgm\nresolution: 1.0\norigin: [-4.5, -4.5, 0.0]\n',
                    encoding='utf-8')
    graph = Graph(probe, start, scan='map', map_file=str(path))
    assert probe.until(lambda: graph.scan)
    assert graph.scan[0].ranges[120] == pytest.approx(3.5, abs=0.01)
    husky = start(scan='map', map_file=str(tmp_path / 'none.yaml'))
    assert husky.node.process.wait(60) == 1
    assert "none.yaml' cannot be used: No such file or directory" in husky.node.log()
