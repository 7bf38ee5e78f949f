# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a result is drawn: into axes that are given, or into those of a new figure."""

from __future__ import annotations

from typing import Any

from lg_husky_sim.errors import ParameterError
from lg_husky_sim.extras import require
import numpy as np


def axes_or_new(axes: Any, grid: tuple[int, int], what: str, size: tuple[float, float],
                share: bool = False) -> list[Any]:
    """
    Return the axes to draw into, row by row; of a new figure if there are none.

    Parameters
    ----------
    axes : matplotlib Axes, sequence or array of them, or None
        Where to draw; None for a new figure.
    grid : tuple of int
        Rows and columns of a new figure; their product is how many axes there must be.
    what : str
        What is drawn, for the message.
    size : tuple of float
        Width and height of a new figure [in].
    share : bool
        Whether all axes of a new figure have one range along x.

    Raises
    ------
    ParameterError
        If another number of axes is given.

    """
    require('matplotlib', 'draw figures')
    count = grid[0] * grid[1]
    if axes is None:
        from matplotlib import pyplot
        _, made = pyplot.subplots(*grid, figsize=size, squeeze=False, sharex=share,
                                  layout='constrained')
        return list(made.flat)
    found = list(np.ravel(np.asarray(axes, dtype=object)))
    if len(found) != count:
        raise ParameterError(f'{len(found)} axes given; {what} is drawn into {count}')
    return found
