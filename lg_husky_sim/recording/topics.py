# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Which topic of a bag holds which stream: by type first, then by name."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, fields, replace

from lg_husky_sim.errors import RecordingError

ODOMETRY = 'nav_msgs/msg/Odometry'
TRANSFORMS = ('tf2_msgs/msg/TFMessage', 'tf/msg/tfMessage')

TYPES: Mapping[str, tuple[str, ...]] = {
    'command': ('geometry_msgs/msg/TwistStamped', 'geometry_msgs/msg/Twist'),
    'wheels': ('sensor_msgs/msg/JointState',),
    'imu': ('sensor_msgs/msg/Imu',),
    'pose': (*TRANSFORMS, ODOMETRY),
    'current_left': ('std_msgs/msg/Float32', 'std_msgs/msg/Float64'),
    'current_right': ('std_msgs/msg/Float32', 'std_msgs/msg/Float64'),
    'voltage': ('sensor_msgs/msg/BatteryState', 'std_msgs/msg/Float32', 'std_msgs/msg/Float64'),
    'status': ('husky_msgs/msg/HuskyStatus',),
}
"""Message types that a role may be read from, the best first."""

NAMES: Mapping[str, tuple[str, ...]] = {
    'command': ('husky_velocity_controller/cmd_vel', 'husky_velocity_controller/cmd_vel_unstamped',
                'platform_velocity_controller/cmd_vel', 'platform/cmd_vel',
                'platform_velocity_controller/cmd_vel_unstamped', 'platform/cmd_vel_unstamped',
                'cmd_vel', 'cmd_vel_unstamped', 'cmd_vel_out'),
    'wheels': ('joint_states',),
    'imu': ('imu_um7/data', 'imu/data', 'imu_0/data', 'imu/data_raw', 'imu_0/data_raw', 'imu'),
    'pose': ('tf', 'ground_truth', 'odometry/filtered', 'odom/filtered', 'platform/odom',
             'husky_velocity_controller/odom', 'odom'),
    'current_left': ('left_driver_current', 'left_current'),
    'current_right': ('right_driver_current', 'right_current'),
    'voltage': ('battery_state', 'battery/bms/state', 'battery_voltage', 'bus_voltage'),
    'status': ('status',),
}
"""Endings of topic names, the best first."""

TELLING = ('command', 'wheels', 'imu', 'pose')
"""Roles by whose topics a namespace is known to be a robot's."""

PARTS = ('platform', 'sensors', 'husky_velocity_controller', 'platform_velocity_controller')
"""Namespaces of a robot's parts."""

SOURCES = ('joy', 'teleop', 'marker', 'autonomous', 'external', 'nav')
"""Words in the names of command topics that are only one of several inputs of a multiplexer."""

NEEDS_NAME = ('current_left', 'current_right')
"""Roles whose type is so common that only a known name is taken."""


@dataclass(frozen=True)
class TopicMap:
    """
    Topics and frames chosen by hand; an empty string leaves the choice to the reader.

    Parameters
    ----------
    command, wheels, imu, pose, current_left, current_right, voltage, status : str
        Topic names.
    odom_frame, base_frame : str
        Parent and child frame of the pose in a tf topic.
    """

    command: str = ''
    wheels: str = ''
    imu: str = ''
    pose: str = ''
    current_left: str = ''
    current_right: str = ''
    voltage: str = ''
    status: str = ''
    odom_frame: str = ''
    base_frame: str = ''

    @classmethod
    def parse(cls, choices: Iterable[str]) -> TopicMap:
        """
        Read choices as they are given on a command line.

        Parameters
        ----------
        choices : iterable of str
            Each ``role=name``, such as ``command=/cmd_vel`` or ``odom_frame=map``.

        Returns
        -------
        TopicMap

        Raises
        ------
        RecordingError
            If one is not of that form, or its role is unknown.
        """
        known = [entry.name for entry in fields(cls)]
        chosen = cls()
        for choice in choices:
            role, equals, name = choice.partition('=')
            if not equals or not name or role not in known:
                raise RecordingError(
                    f'topic choice {choice!r} must be ROLE=NAME with ROLE one of '
                    f'{", ".join(known)}')
            chosen = replace(chosen, **{role: name})
        return chosen


@dataclass(frozen=True)
class Topic:
    """A topic in a bag: name, message type and number of messages."""

    name: str
    kind: str
    count: int


def robots(present: Iterable[Topic], chosen: TopicMap) -> tuple[str, ...]:
    """
    Return the namespaces of several robots in one bag, first the one to read.

    Two namespaces are two robots if both have topics for two roles that tell. The one chosen
    by hand is read, else the one with most roles, else with the likeliest topics.

    Parameters
    ----------
    present : iterable of Topic
        Topics of the bag.
    chosen : TopicMap
        Topics and frames chosen by hand.

    Returns
    -------
    tuple of str
        Empty if there are not two; an empty string is the robot without namespace.
    """
    topics = tuple(present)
    roles: dict[str, list[str]] = {}
    for role in TELLING:
        for topic in candidates(role, topics):
            space = space_of(role, topic.name)
            if (space is None or _is_source(topic.name)
                    or (space == '' and topic.kind in TRANSFORMS)):  # all robots share /tf
                continue
            if role not in roles.setdefault(space, []):
                roles[space].append(role)
    found = [space for space in roles
             if any(len(set(roles[space]) & set(roles[other])) >= 2
                    for other in roles if other != space)]
    names = [_likely_space(role, getattr(chosen, role))
             for role in TELLING if getattr(chosen, role)]
    names += [whole.split('/')[0]
              for whole in (chosen.odom_frame.strip('/'), chosen.base_frame.strip('/'))
              if '/' in whole]
    wished = next((name for name in names if name in found), None)
    return tuple(sorted(found, key=lambda space: (space != wished, -len(roles[space]))))


def space_of(role: str, name: str) -> str | None:
    """Return the robot's namespace in a topic's name, None if its ending is not known."""
    plain = name.strip('/')
    endings = [ending for ending in NAMES[role]
               if plain == ending or plain.endswith('/' + ending)]
    if not endings:
        return None
    space = plain[:-len(max(endings, key=len))].strip('/').split('/')[0]
    return '' if space in PARTS else space


def _likely_space(role: str, name: str) -> str:
    """Return the robot's namespace in a topic's name, its first part where it is not known."""
    space = space_of(role, name)
    return name.strip('/').split('/')[0] if space is None else space


def _foreign(role: str, topic: Topic, others: Collection[str]) -> bool:
    """Say whether a topic belongs to a robot that is not to be read."""
    space = _likely_space(role, topic.name)
    return space in others and not (space == '' and topic.kind in TRANSFORMS)


def _is_source(name: str) -> bool:
    return any(word in name.lower() for word in SOURCES)


def candidates(
    role: str, present: Iterable[Topic], chosen: str = '', others: Collection[str] = (),
) -> tuple[Topic, ...]:
    """
    Return the topics that may hold a role, the likeliest first.

    Parameters
    ----------
    role : str
        A key of ``TYPES``.
    present : iterable of Topic
        Topics of the bag.
    chosen : str
        Topic chosen by hand; empty to look for one.
    others : collection of str
        Namespaces of robots that are not to be read.

    Returns
    -------
    tuple of Topic
        Empty if there is none; topics without messages are never candidates.

    Raises
    ------
    RecordingError
        If the topic chosen by hand is not there, is empty or has a type of no use.
    """
    topics = tuple(present)
    if chosen:
        return _chosen(role, topics, chosen)
    ranked = []
    for topic in topics:
        if topic.count == 0 or topic.kind not in TYPES[role]:
            continue
        rank = _rank(role, topic.name)
        generic = role == 'voltage' and topic.kind != TYPES['voltage'][0]
        if rank == len(NAMES[role]) and (role in NEEDS_NAME or generic):
            continue
        fallback = topic.kind == ODOMETRY  # only where no tf serves
        if _foreign(role, topic, others):
            continue
        source = role == 'command' and _is_source(topic.name)
        ranked.append((fallback, rank, source, -topic.count, topic.name, topic))
    return tuple(entry[-1] for entry in sorted(ranked, key=lambda entry: entry[:-1]))


def _rank(role: str, name: str) -> int:
    """Return the place of a topic's name among the known endings."""
    for place, ending in enumerate(NAMES[role]):
        if name.strip('/') == ending or name.endswith('/' + ending):
            return place
    return len(NAMES[role])


def _chosen(role: str, topics: tuple[Topic, ...], chosen: str) -> tuple[Topic, ...]:
    found = [topic for topic in topics if topic.name.strip('/') == chosen.strip('/')]
    if not found:
        raise RecordingError(
            f'no topic {chosen} for {role}; there are {listing(topics)}')
    usable = [topic for topic in found if topic.kind in TYPES[role]]
    if not usable:
        raise RecordingError(
            f'topic {chosen} is a {found[0].kind}; {role} is read from '
            f'{" or ".join(TYPES[role])}')
    if not any(topic.count for topic in usable):
        raise RecordingError(f'topic {chosen} for {role} holds no message')
    return tuple(topic for topic in usable if topic.count)


def listing(topics: Iterable[Topic]) -> str:
    """Return topics with type and count on one line."""
    text = ', '.join(f'{topic.name} ({topic.kind}, {topic.count})'
                     for topic in sorted(topics, key=lambda topic: topic.name))
    return text or 'no topics'
