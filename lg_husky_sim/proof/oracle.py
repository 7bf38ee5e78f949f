# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
What an oracle that knows the truth could see of an effect in the drives and noise drawn.

The noiseless difference that the effect makes is divided by the spectrum of everything that
nobody can predict (roughness of this floor as this robot feels it, noise of these sensors,
jitter of these stamps). What recalibrated nominal parameters could take over, within
their tolerances, is projected out; the rest is worth so many nats.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
import math

from lg_husky_sim.proof import robots, sensors
from lg_husky_sim.proof import world as w
from lg_husky_sim.proof.commands import Sent
from lg_husky_sim.proof.conventions import Conventions
from lg_husky_sim.proof.manoeuvres import Manoeuvre
from lg_husky_sim.proof.motion import alone, gates, Hidden, Pose, run
from lg_husky_sim.proof.settings import settings
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]

PERIOD = 0.02
STEP = 5e-4
STIFF_STEP = 2e-4
"""For robots with dry friction whose law is steep at rest [s]."""
DELTA = 0.01
# Tolerance (one relative standard deviation) of what a recalibration may move.
_BASE: Mapping[str, tuple[tuple[str, ...], float]] = {
    'creep': (('creep',), 10.0), 'yaw_damping': (('yaw_damping',), 10.0),
    'command_gain': (('command_gain',), 0.1), 'mass': (('mass',), 0.05),
    'yaw_inertia': (('yaw_inertia',), 0.06),
    'wheel_inertia': (('inertia_motor', 'inertia_rear', 'inertia_front'), 0.06),
    'resistance': (('resistance',), 0.06), 'torque_constant': (('torque_constant',), 0.05),
    'radius': (('radius_left', 'radius_right'), 0.004), 'half_track': (('half_track',), 0.01)}


@dataclass(frozen=True)
class Drives:
    """What a case's recordings consist of, apart from chance."""

    drives: Sequence[Manoeuvre]
    sent: Sequence[Sent]
    poses: Sequence[Pose]
    how: Conventions


def _seen(table: Vector, hidden: Hidden, index: int, case: Drives) -> Vector:
    """Return noiseless readings every `PERIOD`, shape (channels, n)."""
    how, drive = case.how, case.drives[index]
    faults = replace(hidden.faults, since=gates(hidden, index)[1])
    times = np.arange(max(drive.moving_start, 0.3), float(table[-1, 0]) - 0.01, PERIOD)

    def at(stream: str) -> Vector:
        return times - np.where((faults.late == stream) & (times >= faults.since),
                                faults.late_by, 0.0)

    rows = []
    if 'wheels' not in how.missing:
        # Positions alone tell as much as differences over one period.
        kind = replace(how.wheels, kind='difference', window=1.0 / how.wheels.rate) \
            if how.wheels.kind == 'positions' else how.wheels
        for side in sensors.SIDES:
            angle = sensors.faulty_angle(table, side, faults)
            rows.append(sensors.wheel_speeds(table, angle, kind, at('wheels'), 1.0, None)[1])
    if 'imu' not in how.missing:
        rows.append(sensors.gyro_rate(table, how.gyro, faults, at('imu'), None))
    if 'pose' not in how.missing:
        rows.append(np.diff(_travel(table, at('pose')), prepend=0.0) / PERIOD)
        rows.append(np.diff(sensors.column(table, 'heading', at('pose')), prepend=0.0) / PERIOD)
        for row in rows[-2:]:
            row[0] = row[1]
    return np.array(rows)


def _travel(table: Vector, times: Vector) -> Vector:
    """Return the distance gone ahead [m]."""
    gone = np.cumsum(table[:, 1]) * (table[1, 0] - table[0, 0])
    return np.asarray(np.interp(times, table[:, 0], gone))


def _noise(case: Drives, signal: Vector, rough: Vector) -> Vector:
    """Return the two-sided noise spectrum of each channel, shape (channels, n // 2 + 1)."""
    how = case.how
    n = signal.shape[1]
    turn = 2.0 * np.pi * np.fft.rfftfreq(n)
    white = []
    if 'wheels' not in how.missing:
        window = how.wheels.window if how.wheels.kind == 'difference' else 1.0 / how.wheels.rate
        ticks = how.wheels.tick / math.sqrt(6.0) / window
        step = how.wheels.step / 0.165 / math.sqrt(12.0)
        size = ticks if how.wheels.kind in ('difference', 'positions') else \
            math.hypot(how.wheels.noise, step)
        white += [size ** 2 / (how.wheels.rate * PERIOD)] * 2
    if 'imu' not in how.missing:
        white.append(how.gyro.noise ** 2 / (how.gyro.rate * PERIOD))
    spectra = [np.full(turn.size, value) for value in white]
    if 'pose' not in how.missing:
        for size in (how.poses.noise, how.poses.heading):
            level = size ** 2 / (how.poses.rate * PERIOD) / PERIOD ** 2
            spectra.append(level * (2.0 - 2.0 * np.cos(turn)) + 1e-3 * level)
    slopes = (np.diff(signal, axis=1) / PERIOD) ** 2
    jitter = (0.5 * how.jitter) ** 2 * slopes.mean(axis=1)
    taper = np.hanning(n)
    power = np.abs(np.fft.rfft(rough * taper, axis=1)) ** 2 / (taper ** 2).sum()
    width = max(3, n // 60)
    smooth = np.array([np.convolve(row, np.ones(width) / width, mode='same') for row in power])
    return np.asarray(np.array(spectra) + jitter[:, None] + smooth + 1e-12)


def nats(hidden: Hidden, case: Drives, rng: np.random.Generator) -> float:
    """Return what an effect is worth beyond any recalibration [nats]."""
    plain = alone(hidden)
    parts: list[Vector] = []
    for index in range(len(case.drives)):
        def motion(robot: Hidden, ground: bool = False, index: int = index) -> Vector:
            drive = case.drives[index]
            floor = robots.floor(case.how.floor, drive.duration, rng) if ground else None
            table = run(robot, drive, case.sent[index], case.how, case.poses[index], index,
                        floor, rng if ground else None, step_of(robot))
            return _seen(table, robot, index, case)

        off = motion(plain)
        changed = motion(hidden) if hidden.gusts == 0.0 else motion(hidden, ground=True)
        rough = motion(plain, ground=True) - off
        columns = [changed - off]
        for names, _ in _BASE.values():
            fields = {name: value * (1.0 + DELTA if name in names else 1.0)
                      for name, value in plain.fields.items()}
            moved = replace(plain, fields=fields, robot=replace(plain.robot, fields=fields))
            columns.append((motion(moved) - off) / DELTA)
        columns += _nuisances(off, case)
        scale = 1.0 / np.sqrt(_noise(case, off, rough) * off.shape[1] / 2.0)
        parts.append(np.array([_flat(np.fft.rfft(one, axis=1) * scale) for one in columns]))
    whole = np.concatenate(parts, axis=1)
    effect, rest = whole[0], whole[1:]
    spread = np.array([*(size for _, size in _BASE.values()), *_spread(case)])
    gram = rest @ rest.T + np.diag(1.0 / spread ** 2)
    taken = effect @ rest.T @ np.linalg.solve(gram, rest @ effect)
    return float(0.5 * (effect @ effect - taken))


def _flat(values: NDArray[np.complex128]) -> Vector:
    return np.concatenate([values.real.ravel(), values.imag.ravel()])


def _nuisances(signal: Vector, case: Drives) -> list[Vector]:
    """Return what a bias of the gyro and an offset of each stream would do."""
    slope = np.gradient(signal, PERIOD, axis=1)
    rows = {'wheels': slice(0, 2), 'imu': slice(2, 3), 'pose': slice(3, 5)}
    at = 0
    result = []
    for stream in case.how.streams:
        width = rows[stream].stop - rows[stream].start
        column = np.zeros_like(signal)
        column[at:at + width] = slope[at:at + width]
        result.append(column)
        if stream == 'imu':
            bias = np.zeros_like(signal)
            bias[at] = 1.0
            result.append(bias)
        at += width
    return result


def _spread(case: Drives) -> list[float]:
    """Return the tolerances of `_nuisances` [s], [rad/s]."""
    result = []
    for stream in case.how.streams:
        result.append(0.002)
        if stream == 'imu':
            result.append(2.0 * float(settings()['conventions']['gyro']['bias']))
    return result


def step_of(hidden: Hidden) -> float:
    """Return a step [s] that is stable for a robot."""
    f = hidden.fields
    steep = max(f['friction_left'], f['friction_right']) > 0.0 and f['form_friction'] > 0.0
    step = STIFF_STEP if steep else STEP
    if f['lateral'] < w.NEVER:
        # Rate at which side slip dies out [1/s].
        rate = f['lateral'] * (1.0 / f['mass'] + f['centre_forward'] ** 2 / f['yaw_inertia'])
        step = min(step, 1.5 / rate)
    return step


def level(worth: float) -> str:
    """Return 'undetectable', 'weak' or 'clear' of an effect that is worth so many nats."""
    bars = settings()['oracle']
    if worth < float(bars['undetectable']):
        return 'undetectable'
    return 'weak' if worth < float(bars['weak']) else 'clear'
