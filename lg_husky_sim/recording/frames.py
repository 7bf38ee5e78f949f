# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The planar pose of the base out of a tree of transforms."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import lru_cache
import math

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.signals import FloatArray
import numpy as np

ODOM_FRAMES = ('odom', 'odom_combined', 'wheel_odom', 'odometry', 'map', 'world', 'earth')
BASE_FRAMES = ('base_link', 'base_footprint', 'base', 'chassis_link', 'base_frame')
ALIKE, UNLIKE = 100, 200

Edge = tuple[str, str]


@lru_cache(maxsize=256)
def plain_frame(name: str) -> str:
    """Return a frame name without leading slash and namespace."""
    return name.strip('/').rsplit('/', 1)[-1]


@lru_cache(maxsize=256)
def whole_frame(name: str) -> str:
    """Return a frame name with its namespace, without leading slash."""
    return name.strip('/')


def frame_space(name: str) -> str:
    """Return the first part of a frame's namespace, empty without one."""
    return name.partition('/')[0] if '/' in name else ''


def told_apart(edges: Collection[Edge]) -> dict[Edge, Edge]:
    """
    Give transforms the names they go by.

    Parameters
    ----------
    edges : collection of (parent, child)
        Transforms recorded, with namespaces.

    Returns
    -------
    dict of (parent, child) to (parent, child)
        Plain names to those given; where the plain ones do not tell all apart, or the frames
        are those of several robots, those given to themselves.

    """
    plain = {(plain_frame(parent), plain_frame(child)): (parent, child)
             for parent, child in edges}
    spaces = {frame_space(frame) for edge in edges for frame in edge
              if plain_frame(frame) in (*ODOM_FRAMES, *BASE_FRAMES)} - {''}
    if len(plain) == len(set(edges)) and len(spaces) < 2:
        return plain
    return {edge: edge for edge in edges}


def quaternion_heading(x: float, y: float, z: float, w: float) -> float:
    """
    Return the yaw angle [rad] of a quaternion, which need not have norm one.

    NaN for a quaternion of norm zero or with a value that is not finite.
    """
    if not math.isfinite(x + y + z + w) or x == y == z == w == 0.0:
        return math.nan
    return math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)


def pose_chain(
    edges: Collection[Edge], odom_frame: str = '', base_frame: str = '', robot: str = '',
) -> tuple[Edge, ...]:
    """
    Choose the transforms that make up the pose of the base.

    Without wishes: odom to base_link if it is there, else the one that looks most like it by
    the names of both frames. With wishes: the shortest way down from one to the other.

    Parameters
    ----------
    edges : collection of (parent, child)
        Transforms recorded, as `told_apart` names them.
    odom_frame, base_frame : str
        Frames wished for; an empty one is free.
    robot : str
        Namespace preferred where frames have one.

    Returns
    -------
    tuple of (parent, child)
        From the top down; empty if nothing looks like a pose of the base.

    Raises
    ------
    RecordingError
        If a frame wished for is not there, or no way leads to it.

    """
    tree = sorted(edges)
    if odom_frame or base_frame:
        return _wished(tree, odom_frame, base_frame, robot)
    ranked = sorted(
        (_rank(plain_frame(parent), ODOM_FRAMES, ('odom', 'map', 'world')),
         _rank(plain_frame(child), BASE_FRAMES, ('base', 'footprint', 'husky')),
         frame_space(child) != robot, (parent, child))
        for parent, child in tree)
    for parent_rank, child_rank, _, edge in ranked:
        if parent_rank < UNLIKE and child_rank < UNLIKE:
            return (edge,)
    return ()


def compose(
    chain: Collection[Edge], series: Mapping[Edge, tuple[FloatArray, FloatArray]],
) -> tuple[FloatArray, FloatArray]:
    """
    Multiply planar transforms along a chain, at the stamps of its densest one.

    Parameters
    ----------
    chain : collection of (parent, child)
        From the top down, at least one.
    series : mapping of (parent, child) to (times, values)
        Times [s], shape (n,), and x, y, heading [m, m, rad], shape (n, 3), heading unwrapped.

    Returns
    -------
    times : numpy.ndarray, shape (n,)
    values : numpy.ndarray, shape (n, 3)
        x, y, heading of the last child in the first parent.

    """
    ways = [series[edge] for edge in chain]
    times = max((way[0] for way in ways), key=lambda stamps: stamps.size)
    total = np.zeros((times.size, 3))
    for stamps, values in ways:
        x, y, heading = (np.interp(times, stamps, values[:, k]) for k in range(3))
        cosine, sine = np.cos(total[:, 2]), np.sin(total[:, 2])
        total = np.column_stack((
            total[:, 0] + cosine * x - sine * y,
            total[:, 1] + sine * x + cosine * y,
            total[:, 2] + heading))
    return times, total


def _rank(name: str, known: tuple[str, ...], parts: tuple[str, ...]) -> int:
    if name in known:
        return known.index(name)
    return ALIKE if any(part in name.lower() for part in parts) else UNLIKE


def _wished(tree: list[Edge], top: str, bottom: str, robot: str) -> tuple[Edge, ...]:
    frames = sorted({frame for edge in tree for frame in edge},
                    key=lambda frame: (frame_space(frame) != robot, frame))
    starts, ends = _meant(top, ODOM_FRAMES, frames), _meant(bottom, BASE_FRAMES, frames)
    for start in starts:
        for end in ends:
            chain = _way(tree, start, end)
            if chain:
                return chain
    raise RecordingError(
        f'no way from frame {top or "odom"} to {bottom or "base_link"}; transforms: '
        + ', '.join(f'{parent} -> {child}' for parent, child in tree))


def _meant(wish: str, known: tuple[str, ...], frames: list[str]) -> list[str]:
    """Return the frames that a wish may mean, all known ones without a wish."""
    if not wish:
        return [frame for name in known for frame in frames if plain_frame(frame) == name]
    told_plainly = not any('/' in frame for frame in frames)
    name = plain_frame(wish) if told_plainly else whole_frame(wish)
    meant = [name] if name in frames else [
        frame for frame in frames if plain_frame(frame) == name]
    if not meant:
        raise RecordingError(
            f'no frame {wish!r}; there are {", ".join(sorted(frames)) or "none"}')
    return meant


def _way(tree: list[Edge], start: str, end: str) -> tuple[Edge, ...]:
    """Return the shortest chain of transforms, empty without one; breadth first."""
    ways: dict[str, tuple[Edge, ...]] = {start: ()}
    queue = [start]
    for frame in queue:
        for parent, child in tree:
            if parent == frame and child not in ways:
                ways[child] = (*ways[frame], (parent, child))
                queue.append(child)
    return ways.get(end, ())
