# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Record the robot's topics into a rosbag2 that is readable whenever it ends."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
import shutil
import time
from typing import Any

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.ros import api
from lg_husky_sim.ros.bag_writer import bag_writer
from lg_husky_sim.ros.graph import Endpoint, publishers
from lg_husky_sim.ros.settings import Settings
from lg_husky_sim.ros.tool import Elapsed, Ended, LOOK, Say, Tool

NAME = 'lg_husky_recorder'
#: Samples kept while the disk is busy.
_DEPTH = 1000
#: Most that a killed process loses [s]; half of it passes between two flushes.
LOSES = 1.0
#: Time between two lines of running counts [s].
EVERY = 5.0
#: Most of a recorder's time that goes into looks at who publishes; messages wait meanwhile.
SHARE = 0.05
#: A publisher's clock that is further from this machine's is another clock [s]. Whoever reads
#: recordings leaves clocks alone that are closer than this (``SKEW_NS`` of recording/clock.py).
SAME_CLOCK = 0.5


def recorded_topics(settings: Settings) -> dict[str, str]:
    """Return topic and type of everything that a robot of a preset sends and takes."""
    topics = {
        settings.command_topic: f'geometry_msgs/msg/{settings.command_type}',
        settings.odometry_topic: 'nav_msgs/msg/Odometry',
        settings.ground_truth_topic: 'nav_msgs/msg/Odometry',
        settings.joint_states_topic: 'sensor_msgs/msg/JointState',
        settings.imu_topic: 'sensor_msgs/msg/Imu',
        settings.battery_topic: 'sensor_msgs/msg/BatteryState',
        # Those of the robot's own, as Clearpath has them, and those of the whole graph.
        'tf': 'tf2_msgs/msg/TFMessage',
        'tf_static': 'tf2_msgs/msg/TFMessage',
        '/tf': 'tf2_msgs/msg/TFMessage',
        '/tf_static': 'tf2_msgs/msg/TFMessage',
    }
    return {topic: kind for topic, kind in topics.items() if api.message_type(kind) is not None}


def adapted(ends: Iterable[Endpoint], kind: str) -> tuple[bool, bool]:
    """
    Return the quality of service that gets the most from all publishers of a type.

    Returns
    -------
    reliable, latched : bool
        Reliable unless somebody is not; what was said before if everybody keeps it.

    """
    ends = [end for end in ends if end.kind == kind]
    return all(end.reliable for end in ends), bool(ends) and all(end.latched for end in ends)


def moment(sent: int, received: int) -> int:
    """
    Return when a message was said that does not tell it in a header [ns].

    Messages that a busy machine receives in bursts were not sent in bursts: the moment of the
    sending counts, where it is by the same clock. What was kept for late joiners, and what is by
    another clock, counts as received.

    Parameters
    ----------
    sent : int
        By the publisher's clock, as the middleware tells it [ns]; any number where it does not.
    received : int
        By this machine's clock [ns].

    """
    return sent if abs(received - sent) <= SAME_CLOCK * 1e9 else received


def _simulated(node: api.Node) -> Callable[[], int]:
    clock = node.get_clock()
    return lambda: int(clock.now().nanoseconds)


class Recorder:
    """
    Subscribes to topics as their publishers offer them and writes what comes into a bag.

    Parameters
    ----------
    node : api.Node
        Whoever spins it makes the recording go on. Messages are stamped by the system's clock
        when they are received, those without a header when they were sent (:func:`moment`); with
        the node's ``use_sim_time`` all by /clock when they are received.
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
        """Open the bag and begin to look for publishers."""
        self.path = path
        self.counts: dict[str, int] = {}
        self._node = node
        simulated = node.get_parameter('use_sim_time').value
        self._now = _simulated(node) if simulated else time.time_ns
        self._headless = set[str]() if simulated else {
            kind for kind in topics.values() if not hasattr(api.message_type(kind)(), 'header')}
        self._next_look = 0.0
        self._writer: Any = bag_writer(path, storage)
        self._kinds = {node.resolve_topic_name(topic): kind for topic, kind in topics.items()}
        self._heard: dict[str, tuple[tuple[bool, bool], Any]] = {}
        for name, kind in self._kinds.items():
            self._writer.add(name, kind)
            self.counts[name] = 0
            # So the first command of a driver that appears later is not missed.
            self._subscribe(name, (True, False))
        self._timers = [api.steady_timer(node, LOOK, self._look),
                        api.steady_timer(node, 0.5 * LOSES, self._writer.flush)]

    def _subscribe(self, topic: str, quality: tuple[bool, bool]) -> None:
        reliable, latched = quality
        profile = api.QoSProfile(
            depth=_DEPTH,
            reliability=api.ReliabilityPolicy.RELIABLE if reliable
            else api.ReliabilityPolicy.BEST_EFFORT,
            durability=api.DurabilityPolicy.TRANSIENT_LOCAL if latched
            else api.DurabilityPolicy.VOLATILE)
        self._heard[topic] = (quality, api.raw_subscription(
            self._node, self._kinds[topic], topic, self._writing(topic), profile))

    def _look(self) -> None:
        if time.monotonic() < self._next_look:
            return
        # Of the processor's time: a look that others interrupt is not put off for that.
        begun = time.thread_time()
        for topic, kind in self._kinds.items():
            quality, subscription = self._heard[topic]
            ends = publishers(self._node, topic)
            wanted = adapted(ends, kind)
            if ends and wanted != quality:
                self._node.destroy_subscription(subscription)
                self._subscribe(topic, wanted)
        self._next_look = time.monotonic() + (time.thread_time() - begun) / SHARE

    def _writing(self, topic: str) -> Callable[[bytes, int], None]:
        headless = self._kinds[topic] in self._headless

        def write(raw: bytes, sent: int) -> None:
            if self._writer is not None:
                now = self._now()
                self._writer.write(topic, moment(sent, now) if headless else now, raw)
                self.counts[topic] += 1
        return write

    def close(self, *, keep: bool = True) -> None:
        """
        End the recording.

        Parameters
        ----------
        keep : bool
            Whether the bag shall stay, or be thrown away.

        """
        if self._writer is None:
            return
        writer, self._writer = self._writer, None
        for timer in self._timers:
            self._node.destroy_timer(timer)
        for _, subscription in self._heard.values():
            self._node.destroy_subscription(subscription)
        writer.close()
        if not keep:
            shutil.rmtree(self.path)


def running(counts: Mapping[str, int], seconds: float) -> str:
    """Return how much has come so far, in a line."""
    heard = {topic: count for topic, count in counts.items() if count}
    words = ', '.join(f'{topic} {count}' for topic, count in heard.items())
    return f'{seconds:7.1f} s  {sum(counts.values())} messages' + (f': {words}' if words else '')


def _await_first(tool: Tool, recorder: Recorder) -> None:
    # Fast DDS tells of a robot up to seconds after the recorder has joined.
    while not any(recorder.counts.values()) and not tool.orderly.acquainted:
        tool.serve()


def record(tool: Tool, path: Path, settings: Settings, *, storage: str = 'mcap',
           seconds: float | None = None, wait: float = 10.0, say: Say = print
           ) -> dict[str, int]:
    """
    Record until the time is over or the tool is asked to end.

    Parameters
    ----------
    tool : Tool
        Serves the subscriptions.
    path : Path
        Folder to make.
    settings : Settings
        Names of the topics.
    storage : str
        ``mcap`` or ``sqlite3``.
    seconds : float, optional
        How long [s], from the first message on, or from when all in the graph are known; of
        simulated time with ``use_sim_time``.
    wait : float
        How long to wait for the first /clock with ``use_sim_time`` [s].
    say : callable
        Is told at once what is listened to, and every few seconds how much has come.

    Returns
    -------
    dict
        Messages of each topic.

    Raises
    ------
    RecordingError
        If nothing came; no bag is left then.
    CommandError
        If simulated time is asked for and nobody publishes it.

    """
    if tool.simulated:
        say('waiting for /clock')
        tool.wait_for_time(wait)
    recorder = Recorder(tool.node, path, recorded_topics(settings), storage)
    try:
        say(f'listening to {", ".join(recorder.counts)}')
        try:
            _await_first(tool, recorder)
            say('recording ' + ('until Ctrl-C' if seconds is None else f'for {seconds:g} s')
                + ('' if any(recorder.counts.values()) else '; nothing has been received yet'))
            passed, due = Elapsed(tool.now), time.monotonic() + EVERY
            while seconds is None or passed() < seconds:
                tool.serve()
                if time.monotonic() >= due:
                    due += EVERY
                    say(running(recorder.counts, passed()))
        except Ended:
            say('stopped')
        empty = not any(recorder.counts.values())
        recorder.close(keep=not empty)
        if empty:
            present = ', '.join(name for name, _ in tool.node.get_topic_names_and_types()
                                if name not in recorder.counts)
            raise RecordingError(
                f'nothing was received on {", ".join(recorder.counts)}; nothing is written. In '
                'the graph '
                f'({api.describe_backend()}) there are: {present or "no topics"}')
        return recorder.counts
    finally:
        recorder.close(keep=any(recorder.counts.values()))
