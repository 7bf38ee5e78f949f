# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Maps as map_server reads them, and the ranges of a laser in them."""

from __future__ import annotations

import math
from pathlib import Path
import re
import tracemalloc

from lg_husky_sim.errors import SettingsError
from lg_husky_sim.ros.occupancy import OccupancyMap, read_map
from lg_husky_sim.signals import FloatArray, Pose
import numpy as np
import pytest

HEAD = 'image: map.pgm\nresolution: 0.5\norigin: [-1.0, -2.0, 0.0]\nnegate: 0\n'
THRESHOLDS = 'occupied_thresh: 0.65\nfree_thresh: 0.196\n'


def written(folder: Path, image: bytes, text: str = HEAD + THRESHOLDS) -> str:
    """Write a map and return the path of its YAML file."""
    (folder / 'map.pgm').write_bytes(image)
    (folder / 'map.yaml').write_text(text, encoding='utf-8')
    return str(folder / 'map.yaml')


def crept(grid: OccupancyMap, pose: Pose, angles: FloatArray, longest: float) -> FloatArray:
    """Return ranges found by creeping along each ray in steps of a thousandth of a cell."""
    turn = grid.origin.heading
    ways = np.arange(0.0, longest, grid.resolution / 1000.0)
    found = []
    for angle in angles:
        x = pose.x + ways * math.cos(pose.heading + angle) - grid.origin.x
        y = pose.y + ways * math.sin(pose.heading + angle) - grid.origin.y
        columns = np.floor((x * math.cos(turn) + y * math.sin(turn)) / grid.resolution)
        rows = np.floor((y * math.cos(turn) - x * math.sin(turn)) / grid.resolution)
        height, width = grid.cells.shape
        inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
        cells = grid.cells[np.where(inside, rows, 0).astype(int),
                           np.where(inside, columns, 0).astype(int)]
        own = (columns == columns[0]) & (rows == rows[0])
        hits = np.flatnonzero(inside & (cells >= grid.occupied) & ~own)
        found.append(ways[hits[0]] if hits.size else np.inf)
    return np.array(found)


@pytest.mark.parametrize('seed', range(12))
def test_rays_end_where_creeping_along_them_meets_an_occupied_cell(seed: int) -> None:
    """Random maps, turned origins and places, a wall or none: the same to a thousandth."""
    random = np.random.default_rng(seed)
    shape = tuple(random.integers(5, 60, 2))
    cells = np.where(random.random(shape) < random.choice([0.0, 0.01, 0.1]), 100, 0)
    cells[random.random(shape) < 0.05] = -1
    if seed % 3:
        cells[0], cells[-1] = 100, 100
        cells[:, 0], cells[:, -1] = 100, 100
    grid = OccupancyMap(cells.astype(np.int8), 0.05, Pose(*random.normal(size=3)), 60)
    height, width = shape
    here = random.uniform(0.1, 0.9, 2) * (width, height) * 0.05
    cos, sin = math.cos(grid.origin.heading), math.sin(grid.origin.heading)
    pose = Pose(grid.origin.x + cos * here[0] - sin * here[1],
                grid.origin.y + sin * here[0] + cos * here[1], float(random.normal()))
    angles = np.linspace(-math.pi, math.pi, 60, endpoint=False)
    ranges = grid.ranges(pose, angles, 2.0)
    expected = crept(grid, pose, angles, 2.0)
    # Creeping may step over the very corner of a cell.
    same = np.isclose(ranges, expected, atol=2e-4) | (ranges == expected)
    assert same.mean() > 0.95
    assert (ranges <= expected + 2e-4).all()
    assert np.isinf(ranges).any() or seed % 3 or (cells == 100).any()


def test_rays_along_the_axes_are_exact() -> None:
    """A wall two cells ahead, one four cells behind, nothing to the sides."""
    cells = np.zeros((5, 9), dtype=np.int8)
    cells[:, 0] = cells[:, 7] = 100
    grid = OccupancyMap(cells, 1.0, Pose(), 60)
    ranges = grid.ranges(Pose(5.0, 2.5, 0.0), np.array([0.0, math.pi / 2, math.pi]), 30.0)
    assert ranges[0] == 2.0
    assert np.isinf(ranges[1])
    assert ranges[2] == pytest.approx(4.0)
    assert grid.ranges(Pose(5.0, 2.5, 0.0), np.array([0.0]), 1.9)[0] == np.inf
    assert np.isinf(grid.ranges(Pose(-1.0, 2.5, 0.0), np.array([0.0]), 30.0)).all()


@pytest.mark.parametrize('image', [
    b'P5\n# made by hand\n3 2\n255\n' + bytes([0, 254, 205, 254, 254, 0]),
    b'P2 3 2 255\n0 254 205\n254 254 0\n'])
def test_a_file_is_read_as_map_server_reads_it(tmp_path: Path, image: bytes) -> None:
    """Black is occupied, white free, grey unknown; the first row of the image is the top."""
    grid = read_map(written(tmp_path, image), 60)
    assert grid.cells.tolist() == [[0, 0, 100], [100, 0, -1]]
    assert (grid.resolution, grid.origin) == (0.5, Pose(-1.0, -2.0, 0.0))


@pytest.mark.parametrize(('more', 'cells'), [
    ('negate: 1\n', [[100, 100, 0], [0, 100, 100]]), ('mode: scale\n', [[0, 0, 100], [100, 0, 0]]),
    ('mode: raw\n', [[-1, -1, 0], [0, -1, -1]])])
def test_modes_of_map_server(tmp_path: Path, more: str, cells: list[list[int]]) -> None:
    """Negated, scaled and raw images."""
    image = b'P5 3 2 255\n' + bytes([0, 254, 205, 254, 254, 0])
    text = HEAD.replace('negate: 0\n', '') + THRESHOLDS + more
    assert read_map(written(tmp_path, image, text), 60).cells.tolist() == cells


@pytest.mark.parametrize(('image', 'text', 'message'), [
    (b'\x89PNG', HEAD, 'is no PGM image (P5 or P2)'),
    (b'P5 30 20 255\n\0', HEAD, 'is cut off or damaged: 30 × 20 pixels'),
    (b'P2 1 2 255\n0 999\n', HEAD, 'is cut off or damaged'),
    (b'P2 1 2 255\n0 9x\n', HEAD, 'is cut off or damaged'),
    (b'P5 1 1 255\n\0', 'resolution: 0.5\n', 'image must be the path of a PGM image'),
    (b'P5 1 1 255\n\0', HEAD.replace('0.5', '-1'), 'resolution = -1 must be a number'),
    (b'P5 1 1 255\n\0', HEAD.replace('[-1.0', '[x'), "origin = ['x'"),
    (b'P5 1 1 255\n\0', HEAD + 'mode: other\n', "mode = 'other' is not allowed: trinary, scale"),
    (b'P5 1 1 255\n\0', HEAD + 'free_thresh: 0.7\n', 'free_thresh = 0.7 is not below'),
    (b'P5 1 1 255\n\0', HEAD.replace('[-1.0', '[1' + '0' * 400), 'int too large'),
    (b'P5 1 1 255\n\0', HEAD.replace('map.pgm', '"\\0"'), 'null'),
    (b'P5 999999 999999 255\n\0', HEAD, 'cannot be used; at most 40000000 pixels'),
    (b'P2 4001 4001 255\n0', HEAD, 'cannot be used; at most 16000000 pixels'),
    (b'P5 1 1 65536\n\0', HEAD, '1 × 1 pixels of 0 to 65536 cannot be used')])
def test_a_file_that_cannot_be_used_is_refused_in_one_line(
        tmp_path: Path, image: bytes, text: str, message: str) -> None:
    """Name of the file and reason."""
    path = written(tmp_path, image, text)
    with pytest.raises(SettingsError, match=re.escape(message)) as caught:
        read_map(path, 60)
    assert str(caught.value).startswith(f'map_file = {path!r} cannot be used: ')
    assert '\n' not in str(caught.value)


def test_only_what_an_image_announces_is_read(tmp_path: Path) -> None:
    """Not the gigabytes behind it, nor spaces without end before its sizes."""
    path = written(tmp_path, b'P5 3 2 255\n' + bytes([0, 254, 205, 254, 254, 0]))
    cells = read_map(path, 60).cells
    with (tmp_path / 'map.pgm').open('r+b') as file:
        file.truncate(10**9)
    (tmp_path / 'blank.pgm').write_bytes(b'P5' + b' ' * 10**7)
    tracemalloc.start()
    try:
        np.testing.assert_array_equal(read_map(path, 60).cells, cells)
        (tmp_path / 'map.yaml').write_text(
            HEAD.replace('map.pgm', 'blank.pgm') + THRESHOLDS, encoding='utf-8')
        with pytest.raises(SettingsError, match='is no PGM image'):
            read_map(path, 60)
        # 10 MB for the search of the first 64 kB, 150 times that for all.
        assert tracemalloc.get_traced_memory()[1] < 2e7
    finally:
        tracemalloc.stop()


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    """The YAML file, and the image."""
    with pytest.raises(SettingsError, match='No such file'):
        read_map(str(tmp_path / 'none.yaml'), 60)
    (tmp_path / 'map.yaml').write_text(HEAD, encoding='utf-8')
    with pytest.raises(SettingsError, match=r'map\.pgm'):
        read_map(str(tmp_path / 'map.yaml'), 60)
