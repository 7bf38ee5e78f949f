# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Trajectories in the TUM format: one line a pose, as evo reads them."""

from __future__ import annotations

import os
from pathlib import Path

from lg_husky_sim.folders import check_unchanged, scratch_beside, signed
from lg_husky_sim.signals import TimeSeries
import numpy as np

#: First line of every file.
HEAD = '# timestamp x y z qx qy qz qw'


def check_tum(path: Path) -> None:
    """
    Check that a trajectory may be written at a path.

    Raises
    ------
    SettingsError
        If something else is there.

    """
    check_unchanged(path, HEAD)


def write_tum(path: str | os.PathLike[str], pose: TimeSeries, start_ns: int = 0) -> Path:
    """
    Write a trajectory, whole or not at all.

    Parameters
    ----------
    path : path-like
        Replaced if such a file is there that was written here and not changed since.
    pose : TimeSeries
        Names x, y [m], heading [rad].
    start_ns : int
        Time zero [ns].

    Returns
    -------
    pathlib.Path

    Raises
    ------
    SettingsError
        If something else is there.

    """
    place = Path(path)
    check_tum(place)
    stamps = start_ns + np.round(pose.times * 1e9).astype(np.int64)
    lines = [HEAD]
    for stamp, (x, y, heading) in zip(stamps.tolist(), pose.values.tolist(), strict=True):
        # Written from integers: a float of seconds since 1970 holds no nanoseconds.
        lines.append(f'{stamp // 10**9}.{stamp % 10**9:09d} {x:.9g} {y:.9g} 0 0 0 '
                     f'{np.sin(0.5 * heading):.12g} {np.cos(0.5 * heading):.12g}')
    with scratch_beside(place) as scratch:
        draft = scratch / place.name
        draft.write_text(signed('\n'.join(lines) + '\n'), encoding='utf-8')
        os.replace(draft, place)
    return place
