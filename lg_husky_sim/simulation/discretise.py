# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Operators of one sub-step, exact for the linear part."""

from __future__ import annotations

from dataclasses import dataclass
import itertools
import math
from typing import TypeVar

from lg_husky_sim.errors import ParameterError
from lg_husky_sim.husky.effects import OnsetKind
from lg_husky_sim.husky.laws import Law, WIDTH
from lg_husky_sim.husky.plant import CommandStage, Plant, PlantSet
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation.kernel import COMMAND, DELAY
from lg_husky_sim.simulation.merging import merged
import numpy as np
from numpy.typing import NDArray

#: Edges of the panels of the pose quadrature [s]: graded, since a change of the voltage excites
#: the fast electrical modes at the start of a step.
PANELS = (0.0, 0.0005, 0.0015, 0.004, 0.01, 0.025, 0.06, 0.15, 0.4, 1.0)
#: Gauss-Legendre points of a panel.
POINTS = 4
#: Longest sub-step of a plant with efforts [s].
LONGEST = 0.01
_Numbers = TypeVar('_Numbers', NDArray[np.float64], NDArray[np.int64])
_ONSETS = {OnsetKind.TIME: 1.0, OnsetKind.PLACE_ABOVE: 2.0, OnsetKind.PLACE_BELOW: 3.0}


@dataclass(frozen=True, eq=False)
class Operators:
    """
    What the kernel needs of a plant at one period.

    Parameters
    ----------
    period : float
        Step [s].
    substeps : int
    n : int
        States of graph and controllers.
    arguments : tuple
        In the order of :func:`lg_husky_sim.simulation.kernel.run` from ``period`` on.
    """

    period: float
    substeps: int
    n: int
    arguments: tuple[object, ...]


def expm(matrix: FloatArray) -> FloatArray:
    """
    Return the exponential of a small matrix by scaling, Taylor series and squaring.

    Products only: a linear solve of this size wakes a threaded LAPACK's workers, which costs far
    more than the exponential itself.

    Parameters
    ----------
    matrix : numpy.ndarray, shape (m, m)

    Returns
    -------
    numpy.ndarray, shape (m, m)
    """
    norm = float(np.max(np.sum(np.abs(matrix), axis=1)))
    squarings = max(0, math.ceil(math.log2(norm / 0.5))) if norm > 0.5 else 0
    scaled = matrix / 2.0 ** squarings
    identity = np.eye(matrix.shape[0])
    result = identity
    for order in range(14, 0, -1):
        result = identity + scaled @ result / order
    for _ in range(squarings):
        result = result @ result
    return result


def _held(plant: PlantSet) -> tuple[FloatArray, FloatArray, FloatArray]:
    # Matrices with wheel angles, distance and heading as further states.
    n, efforts = plant.a.shape[0], plant.laws.size
    a = np.zeros((n + 4, n + 4))
    a[:n, :n] = plant.a
    a[n:, :n] = plant.rows[:4]
    b = np.vstack([plant.b, plant.rows_u[:4]])
    g = np.vstack([plant.g, plant.rows_f[:4]]) if efforts else np.zeros((n + 4, 0))
    return a, b, g


def _block(a: FloatArray, b: FloatArray, g: FloatArray, step: float) -> FloatArray:
    # exp of this gives [phi, gamma_u, gamma_1, gamma_2] in its first rows.
    size, efforts = a.shape[0], g.shape[1]
    block = np.zeros((size + 2 + 2 * efforts,) * 2)
    block[:size, :size] = a
    block[:size, size:size + 2] = b
    block[:size, size + 2:size + 2 + efforts] = g
    block[size + 2:size + 2 + efforts, size + 2 + efforts:] = np.eye(efforts) / step
    return block


def _quadrature(step: float) -> tuple[FloatArray, FloatArray]:
    points, weights = np.polynomial.legendre.leggauss(POINTS)
    edges = [edge for edge in PANELS if edge < step * (1.0 - 1e-9)] + [step]
    times, shares = [], []
    for left, right in itertools.pairwise(edges):
        times.append(left + 0.5 * (right - left) * (points + 1.0))
        shares.append(0.5 * (right - left) * weights)
    return np.concatenate(times), np.concatenate(shares)


def _nodes(plant: PlantSet, a: FloatArray, b: FloatArray, g: FloatArray, step: float,
           times: FloatArray) -> FloatArray:
    size = a.shape[0]
    block = _block(a, b, g, step)
    pick = np.zeros((2, block.shape[0]))
    pick[0, :size - 4] = plant.rows[2]
    pick[0, size:size + 2] = plant.rows_u[2]
    pick[1, size - 1] = 1.0
    maps = np.stack([pick @ expm(block * t) for t in times])
    return np.ascontiguousarray(np.concatenate([maps[:, 0], maps[:, 1]]).T)


def _stage(command: CommandStage, period: float) -> list[float]:
    longest = (DELAY - 2) * period
    if command.latency > longest * (1.0 + 1e-9):
        raise ParameterError(f'latency = {command.latency:g} s is longer than {longest:g} s, '
                             f'what steps of period {period:g} s can hold back')
    return [command.latency / period, command.slew_forward * period, command.slew_yaw * period,
            command.limit_forward, command.limit_yaw, command.volts_per_speed,
            -command.volts_per_rate, command.volts_per_speed, command.volts_per_rate,
            command.clamp]


def _padded(array: _Numbers, shape: tuple[int, ...], value: int = 0) -> _Numbers:
    if array.shape == shape:
        return array
    whole: _Numbers = np.full(shape, value, dtype=array.dtype)
    whole[tuple(slice(have) for have in array.shape)] = array
    return whole


def discretise(plant: Plant, period: float, *, fine_pose: bool = True) -> Operators:
    """
    Make the operators of a plant for one period.

    Parameters
    ----------
    plant : Plant
    period : float
        Step [s], positive. A plant with efforts is sub-stepped at :data:`LONGEST`.
    fine_pose : bool
        Quadrature of x and y at graded nodes (error below 1e-9 m a step); False takes the arc of
        each sub-step's distance and heading change, which is faster and good to 1e-5 m.

    Returns
    -------
    Operators

    Raises
    ------
    ParameterError
        If the command's latency is longer than :data:`kernel.DELAY` - 2 periods.
    """
    sets = tuple(merged(one) for one in plant.sets)
    efforts = max(s.laws.size for s in sets)
    arguments = max(s.h.shape[0] for s in sets)
    n = sets[0].a.shape[0]
    substeps = 1 if efforts == 0 else max(1, math.ceil(period / LONGEST - 1e-9))
    step = period / substeps
    times, weights = _quadrature(step) if fine_pose else (np.zeros(0), np.zeros(0))
    size = n + 4
    stacks: list[list[NDArray[np.generic]]] = [[] for _ in range(12)]
    for one in sets:
        a, b, g = _held(one)
        g = _padded(g, (n + 4, efforts))
        whole = expm(_block(a, b, g, step) * step)[:size]
        # What pads a set reads no argument: there may be none in the whole plant.
        laws = _padded(one.laws, (efforts,), int(Law.HEADING))
        coefficients = np.array(_padded(one.coefficients, (efforts, WIDTH)))
        pieces: list[NDArray[np.generic]] = [
            np.array(_stage(one.command, period)),
            np.ascontiguousarray(whole[:, :size].T),
            np.ascontiguousarray(whole[:, size:size + 2].T),
            np.ascontiguousarray(whole[:, size + 2:size + 2 + efforts].T),
            np.ascontiguousarray(whole[:, size + 2 + efforts:].T),
            np.ascontiguousarray(_padded(one.h, (arguments, n)).T),
            np.ascontiguousarray(_padded(one.k, (arguments, 2)).T),
            laws, coefficients, _padded(one.offsets, (efforts,)),
            np.ascontiguousarray(one.rows.T),
            np.ascontiguousarray(one.rows_u.T),
        ]
        for stack, piece in zip(stacks, pieces, strict=True):
            stack.append(piece)
    rows_f = np.stack([np.ascontiguousarray(_padded(s.rows_f, (9, efforts)).T)
                       for s in sets])
    nodes = np.zeros((len(sets), size + 2 + 2 * efforts, 2 * times.size))
    if fine_pose:
        for index, one in enumerate(sets):
            a, b, g = _held(one)
            g = _padded(g, (n + 4, efforts))
            nodes[index] = _nodes(one, a, b, g, step, times)
    onset = np.zeros(2)
    if plant.onset is not None and len(sets) > 1:
        onset[:] = _ONSETS[plant.onset.kind], plant.onset.value
    stacked = [np.stack(stack) for stack in stacks]
    assert stacked[0].shape[1] == COMMAND
    return Operators(period, substeps, n, (
        period, substeps, onset, *stacked, rows_f, nodes, weights))
