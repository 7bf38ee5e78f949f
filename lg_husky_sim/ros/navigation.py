# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What a navigation stack needs beside a robot: map to odom, and a laser scan of the map."""

from __future__ import annotations

import math
from typing import Any

from lg_husky_sim.errors import SettingsError
from lg_husky_sim.ros import api, conversions
from lg_husky_sim.ros.api import message_type, Node
from lg_husky_sim.ros.engine import Reading
from lg_husky_sim.ros.occupancy import map_from_msg, OccupancyMap, read_map
from lg_husky_sim.ros.settings import Settings
from lg_husky_sim.signals import FloatArray, Pose
import numpy as np

_SECOND = 1_000_000_000
_LATCHED = api.QoSProfile(depth=1, durability=api.DurabilityPolicy.TRANSIENT_LOCAL)


def compose(outer: Pose, inner: Pose) -> Pose:
    """Return a pose in the frame in which the pose of its own frame is given."""
    cos, sin = math.cos(outer.heading), math.sin(outer.heading)
    return Pose(outer.x + cos * inner.x - sin * inner.y, outer.y + sin * inner.x + cos * inner.y,
                outer.heading + inner.heading)


def inverse(pose: Pose) -> Pose:
    """Return where a frame stands in the frame of its own pose."""
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    return Pose(-cos * pose.x - sin * pose.y, sin * pose.x - cos * pose.y, -pose.heading)


def scan_angles(settings: Settings) -> FloatArray:
    """Return the angles of a scan's rays [rad], as many as nav2_loopback_sim has."""
    span = settings.scan_angle_max - settings.scan_angle_min
    count = max(1, int(span / settings.scan_angle_increment))
    steps = np.arange(count, dtype=np.float64)
    return np.asarray(settings.scan_angle_min + settings.scan_angle_increment * steps)


class Navigation:
    """
    The part of a localisation that knows the truth, and a laser that sees a map.

    Parameters
    ----------
    node : Node
    settings : Settings

    Raises
    ------
    SettingsError
        If the map's file cannot be used.

    """

    def __init__(self, node: Node, settings: Settings) -> None:
        """Make what the settings ask for; the frames of map and odometry are one at first."""
        self._node, self._settings = node, settings
        #: Pose of the truth's frame in the map.
        self._world = Pose()
        self._truth = Pose()
        self._map: OccupancyMap | None = None
        self._tf: Any = None
        self._scan: Any = None
        self._random = self._noise()
        if settings.publish_map_tf:
            self._tf = self._publisher('tf2_msgs/msg/TFMessage', 'tf', 100)
            self._tf_message = conversions.transform_message(
                settings.map_frame, settings.odom_frame, 2)
        if settings.scan != 'none':
            self._start_scan()

    def _noise(self) -> np.random.Generator:
        # A stream of its own: the noise of other sensors does not depend on the scan.
        return np.random.default_rng((self._settings.seed, 1))

    def _publisher(self, kind: str, topic: str, qos: Any) -> Any:
        message = message_type(kind)
        if message is None:
            self._node.get_logger().warning(
                f'{topic} is not published: message package {kind.split("/")[0]} is missing')
            return None
        return self._node.create_publisher(message, topic, qos)

    def _start_scan(self) -> None:
        one = self._settings
        self._every = one.every('scan_rate')
        self._angles = scan_angles(one)
        self._mount = Pose(one.scan_x, one.scan_y, one.scan_heading)
        # As sensors do; a reliable reader does not match it.
        self._scan = self._publisher(
            'sensor_msgs/msg/LaserScan', one.scan_topic, api.QoSProfile(
                depth=10, reliability=api.ReliabilityPolicy.BEST_EFFORT))
        self._scan_message = conversions.scan_message(one)
        self._static: Any = None
        if one.publish_scan_tf:
            self._static = self._publisher('tf2_msgs/msg/TFMessage', 'tf_static', _LATCHED)
        if self._static is not None:
            mounted = conversions.transform_message(one.base_frame, one.scan_frame)
            conversions.fill_transform(mounted, 0, self._mount)
            self._static.publish(mounted)
        if one.scan == 'map' and one.map_file:
            self._map = read_map(one.map_file, one.map_occupied)
        elif one.scan == 'map':
            self._node.create_subscription(
                message_type('nav_msgs/msg/OccupancyGrid'), one.map_topic, self._on_map,
                _LATCHED)

    def _on_map(self, msg: Any) -> None:
        log = self._node.get_logger()
        if msg.header.frame_id not in ('', self._settings.map_frame):
            log.warning(f'map ignored: frame {msg.header.frame_id!r} is not '
                        f'{self._settings.map_frame!r}', throttle_duration_sec=1.0)
            return
        try:
            self._map = map_from_msg(msg, self._settings.map_occupied)
        except SettingsError as error:
            log.warning(f'map refused: {error}', throttle_duration_sec=1.0)
            return
        log.info(f'the scan sees a map of {msg.info.width} × {msg.info.height} cells')

    def configure(self, settings: Settings) -> None:
        """Take live settings."""
        self._settings = settings

    def correct(self, pose: Pose) -> None:
        """Let the robot be somewhere in the map, by moving the map."""
        self._world = compose(pose, inverse(self._truth))

    def forget(self, *, time: bool) -> None:
        """Let the frames of map and odometry be one again; with the time, noise starts anew."""
        self._world = Pose()
        if time:
            self._random = self._noise()

    def locate(self, reading: Reading, nanoseconds: int) -> None:
        """
        Publish map to odom: at the step, and held until just before the next one.

        Looked up at the step's stamp it is what it was then; from then on nobody waits for it.
        One transform that is stamped a step ahead, as nav2_loopback_sim's, would put all that the
        wheels drift in a step between the robot and what its sensors see.

        Parameters
        ----------
        reading : Reading
            Of the step.
        nanoseconds : int
            Stamp of the step.

        """
        one = self._settings
        self._truth = reading.pose
        if self._tf is None:
            return
        # A robot whose odometry somebody else puts on tf is taken to be where that says.
        shown = reading.wheel_pose if one.publish_tf and one.tf_source == 'wheels' else (
            reading.pose)
        place = compose(compose(self._world, reading.pose), inverse(shown))
        spacing = one.period if one.publish_clock else one.period / (one.speed or 1.0)
        for index, stamp in enumerate((nanoseconds, nanoseconds + round(_SECOND * spacing) - 1)):
            conversions.fill_transform(self._tf_message, stamp, place, index)
        self._tf.publish(self._tf_message)

    def publish(self, reading: Reading, nanoseconds: int) -> None:
        """
        Publish the scan, if one is due after a step.

        Parameters
        ----------
        reading : Reading
            Of the step.
        nanoseconds : int
            Stamp of the step.

        """
        if self._scan is not None and reading.step % self._every == 0:
            conversions.set_stamp(self._scan_message.header.stamp, nanoseconds)
            self._scan_message.ranges = self._ranges(reading.pose).astype(np.float32)
            self._scan.publish(self._scan_message)

    def _ranges(self, pose: Pose) -> FloatArray:
        one = self._settings
        ranges: FloatArray = np.full(self._angles.size, np.inf)
        if self._map is not None:
            place = compose(compose(self._world, pose), self._mount)
            ranges = self._map.ranges(place, self._angles, one.scan_range_max)
            if one.sensor_noise and one.scan_stddev:
                # Drawn for all, so that what one ray hits does not change another's noise.
                noise = self._random.standard_normal(ranges.size)
                ranges = np.maximum(ranges + one.scan_stddev * noise, 0.0)
        if not one.scan_use_inf:
            ranges[np.isinf(ranges)] = one.scan_range_max - 0.1
        return ranges
