# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Which topic of a bag holds which stream: by type first, then by name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace

from lg_husky_sim.errors import RecordingError

ODOMETRY = 'nav_msgs/msg/Odometry'
POSES = ('geometry_msgs/msg/PoseStamped', 'geometry_msgs/msg/PoseWithCovarianceStamped')
TRANSFORMS = ('tf2_msgs/msg/TFMessage', 'tf/msg/tfMessage')

TYPES: Mapping[str, tuple[str, ...]] = {
    'command': ('geometry_msgs/msg/TwistStamped', 'geometry_msgs/msg/Twist'),
    'wheels': ('sensor_msgs/msg/JointState',),
    'imu': ('sensor_msgs/msg/Imu',),
    'pose': (*TRANSFORMS, ODOMETRY, *POSES),
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

DRIVING = frozenset({'command', 'wheels'})
"""Those of them that a camera or another sensor never has."""

PARTS = ('platform', 'sensors', 'husky_velocity_controller', 'platform_velocity_controller')
"""Namespaces of a robot's parts."""

SOURCES = ('joy', 'teleop', 'marker', 'autonomous', 'external', 'nav')
"""Words in the names of command topics that are only one of several inputs of a multiplexer."""

WISHES = ('goal', 'target', 'waypoint', 'setpoint', 'initial')
"""Words in the names of poses at which the robot is not, but is to be."""

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
    left_wheels, right_wheels : str
        Joints of each side, separated by commas, where their names do not tell it.

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
    left_wheels: str = ''
    right_wheels: str = ''

    def joints(self) -> tuple[tuple[str, ...], tuple[str, ...]] | None:
        """
        Return the joints of the left and of the right side that were chosen, None without.

        Raises
        ------
        RecordingError
            If only one side was, or a joint for both.

        """
        left, right = (tuple(name.strip() for name in side.split(',') if name.strip())
                       for side in (self.left_wheels, self.right_wheels))
        if bool(left) != bool(right):
            raise RecordingError('left_wheels and right_wheels are chosen together, as in '
                                 'left_wheels=A,B right_wheels=C,D')
        both = [name for name in left if name in right]
        if both:
            raise RecordingError(f'{both[0]} is a joint of both sides')
        return (left, right) if left else None

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


@dataclass(frozen=True)
class Robots:
    """
    Whose topics a bag holds, by namespace; an empty string is the robot without one.

    Parameters
    ----------
    home : str or None
        The robot to read; None where nothing tells.
    others : tuple of str
        Further robots, whose topics are not read.
    beside : tuple of str
        What looks like a robot but is none by itself, such as a camera with IMU and odometry:
        it serves only where the robot has no topic of its own.

    """

    home: str | None = None
    others: tuple[str, ...] = ()
    beside: tuple[str, ...] = ()


def robots(present: Iterable[Topic], chosen: TopicMap) -> Robots:
    """
    Tell the robots in one bag apart by their namespaces.

    Two namespaces are two robots if both have topics for two roles that tell, wheels among
    them; two that have a name also if commands are among them, and one of the two has wheels or
    none in the bag. The one chosen by hand is read, else the one with most roles, else with
    wheels or the likeliest topics.

    Parameters
    ----------
    present : iterable of Topic
        Topics of the bag.
    chosen : TopicMap
        Topics and frames chosen by hand.

    Returns
    -------
    Robots

    """
    roles = _roles(tuple(present))
    found = [space for space in roles
             if any(_two_robots(space, other, roles) for other in roles if other != space)]
    driving = [space for space in roles if not roles[space].isdisjoint(DRIVING)]
    pool = found or driving or [space for space in roles if space == ''] or list(roles)
    if not pool:
        return Robots()
    wished = next((space for space in _wished(chosen) if space in found), None)
    home, *rest = sorted(pool, key=lambda space: (
        space != wished, -len(roles[space]), 'wheels' not in roles[space]))
    alike = tuple(space for space in roles if space != home and space not in found
                  and any(len(roles[space] & roles[other]) > 1
                          for other in roles if other != space))
    # Of several robots, nothing tells whose relays or whose camera these are.
    return Robots(home, (*rest, *alike)) if found else Robots(home, beside=alike)


def _roles(topics: tuple[Topic, ...]) -> dict[str, set[str]]:
    """Return the telling roles that each namespace has topics for, the likeliest first."""
    roles: dict[str, set[str]] = {}
    for role in TELLING:
        for topic in candidates(role, topics):
            space = space_of(role, topic.name)
            if not (space is None or _is_source(topic.name) or _shared(space, topic)):
                roles.setdefault(space, set()).add(role)
    return roles


def _two_robots(one: str, other: str, roles: Mapping[str, set[str]]) -> bool:
    """
    Say whether two namespaces are two robots.

    Beside a robot with a name, topics without one are often its relays, and beside one without,
    those with a name its parts; only wheels are never relayed.
    """
    both = roles[one] & roles[other]
    if len(both) < 2 or 'wheels' in both:
        return len(both) > 1
    # Where only a third namespace has wheels, both may be parts of that robot.
    wheeled = [space for space in roles if 'wheels' in roles[space]]
    return ('command' in both and '' not in (one, other)
            and (not wheeled or one in wheeled or other in wheeled))


def _wished(chosen: TopicMap) -> list[str]:
    """Return the namespaces of what was chosen by hand, what tells most first."""
    names = [_likely_space(role, getattr(chosen, role))
             for role in TELLING if getattr(chosen, role)]
    frames = (chosen.odom_frame.strip('/'), chosen.base_frame.strip('/'))
    return names + [frame.split('/')[0] for frame in frames if '/' in frame]


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


def shared_transforms(topic: Topic) -> bool:
    """Say whether all robots of a bag may write into a topic, as into /tf."""
    return _shared(_likely_space('pose', topic.name), topic)


def _shared(space: str, topic: Topic) -> bool:
    return space == '' and topic.kind in TRANSFORMS


def _is_source(name: str) -> bool:
    return any(word in name.lower() for word in SOURCES)


def candidates(
    role: str, present: Iterable[Topic], chosen: str = '', whose: Robots | None = None,
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
    whose : Robots, optional
        Whose topics are to be read; without, those of all.

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
    robot = whose or Robots()
    ranked = []
    for topic in topics:
        if topic.count == 0 or topic.kind not in TYPES[role]:
            continue
        rank = _rank(role, topic.name)
        generic = role == 'voltage' and topic.kind != TYPES['voltage'][0]
        if rank == len(NAMES[role]) and (role in NEEDS_NAME or generic):
            continue
        if topic.kind in POSES and any(word in topic.name.lower() for word in WISHES):
            continue
        # Only where no tf serves, and then those that name a frame of the robot first.
        fallback = (topic.kind == ODOMETRY) + 2 * (topic.kind in POSES)
        space = _likely_space(role, topic.name)
        shared = _shared(space, topic)
        if space in robot.others and not shared:
            continue
        beside = space in robot.beside and not shared
        source = role == 'command' and _is_source(topic.name)
        # A camera's IMU is faster than the robot's. The busiest command is the multiplexer's
        # output, wherever that stands.
        away = 0 if role == 'command' else (space != robot.home) + (
            space not in ('', robot.home))
        ranked.append(
            (beside, fallback, rank, source, away, -topic.count, topic.name, topic))
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
