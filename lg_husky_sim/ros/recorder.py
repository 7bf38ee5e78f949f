# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Record the robot's topics into a rosbag2, which appears whole or not at all."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from os import replace
from pathlib import Path
import shutil
import tempfile
import time
from typing import Any

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.extras import require
from lg_husky_sim.ros import api
from lg_husky_sim.ros.settings import Settings

NAME = 'lg_husky_recorder'
STORAGES = ('mcap', 'sqlite3')
#: Samples kept while the disk is busy.
_DEPTH = 1000


def recorded_topics(settings: Settings) -> dict[str, str]:
    """Return topic and type of everything that a robot of a preset sends and takes."""
    topics = {
        settings.command_topic: f'geometry_msgs/msg/{settings.command_type}',
        settings.odometry_topic: 'nav_msgs/msg/Odometry',
        settings.ground_truth_topic: 'nav_msgs/msg/Odometry',
        settings.joint_states_topic: 'sensor_msgs/msg/JointState',
        settings.imu_topic: 'sensor_msgs/msg/Imu',
        settings.battery_topic: 'sensor_msgs/msg/BatteryState',
        '/tf': 'tf2_msgs/msg/TFMessage',
    }
    return {topic: kind for topic, kind in topics.items() if api.message_type(kind) is not None}


class Recorder:
    """
    Subscribes to topics and writes what comes into a bag.

    Parameters
    ----------
    node : api.Node
        Whoever spins it makes the recording go on.
    path : Path
        Folder to make; must not exist yet.
    topics : mapping of str to str
        Topic to type.
    storage : str
        ``mcap`` or ``sqlite3``.

    Raises
    ------
    RecordingError
        If something is at the path, or the storage is unknown.

    """

    def __init__(self, node: api.Node, path: Path, topics: Mapping[str, str],
                 storage: str = 'mcap') -> None:
        """Open the bag and subscribe."""
        require('rosbags', 'write recordings')
        from rosbags.rosbag2 import StoragePlugin, Writer
        from rosbags.typesys import get_typestore, Stores
        if storage not in STORAGES:
            raise RecordingError(
                f'storage {storage!r} is unknown; there are {", ".join(STORAGES)}')
        if path.exists() or path.is_symlink():
            raise RecordingError(f'{path} exists already; choose another name or remove it')
        self.path = path
        self.counts: dict[str, int] = {}
        path.parent.mkdir(parents=True, exist_ok=True)
        self._scratch = tempfile.mkdtemp(prefix=f'.{path.name}.', dir=path.parent)
        self._made = Path(self._scratch) / path.name
        store = get_typestore(Stores.ROS2_JAZZY)
        plugin = StoragePlugin.MCAP if storage == 'mcap' else StoragePlugin.SQLITE3
        self._writer: Any = Writer(self._made, version=9, storage_plugin=plugin)
        self._writer.open()
        for topic, kind in topics.items():
            name = node.resolve_topic_name(topic)
            connection = self._writer.add_connection(name, kind, typestore=store)
            self.counts[name] = 0
            node.create_subscription(
                api.message_type(kind), topic, self._writing(name, connection), _DEPTH)

    def _writing(self, topic: str, connection: Any) -> Callable[[Any], None]:
        def write(message: Any) -> None:
            if self._writer is not None:
                self._writer.write(connection, time.time_ns(), api.serialised(message))
                self.counts[topic] += 1
        return write

    def close(self, *, keep: bool = True) -> None:
        """
        End the recording.

        Parameters
        ----------
        keep : bool
            Whether the bag shall appear at its path, or be thrown away.

        """
        if self._writer is None:
            return
        writer, self._writer = self._writer, None
        writer.close()
        if keep:
            replace(self._made, self.path)
        shutil.rmtree(self._scratch)


def record(path: Path, settings: Settings, *, storage: str = 'mcap',
           seconds: float | None = None) -> dict[str, int]:
    """
    Record until the time is over or Ctrl-C; needs :func:`api.init` before.

    Parameters
    ----------
    path : Path
        Folder to make.
    settings : Settings
        Names of the topics.
    storage : str
        ``mcap`` or ``sqlite3``.
    seconds : float, optional
        How long [s].

    Returns
    -------
    dict
        Messages of each topic.

    """
    node = api.Node(NAME)
    executor = api.SingleThreadedExecutor()
    executor.add_node(node)
    recorder = None
    try:
        recorder = Recorder(node, path, recorded_topics(settings), storage)
        end = None if seconds is None else time.monotonic() + seconds
        try:
            while api.ok() and (end is None or time.monotonic() < end):
                executor.spin_once(timeout_sec=0.1)
        except (KeyboardInterrupt, api.ExternalShutdownException):
            node.get_logger().info('stopped')
        recorder.close()
        return recorder.counts
    finally:
        if recorder is not None:
            recorder.close(keep=False)
        executor.shutdown()
        node.destroy_node()
