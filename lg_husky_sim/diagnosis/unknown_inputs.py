# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Unknown inputs at the balances of the graph, estimated from what a fit leaves.

An effort that the graph lacks pushes into one of its balances: the torque balance of a drivetrain,
the contact between wheels and ground, the force or the moment balance of the chassis. A sensor
that is off adds to its channel alone. Each input is a Gaussian process in time (first-order
Markov, straight between knots); its response in every channel follows from the linear part of
the derived equations. The estimate is that of a Kalman smoother, computed as regularised least
squares with a banded matrix, so that every channel keeps its own stamps and windows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
import itertools
import math

from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.identification.noise import LEAST, spread, STAMP
from lg_husky_sim.identification.problem import Observations
from lg_husky_sim.signals import FloatArray
import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded, expm
from scipy.sparse import csc_matrix

#: Time between knots of an input, and width of the bins of fast channels [s].
KNOT = 0.2
BIN = 0.1
#: Step of the responses and longest memory that they have [s].
STEP = 0.01
MEMORY = 3.0
#: Correlation times [s] and relative sizes of the processes that are tried.
TIMES = (0.3, 3.0)
SIZES = (0.1, 0.4, 1.6, 6.4, 25.0)
#: Row of the plant's outputs that a channel sees, and whether it is averaged over a window.
_ROWS = {'wheel_left': 0, 'wheel_right': 1, 'yaw_rate': 3, 'advance': 2, 'turn': 3}
_WINDOWED = ('advance', 'turn')
_CARRIERS = (('rolling_resistance', 'none'), ('yaw_pull', 'none'),
             ('coulomb_drivetrain', 'both'), ('traction_saturation', 'none'))


@dataclass(frozen=True)
class Input:
    """
    One unknown input.

    Parameters
    ----------
    name : str
    unit : str
    size : float
        Typical size [unit]; the relative sizes that are tried refer to it.
    channels : tuple of str
        For a sensor, the channels that it adds to; empty for an effort.
    efforts : tuple of str
        For an effort, the modulated sources of the graph that carry it together.
    """

    name: str
    unit: str
    size: float
    channels: tuple[str, ...] = ()
    efforts: tuple[str, ...] = ()


LEFT = Input('left drivetrain', 'N·m', 1.0, efforts=('T_coulomb_drivetrain_L',))
RIGHT = Input('right drivetrain', 'N·m', 1.0, efforts=('T_coulomb_drivetrain_R',))
SLIP_LEFT = Input('left contact', 'N·m', 1.0, efforts=('T_slip_FL', 'T_slip_RL'))
SLIP_RIGHT = Input('right contact', 'N·m', 1.0, efforts=('T_slip_FR', 'T_slip_RR'))
FORCE = Input('chassis force', 'N', 5.0, efforts=('F_rolling_resistance',))
MOMENT = Input('yaw moment', 'N·m', 1.0, efforts=('F_yaw_pull',))
GYRO = Input('gyro', 'rad/s', 0.02, channels=('yaw_rate',))
ENCODER_LEFT = Input('left encoder', 'rad/s', 0.1, channels=('wheel_left',))
ENCODER_RIGHT = Input('right encoder', 'rad/s', 0.1, channels=('wheel_right',))


@dataclass(frozen=True, eq=False)
class Bins:
    """
    Residuals of one piece in bins of time, scaled by their noise.

    Parameters
    ----------
    piece : int
    channels : tuple of str
        Channel of each row.
    begins, ends : numpy.ndarray, shape (n_rows,)
        Window of each row [s]; equal for a channel that is no average over a window.
    values, deviations : numpy.ndarray, shape (n_rows,)
        Residual and its standard deviation [unit of the channel].
    slopes : numpy.ndarray, shape (n_rows, n_unknowns)
        Derivatives of the prediction by what a recalibration moves.
    """

    piece: int
    channels: tuple[str, ...]
    begins: FloatArray
    ends: FloatArray
    values: FloatArray
    deviations: FloatArray
    slopes: FloatArray


@dataclass(frozen=True, eq=False)
class Estimate:
    """
    Inputs over one piece.

    Parameters
    ----------
    piece : int
    times : numpy.ndarray, shape (n_knots,)
        On the recording's clock [s].
    values, deviations : numpy.ndarray, shape (n_knots, n_inputs)
        Estimate and its standard deviation [unit of each input].
    gains : numpy.ndarray, shape (n_rows,)
        Drop of the half squared residual of each row of the bins [nats].
    """

    piece: int
    times: FloatArray
    values: FloatArray
    deviations: FloatArray
    gains: FloatArray


@dataclass(frozen=True, eq=False)
class Explanation:
    """
    What a family of inputs explains together.

    Parameters
    ----------
    inputs : tuple of Input
    evidence : float
        Logarithm of the marginal likelihood against no input at all [nats].
    estimates : tuple of Estimate
        One for each piece.
    """

    inputs: tuple[Input, ...]
    evidence: float
    estimates: tuple[Estimate, ...]


def effort_columns(structure: Structure, parameters: Parameters
                   ) -> tuple[FloatArray, FloatArray, dict[str, FloatArray]]:
    """
    Return the linear part of a model with a column for each effort that may be missing.

    Parameters
    ----------
    structure, parameters
        Of a fitted model.

    Returns
    -------
    numpy.ndarray, shape (n, n)
        State matrix.
    numpy.ndarray, shape (9, n)
        Output rows.
    dict of str to numpy.ndarray, shape (n,)
        Input columns by the name of the modulated source that pushes there.
    """
    bare = replace(structure, onset=None,
                   effects=tuple(replace(e, late=False) for e in structure.effects))
    have = {(e.id, e.side) for e in bare.effects}
    extra = []
    for name, side in _CARRIERS:
        effect = Effect(name) if side == 'none' else Effect(name, side)
        if (effect.id, effect.side) not in have:
            try:
                compile_model(bare.with_effect(effect))
            except LgHuskyError:
                continue
            bare = bare.with_effect(effect)
            extra.extend(p.parameter() for p in effect.parameters())
    model = compile_model(bare)
    missing = [p for p in extra if p.name not in parameters]
    plant = model.at(parameters.with_entries(*missing)).sets[0]
    names = model.regimes[0].numeric.efforts
    return plant.a, plant.rows, {name: plant.g[:, i] for i, name in enumerate(names)}


def binned(observations: Observations, residual: FloatArray, predicted: FloatArray
           ) -> tuple[Bins, ...]:
    """
    Average residuals over short bins.

    Parameters
    ----------
    observations : Observations
    residual, predicted : numpy.ndarray, shape (n_values,)
        Of a fit.

    Returns
    -------
    tuple of Bins
        One for each piece. The noise is that of the differences between neighbours, and the
        slope of the signal times the uncertainty of a stamp.
    """
    level = {}
    for name in observations.channels:
        steps = np.concatenate([np.diff(residual[s.first:s.last]) for s in observations.slices
                                if s.channel == name])
        level[name] = max(spread(steps) / math.sqrt(2.0), LEAST[name])
    parts: dict[int, list[tuple[str, FloatArray]]] = {}
    for one in observations.slices:
        piece = observations.pieces[one.piece]
        channel = next(c for c in piece.channels if c.name == one.channel)
        own, signal = residual[one.first:one.last], predicted[one.first:one.last]
        cell = np.arange(own.size) if one.channel in _WINDOWED else np.floor(
            (channel.times - piece.start) / BIN).astype(np.int64)
        _, cell = np.unique(cell, return_inverse=True)
        count = np.bincount(cell)
        slope = np.abs(np.gradient(signal, channel.times + 1e-9 * np.arange(own.size)))
        rows = np.column_stack([
            np.bincount(cell, channel.begins) / count, np.bincount(cell, channel.times) / count,
            np.bincount(cell, own) / count,
            np.sqrt(level[one.channel] ** 2 / count
                    + (STAMP * np.bincount(cell, slope) / count) ** 2)])
        parts.setdefault(one.piece, []).append((one.channel, rows))
    found = []
    for number, named in parts.items():
        table = np.vstack([rows for _, rows in named])
        names = tuple(name for name, rows in named for _ in range(len(rows)))
        found.append(Bins(number, names, *table.T))
    return tuple(found)


class Responses:
    """
    Responses of the channels to hat-shaped pulses of the inputs.

    Parameters
    ----------
    structure, parameters
        Of a fitted model.
    """

    def __init__(self, structure: Structure, parameters: Parameters) -> None:
        self._a, self._rows, self._columns = effort_columns(structure, parameters)
        self._kernels: dict[tuple[str, ...], FloatArray] = {}

    def has(self, one: Input) -> bool:
        """Return whether the graph has all sources that carry an input."""
        return all(name in self._columns for name in one.efforts)

    def _kernel(self, efforts: tuple[str, ...]) -> FloatArray:
        # Responses of all outputs to a pulse at 0, from -KNOT on, every STEP.
        if efforts not in self._kernels:
            n = self._a.shape[0]
            column = np.sum([self._columns[name] for name in efforts], axis=0)
            block = np.zeros((n + 1, n + 1))
            block[:n, :n], block[:n, n] = self._a, column
            step = expm(block * STEP)
            times = np.arange(round((KNOT + MEMORY) / STEP)) * STEP - KNOT
            pulse = np.maximum(0.0, 1.0 - np.abs(times + 0.5 * STEP) / KNOT)
            state, states = np.zeros(n), np.zeros((times.size + 1, n))
            for i, push in enumerate(pulse):
                state = step[:n, :n] @ state + step[:n, n] * push
                states[i + 1] = state
            self._kernels[efforts] = states @ self._rows.T
        return self._kernels[efforts]

    def design(self, bins: Bins, inputs: Sequence[Input], knots: FloatArray) -> csc_matrix:
        """
        Return the scaled response of every row to every knot.

        Parameters
        ----------
        bins : Bins
        inputs : sequence of Input
        knots : numpy.ndarray, shape (n_knots,)
            Their times [s].

        Returns
        -------
        scipy.sparse.csc_matrix, shape (n_rows, n_knots * n_inputs)
            The inputs of one knot stand side by side.
        """
        names = np.array(bins.channels)
        rows, columns, values = [], [], []
        reach = math.ceil((MEMORY + 2.0 * KNOT) / KNOT)
        for place, one in enumerate(inputs):
            for channel in dict.fromkeys(bins.channels):
                if one.channels and channel not in one.channels:
                    continue
                here = np.flatnonzero(names == channel)
                last = np.floor((bins.ends[here] - knots[0]) / KNOT).astype(np.int64) + 1
                knot = last[:, None] - np.arange(reach)[None, :]
                inside = (knot >= 0) & (knot < knots.size)
                at = knots[np.clip(knot, 0, knots.size - 1)]
                late, early = (edge[here][:, None] - at for edge in (bins.ends, bins.begins))
                value = np.where(inside, self._seen(one, channel, early, late), 0.0)
                value /= bins.deviations[here][:, None]
                used = np.abs(value) > 1e-6
                rows.append(np.broadcast_to(here[:, None], knot.shape)[used])
                columns.append((knot * len(inputs) + place)[used])
                values.append(value[used])
        shape = (len(bins.channels), knots.size * len(inputs))
        if not rows:
            return csc_matrix(shape)
        return csc_matrix((np.concatenate(values),
                           (np.concatenate(rows), np.concatenate(columns))), shape=shape)

    def _seen(self, one: Input, channel: str, early: FloatArray, late: FloatArray) -> FloatArray:
        if one.channels:
            hat: FloatArray = np.maximum(0.0, 1.0 - np.abs(0.5 * (early + late)) / KNOT)
            return hat
        kernel = self._kernel(one.efforts)[:, _ROWS[channel]]
        times = np.arange(kernel.size) * STEP - KNOT
        if channel not in _WINDOWED:
            return np.interp(late, times, kernel, left=0.0, right=0.0)
        total = np.concatenate([[0.0], np.cumsum(0.5 * (kernel[1:] + kernel[:-1])) * STEP])
        way: FloatArray = ((np.interp(late, times, total) - np.interp(early, times, total))
                           / (late - early))
        return way


def _prior(count: int, sizes: Sequence[float], time: float, width: int) -> FloatArray:
    # Banded precision (lower form) of independent first-order Markov processes.
    k = len(sizes)
    share = math.exp(-KNOT / time)
    band = np.zeros((width + 1, count * k))
    for place, size in enumerate(sizes):
        inner = 1.0 / (size ** 2 * (1.0 - share ** 2))
        diagonal = np.full(count, inner * (1.0 + share ** 2))
        diagonal[[0, -1]] = inner
        band[0, place::k] = diagonal
        band[k, place:(count - 1) * k:k] = -share * inner
    return band


def _banded(matrix: csc_matrix, width: int) -> FloatArray:
    band = np.zeros((width + 1, matrix.shape[0]))
    for offset in range(width + 1):
        diagonal = matrix.diagonal(-offset)
        band[offset, :diagonal.size] = diagonal
    return band


@dataclass(frozen=True, eq=False)
class _System:
    design: csc_matrix
    band: FloatArray
    along: FloatArray
    knots: FloatArray
    width: int

    def posterior(self, sizes: Sequence[float], time: float) -> tuple[float, FloatArray]:
        prior = _prior(self.knots.size, sizes, time, self.width)
        factor = cholesky_banded(self.band + prior, lower=True)
        own = cholesky_banded(prior, lower=True)
        mean = cho_solve_banded((factor, True), self.along)
        gain = 0.5 * float(self.along @ mean) - float(
            np.sum(np.log(factor[0])) - np.sum(np.log(own[0])))
        return gain, mean

    def deviations(self, sizes: Sequence[float], time: float) -> FloatArray:
        prior = _prior(self.knots.size, sizes, time, self.width)
        factor = cholesky_banded(self.band + prior, lower=True)
        inverse = cho_solve_banded((factor, True), np.eye(self.along.size))
        spreads: FloatArray = np.sqrt(np.maximum(np.diag(inverse), 0.0))
        return spreads


def explain(observations: Observations, bins: Sequence[Bins], responses: Responses,
            inputs: Sequence[Input], spreads: bool = True,
            progress: Callable[[], object] | None = None) -> Explanation:
    """
    Estimate a family of inputs, their sizes and correlation time chosen by the evidence.

    Parameters
    ----------
    observations : Observations
    bins : sequence of Bins
        Of :func:`binned`.
    responses : Responses
    inputs : sequence of Input
        All estimated together.
    spreads : bool
        Whether standard deviations are wanted; NaN without.
    progress : callable, optional
        Called after each piece.

    Returns
    -------
    Explanation
    """
    k = len(inputs)
    systems = []
    for one in bins:
        start, end = float(one.begins.min()), float(one.ends.max())
        knots = start + KNOT * np.arange(max(3, math.ceil((end - start) / KNOT) + 2))
        design = responses.design(one, inputs, knots)
        square = (design.T @ design).tocsc()
        entries = square.tocoo()
        reach = int(np.max(np.abs(entries.row - entries.col), initial=0))
        width = min(max(reach, k), knots.size * k - 1)
        systems.append(_System(design, _banded(square, width),
                               design.T @ (one.values / one.deviations), knots, width))
        if progress is not None:
            progress()
    best: tuple[float, tuple[float, ...], float] = (0.0, (), TIMES[0])
    for time, relative in itertools.product(TIMES, SIZES):
        sizes = tuple(relative * one.size for one in inputs)
        gain = sum(system.posterior(sizes, time)[0] for system in systems)
        if gain > best[0] or not best[1]:
            best = (gain, sizes, time)
    evidence, sizes, time = best
    estimates = []
    for one, system in zip(bins, systems, strict=True):
        mean = system.posterior(sizes, time)[1]
        scaled = one.values / one.deviations
        gains = 0.5 * (scaled ** 2 - (scaled - system.design @ mean) ** 2)
        spread_of = system.deviations(sizes, time) if spreads else np.full(mean.size, np.nan)
        estimates.append(Estimate(one.piece, system.knots, mean.reshape(-1, k),
                                  spread_of.reshape(-1, k), gains))
    return Explanation(tuple(inputs), max(evidence, 0.0), tuple(estimates))


def families() -> Mapping[str, tuple[Input, ...]]:
    """Return the families of inputs that are held against each other, by the part they sit in."""
    return {'drive': (LEFT, RIGHT), 'traction': (SLIP_LEFT, SLIP_RIGHT),
            'translation': (FORCE,), 'rotation': (MOMENT,), 'gyro': (GYRO,),
            'encoders': (ENCODER_LEFT, ENCODER_RIGHT)}
