# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a model may get wrong in the same way before and after a change.

No model of a real robot is right: tyres, speed loops and floors leave errors that are larger than
most changes. What is wrong before a change is wrong after it in the same way, as a function of
what is commanded and how the robot moves. Such errors enter as columns with unknown coefficients,
one set for all recordings; recordings made before the change determine them, and only what they
cannot explain afterwards counts as changed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
import math

from lg_husky_sim.diagnosis.fits import extras_of, Fit
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.identification.pieces import Channel, Piece
from lg_husky_sim.identification.problem import Observations, PERIOD, simulate_piece
from lg_husky_sim.jit import jit
from lg_husky_sim.signals import FloatArray
from lg_husky_sim.simulation.kernel import COLUMNS
from lg_husky_sim.simulation.simulator import hold, Simulator
import numpy as np

#: Size of each error that is believed possible, as a part of the channel's root mean square.
BELIEVED = 0.3
#: Time constants by which the quantities are smoothed [s]; 0 for as they are.
LAGS = (0.0, 0.25, 1.0)
#: Relative deviation of the robot's numbers that is believed possible at most, and the part of an
#: effect's number that a derivative's step is.
UNSURE, STEP = 0.2, 0.05
#: Speeds at which a sign is smoothed [m/s, rad/s].
SLOW_FORWARD, SLOW_YAW = 0.08, 0.12


def with_common_errors(observations: Observations, fit: Fit) -> Observations:
    """
    Return observations that make room for errors that are alike everywhere.

    Parameters
    ----------
    observations : Observations
    fit : Fit
        Of the robot before the change, with its derivatives on all recordings: its prediction is
        what the errors are functions of, and its numbers are only known so well.

    Returns
    -------
    Observations
        The same, with ``common`` set.
    """
    always = replace(fit.structure, onset=None, effects=tuple(
        e for e in fit.structure.effects if not e.late))
    simulator = Simulator(compile_model(always).at(fit.parameters), PERIOD, fine_pose=False)
    latency = extras_of(fit).get('latency', 0.0)
    count = len(_quantities_at_rest()) * len(LAGS)
    sizes = {name: float(np.sqrt(np.mean(observations.measured[
        observations.channel_mask(name)] ** 2))) for name in observations.channels}
    columns = np.zeros((observations.measured.size, count * len(sizes)))
    for number, piece in enumerate(observations.pieces):
        grid = simulate_piece(simulator, piece, latency)
        features = _features(grid, hold(piece.commands, piece.start, PERIOD, piece.count))
        slices = [s for s in observations.slices if s.piece == number]
        for one, channel in zip(slices, piece.channels, strict=True):
            first = list(sizes).index(one.channel) * count
            columns[one.first:one.last, first:first + count] = _sampled(features, piece, channel)
    for k, name in enumerate(sizes):
        block = columns[:, k * count:(k + 1) * count]
        size = np.sqrt(np.sum(block ** 2, axis=0) / max(
            int(np.count_nonzero(observations.channel_mask(name))), 1))
        block *= BELIEVED * sizes[name] / np.where(size > 1e-9, size, np.inf)
    return replace(observations, common=np.hstack([columns, _of_numbers(fit)]))


def _of_numbers(fit: Fit) -> FloatArray:
    # What another value of each number would change, by the deviation that is believed.
    unknowns = [(i, u) for i, u in enumerate(fit.solution.unknowns) if not u.extra]
    sizes = [min(u.deviation, UNSURE) if u.logarithmic
             else UNSURE * max(abs(fit.solution.values[u.name]), u.step / STEP)
             for _, u in unknowns]
    scaled: FloatArray = fit.solution.jacobian[:, [i for i, _ in unknowns]] * np.array(sizes)
    return scaled


def _quantities_at_rest() -> Sequence[FloatArray]:
    return _quantities(np.zeros(2), np.zeros(2), np.zeros(2), np.zeros(2))


def _quantities(forward: FloatArray, yaw: FloatArray, commanded: FloatArray, turned: FloatArray
                ) -> Sequence[FloatArray]:
    ahead, left = np.tanh(forward / SLOW_FORWARD), np.tanh(yaw / SLOW_YAW)
    return (np.ones_like(forward), forward, yaw, np.abs(forward), np.abs(yaw), forward * yaw,
            np.abs(forward) * yaw, forward * np.abs(yaw), forward * np.abs(forward),
            yaw * np.abs(yaw), ahead, left, ahead * np.abs(left), np.abs(ahead) * left,
            commanded - forward, turned - yaw, np.abs(commanded - forward),
            np.abs(turned - yaw))


def _features(grid: FloatArray, held: FloatArray) -> FloatArray:
    commands = np.vstack([held[:1], held])
    raw = np.column_stack(_quantities(
        grid[:, COLUMNS.index('forward')], grid[:, COLUMNS.index('yaw_rate')],
        commands[:, 0], commands[:, 1]))
    parts = []
    for lag in LAGS:
        parts.append(_smoothed(raw, math.exp(-PERIOD / lag) if lag else 0.0))
    return np.hstack(parts)


@jit
def _smoothed(raw: FloatArray, keep: float) -> FloatArray:
    # A lag of first order, settled at the first row; row by row, since each needs the one before.
    out = np.empty_like(raw)
    out[0] = raw[0]
    for row in range(1, raw.shape[0]):
        out[row] = keep * out[row - 1] + (1.0 - keep) * raw[row]
    return out


def _sampled(features: FloatArray, piece: Piece, channel: Channel) -> FloatArray:
    middle = 0.5 * (channel.times + channel.begins)
    place = np.clip(np.rint((middle - piece.start) / PERIOD), 0, features.shape[0] - 1)
    sampled: FloatArray = features[place.astype(np.int64)]
    return sampled
