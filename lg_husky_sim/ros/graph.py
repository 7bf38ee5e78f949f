# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Who is in the graph: the two ends of a topic, and the Huskies that its topics betray."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
import posixpath
from types import MappingProxyType

from lg_husky_sim.errors import SettingsError
from lg_husky_sim.ros import api
from lg_husky_sim.ros.settings import BY_NAME, make_settings, Settings

#: Settings that name what a robot is known by, beside its preset.
NAMED = ('command_topic', 'command_type', 'odometry_topic', 'joint_states_topic', 'imu_topic')
#: Nodes of ours that only listen or only talk; none of them is a robot.
TOOLS = ('lg_husky_driver', 'lg_husky_player', 'lg_husky_recorder', 'lg_husky_twin',
         'lg_husky_look')


@dataclass(frozen=True)
class Endpoint:
    """
    One end of a topic.

    Parameters
    ----------
    node : str
        Full name of the node that owns it.
    kind : str
        Type of its messages, such as ``nav_msgs/msg/Odometry``.
    reliable : bool
        Whether lost samples are sent again.
    latched : bool
        Whether late joiners get the last samples (durability transient local).

    """

    node: str
    kind: str
    reliable: bool
    latched: bool

    @property
    def is_named(self) -> bool:
        """Whether it is known which node owns it; the graph may tell that a little later."""
        return 'UNKNOWN' not in self.node

    @property
    def is_tool(self) -> bool:
        """Whether one of our own live tools owns it."""
        return self.node.rpartition('/')[2] in TOOLS


def _endpoints(infos: Iterable[object]) -> tuple[Endpoint, ...]:
    return tuple(sorted((Endpoint(
        f'{one.node_namespace.rstrip("/")}/{one.node_name}',  # type: ignore[attr-defined]
        one.topic_type,  # type: ignore[attr-defined]
        one.qos_profile.reliability.name == 'RELIABLE',  # type: ignore[attr-defined]
        one.qos_profile.durability.name == 'TRANSIENT_LOCAL')  # type: ignore[attr-defined]
        for one in infos), key=lambda end: end.node))


def publishers(node: api.Node, topic: str) -> tuple[Endpoint, ...]:
    """Return who publishes a topic, in order of their nodes' names."""
    return _endpoints(node.get_publishers_info_by_topic(node.resolve_topic_name(topic)))


def listeners(node: api.Node, topic: str) -> tuple[Endpoint, ...]:
    """Return who subscribes to a topic, in order of their nodes' names."""
    return _endpoints(node.get_subscriptions_info_by_topic(node.resolve_topic_name(topic)))


@dataclass(frozen=True)
class Robot:
    """
    A Husky by its topics.

    Parameters
    ----------
    namespace : str
        Such as ``/a200_0000``; ``/`` for none.
    preset : str
        The names that fit best.
    matched : int
        How many of command, odometry, joint states and IMU are there.

    """

    namespace: str
    preset: str
    matched: int

    def words(self) -> str:
        """Return the options that choose it."""
        place = '' if self.namespace == '/' else f' --namespace {self.namespace}'
        return f'--preset {self.preset}{place}'


def roles(settings: Settings) -> dict[str, tuple[str, str]]:
    """Return topic and type of what every Husky has, by its role."""
    return {
        'command': (settings.command_topic, f'geometry_msgs/msg/{settings.command_type}'),
        'odometry': (settings.odometry_topic, 'nav_msgs/msg/Odometry'),
        'joint_states': (settings.joint_states_topic, 'sensor_msgs/msg/JointState'),
        'imu': (settings.imu_topic, 'sensor_msgs/msg/Imu')}


def find_robots(topics: Mapping[str, Iterable[str]], *, preset: str | None = None,
                namespace: str | None = None, named: Mapping[str, object] = MappingProxyType({})
                ) -> tuple[Robot, ...]:
    """
    Return the Huskies among the topics of a graph.

    A namespace holds one if the command or the odometry of a preset is below it with the right
    type: joint states and an IMU have many robots.

    Parameters
    ----------
    topics : mapping of str to iterable of str
        Full names and types of the topics in the graph.
    preset, namespace : str, optional
        Look for these only.
    named : mapping of str to object
        Settings of :data:`NAMED` that count instead of the presets' own.

    Returns
    -------
    tuple of Robot
        One for each namespace, with the preset of which most is there; the first one in the
        table of presets where several fit alike.

    """
    best: dict[str, Robot] = {}
    home = f'/{(namespace or "").strip("/")}'
    for name in (preset,) if preset is not None else BY_NAME['preset'].choices:
        wanted = roles(make_settings(named, preset=name))
        # A topic with a leading slash is below no namespace.
        places = {home if ending.startswith('/') else f'/{topic.removesuffix(ending).strip("/")}'
                  for ending, kind in (wanted['command'], wanted['odometry'])
                  for topic, kinds in topics.items()
                  if topic.endswith(f'/{ending.lstrip("/")}') and kind in kinds
                  and (topic == ending or not ending.startswith('/'))}
        for place in places:
            matched = sum(kind in topics.get(posixpath.join(place, topic), ())
                          for topic, kind in wanted.values())
            if place not in best or matched > best[place].matched:
                best[place] = Robot(place, name, matched)
    return tuple(best[place] for place in sorted(best)
                 if namespace is None or place == home)


def the_one(robots: tuple[Robot, ...]) -> Robot | None:
    """
    Return the only robot, or None where there is none yet.

    Raises
    ------
    SettingsError
        If there are several; all are listed.

    """
    if len(robots) > 1:
        words = '; '.join(one.words() for one in robots)
        raise SettingsError(f'{len(robots)} Huskies are in the graph, choose one: {words}')
    return robots[0] if robots else None
