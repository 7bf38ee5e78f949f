# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What a node says of its topics at the start, and of others that publish them as well."""

from __future__ import annotations

from lg_husky_sim.errors import SettingsError
from lg_husky_sim.ros.api import message_type, Node, steady_timer
from lg_husky_sim.ros.graph import publishers
from lg_husky_sim.ros.settings import Settings

#: Time between two looks [s].
EVERY = 1.0


def _own(settings: Settings) -> dict[str, str]:
    # What a node of these settings publishes for itself alone, by the setting that says so.
    names = ['odometry_topic', 'ground_truth_topic', 'joint_states_topic', 'imu_topic']
    if settings.publish_battery:
        names.append('battery_topic')
    if settings.scan != 'none':
        names.append('scan_topic')
    own = {name: str(getattr(settings, name)) for name in names}
    return own | ({'publish_clock': '/clock'} if settings.publish_clock else {})


def topics_out(settings: Settings) -> tuple[str, ...]:
    """Return the topics that a node of these settings publishes for itself alone."""
    return tuple(_own(settings).values())


def topics_in(settings: Settings) -> dict[str, str]:
    """Return the topics that a node of these settings listens to, by setting."""
    seen = settings.scan == 'map' and not settings.map_file
    return {name: str(getattr(settings, name)) for name in
            ('command_topic', 'initial_pose_topic', *(['map_topic'] if seen else []))}


def refuse_doubled(node: Node, settings: Settings) -> None:
    """
    Refuse two settings that name one topic, on which messages of both would be mixed.

    Parameters
    ----------
    node : Node
        Its namespace and remappings count.
    settings : Settings
        What it publishes and listens to.

    Raises
    ------
    SettingsError
        If there are two.

    """
    first: dict[str, str] = {}
    for name, topic in (_own(settings) | topics_in(settings)).items():
        full = node.resolve_topic_name(topic)
        if full in first:
            raise SettingsError(f'{first[full]} and {name} are both {full}: each needs a topic '
                                'of its own')
        first[full] = name


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
    command, *others = topics_in(settings).values()
    log.info(f'in: {named((command,))} ({settings.command_type}), {named(tuple(others))}')
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
