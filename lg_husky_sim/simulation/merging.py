# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Let efforts that are one function of the same arguments be evaluated once."""

from __future__ import annotations

from dataclasses import replace

from lg_husky_sim.husky.laws import REMEMBERING
from lg_husky_sim.husky.plant import PlantSet
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Bits of a number's mantissa that count; the graph's algebra rounds the last ones.
_BITS = 44


def _rounded(values: FloatArray) -> FloatArray:
    # The same for numbers that only differ by rounding.
    mantissas, exponents = np.frexp(values)
    rounded: FloatArray = np.ldexp(np.round(mantissas * 2.0 ** _BITS), exponents - _BITS)
    return rounded


def merged(plant: PlantSet) -> PlantSet:
    """
    Sum the gains of efforts that always have the same value.

    The tyres of one side slip alike where the contacts of a graph roll with the same wheel rate:
    what the graph keeps apart, branch by branch, is then computed twice.

    Parameters
    ----------
    plant : PlantSet
        Matrices and laws of one regime.

    Returns
    -------
    PlantSet
        The same set where no two efforts have the same law, coefficients and arguments.

    """
    ends = np.append(plant.offsets[1:], plant.h.shape[0])
    if plant.laws.size < 2:
        return plant
    coefficients = _rounded(plant.coefficients)
    rows = np.hstack([plant.h, plant.k])
    # What is nothing beside the largest is left by a difference of equals.
    rows = _rounded(np.where(np.abs(rows) > 1e-14 * np.max(np.abs(rows), initial=0.0), rows, 0.0))
    place: dict[tuple[int, int, bytes, bytes], int] = {}
    kept: list[int] = []
    home: list[int] = []
    for effort, law in enumerate(plant.laws.tolist()):
        own = slice(plant.offsets[effort], ends[effort])
        alone = effort if law in REMEMBERING else -1
        key = (law, alone, coefficients[effort].tobytes(), rows[own].tobytes())
        if key not in place:
            place[key] = len(kept)
            kept.append(effort)
        home.append(place[key])
    if len(kept) == plant.laws.size:
        return plant
    gains = np.zeros((plant.laws.size, len(kept)))
    gains[np.arange(plant.laws.size), home] = 1.0
    own_rows = [np.arange(plant.offsets[effort], ends[effort]) for effort in kept]
    arguments = np.concatenate(own_rows)
    return replace(
        plant, g=plant.g @ gains, rows_f=plant.rows_f @ gains, h=plant.h[arguments],
        k=plant.k[arguments], laws=plant.laws[kept], coefficients=plant.coefficients[kept],
        offsets=np.cumsum([0] + [row.size for row in own_rows[:-1]]))
