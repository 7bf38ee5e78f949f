# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Draw one robot, and the roughness of the floor it drives on: no two are alike."""

from __future__ import annotations

from dataclasses import dataclass
import math

from lg_husky_sim.proof import world as w
from lg_husky_sim.proof.commands import CommandPath
from lg_husky_sim.proof.conventions import FloorKind
from lg_husky_sim.proof.hidden import logarithmic, Rng
from lg_husky_sim.proof.integrate import Floor, ROUGH_PERIOD
from lg_husky_sim.proof.settings import settings
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Robot:
    """A robot without its hidden effect; `told_*` [m] is what the diagnosis is told."""

    fields: dict[str, float]
    command: CommandPath
    told_radius: float
    told_track: float


def _factor(rng: Rng, name: str) -> float:
    most = float(settings()['nuisances'][name]['factor'])
    return logarithmic(rng, 1.0 / most, most)


def open_loop_robot(rng: Rng) -> Robot:
    """Return a robot of the paper's kind: voltage drives, creeping wheels."""
    f = w.nominal()
    radius = round(f['radius_left'] * _factor(rng, 'told_radius'), 4)
    track = round(2.0 * f['half_track'] * _factor(rng, 'told_track'), 4)
    for name in ('mass', 'yaw_inertia', 'creep', 'yaw_damping', 'command_gain', 'resistance',
                 'inductance', 'torque_constant'):
        f[name] *= _factor(rng, name)
    inertia = _factor(rng, 'wheel_inertia')
    for name in ('inertia_motor', 'inertia_rear', 'inertia_front'):
        f[name] *= inertia
    f['radius_left'] = f['radius_right'] = radius * _factor(rng, 'told_radius')
    f['half_track'] = 0.5 * track * _factor(rng, 'told_track')
    slip = settings()['nuisances']['lateral']
    if rng.random() >= float(slip['rigid']):
        f['lateral'] = logarithmic(rng, float(slip['low']), float(slip['high']))
    return Robot(f, CommandPath(), radius, track)


def closed_loop_robot(rng: Rng) -> Robot:
    """Return a robot as sold: four tyres that share adhesion, a wheel-speed loop, limits."""
    robot = open_loop_robot(rng)
    f = dict(robot.fields)
    f.update({
        'tyre': 1.0, 'tyre_stiffness': float(rng.uniform(500.0, 1100.0)),
        'tyre_friction': float(rng.uniform(0.45, 0.8)),
        'form_force': float(rng.choice([0.0, 1.0, 4.0])),
        'yaw_damping': float(rng.uniform(1.0, 4.0)),
        'rolling': float(rng.uniform(2.0, 8.0)), 'form_dry': 1.0,
        'friction_left': float(rng.uniform(0.5, 2.0)),
        'friction_right': float(rng.uniform(0.5, 2.0)),
        'form_friction': float(rng.integers(3)), 'current_limit': float(rng.uniform(40.0, 70.0)),
        'loop': 1.0, 'loop_gain': float(rng.uniform(0.3, 1.0)),
        'loop_integral': float(rng.uniform(10.0, 40.0)),
        'loop_forward': float(rng.uniform(0.8, 1.05)),
        'loop_period': float(rng.choice([0.01, 0.02, 0.05]))})
    path = CommandPath(
        latency=float(rng.uniform(0.02, 0.12)), slew_forward=float(rng.choice([1.0, 3.0])),
        slew_yaw=float(rng.choice([1.0, 6.0])), limit_forward=1.0,
        limit_yaw=float(rng.choice([1.0, 2.0])), loop_lag=float(rng.uniform(0.03, 0.2)),
        loop_yaw_ratio=float(rng.uniform(1.6, 1.95)))
    return Robot(f, path, robot.told_radius, robot.told_track)


def engine_robot(rng: Rng) -> Robot:
    """Return a robot for a rigid-body engine: voltage drives, dry contact."""
    robot = open_loop_robot(rng)
    f = dict(robot.fields)
    f['tyre'] = 1.0
    f['tyre_friction'] = float(rng.uniform(0.45, 0.8))
    return Robot(f, CommandPath(), robot.told_radius, robot.told_track)


def floor(kind: FloorKind, seconds: float, rng: Rng) -> Floor:
    """Return what a floor of this kind does during one drive."""
    from scipy.signal import lfilter
    count = int(seconds / ROUGH_PERIOD) + 1
    waves = np.zeros((0, 7))
    size = np.array([kind.drive, kind.drive, kind.force, 0.5 * kind.force, kind.moment])
    if kind.force == 0.0:
        return Floor(np.zeros((1, 5)), waves)
    if kind.colour == 'place':
        number = 8
        length = kind.wavelength * np.exp(rng.uniform(-0.7, 0.7, number))
        to = rng.uniform(-math.pi, math.pi, number)
        part = rng.normal(0.0, 1.0, (number, 4)) * math.sqrt(2.0 / number)
        waves = np.column_stack([
            2.0 * math.pi / length * np.cos(to), 2.0 * math.pi / length * np.sin(to),
            rng.uniform(0.0, 6.28, number), part[:, 0] * kind.force, part[:, 1] * kind.moment,
            part[:, 2] * kind.drive, part[:, 3] * kind.drive])
        return Floor(np.zeros((1, 5)), waves)
    white = rng.standard_normal((count, 5))
    if kind.colour == 'coloured':
        # Drives feel the floor faster than the body does.
        for columns, time in ((slice(0, 2), 0.3 * kind.time), (slice(2, 5), kind.time)):
            keep = math.exp(-ROUGH_PERIOD / time)
            white[:, columns] = lfilter([math.sqrt(1.0 - keep * keep)], [1.0, -keep],
                                        white[:, columns], axis=0)
    return Floor(white * size, waves)


def gusts(force: float, headings: Vector, rng: Rng) -> Vector:
    """
    Return wind on the robot every `ROUGH_PERIOD`, shape (n, 5).

    Parameters
    ----------
    force
        Its rms [N].
    headings
        Heading of the robot at these times [rad], shape (n,).
    rng
        Draws the gusts, and where the wind comes from.

    """
    from scipy.signal import lfilter
    keep = float(np.exp(-ROUGH_PERIOD / 2.5))
    white = rng.standard_normal(headings.size) * np.sqrt(1.0 - keep * keep)
    strength = force * lfilter([1.0], [1.0, -keep], white)
    relative = float(rng.uniform(-np.pi, np.pi)) - headings
    result = np.zeros((headings.size, 5))
    result[:, 2] = strength * np.cos(relative)
    result[:, 3] = strength * np.sin(relative)
    return result
