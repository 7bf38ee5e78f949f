# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A bag to a `Recording`: topics found, messages collected, clocks joined, samples cleaned."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.recording.bags import Bag, open_bag, SUFFIXES
from lg_husky_sim.recording.clean import clean, joined, Sample, wheel_streams
from lg_husky_sim.recording.clock import common_clock
from lg_husky_sim.recording.decode import Collected, COLLECTORS, edge_name, Rows
from lg_husky_sim.recording.frames import (
    compose,
    Edge,
    frame_space,
    plain_frame,
    pose_chain,
    told_apart,
)
from lg_husky_sim.recording.names import printable
from lg_husky_sim.recording.recording import CHANNELS, Recording
from lg_husky_sim.recording.rosbag2 import Rosbag2
from lg_husky_sim.recording.topics import (
    candidates,
    listing,
    ODOMETRY,
    POSES,
    Robots,
    robots,
    shared_transforms,
    Topic,
    TopicMap,
    TYPES,
)
from lg_husky_sim.signals import TimeSeries
import numpy as np


@dataclass(frozen=True)
class _Found:
    """The topic that serves a role, and what it gave."""

    topic: Topic
    collected: Collected


def read_recording(path: str | PathLike[str], topics: TopicMap | None = None) -> Recording:
    """
    Read a ROS bag.

    Topics are found by type and name; header stamps are taken where they are there and make
    sense, log times otherwise; samples are sorted, of those with one stamp the last one counts,
    and samples that are not finite are dropped. What was repaired stands in ``notes``.

    Parameters
    ----------
    path : path-like
        A rosbag2 folder, an .mcap or .db3 file, or a ROS 1 .bag file.
    topics : TopicMap, optional
        Topics and frames chosen by hand.

    Returns
    -------
    Recording

    Raises
    ------
    RecordingError
        If there is no bag at `path`, it is damaged, a topic chosen by hand is not in it, or
        nothing in it is of use; the last two list what is there.
    MissingExtraError
        If the package `rosbags` is not installed.

    """
    place = Path(path)
    if place.name == 'metadata.yaml':
        place = place.parent
    chosen = topics or TopicMap()
    with open_bag(place) as bag:
        present = bag.topics()
        whose = robots(present, chosen)
        found = _collect(bag, present, chosen, whose)
        repaired = bag.notes
    try:
        read = _recording(place, present, found, chosen, whose)
        return replace(read, notes=(*repaired, *read.notes))
    except RecordingError as error:
        raise RecordingError('; '.join([f'cannot use {place}: {error}', *repaired])) from error


def _collect(
    bag: Bag | Rosbag2, present: tuple[Topic, ...], chosen: TopicMap, whose: Robots,
) -> dict[str, _Found]:
    """Read the likeliest topic of each role; the next one where it gave nothing."""
    waiting = {role: list(candidates(role, present, getattr(chosen, role), whose))
               for role in TYPES}
    found: dict[str, _Found] = {}
    while any(waiting.values()):
        attempt = {role: topics.pop(0) for role, topics in waiting.items() if topics}
        for role, collected in _read(bag, attempt, chosen).items():
            entry = _Found(attempt[role], collected)
            if _serves(role, entry, chosen, whose):
                found[role] = entry
                waiting[role] = []
            else:  # kept for the message that nothing serves
                found.setdefault(role, entry)
    if 'wheels' in found:
        _check_joints(found['wheels'])
    return found


def _read(bag: Bag | Rosbag2, attempt: Mapping[str, Topic], chosen: TopicMap
          ) -> dict[str, Collected]:
    joints = chosen.joints()
    collected = {role: Collected(joints=joints) for role in attempt}
    by_topic: dict[Topic, list[str]] = {}
    for role, topic in attempt.items():
        by_topic.setdefault(topic, []).append(role)
    takers = [[(COLLECTORS[role, topic.kind], collected[role]) for role in roles]
              for topic, roles in by_topic.items()]
    for place, logged, message in bag.messages(tuple(by_topic)):
        for collect, into in takers[place]:
            collect(into, logged, message)
    for into in collected.values():
        into.settle()
    return collected


def _check_joints(wheels: _Found) -> None:
    # Those chosen by hand are there.
    seen = wheels.collected.seen
    for name in (name for side in wheels.collected.joints or () for name in side):
        if name not in seen:
            raise RecordingError(f'no joint {name} in {wheels.topic.name}; there are '
                                 + (', '.join(sorted(seen)) or 'none'))


def _serves(role: str, entry: _Found, chosen: TopicMap, whose: Robots) -> bool:
    if role == 'pose':
        return bool(_chain(entry, chosen, whose)[0])
    return bool(entry.collected.rows)


def _chain(
    entry: _Found, chosen: TopicMap, whose: Robots,
) -> tuple[tuple[Edge, ...], dict[Edge, Edge]]:
    """Return the transforms of the pose, and under which names all were recorded."""
    edges = [(name.split('>')[0], name.split('>')[1]) for name in entry.collected.rows]
    if not (chosen.odom_frame or chosen.base_frame):
        # In a topic of the robot's own, frames without namespace are its own.
        others = set(whose.others) - (set() if shared_transforms(entry.topic) else {''})
        edges = [edge for edge in edges if frame_space(edge[1]) not in others]
    told = told_apart(edges)
    return pose_chain(told, chosen.odom_frame, chosen.base_frame, whose.home or ''), told


def _recording(
    path: Path, present: tuple[Topic, ...], found: Mapping[str, _Found], chosen: TopicMap,
    whose: Robots,
) -> Recording:
    notes: list[str] = []
    if whose.others:
        notes.append(f'there are topics of several robots: those of /{whose.home} are used, not '
                     'those of '
                     f'/{", /".join(whose.others)}; --topic chooses another')
    chain: tuple[Edge, ...] = ()
    rows: dict[str, Rows] = {}
    origin: dict[str, str] = {}
    for role, entry in found.items():
        given = entry.collected.rows
        if role == 'pose':
            chain, told = _chain(entry, chosen, whose)
            given = {edge_name(*edge): given[edge_name(*told[edge])] for edge in chain}
            notes += _doubts(entry.topic, chain, told, chosen, whose)
        names = list(given)
        notes += entry.collected.notes
        for name in names:
            if name not in rows:
                rows[name] = given[name]
                origin['pose' if role == 'pose' else name] = entry.topic.name
        if not names and role in ('wheels', 'pose'):
            seen = ', '.join(sorted(entry.collected.seen)) or 'nothing'
            owner = f' of /{whose.home}' if whose.others else ''
            notes.append(f'no {role}{owner} in {entry.topic.name}: it holds {seen}')
        if role == 'pose' and names and entry.topic.kind == ODOMETRY:
            notes.append(f'pose taken from odometry ({entry.topic.name}): if that is computed '
                         'from the wheels, their slip does not show in it')
        if role == 'pose' and names and entry.topic.kind in POSES:
            notes.append(f'pose taken from {entry.topic.name}, which names no frame of the robot: '
                         'taken for that of its base')
    if not rows:
        raise RecordingError('; '.join([
            'no usable messages: commands, wheels, imu or pose', *notes,
            f'there are {listing(present)}']))
    times, repairs = common_clock({name: entry.stamps() for name, entry in rows.items()})
    notes += repairs
    start_ns = min(int(stamps.min()) for stamps in times.values())
    samples = {
        name: clean(name, np.float64(1e-9) * (times[name] - start_ns), entry.array(), notes)
        for name, entry in rows.items()}
    streams, sources = _streams(samples, chain, origin, notes)
    if not streams:
        raise RecordingError('; '.join(['no sample of use', *notes]))
    name = path.stem if path.suffix in SUFFIXES else path.resolve().name
    return Recording(
        name=printable(name),
        path=str(path),
        streams=streams,
        start_ns=start_ns,
        topics=sources,
        frames=(chain[0][0], chain[-1][1]) if chain else ('', ''),
        present={topic.name: topic.kind for topic in present},
        notes=tuple(notes))


def _doubts(
    topic: Topic, chain: tuple[Edge, ...], told: Mapping[Edge, Edge], chosen: TopicMap,
    whose: Robots,
) -> list[str]:
    """Return notes if the transform taken may be another robot's or others are called alike."""
    if not chain or chosen.odom_frame or chosen.base_frame:
        return []
    notes: list[str] = []
    parent, child = told[chain[0]]
    if whose.others and whose.home and shared_transforms(topic) and not frame_space(child):
        notes.append(f'{parent} -> {child} in {topic.name} names no robot: taken for that of '
                     f'/{whose.home}')
    plain = [plain_frame(frame) for frame in chain[0]]
    others = [edge for edge in told if edge != chain[0]
              and [plain_frame(frame) for frame in edge] == plain]
    if others:
        words = ', '.join(f'{parent} -> {child}' for parent, child in sorted(others))
        notes.append(f'several transforms of one name: {chain[0][0]} -> {chain[0][1]} is read, '
                     f'not {words}; --topic odom_frame=NAME chooses another')
    return notes


def _streams(
    samples: Mapping[str, Sample], chain: tuple[Edge, ...], origin: Mapping[str, str],
    notes: list[str],
) -> tuple[dict[str, TimeSeries], dict[str, str]]:
    """Make the streams of a recording from cleaned samples, in the order of CHANNELS."""
    made: dict[str, Sample] = {}
    sources: dict[str, str] = {}
    for name in ('command', 'imu', 'voltage'):
        if name in samples:
            made[name], sources[name] = samples[name], origin[name]
    if 'wheels' in samples:
        for name, sample in wheel_streams(*samples['wheels'], notes).items():
            made[name], sources[name] = sample, origin['wheels']
    if 'current_left' in samples and 'current_right' in samples:
        made['currents'] = joined(samples['current_left'], samples['current_right'])
        sources['currents'] = ' '.join(dict.fromkeys(
            (origin['current_left'], origin['current_right'])))
    elif 'current_left' in samples or 'current_right' in samples:
        notes.append('current of one side only: left out')
    if chain:
        ways = {edge: samples[edge_name(*edge)] for edge in chain}
        if all(way[0].size for way in ways.values()):
            made['pose'], sources['pose'] = compose(chain, _unwrapped(chain, ways)), origin['pose']
    kept = [name for name in CHANNELS if name in made and made[name][0].size]
    return ({name: TimeSeries(made[name][0], made[name][1], CHANNELS[name]) for name in kept},
            {name: sources[name] for name in kept})


def _unwrapped(chain: Iterable[Edge], ways: Mapping[Edge, Sample]) -> dict[Edge, Sample]:
    result: dict[Edge, Sample] = {}
    for edge in chain:
        times, values = ways[edge]
        result[edge] = times, np.column_stack((values[:, :2], np.unwrap(values[:, 2])))
    return result
