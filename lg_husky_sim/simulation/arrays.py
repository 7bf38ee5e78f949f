# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Arrays of the event-driven kernel: a plant in the coordinates of its modes, and a place to work.

Vectors of one kind are the rows of one array: each array that a compiled function is handed takes
a share of the seconds that its compilation takes, and of each call.
"""

from __future__ import annotations

from typing import NamedTuple

from lg_husky_sim.husky.laws import MEMORY as MEMORIES
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray

#: Columns of ``Packed.stages``: latency [s], slew forward and yaw [m/s², rad/s²], limit forward
#: and yaw [m/s, rad/s], volts per speed and per yaw rate [V·s/m, V·s/rad], clamp [V] (0: none),
#: first step after a jump [s], kind of the onset and its value.
LATENCY, SLEW, LIMIT, SPEED_VOLTS, TURN_VOLTS, CLAMP, FIRST_STEP, KIND, ONSET, STAGES = (
    0, 1, 3, 5, 6, 7, 8, 9, 10, 11)
#: Columns of ``Packed.counts``: real modes, pairs, efforts; whether efforts need the pose, a
#: memory, the voltages, what their arguments add up to.
REALS, PAIRS, EFFORTS, POSED, REMEMBERING, FED, ADDING = 0, 1, 2, 3, 4, 5, 6
#: Rows of ``Packed.modal``: rates of the modes [1/s], what voltages do to them, what wheel rates,
#: speed and yaw rate read of them, and from row GAINS on what the efforts do to them.
RATES, INPUTS, MOTION, GAINS = 0, 1, 3, 7
#: Kinds of onset: the second set is in force from a time on [s], at or beyond a place [m], or
#: before it; 0 for never.
FROM_TIME, BEYOND_PLACE, BEFORE_PLACE = 1.0, 2.0, 3.0


class Packed(NamedTuple):
    """
    What the kernel needs of a plant; the first axis counts its sets of matrices.

    Parameters
    ----------
    stages : numpy.ndarray, shape (n_sets, STAGES)
    counts : numpy.ndarray of int64, shape (n_sets, 7)
    modal : numpy.ndarray, shape (n_sets, GAINS + n_efforts, n_modes)
    bases : numpy.ndarray, shape (n_sets, 2, n, n_modes)
        States of modes, and modes of states (its column).
    readings : numpy.ndarray, shape (n_sets, n_modes + 2, n_arguments)
        What the efforts' arguments read of each mode and voltage.
    outputs : numpy.ndarray, shape (n_sets, ROWS, n + 2 + n_efforts)
        Outputs of the plant, then the derivatives of yaw rate and speed: of modes, voltages and
        efforts.
    laws, coefficients, offsets : numpy.ndarray, shapes (n_sets, n_efforts[, laws.WIDTH])

    """

    stages: FloatArray
    counts: NDArray[np.int64]
    modal: FloatArray
    bases: FloatArray
    readings: FloatArray
    outputs: FloatArray
    laws: NDArray[np.int64]
    coefficients: FloatArray
    offsets: NDArray[np.int64]


#: Points at once; loops over them are written for this number.
LANES = 8
#: Rows of ``Work.modes``: those at the start of a step, their rate then, slope and bend of their
#: forcing, something for a moment, those inside the step, and phi_1 to phi_4 for a quarter of
#: the step, its half, the whole and three quarters.
XI, RATE, SLOPE, BEND, FORCE, INSIDE, PHI, MODE_ROWS = 0, 1, 2, 3, 4, 5, 6, 22
#: Rows of ``Work.efforts``: at start, middle and end of a step; slope and bend of the parabola
#: through them, and of that of the step before; what the laws differ from the parabola between
#: the nodes, at the middle and the end, and did before; what the laws just said.
F, PARABOLA, FORMER, CHANGE, OLD, NEW, EFFORT_ROWS = 0, 3, 5, 7, 10, 13, 14
#: Rows of ``Work.arguments``: at start, middle and end of a step, and between; integrals of them.
BETWEEN, SWEPT, ARGUMENT_ROWS = 3, 4, 5
#: Rows of ``Work.lanes``: times since the start of the step [s], those beyond the last point
#: repeat it; exp(z) - 1 of a pair of modes; outputs; what wheels turned [rad], the base went [m]
#: and turned [rad] since the start of the step; from row INTEGRALS on those of the modes, and
#: then modes, voltages and efforts.
GOALS, GROWN, OUTPUTS, DRIVEN, INTEGRALS = 0, 1, 3, 14, 18
#: Rows of the outputs: those of the plant, yaw acceleration, derivative of the speed.
YAW_ACCELERATION, ACCELERATION, ROWS = 9, 10, 11
#: Rows of ``Work.few``: context and memory of the laws, that at the middle and the end of a step
#: and inside it; voltages, their slopes, those inside a step; command in force, behind limits
#: and ramps, slopes of the ramps, times at which they end, and where; direction (cosine, sine);
#: integrals of wheel rates, speed and yaw rate over a part of a step; speed, yaw rate and their
#: derivatives at the last point; what memories with stops add up to by the middle of a step, and
#: what they would be at its end without a look at the middle, less what they are.
(CONTEXT, MEMORY, KEPT, NOW, U, DU, U_INSIDE, COMMANDED, LIMITED, SLOPES, RAMPS, AIMS, TANGENT,
 PART, LAST, WAY, ASTRAY, FEW_ROWS) = 0, 1, 2, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18
#: Their length.
FEW = 8


class Work(NamedTuple):
    """
    Where the kernel works; what is in it between two calls means nothing.

    Parameters
    ----------
    modes : numpy.ndarray, shape (MODE_ROWS, n_modes)
    efforts : numpy.ndarray, shape (EFFORT_ROWS, n_efforts)
    arguments : numpy.ndarray, shape (ARGUMENT_ROWS, n_arguments)
    lanes : numpy.ndarray, shape (INTEGRALS + 2 n + 2 + n_efforts, LANES)
    few : numpy.ndarray, shape (FEW_ROWS, FEW)

    """

    modes: FloatArray
    efforts: FloatArray
    arguments: FloatArray
    lanes: FloatArray
    few: FloatArray


def workspace(plant: Packed) -> Work:
    """Return a place to work for one thread."""
    n, size, efforts = plant.bases.shape[2], plant.bases.shape[3], plant.laws.shape[1]
    return Work(np.zeros((MODE_ROWS, size)), np.zeros((EFFORT_ROWS, efforts)),
                np.zeros((ARGUMENT_ROWS, plant.readings.shape[2])),
                np.zeros((INTEGRALS + 2 * n + 2 + efforts, LANES)), np.zeros((FEW_ROWS, FEW)))


assert MEMORIES <= FEW
