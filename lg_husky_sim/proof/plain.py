# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The plain rival: the paper's linear model, refitted here, with nothing added.

It is what a person has who recalibrates B, B_H and c and stops there; the improvement that
a diagnosis reaches is counted from it.
"""

from __future__ import annotations

from collections.abc import Sequence

from lg_husky_sim.proof import world as w
from lg_husky_sim.proof.jit import compiled
from lg_husky_sim.proof.measures import increments
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Bag = dict[str, Vector]

_PERIOD = 0.005
_START = (1.3016, 12.8650, 0.8961)
_SUPPLY = 24.0
_TURN_RATIO = 0.541


def matrices(damping: float, scrub: float) -> tuple[Vector, Vector]:
    """
    Return A, shape (6, 6), and B, shape (6, 2), of McCormick et al., eqs. (19) and (20).

    Parameters
    ----------
    damping, scrub
        B of each wheel and B_H [N·m·s/rad].

    """
    f = w.nominal()
    radius, arm = f['radius_left'], f['half_track']
    inertia = f['inertia_motor'] + f['inertia_rear'] + f['inertia_front']
    gear, ohms, henry = f['torque_constant'], f['resistance'], f['inductance']
    pull, turn = 2.0 * damping / radius, 2.0 * damping * arm / radius
    a = np.zeros((6, 6))
    a[0, :5] = np.array([-2.0 * damping, 0.0, pull, -turn, gear]) / inertia
    a[1, :6] = np.array([0.0, -2.0 * damping, pull, turn, 0.0, gear]) / inertia
    a[2, :3] = np.array([pull, pull, -2.0 * pull / radius]) / f['mass']
    a[3, :4] = np.array([-turn, turn, 0.0, -2.0 * turn * arm / radius - scrub]) \
        / f['yaw_inertia']
    a[4, [0, 4]] = -gear / henry, -ohms / henry
    a[5, [1, 5]] = -gear / henry, -ohms / henry
    b = np.zeros((6, 2))
    b[4, 0] = b[5, 1] = 1.0 / henry
    return a, b


@compiled
def _march(ad: Vector, bd: Vector, volts: Vector, rows: Vector) -> None:
    state = np.zeros(6)
    for k in range(volts.shape[0]):
        rows[k] = state
        state = ad @ state + bd @ volts[k]


def _held_mean(stamps: Vector, values: Vector, edges: Vector) -> Vector:
    """Return the mean of a held command between each pair of edges."""
    area = np.concatenate([[0.0], np.cumsum(values[:-1] * np.diff(stamps))])
    area = np.append(area, area[-1] + values[-1] * 1e3)
    integral = np.interp(edges, np.append(stamps, stamps[-1] + 1e3), area)
    mean: Vector = np.diff(integral) / np.diff(edges)
    return mean


def _as_encoders(rates: Vector) -> Vector:
    """Return wheel rates as differences of angles over the last 20 ms, as encoders do."""
    lag = round(0.02 / _PERIOD)
    angles = np.concatenate([np.zeros((1, 2)), np.cumsum(rates, axis=0) * _PERIOD])
    before = np.concatenate([np.zeros((lag, 2)), angles])[:rates.shape[0]]
    seen: Vector = (angles[:-1] - before) / (lag * _PERIOD)
    return seen


def simulate(fitted: Sequence[float], bag: Bag) -> Bag:
    """
    Return what the plain model's sensors would read under a bag's commands.

    Parameters
    ----------
    fitted
        B, B_H [N·m·s/rad] and c.
    bag
        With 'commands' (time, forward, yaw), 'joints' and 'poses' (`bags.read_bag`).

    """
    from scipy.linalg import expm
    damping, scrub, gain = fitted
    a, b = matrices(damping, scrub)
    step = expm(np.block([[a, b], [np.zeros((2, 8))]]) * _PERIOD)
    commands = bag['commands']
    start = commands[0, 0]
    end = max(bag[name][-1, 0] for name in ('commands', 'joints', 'poses')) + 2.0 * _PERIOD
    times = start + np.arange(int((end - start) / _PERIOD)) * _PERIOD
    edges = np.append(times, times[-1] + _PERIOD)
    forward, yaw = (_held_mean(commands[:, 0], commands[:, k], edges) for k in (1, 2))
    volts = _SUPPLY * gain * np.column_stack(
        [forward - _TURN_RATIO * yaw, forward + _TURN_RATIO * yaw])
    volts = np.clip(volts, -_SUPPLY, _SUPPLY)
    rows = np.zeros((times.size, 6))
    _march(np.ascontiguousarray(step[:6, :6]), np.ascontiguousarray(step[:6, 6:]), volts, rows)
    pose = bag['poses'][0, 1:4]
    heading = pose[2] + np.concatenate([[0.0], np.cumsum(rows[:-1, 3]) * _PERIOD])
    x = pose[0] + np.concatenate([[0.0], np.cumsum(rows[:-1, 2] * np.cos(heading[:-1]))
                                  * _PERIOD])
    y = pose[1] + np.concatenate([[0.0], np.cumsum(rows[:-1, 2] * np.sin(heading[:-1]))
                                  * _PERIOD])
    zeros = np.zeros(times.size)
    return {'joints': np.column_stack([times, *_as_encoders(rows[:, :2]).T]),
            'imu': np.column_stack([times, rows[:, 3], zeros, zeros]),
            'poses': np.column_stack([times, x, y, heading])}


def _residuals(fitted: Sequence[float], bags: Sequence[Bag]) -> Vector:
    parts = []
    for bag in bags:
        model = simulate(fitted, bag)
        joints, imu, poses = bag['joints'], bag['imu'], bag['poses']
        for k in (1, 2):
            parts.append((joints[:, k] - np.interp(
                joints[:, 0], model['joints'][:, 0], model['joints'][:, k])) / 0.1)
        parts.append((imu[:, 1] - np.interp(
            imu[:, 0], model['imu'][:, 0], model['imu'][:, 1])) / 0.02)
        starts = np.arange(poses[0, 0], poses[-1, 0] - 1.0, 0.2)
        gap = increments(poses, starts) - increments(model['poses'], starts)
        parts.append(gap.ravel() / 0.02)
    return np.concatenate(parts)


def calibrate(bags: Sequence[Bag]) -> tuple[float, float, float]:
    """Return B, B_H [N·m·s/rad] and c that fit some bags best (least squares, bounded)."""
    from scipy.optimize import least_squares
    low, high = np.log([0.1, 0.3, 0.4]), np.log([60.0, 400.0, 1.6])

    def cost(logs: Vector) -> Vector:
        return _residuals([float(value) for value in np.exp(logs)], bags)

    best = least_squares(cost, np.log(_START), bounds=(low, high), loss='soft_l1',
                         diff_step=1e-4, max_nfev=25)
    damping, scrub, gain = (float(value) for value in np.exp(best.x))
    return damping, scrub, gain
