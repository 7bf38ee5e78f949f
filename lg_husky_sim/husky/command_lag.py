# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Smooth the commands of a base by a first-order low pass in front of its inputs."""

from __future__ import annotations

from dataclasses import replace

from lg_husky_sim.husky.plant import PlantSet
from lg_husky_sim.husky.speed_loop import clipped
import numpy as np

#: States that the low pass adds.
STATES = ('smoothed(left)', 'smoothed(right)')


def smooth_commands(plant: PlantSet, lag: float) -> PlantSet:
    """
    Put a first-order low pass in front of both inputs.

    With the inputs u of the plant and what the commands ask for, r of eqs. (24), (25)::

        u' = (r - u) / lag

    The driver clips the smoothed voltage at its supply.

    Parameters
    ----------
    plant : PlantSet
        Open loop, or with a speed loop that follows its inputs.
    lag : float
        Time constant [s].

    Returns
    -------
    PlantSet
        With two more states; inputs are what the commands ask for.

    """
    n = plant.a.shape[0]
    a = np.zeros((n + 2, n + 2))
    a[:n] = np.hstack([plant.a, plant.b])
    a[n:, n:] = -np.eye(2) / lag
    b = np.zeros((n + 2, 2))
    b[n:] = np.eye(2) / lag
    smooth = replace(
        plant, a=a, b=b, g=np.vstack([plant.g, np.zeros((2, plant.g.shape[1]))]),
        h=np.hstack([plant.h, plant.k]), k=np.zeros_like(plant.k),
        rows=np.hstack([plant.rows, plant.rows_u]), rows_u=np.zeros_like(plant.rows_u))
    if not plant.command.clamp:
        # A speed loop, which clips what it makes of them.
        return smooth
    return clipped(smooth, np.hstack([np.zeros((2, n)), np.eye(2)]),
                   np.vstack([plant.b, np.zeros((2, 2))]), plant.rows_u, plant.command.clamp)
