# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Step the event-driven kernel at a fixed period, one command a step."""

from __future__ import annotations

from lg_husky_sim.jit import jit
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation.event_kernel import run
from lg_husky_sim.simulation.modal_kernel import Packed
import numpy as np


@jit
def march(s: FloatArray, ages: FloatArray, values: FloatArray, waiting: int,
          commands: FloatArray, out: FloatArray, period: float, longest: float, fine: bool,
          plant: Packed) -> tuple[int, int]:
    """
    Advance the flat state ``s`` by one period for each command, in place.

    Parameters
    ----------
    s : numpy.ndarray
        Flat state.
    ages, values : numpy.ndarray, shapes (m,), (m, 2)
        Buffer of the commands that a dead time still holds back, m >= waiting + n_steps: when
        they were given [s], before now, and what.
    waiting : int
        How many there are at the start.
    commands : numpy.ndarray, shape (n_steps, 2)
        Each is given at the beginning of its step.
    out : numpy.ndarray, shape (n_steps, 15)
        Receives :data:`event_kernel.COLUMNS` at the end of each step.
    period, longest : float
        Length of a step, and longest dead time [s].
    fine, plant
        As in :func:`lg_husky_sim.simulation.event_kernel.run`.

    Returns
    -------
    tuple of int
        Where in the buffer those begin and end that are still held back at the end.
    """
    clock = plant.out_of.shape[1] + 6
    stamps, end, place = np.zeros(ages.size), np.zeros(1), np.zeros(1, dtype=np.int64)
    first, last = 0, waiting
    for k in range(commands.shape[0]):
        ages[last], values[last, 0], values[last, 1] = 0.0, commands[k, 0], commands[k, 1]
        last += 1
        for i in range(first, last):
            stamps[i] = s[clock] + ages[i]
        end[0] = s[clock] + period
        run(s, stamps[first:last], values[first:last], end, place, out[k:k + 1], end[0], fine,
            plant)
        for i in range(first, last):
            ages[i] = stamps[i] - s[clock]
        while first < last and ages[first] + longest < -period:
            first += 1
    return first, last
