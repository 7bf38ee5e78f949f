# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Occupancy maps, from a topic or from a file of map_server, and what a laser sees in them."""

from __future__ import annotations

from dataclasses import dataclass
import math
from pathlib import Path
import re
from typing import Any

from lg_husky_sim.errors import SettingsError
from lg_husky_sim.ros.conversions import pose_from_msg
from lg_husky_sim.signals import FloatArray, Pose
from lg_husky_sim.yaml_files import read_yaml
import numpy as np
import numpy.typing as npt
from scipy.ndimage import distance_transform_cdt

#: Most cells of a map that are taken; reading one takes 45 bytes of memory for each, 1.8 GB.
MOST_CELLS = 40_000_000
#: Most pixels of an image in plain text, which takes some 80 bytes of memory for each.
MOST_PLAIN = 16_000_000
#: Longest beginning of an image, with its comments [bytes].
_LONGEST_HEAD = 65_536
_MODES = ('trinary', 'scale', 'raw')
_UNKNOWN = -1


@dataclass(frozen=True)
class OccupancyMap:
    """
    A grid of cells that are free or reflect; beyond its edges everything is free.

    Parameters
    ----------
    cells : ndarray of int8, shape (height, width)
        Occupancy from 0 to 100 [%], -1 where it is unknown; row 0 is at the origin.
    resolution : float
        Length of a cell's side [m].
    origin : Pose
        Lower left corner of the first cell, in the map's frame.
    occupied : int
        Occupancy from which on a cell reflects [%].

    Raises
    ------
    SettingsError
        If it is no such grid.

    """

    cells: npt.NDArray[np.int8]
    resolution: float
    origin: Pose
    occupied: int

    def __post_init__(self) -> None:
        """Check the grid, and measure once how far the next obstacle is from each cell."""
        if not (math.isfinite(self.resolution) and self.resolution > 0.0):
            raise SettingsError(f'map resolution = {self.resolution:g} m must be above 0')
        if not all(math.isfinite(v) for v in (
                self.origin.x, self.origin.y, self.origin.heading)):
            raise SettingsError('map origin is not finite')
        if not 0 < self.cells.size <= MOST_CELLS:
            raise SettingsError(f'map of {self.cells.size} cells: from 1 to {MOST_CELLS}')
        free = self.cells < self.occupied
        if free.all():
            gaps = np.full(free.shape, max(free.shape), dtype=np.int32)
        else:
            # In cells along the longer axis: all cells nearer than this are free.
            gaps = distance_transform_cdt(free, metric='chessboard').astype(np.int32)
        object.__setattr__(self, '_gaps', gaps)

    def ranges(self, pose: Pose, angles: FloatArray, longest: float) -> FloatArray:
        """
        Return how far it is from a place to the first occupied cell.

        Parameters
        ----------
        pose : Pose
            Of the laser, in the map's frame.
        angles : ndarray, shape (n_rays,)
            Of the rays against the laser's heading [rad].
        longest : float
            Largest range [m].

        Returns
        -------
        ndarray, shape (n_rays,)
            [m], to where a ray enters the cell; infinite where nothing is within the longest
            range, and all of it from outside the map.

        """
        gaps: npt.NDArray[np.int32] = getattr(self, '_gaps')  # noqa: B009
        height, width = gaps.shape
        turned = -self.origin.heading
        x, y = pose.x - self.origin.x, pose.y - self.origin.y
        start = ((x * math.cos(turned) - y * math.sin(turned)) / self.resolution,
                 (x * math.sin(turned) + y * math.cos(turned)) / self.resolution)
        result = np.full(angles.size, np.inf)
        if not (0.0 <= start[0] < width and 0.0 <= start[1] < height):
            return result
        directions = angles + (pose.heading + turned)
        way = np.stack([np.cos(directions), np.sin(directions)])
        cell = np.empty(way.shape, dtype=np.int64)
        cell[0], cell[1] = int(start[0]), int(start[1])
        rays = np.arange(angles.size)
        # A laser inside an obstacle looks out of its own cell.
        gap = np.maximum(gaps[cell[1], cell[0]], 1)
        origin = np.array(start)[:, None]
        while rays.size:
            # The square of free cells around the ray's cell is left through its nearer side.
            with np.errstate(divide='ignore', invalid='ignore'):
                side = np.where(way > 0.0, cell + gap, cell - gap + 1)
                lengths = np.where(way == 0.0, np.inf, (side - origin) / way)
            across = np.argmin(lengths, axis=0)
            length = np.take_along_axis(lengths, across[None], axis=0)[0]
            beside = np.clip(np.floor(origin + length * way).astype(np.int64),
                             cell - gap + 1, cell + gap - 1)
            ahead = np.where(way > 0.0, cell + gap, cell - gap)
            cell = np.where(across == np.arange(2)[:, None], ahead, beside)
            inside = (cell[0] >= 0) & (cell[0] < width) & (cell[1] >= 0) & (cell[1] < height) & (
                length * self.resolution <= longest)
            gap = np.where(inside, gaps[np.where(inside, cell[1], 0),
                                        np.where(inside, cell[0], 0)], 1)
            hit = inside & (gap == 0)
            result[rays[hit]] = length[hit] * self.resolution
            on = inside & ~hit
            rays, way, cell, gap = rays[on], way[:, on], cell[:, on], gap[on]
        return result


def map_from_msg(msg: Any, occupied: int) -> OccupancyMap:
    """
    Read a nav_msgs/msg/OccupancyGrid.

    Parameters
    ----------
    msg : nav_msgs.msg.OccupancyGrid
        As received.
    occupied : int
        Occupancy from which on a cell reflects [%].

    Raises
    ------
    SettingsError
        If size and data do not agree, or a number is not finite.

    """
    width, height = int(msg.info.width), int(msg.info.height)
    cells = np.array(msg.data, dtype=np.int8)
    if cells.size != width * height:
        raise SettingsError(f'map of {width} × {height} cells has {cells.size} values')
    return OccupancyMap(cells.reshape(height, width), float(msg.info.resolution),
                        pose_from_msg(msg.info.origin), occupied)


def _number(data: dict[str, Any], name: str, low: float, high: float,
            default: float | None = None) -> float:
    value = data.get(name, default)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not low <= value <= high:
        raise SettingsError(f'{name} = {value!r} must be a number from {low:g} to {high:g}')
    return float(value)


def _grey(path: Path) -> npt.NDArray[np.float64]:
    """Return the grey values of a PGM image from 0 (black) to 1, the lowest row first."""
    with path.open('rb') as file:
        # Only its beginning is searched for the sizes, and only what they announce is read.
        begun = file.read(_LONGEST_HEAD)
        head = re.match(rb'(P[25])' + rb'(?:\s|#[^\n]*\n)+(\d{1,6})' * 3 + rb'(?:#[^\n]*\n)*\s',
                        begun)
        if head is None:
            raise SettingsError(f'{path} is no PGM image (P5 or P2); convert it, such as by '
                                'convert map.png map.pgm')
        width, height, largest = (int(head[i]) for i in (2, 3, 4))
        most = MOST_CELLS if head[1] == b'P5' else MOST_PLAIN
        if not (0 < width * height <= most and 0 < largest < 65536):
            raise SettingsError(f'{path}: {width} × {height} pixels of 0 to {largest} cannot be '
                                f'used; at most {most} pixels of 0 to 65535 ({head[1].decode()})')
        kind = np.dtype(np.uint8 if largest < 256 else '>u2')
        # Of plain text: five digits and a space for each pixel, and comments.
        size = width * height * (kind.itemsize if head[1] == b'P5' else 6) + _LONGEST_HEAD
        file.seek(head.end())
        body = file.read(size)
    if head[1] == b'P5':
        size = width * height * kind.itemsize
        values = np.frombuffer(body, dtype=kind, count=width * height) if (
            len(body) >= size) else np.empty(0, dtype=kind)
    else:
        words = re.sub(rb'#[^\n]*', b'', body).split(maxsplit=width * height)[:width * height]
        values = np.array([int(word) if word[:6].isdigit() and len(word) < 6 else largest + 1
                           for word in words])
    if values.size != width * height or values.max() > largest:
        raise SettingsError(f'{path} is cut off or damaged: {width} × {height} pixels of 0 to '
                            f'{largest} are announced')
    return np.flipud(values.reshape(height, width).astype(np.float64) / largest)


def read_map(file: str, occupied: int) -> OccupancyMap:
    """
    Read a map as Nav2's map_server does: a YAML file that names a PGM image.

    Parameters
    ----------
    file : str
        The YAML file, with ``image``, ``resolution``, ``origin``, ``negate``,
        ``occupied_thresh``, ``free_thresh`` and ``mode``.
    occupied : int
        Occupancy from which on a cell reflects [%].

    Raises
    ------
    SettingsError
        With file and reason, if it cannot be used.

    """
    try:
        return _read_map(Path(file), occupied)
    except (SettingsError, OSError, OverflowError, ValueError) as error:
        # A number without end, or a path with a zero in it.
        raise SettingsError(f'map_file = {file!r} cannot be used: {error}') from error


def _read_map(path: Path, occupied: int) -> OccupancyMap:
    data = read_yaml(path, SettingsError)
    image, mode, origin = data.get('image'), data.get('mode', 'trinary'), data.get('origin')
    if not isinstance(image, str):
        raise SettingsError('image must be the path of a PGM image')
    if mode not in _MODES:
        raise SettingsError(f'mode = {mode!r} is not allowed: {", ".join(_MODES)}')
    if not isinstance(origin, list) or len(origin) != 3 or not all(
            isinstance(v, (int, float)) and math.isfinite(v) for v in origin):
        raise SettingsError(f'origin = {origin!r} must be three numbers: x, y, heading')
    resolution = _number(data, 'resolution', 1e-4, 1e4)
    full = _number(data, 'occupied_thresh', 0.0, 1.0, 0.65)
    empty = _number(data, 'free_thresh', 0.0, 1.0, 0.25)
    if empty >= full:
        raise SettingsError(f'free_thresh = {empty:g} is not below occupied_thresh = {full:g}')
    grey = _grey(path.parent / image)
    if data.get('negate', 0) not in (0, 1):
        raise SettingsError(f'negate = {data["negate"]!r} must be 0 or 1')
    dark = grey if data.get('negate', 0) else 1.0 - grey
    if mode == 'raw':
        raw = np.rint(grey * 255.0)
        cells = np.where(raw <= 100.0, raw, _UNKNOWN)
    else:
        between = np.rint(100.0 * (dark - empty) / (full - empty)) if mode == 'scale' else (
            np.full(dark.shape, float(_UNKNOWN)))
        cells = np.where(dark >= full, 100.0, np.where(dark <= empty, 0.0, between))
    corner = Pose(*(float(v) for v in origin))
    return OccupancyMap(cells.astype(np.int8), resolution, corner, occupied)
