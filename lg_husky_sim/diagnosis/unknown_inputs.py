# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Unknown inputs at the balances of the graph, estimated from what a fit leaves.

An effort that the graph lacks pushes into one of its balances: the torque balance of a drivetrain,
the contact between wheels and ground, the force or the moment balance of the chassis. A sensor
that is off adds to its channel alone. Each input is a Gaussian process in time (first-order
Markov, straight between knots); its response in every channel follows from the linear part of
the derived equations. Every channel keeps its own stamps and windows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
import itertools
import math

from lg_husky_sim.diagnosis.fits import Fit
from lg_husky_sim.errors import LgHuskyError
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model import compile_model, Structure
from lg_husky_sim.husky.parameters import Parameter, Parameters
from lg_husky_sim.husky.plant import OUTPUTS
from lg_husky_sim.identification.noise import LEAST, spread
from lg_husky_sim.identification.problem import Observations, PERIOD
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation.kernel import COLUMNS
import numpy as np
from scipy.linalg import expm
from scipy.ndimage import maximum_filter1d
from scipy.sparse import csc_matrix

#: Time between knots of an input, and width of the bins of fast channels [s].
KNOT = 0.2
BIN = 0.1
#: Step of the responses and longest memory that they have [s].
STEP = 0.01
MEMORY = 3.0
#: What no input has to explain: late or early by this much [s], off by this share of the signal.
JITTER = 0.012
SHARE = 0.01
#: Forces of an ordinary rough floor as a share of the weight, and what their correlation in time
#: costs: neighbouring bins are no independent witnesses.
ROUGHNESS = 0.01
CORRELATED = 1.6
#: Standard acceleration of free fall [m/s²].
GRAVITY = 9.80665
#: Row of the plant's outputs that a channel sees, and whether it is averaged over a window.
_ROWS = {'wheel_left': 0, 'wheel_right': 1, 'yaw_rate': 3, 'advance': 2, 'turn': 3}
_WINDOWED = ('advance', 'turn')
_SIDES = ('left', 'right')
#: Sizes by which factors are made comparable, by the first word of a column.
_SCALES = {'voltage': 10.0, 'wheel': 4.0, 'forward': 0.6, 'yaw': 0.6, 'current': 5.0}
_CARRIERS = (('rolling_resistance', 'none'), ('yaw_pull', 'none'),
             ('coulomb_drivetrain', 'both'), ('traction_saturation', 'none'))


@dataclass(frozen=True)
class Term:
    """
    Where a process acts, and what it is multiplied by.

    Parameters
    ----------
    efforts : tuple of str
        Modulated sources of the graph that it drives together; empty for a sensor.
    channels : tuple of str
        Channels that a sensor adds it to.
    factor : str
        One of :data:`FACTORS`.
    """

    efforts: tuple[str, ...] = ()
    channels: tuple[str, ...] = ()
    factor: str = 'one'


@dataclass(frozen=True)
class Input:
    """
    One unknown input: a process in time, and where it acts.

    Parameters
    ----------
    name : str
    unit : str
    size : float
        Typical size [unit]; the relative sizes that are tried refer to it.
    terms : tuple of Term
    """

    name: str
    unit: str
    size: float
    terms: tuple[Term, ...]


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
    extra: list[Parameter] = []
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


def binned(observations: Observations, fit: Fit, floor: Mapping[str, float]
           ) -> tuple[Bins, ...]:
    """
    Average what a fit leaves over short bins.

    Parameters
    ----------
    observations : Observations
    fit : Fit
    floor : mapping of str to float
        Deviation of each channel that an ordinary rough floor explains.

    Returns
    -------
    tuple of Bins
        One for each piece. The noise is that of the differences between neighbours, the slope of
        the signal near by times a small delay, a small share of the largest signal, and
        what an ordinary floor does.
    """
    predicted, jacobian = fit.solution.predicted, fit.solution.jacobian
    residual = observations.measured - predicted
    level = {}
    for name in observations.channels:
        steps = np.concatenate([np.diff(residual[s.first:s.last]) for s in observations.slices
                                if s.channel == name])
        level[name] = max(spread(steps) / math.sqrt(2.0), LEAST[name])
    parts: dict[int, list[tuple[str, FloatArray]]] = {}
    for one in observations.slices:
        piece = observations.pieces[one.piece]
        channel = next(c for c in piece.channels if c.name == one.channel)
        part = slice(one.first, one.last)
        size = one.last - one.first
        cell = np.arange(size) if one.channel in _WINDOWED else np.unique(np.floor(
            (channel.times - piece.start) / BIN), return_inverse=True)[1]
        count = np.bincount(cell)
        slope = np.abs(np.gradient(predicted[part], channel.times + 1e-9 * np.arange(size)))
        averages = csc_matrix((1.0 / count[cell], (cell, np.arange(size)))) @ np.column_stack(
            [channel.begins, channel.times, residual[part], slope, jacobian[part]])
        near = maximum_filter1d(averages[:, 3], 3 if one.channel in _WINDOWED else 5)
        averages[:, 3] = np.sqrt(level[one.channel] ** 2 / count + (JITTER * near) ** 2
                                 + (SHARE * np.max(np.abs(predicted[part]))) ** 2
                                 + floor[one.channel] ** 2)
        parts.setdefault(one.piece, []).append((one.channel, averages))
    found = []
    for number, named in parts.items():
        table = np.vstack([rows for _, rows in named])
        names = tuple(name for name, rows in named for _ in range(len(rows)))
        begins, ends, values, deviations = table[:, :4].T
        found.append(Bins(number, names, begins, ends, values, deviations, table[:, 4:]))
    return tuple(found)


class Responses:
    """
    Responses of the channels to hat-shaped pulses of the inputs.

    Parameters
    ----------
    observations : Observations
    fit : Fit
    """

    def __init__(self, observations: Observations, fit: Fit) -> None:
        self._a, self._rows, self._columns = effort_columns(fit.structure, fit.parameters)
        self._kernels: dict[tuple[str, ...], FloatArray] = {}
        self._pieces = observations.pieces
        plant = compile_model(fit.structure).at(fit.parameters)
        self._grids = observations.simulate(plant)

    def has(self, one: Input) -> bool:
        """Return whether the graph has all sources that carry an input."""
        return all(name in self._columns for term in one.terms for name in term.efforts)

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

    def floor(self, parameters: Parameters) -> dict[str, float]:
        """
        Return the deviation of each channel on an ordinary rough floor.

        Parameters
        ----------
        parameters : Parameters

        Returns
        -------
        dict of str to float
        """
        force = ROUGHNESS * GRAVITY * parameters['mass']
        pushes = {'F_rolling_resistance': force, 'F_yaw_pull': 0.25 * force * parameters['track']}
        for side in 'LR':
            pushes[f'T_coulomb_drivetrain_{side}'] = force * parameters['wheel_radius']
        every = round(KNOT / STEP)
        squares = np.zeros(len(OUTPUTS))
        for name, push in pushes.items():
            if name in self._columns:
                squares += np.sum((push * self._kernel((name,))[::every]) ** 2, axis=0)
        return {channel: CORRELATED * math.sqrt(squares[row]) for channel, row in _ROWS.items()}

    def signal(self, piece: int, name: str, times: FloatArray) -> FloatArray:
        """
        Return a column of the fitted model's simulation.

        Parameters
        ----------
        piece : int
        name : str
            A column of the simulator, or half the sum or difference of its voltages:
            ``voltage_common``, ``voltage_difference``.
        times : numpy.ndarray, shape (n,)
            [s].

        Returns
        -------
        numpy.ndarray, shape (n,)
        """
        grid = self._grids[piece]
        if name in ('voltage_common', 'voltage_difference'):
            left, right = (grid[:, COLUMNS.index(f'voltage_{side}')] for side in _SIDES)
            column = 0.5 * (right + (left if name == 'voltage_common' else -left))
        else:
            column = grid[:, COLUMNS.index(name)]
        start = self._pieces[piece].start
        return np.interp(times, start + PERIOD * np.arange(column.size), column)

    def factor(self, piece: int, name: str, times: FloatArray) -> FloatArray:
        """
        Return what a process is multiplied by, about 1 in size.

        Parameters
        ----------
        piece : int
        name : str
            ``one``; a signal, with its ``rate`` (change in time), its ``sign``
            or its recent ``change`` behind a colon.
        times : numpy.ndarray, shape (n,)
            [s].

        Returns
        -------
        numpy.ndarray, shape (n,)
        """
        if name == 'one':
            return np.ones(times.size)
        if name.startswith('-'):
            return -self.factor(piece, name[1:], times)
        column, _, kind = name.partition(':')
        value = self.signal(piece, column, times)
        scale = _SCALES.get(column.split('_')[0], 1.0)
        if kind == 'sign':
            return np.tanh(value / (0.05 * scale))
        if kind == 'change':
            before = np.array([self.signal(piece, column, times + lag)
                               for lag in np.arange(-1.0, 0.3, 0.1)])
            change: FloatArray = np.ptp(before, axis=0) / scale
            return change
        if kind == 'rate':
            ahead, behind = (self.signal(piece, column, times + lag) for lag in (0.05, -0.05))
            rate: FloatArray = (ahead - behind) / (0.1 * scale)
            return rate
        scaled: FloatArray = value / scale
        return scaled

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
        shape = (len(bins.channels), knots.size * len(inputs))
        rows, columns, values = [], [], []
        reach = math.ceil((MEMORY + 2.0 * KNOT) / KNOT)
        for (place, one), channel in itertools.product(enumerate(inputs),
                                                       dict.fromkeys(bins.channels)):
            here = np.flatnonzero(names == channel)
            last = np.floor((bins.ends[here] - knots[0]) / KNOT).astype(np.int64) + 1
            knot = last[:, None] - np.arange(reach)[None, :]
            near = np.clip(knot, 0, knots.size - 1)
            late, early = (edge[here][:, None] - knots[near] for edge in (bins.ends, bins.begins))
            value = np.zeros(knot.shape)
            for term in one.terms:
                if not term.channels or channel in term.channels:
                    value += (self._seen(term, channel, early, late)
                              * self.factor(bins.piece, term.factor, knots)[near])
            value /= bins.deviations[here][:, None]
            used = (np.abs(value) > 1e-6) & (knot == near)
            rows.append(np.broadcast_to(here[:, None], knot.shape)[used])
            columns.append((knot * len(inputs) + place)[used])
            values.append(value[used])
        return csc_matrix((np.concatenate(values),
                           (np.concatenate(rows), np.concatenate(columns))), shape=shape)

    def _seen(self, term: Term, channel: str, early: FloatArray, late: FloatArray) -> FloatArray:
        if term.channels:
            hat: FloatArray = np.maximum(0.0, 1.0 - np.abs(0.5 * (early + late)) / KNOT)
            return hat
        kernel = self._kernel(term.efforts)[:, _ROWS[channel]]
        times = np.arange(kernel.size) * STEP - KNOT
        if channel not in _WINDOWED:
            return np.interp(late, times, kernel, left=0.0, right=0.0)
        total = np.concatenate([[0.0], np.cumsum(0.5 * (kernel[1:] + kernel[:-1])) * STEP])
        way: FloatArray = ((np.interp(late, times, total) - np.interp(early, times, total))
                           / (late - early))
        return way
