# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The node with ends as Nav2's nodes make them (row 59): topics, types, QoS, frames, stamps."""

from __future__ import annotations

from collections.abc import Callable
import math
from pathlib import Path
from typing import Any

from lg_husky_sim.ros import api
from lg_husky_sim.testing.live import LiveHusky, Probe
import pytest

PARAMETERS = Path(__file__).resolve().parent.parent.parent / 'config' / 'nav2.yaml'
#: Nav2's `transform_tolerance` of controller and behaviours, the smallest in its nav2_params.yaml.
TOLERANCE = 0.1
BEST_EFFORT = api.ReliabilityPolicy.BEST_EFFORT
LATCHED = api.DurabilityPolicy.TRANSIENT_LOCAL
#: Who subscribes in Nav2 1.3, and how: ObstacleLayer (sensor data, depth 50), OdomSmoother (the
#: system's default), TransformListener (twice), rclcpp's TimeSource (ClockQoS).
EARS = {
    'scan': ('sensor_msgs/msg/LaserScan', '/sensors/lidar2d_0/scan',
             api.QoSProfile(depth=50, reliability=BEST_EFFORT)),
    'odom': ('nav_msgs/msg/Odometry', '/platform/odom', api.QoSProfile(depth=1)),
    'tf': ('tf2_msgs/msg/TFMessage', '/tf', api.QoSProfile(depth=100)),
    'static': ('tf2_msgs/msg/TFMessage', '/tf_static',
               api.QoSProfile(depth=100, durability=LATCHED)),
    'clock': ('rosgraph_msgs/msg/Clock', '/clock',
              api.QoSProfile(depth=1, reliability=BEST_EFFORT)),
}


def seconds(stamp: Any) -> float:
    """Return a stamp in seconds."""
    return float(stamp.sec + 1e-9 * stamp.nanosec)


def newest(heard: list[Any], parent: str, child: str) -> Any:
    """Return the last transform between two frames, or None."""
    return next((one for message in reversed(heard) for one in message.transforms
                 if (one.header.frame_id, one.child_frame_id) == (parent, child)), None)


@pytest.fixture
def heard(probe: Probe, start: Callable[..., LiveHusky]) -> dict[str, list[Any]]:
    """Listen as Nav2 does, publish a room as map_server does, and start the node."""
    ears = {name: probe.listen(*how) for name, how in EARS.items()}
    mouth, kind = probe.talk('nav_msgs/msg/OccupancyGrid', '/map',
                             api.QoSProfile(depth=1, durability=LATCHED))
    room = kind()
    room.header.frame_id = 'map'
    room.info.resolution, room.info.width, room.info.height = 0.5, 20, 20
    room.info.origin.position.x = room.info.origin.position.y = -5.0
    room.data = [100 if 0 in (row, column) or 19 in (row, column) else 0
                 for row in range(20) for column in range(20)]
    mouth.publish(room)
    start(arguments=('--params-file', str(PARAMETERS)), preset='clearpath_jazzy').ready(
        ears['odom'])
    assert probe.until(lambda: len(ears['scan']) > 2 and newest(ears['tf'], 'map', 'odom')
                       and max(ears['scan'][-1].ranges) < 7.0 and ears['clock'], 30.0)
    return ears


def test_every_end_of_nav2_hears_the_node(probe: Probe, heard: dict[str, list[Any]]) -> None:
    """Frames are joined from the map to the laser, and no stamp is older than Nav2 bears."""
    scan, odom = heard['scan'][-1], heard['odom'][-1]
    assert (odom.header.frame_id, odom.child_frame_id) == ('odom', 'base_link')
    assert newest(heard['static'], 'base_link', scan.header.frame_id) is not None
    # Of one instant of the probe: the clock, and the transforms that it could look up then.
    for _ in range(20):
        heard['tf'].clear()
        assert probe.until(lambda: newest(heard['tf'], 'odom', 'base_link') is not None
                           and newest(heard['tf'], 'map', 'odom') is not None)
        # The clock's depth of 1 and the transforms' queues are served in any order.
        now = seconds(heard['clock'][-1].clock)
        for parent, child in (('odom', 'base_link'), ('map', 'odom')):
            stamp = seconds(newest(heard['tf'], parent, child).header.stamp)
            assert abs(now - stamp) < TOLERANCE
    # What the message filter of the costmap waits for: a transform as new as the scan.
    stamp = seconds(heard['scan'][-1].header.stamp)
    assert probe.until(
        lambda: seconds(newest(heard['tf'], 'odom', 'base_link').header.stamp) >= stamp)


def test_commands_as_nav2_sends_them_drive_to_a_goal(
        probe: Probe, heard: dict[str, list[Any]]) -> None:
    """TwistStamped, reliable, depth 1, stamped by /clock at 20 Hz; the pose comes from tf."""
    mouth, kind = probe.talk('geometry_msgs/msg/TwistStamped', '/platform/cmd_vel',
                             api.QoSProfile(depth=1))
    assert probe.until(lambda: mouth.get_subscription_count() > 0)
    goal, begun = (1.0, 1.0), seconds(heard['clock'][-1].clock)
    left, last = math.inf, -math.inf
    while left > 0.25:
        assert probe.until(lambda before=last: seconds(  # type: ignore[misc]
            heard['clock'][-1].clock) >= before + 0.05)
        last = seconds(heard['clock'][-1].clock)
        assert last - begun < 30.0
        outer = newest(heard['tf'], 'map', 'odom').transform
        assert (outer.translation.x, outer.translation.y, outer.rotation.z) == pytest.approx(
            (0.0, 0.0, 0.0), abs=1e-9)
        place = newest(heard['tf'], 'odom', 'base_link').transform
        x, y = place.translation.x, place.translation.y
        angle = math.remainder(math.atan2(goal[1] - y, goal[0] - x)
                               - 2.0 * math.atan2(place.rotation.z, place.rotation.w), math.tau)
        left = math.dist((x, y), goal)
        command = kind()
        command.header.frame_id = 'base_link'
        command.header.stamp = heard['clock'][-1].clock
        command.twist.linear.x = 0.4 if abs(angle) < 0.5 else 0.0
        command.twist.angular.z = max(-1.0, min(1.0, 2.0 * angle))
        mouth.publish(command)
    assert last > begun + 2.0
