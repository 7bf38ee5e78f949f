# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A plant in the coordinates of its modes, in which any interval is exact."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, TypeVar

from lg_husky_sim.husky.effects import OnsetKind
from lg_husky_sim.husky.laws import CONTEXTUAL, Law, REMEMBERING, WIDTH
from lg_husky_sim.husky.plant import CommandStage, Plant, PlantSet
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation.arrays import (
    BEFORE_PLACE,
    BEYOND_PLACE,
    FROM_TIME,
    GAINS,
    MOTION,
    Packed,
    ROWS,
    STAGES,
)
from lg_husky_sim.simulation.merging import merged
import numpy as np
from numpy.typing import NDArray

#: Condition of the eigenvectors beyond which A is perturbed.
WORST_CONDITION = 1e7
#: Relative size of that perturbation: the matrices' own numbers are known far worse.
PERTURBATION = 1e-10
#: Entries of a matrix that are rounding, relative to the largest.
NOTHING = 1e-15
_LANES = 4
_ONSETS = {OnsetKind.TIME: FROM_TIME, OnsetKind.PLACE_ABOVE: BEYOND_PLACE,
           OnsetKind.PLACE_BELOW: BEFORE_PLACE}
_Numbers = TypeVar('_Numbers', NDArray[np.float64], NDArray[np.int64])


@dataclass(frozen=True, eq=False)
class Modes:
    """
    The modes of one matrix A (n x n): real ones first, then pairs.

    Parameters
    ----------
    n_real, n_pairs : int
    rates : numpy.ndarray, shape (n_real + 2 n_pairs,)
        Real eigenvalues, real parts of the pairs, imaginary parts of the pairs [1/s].
    out_of : numpy.ndarray, shape (n, n_real + 2 n_pairs)
        x = out_of @ xi, xi = real modes, real and imaginary parts of the pairs.
    into : numpy.ndarray, shape (n_real + 2 n_pairs, n)
        xi = into @ x.

    """

    n_real: int
    n_pairs: int
    rates: FloatArray
    out_of: FloatArray
    into: FloatArray


def modes_of(a: FloatArray, mixing: tuple[FloatArray, FloatArray] | None = None) -> Modes:
    """
    Return the modes of a matrix.

    Parameters
    ----------
    a : numpy.ndarray, shape (n, n)
        Of x' = a x, real [1/s].
    mixing : tuple of numpy.ndarray, shapes (n, n), optional
        Matrix of coordinates in which a may fall apart into blocks, such as the mean of both
        sides and their difference, and its inverse; modes then stay apart to the last bit.

    Returns
    -------
    Modes
        Of a matrix nearby (:data:`PERTURBATION`) where equal eigenvalues share an eigenvector.

    """
    n = a.shape[0]
    onto, back = (np.eye(n), np.eye(n)) if mixing is None else mixing
    mixed = onto @ a @ back
    values = np.zeros(n, dtype=np.complex128)
    vectors = np.zeros((n, n), dtype=np.complex128)
    inverse = np.zeros((n, n), dtype=np.complex128)
    for block in _blocks(mixed):
        place = np.ix_(block, block)
        values[block], vectors[place], inverse[place] = _decomposed(mixed[place])
    vectors, inverse = back @ vectors, inverse @ onto
    real = np.flatnonzero(values.imag == 0.0)
    pairs = np.flatnonzero(values.imag > 0.0)
    rates = np.concatenate([values[real].real, values[pairs].real, values[pairs].imag])
    out_of = np.concatenate([vectors[:, real].real, 2.0 * vectors[:, pairs].real,
                             -2.0 * vectors[:, pairs].imag], axis=1)
    into = np.concatenate([inverse[real].real, inverse[pairs].real, inverse[pairs].imag])
    return Modes(real.size, pairs.size, rates, out_of, into)


def _blocks(a: FloatArray) -> list[NDArray[np.intp]]:
    # States that act on each other, over any number of others.
    size = np.abs(a)
    linked = size > NOTHING * size.max(initial=0.0)
    linked = linked | linked.T | np.eye(a.shape[0], dtype=bool)
    for _ in range(max(1, a.shape[0].bit_length())):
        linked = linked @ linked
    blocks = {row.tobytes(): np.flatnonzero(row) for row in linked}
    return list(blocks.values())


def _decomposed(a: FloatArray) -> tuple[NDArray[np.complex128], ...]:
    values, vectors = np.linalg.eig(a)
    inverse = _inverse(vectors)
    if inverse is None:
        # Fixed numbers: the same plant gives the same bits.
        size = np.abs(a) + 1e-3 * np.max(np.abs(a), initial=1.0)
        shake = np.random.default_rng(0).uniform(-1.0, 1.0, a.shape)
        values, vectors = np.linalg.eig(a + PERTURBATION * size * shake)
        inverse = np.linalg.inv(vectors)
    return values, vectors, inverse


#: Names of the left side's parts in those of states, and of the right side's.
_SIDES = (('LW', 'RW'), ('(L_1)', '(L_2)'), ('J_RL', 'J_RR'), ('J_FL', 'J_FR'),
          ('BeltL', 'BeltR'), ('(left)', '(right)'))


@lru_cache(maxsize=64)
def _sides_mixed(states: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
    # Sum and difference of both sides, the other states as they are; and back.
    mixing = np.eye(len(states))
    for left, right in _SIDES:
        for i, state in enumerate(states):
            twin = state.replace(left, right)
            if twin != state and twin in states:
                j = states.index(twin)
                mixing[i, j], mixing[j, i], mixing[j, j] = 1.0, 1.0, -1.0
    back = np.asarray(np.linalg.inv(mixing), dtype=np.float64)
    for matrix in (mixing, back):
        matrix.setflags(write=False)
    return mixing, back


def _inverse(vectors: NDArray[np.complex128]) -> NDArray[np.complex128] | None:
    try:
        inverse = np.linalg.inv(vectors).astype(np.complex128)
    except np.linalg.LinAlgError:
        return None
    size = np.abs(vectors).sum(axis=0).max() * np.abs(inverse).sum(axis=0).max()
    return inverse if size < WORST_CONDITION else None


def _stage(command: CommandStage) -> list[float]:
    return [command.latency, command.slew_forward, command.slew_yaw, command.limit_forward,
            command.limit_yaw, command.volts_per_speed, command.volts_per_rate, command.clamp]


def _padded(array: _Numbers, shape: tuple[int, ...], value: int = 0) -> _Numbers:
    if array.shape == shape:
        return np.ascontiguousarray(array)
    whole: _Numbers = np.full(shape, value, dtype=array.dtype)
    whole[tuple(slice(have) for have in array.shape)] = array
    return whole


def _rows(one: PlantSet) -> tuple[FloatArray, FloatArray, FloatArray]:
    # Outputs with the derivatives of yaw rate and speed as further rows, transposed.
    body = one.rows[[3, 2]]
    rows = np.vstack([one.rows, body @ one.a])
    rows_u = np.vstack([one.rows_u, body @ one.b])
    rows_f = np.vstack([one.rows_f, body @ one.g])
    return rows.T, rows_u.T, rows_f.T


def packed(plant: Plant) -> Packed:
    """
    Return what the kernel needs of a plant.

    Parameters
    ----------
    plant : Plant
        With one set of matrices, or two where effects begin at an onset.

    Returns
    -------
    Packed

    """
    sets = tuple(merged(one) for one in plant.sets)
    n = sets[0].a.shape[0]
    mixing = _sides_mixed(plant.states)
    modes = [modes_of(one.a, mixing) for one in sets]
    # Whole vectors of the processor: dummies at rest fill the last one.
    size = -(-max(mode.rates.size for mode in modes) // _LANES) * _LANES
    efforts = max(one.laws.size for one in sets)
    arguments = max(one.h.shape[0] for one in sets)
    onset = [0.0, 0.0]
    if plant.onset is not None and len(sets) > 1:
        onset = [_ONSETS[plant.onset.kind], plant.onset.value]
    stacks: list[list[NDArray[np.generic]]] = [[] for _ in Packed._fields]
    for one, mode in zip(sets, modes, strict=True):
        laws = set(one.laws.tolist())
        needs = (not laws.isdisjoint(CONTEXTUAL), not laws.isdisjoint(REMEMBERING),
                 bool(one.k.any()), Law.STICTION in laws)
        stages = np.array([*_stage(one.command), _first_step(mode), *onset])
        assert stages.size == STAGES
        counts = np.array([mode.n_real, mode.n_pairs, one.laws.size, *needs], dtype=np.int64)
        motion = _padded((mode.out_of.T @ one.rows[:4].T).T, (GAINS - MOTION, size))
        modal = np.vstack([
            _padded(mode.rates[None], (1, size)), _padded((mode.into @ one.b).T, (2, size)),
            motion, _padded((mode.into @ one.g).T, (efforts, size))])
        bases = np.stack([_padded(mode.out_of, (n, size)), _padded(mode.into.T, (n, size))])
        readings = np.vstack([_padded((one.h @ mode.out_of).T, (size, arguments)),
                              _padded(one.k.T, (2, arguments))])
        rows, rows_u, rows_f = _rows(one)
        outputs = np.hstack([(mode.out_of.T @ rows).T, rows_u.T,
                             _padded(rows_f.T, (ROWS, efforts))])
        pieces: Packed = Packed(
            stages, counts, modal, bases, readings, outputs,
            # What pads a set reads no argument: there may be none in the whole plant.
            _padded(one.laws, (efforts,), int(Law.HEADING)),
            _padded(one.coefficients, (efforts, WIDTH)), _padded(one.offsets, (efforts,)))
        for stack, piece in zip(stacks, pieces, strict=True):
            stack.append(piece)
    return Packed(*(_stacked(stack) for stack in stacks))


def _stacked(arrays: list[NDArray[np.generic]]) -> NDArray[Any]:
    return arrays[0][None] if len(arrays) == 1 else np.stack(arrays)


#: Bounds of the first step after a jump of the input [s].
FIRST = (5e-5, 5e-4)


def _first_step(modes: Modes) -> float:
    fastest = max(1.0, float(np.abs(modes.rates).max(initial=1.0)))
    return min(max(0.4 / fastest, FIRST[0]), FIRST[1])
