# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Draw the nuisances of one robot, one floor and one recorder: no two are alike."""

from __future__ import annotations

from dataclasses import dataclass

from lg_husky_sim.proof import world as w
from lg_husky_sim.proof.integrate import ROUGH_PERIOD
from lg_husky_sim.proof.manoeuvres import Manoeuvre
from lg_husky_sim.proof.sensors import CommandPath, Senses
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Floor:
    """
    Roughness of the floor: rms of Ornstein-Uhlenbeck disturbances and their time [s].

    `torque` [N·m] on each drivetrain, `force` [N] ahead and across, `moment` [N·m].
    """

    torque: float
    force: float
    moment: float
    time: float


@dataclass(frozen=True)
class Robot:
    """A robot without its hidden effect."""

    fields: dict[str, float]
    command: CommandPath
    senses: Senses
    floor: Floor


def _near(rng: np.random.Generator, part: float) -> float:
    return 1.0 + float(rng.uniform(-part, part))


def _recorder(rng: np.random.Generator) -> Senses:
    return Senses(
        tick=float(np.exp(rng.uniform(np.log(5e-4), np.log(2e-3)))),
        stamp_jitter=float(rng.uniform(2e-4, 1e-3)),
        gyro_noise=float(rng.uniform(0.004, 0.012)),
        accel_noise=float(rng.uniform(0.08, 0.2)),
        accel_bias=float(rng.normal(0.0, 0.015)),
        pose_rate=float(rng.choice([20.0, 25.0, 50.0])),
        pose_noise=float(rng.uniform(0.004, 0.009)),
        heading_noise=float(rng.uniform(0.002, 0.004)),
        nuisance_bias=float(rng.normal(0.0, 6e-4)),
        stamped=bool(rng.random() < 0.6),
        suffix='_joint' if rng.random() < 0.5 else '')


def _path(rng: np.random.Generator) -> CommandPath:
    low = float(rng.uniform(0.0, 0.003))
    return CommandPath(gain=w.COMMAND_GAIN * _near(rng, 0.03), delay_low=low,
                       delay_high=low + float(rng.uniform(0.0, 0.004)),
                       loss=float(rng.uniform(0.0, 0.01)))


def open_loop_robot(rng: np.random.Generator) -> Robot:
    """Return a robot of the paper's kind: voltage drives, creeping wheels, side slip."""
    f = w.nominal()
    f['mass'] *= _near(rng, 0.05)
    f['yaw_inertia'] *= _near(rng, 0.06)
    f['creep'] *= float(np.exp(rng.uniform(-0.26, 0.26)))
    f['yaw_damping'] *= float(np.exp(rng.uniform(-0.2, 0.2)))
    for name in ('inertia_motor', 'inertia_rear', 'inertia_front', 'inductance'):
        f[name] *= _near(rng, 0.1)
    f['resistance'] *= _near(rng, 0.05)
    f['torque_constant'] *= _near(rng, 0.01)
    f['lateral'] = float(np.exp(rng.uniform(np.log(3000.0), np.log(12000.0))))
    f['force_limit'] = float(rng.uniform(150.0, 300.0))
    scale = float(rng.uniform(0.3, 1.0))
    return Robot(f, _path(rng), _recorder(rng),
                 Floor(0.5 * scale, 4.0 * scale, 0.5 * scale, float(rng.uniform(0.1, 0.4))))


def closed_loop_robot(rng: np.random.Generator) -> Robot:
    """Return a robot as sold: brush tyres that share adhesion, a wheel-speed loop, limits."""
    robot = open_loop_robot(rng)
    f = dict(robot.fields)
    f['tyre'] = 1.0
    f['creep'] = float(rng.uniform(500.0, 1100.0))
    f['tyre_friction'] = float(rng.uniform(0.45, 0.8))
    f['force_limit'] = 1e9
    f['yaw_damping'] = float(rng.uniform(0.5, 2.0))
    f['rolling'] = float(rng.uniform(6.0, 16.0))
    friction = float(rng.uniform(0.4, 1.2))
    f['friction_left'] = friction * _near(rng, 0.1)
    f['friction_right'] = friction * _near(rng, 0.1)
    f['loop'] = 1.0
    f['loop_gain'] = float(rng.uniform(0.4, 1.0))
    f['loop_integral'] = float(rng.uniform(20.0, 50.0))
    f['loop_forward'] = float(rng.uniform(0.8, 1.0))
    f['battery_resistance'] = float(rng.uniform(0.02, 0.06))
    path = CommandPath(
        gain=robot.command.gain, delay_low=robot.command.delay_low,
        delay_high=robot.command.delay_high, loss=robot.command.loss,
        latency=float(rng.uniform(0.03, 0.12)), slew_forward=3.0, slew_yaw=6.0,
        limit_forward=1.0, limit_yaw=2.0, loop_lag=float(rng.uniform(0.08, 0.25)),
        loop_yaw_ratio=float(rng.uniform(1.6, 1.95)))
    return Robot(f, path, robot.senses, robot.floor)


def engine_robot(rng: np.random.Generator) -> Robot:
    """Return a robot for the rigid-body engine: voltage drives, dry contact."""
    robot = open_loop_robot(rng)
    f = dict(robot.fields)
    f['force_limit'] = 1e9
    f['tyre_friction'] = float(rng.uniform(0.45, 0.8))
    return Robot(f, robot.command, robot.senses, robot.floor)


def roughness(floor: Floor, drive: Manoeuvre, rng: np.random.Generator) -> Vector:
    """Return disturbances every 10 ms, shape (n, 5), that rest while the robot rests."""
    from scipy.signal import lfilter
    count = int(drive.duration / ROUGH_PERIOD) + 1
    keep = float(np.exp(-ROUGH_PERIOD / floor.time))
    white = rng.standard_normal((count, 5)) * np.sqrt(1.0 - keep * keep)
    wave = lfilter([1.0], [1.0, -keep], white, axis=0)
    times = np.arange(count) * ROUGH_PERIOD
    which = np.maximum(np.searchsorted(drive.times, times, side='right') - 1, 0)
    moving = np.clip(np.abs(drive.commands[which]).sum(axis=1) / 0.3, 0.0, 1.0)
    size = np.array([floor.torque, floor.torque, floor.force, floor.force, floor.moment])
    result: Vector = wave * size * moving[:, None]
    return result


def gusts(force: float, headings: Vector, rng: np.random.Generator) -> Vector:
    """
    Return wind on the robot every 10 ms, shape (n, 5).

    Parameters
    ----------
    force
        Its rms [N].
    headings
        Heading of the robot every 10 ms [rad].

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
