# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What a node says of its topics at the start, and of others that publish them as well."""

from __future__ import annotations

from lg_husky_sim.ros.api import message_type, Node, steady_timer
from lg_husky_sim.ros.graph import publishers
from lg_husky_sim.ros.settings import Settings

#: Time between two looks [s].
EVERY = 1.0


def topics_out(settings: Settings) -> tuple[str, ...]:
    """Return the topics that a node of these settings publishes for itself alone."""
    names = [settings.odometry_topic, settings.ground_truth_topic, settings.joint_states_topic,
             settings.imu_topic]
    if settings.publish_battery:
        names.append(settings.battery_topic)
    if settings.scan != 'none':
        names.append(settings.scan_topic)
    if settings.publish_clock:
        names.append('/clock')
    return tuple(names)


def shared(settings: Settings) -> tuple[str, ...]:
    """Return the topics that a node of these settings shares with others, if it can at all."""
    if message_type('tf2_msgs/msg/TFMessage') is None:
        return ()
    static = settings.scan != 'none' and settings.publish_scan_tf
    moving = settings.publish_tf or settings.publish_map_tf
    return (*(['tf'] if moving else []), *(['tf_static'] if static else []))


def for_diagnosis(settings: Settings) -> tuple[str, ...]:
    """Return the topics on which a node of these settings says how it keeps time."""
    there = settings.publish_diagnostics and message_type('diagnostic_msgs/msg/DiagnosticArray')
    return ('diagnostics',) if there else ()


def announce(node: Node, settings: Settings) -> None:
    """Log which topics go in and out, under their full names."""
    def named(topics: tuple[str, ...]) -> str:
        return ', '.join(node.resolve_topic_name(topic) for topic in topics)

    log = node.get_logger()
    seen = settings.scan == 'map' and not settings.map_file
    others = (settings.initial_pose_topic, *([settings.map_topic] if seen else []))
    log.info(f'in: {named((settings.command_topic,))} ({settings.command_type}), {named(others)}')
    log.info('out: ' + named(
        (*topics_out(settings), *shared(settings), *for_diagnosis(settings))))


class Neighbours:
    """
    Warns once of each node that publishes what only one should.

    Parameters
    ----------
    node : Node
    settings : Settings

    """

    def __init__(self, node: Node, settings: Settings) -> None:
        """Begin to look."""
        self._node = node
        self._topics = topics_out(settings)
        self._known: set[tuple[str, str]] = set()
        steady_timer(node, EVERY, self.look)

    def look(self) -> None:
        """Look who publishes, and warn of who is new."""
        own = self._node.get_fully_qualified_name()
        for topic in self._topics:
            # An end whose node is not known yet is looked at again later.
            others = [end.node for end in publishers(self._node, topic)
                      if end.is_named]
            if own in others:
                others.remove(own)
            for other in others:
                if (topic, other) not in self._known:
                    self._known.add((topic, other))
                    twin = ' (of the same name)' if other == own else ''
                    self._node.get_logger().warning(
                        f'{other}{twin} publishes {self._node.resolve_topic_name(topic)} as '
                        'well: subscribers receive both')
