# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The way of a command from its publisher to the voltages of the drives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from lg_husky_sim.proof.conventions import Link
from lg_husky_sim.proof.manoeuvres import Manoeuvre
import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Rng = np.random.Generator

FINE = 0.001
"""Steps of command paths with memory [s]."""


@dataclass(frozen=True)
class CommandPath:
    """
    What a hidden effect does to commands; all zero when off.

    Times in seconds, rates in m/s² and rad/s², limits in m/s and rad/s, `since` the time
    from which it holds, `lag` and `loop_lag` first-order time constants. `own` are
    latency, slews and limits that hold before: a robot as sold has some of its own.
    """

    since: float = -1.0
    latency: float = 0.0
    latency_spread: float = 0.0
    slew_forward: float = 0.0
    slew_yaw: float = 0.0
    lag: float = 0.0
    limit_forward: float = 0.0
    limit_yaw: float = 0.0
    limit_soft: float = 0.0
    stutter_period: float = 0.0
    stutter_hold: float = 0.0
    loop_lag: float = 0.0
    loop_yaw_ratio: float = 1.875
    cutback: float = 0.0
    own: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)

    @property
    def limits(self) -> tuple[float, float, float, float, float]:
        """Latency, slews forward and yaw, limits forward and yaw."""
        return (self.latency, self.slew_forward, self.slew_yaw, self.limit_forward,
                self.limit_yaw)

    @property
    def has_memory(self) -> bool:
        """Whether a command's effect depends on those before."""
        return any((self.slew_forward, self.slew_yaw, self.lag, self.loop_lag, self.cutback,
                    self.limit_forward, self.limit_yaw, *self.own[1:]))


@dataclass(frozen=True)
class Sent:
    """
    One drive's messages: what chance did to them is drawn once.

    `times` of publishing [s], `commands` (n, 2), `arrive` at the base [s], whether the
    robot `heard` and the recorder `logged` each, `spread` in -1..1.
    """

    times: Vector
    commands: Vector
    arrive: Vector
    heard: NDArray[np.bool_]
    logged: NDArray[np.bool_]
    spread: Vector


def send(drive: Manoeuvre, link: Link, jitter: float, rng: Rng | None) -> Sent:
    """Publish a drive's commands; without `rng` nothing is lost, late or off its time."""
    n = drive.times.size
    every = np.ones(n, dtype=bool)
    if rng is None:
        return Sent(drive.times, drive.commands, drive.times + link.delay, every, every,
                    np.zeros(n))
    times = drive.times + np.abs(rng.normal(0.0, min(jitter, 0.2 / link.rate), n))
    delay = link.delay * rng.uniform(0.6, 1.4, n)
    delay += np.where(rng.random(n) < link.late, link.late_by, 0.0)
    heard = rng.random(n) >= link.lost_robot
    logged = rng.random(n) >= link.lost_recorder
    heard[0] = logged[0] = True
    return Sent(times, drive.commands, times + delay, heard, logged, rng.uniform(-1.0, 1.0, n))


def received(sent: Sent, path: CommandPath, link: Link, seconds: float) -> tuple[Vector, Vector]:
    """
    Return when commands take effect [s, rising] and what they are then, shape (m, 2).

    In this order: dead time, the base's own clock, limits, slews and lags.
    """
    active = sent.times >= path.since
    arrive = sent.arrive + np.where(
        active, path.latency + path.latency_spread * sent.spread, path.own[0])
    if path.stutter_period > 0.0:
        phase = np.mod(arrive, path.stutter_period)
        frozen = active & (phase < path.stutter_hold)
        arrive = np.where(frozen, arrive - phase + path.stutter_hold, arrive)
    arrive = np.asarray(np.maximum.accumulate(arrive[sent.heard]))
    held: Vector = sent.commands[sent.heard]
    if link.base_rate > 0.0:
        turns = np.ceil(arrive * link.base_rate - link.base_phase) + link.base_phase
        arrive = np.asarray(turns / link.base_rate, dtype=np.float64)
    if not path.has_memory:
        return arrive, held
    times: Vector = np.arange(int(seconds / FINE), dtype=np.float64) * FINE
    which = np.searchsorted(arrive, times, side='right') - 1
    fine: Vector = held[np.maximum(which, 0)].copy()
    fine[which < 0] = 0.0
    fine = _shaped(times, fine, path)
    changed = np.ones(times.size, dtype=bool)
    changed[1:] = np.any(np.abs(np.diff(fine, axis=0)) > 1e-9, axis=1)
    return times[changed], fine[changed]


def _shaped(times: Vector, held: Vector, path: CommandPath) -> Vector:
    """Apply limits, slews, lags and cut-backs to commands every `FINE` seconds."""
    on = times >= path.since
    for column in (0, 1):
        # 0 stands for no limit.
        limit = np.where(on, path.limits[3 + column], path.own[3 + column])
        limit[limit <= 0.0] = np.inf
        if path.limit_soft > 0.0:
            some = np.isfinite(limit)
            held[some, column] = limit[some] * np.tanh(held[some, column] / limit[some])
        held[:, column] = np.clip(held[:, column], -limit, limit)
    for column in (0, 1):
        slew = np.where(on, path.limits[1 + column], path.own[1 + column])
        if np.any(slew > 0.0):
            slew[slew <= 0.0] = np.inf
            held[:, column] = _slewed(held[:, column], slew * FINE)
    if path.cutback > 0.0:
        held[on & (np.mod(times, 11.0) > 8.5)] *= 1.0 - path.cutback
    for lag in (path.lag, path.loop_lag):
        if lag > 0.0:
            late = _lagged(held, FINE / lag)
            held = np.where(on[:, None], late, held)
    return held


def _slewed(values: Vector, most: Vector) -> Vector:
    """Limit the change per step."""
    result = values.copy()
    last = 0.0
    for k, (value, step) in enumerate(zip(values.tolist(), most.tolist(), strict=True)):
        last = min(max(value, last - step), last + step)
        result[k] = last
    return result


def _lagged(values: Vector, share: float) -> Vector:
    from scipy.signal import lfilter
    result: Vector = lfilter([share], [1.0, share - 1.0], values, axis=0)
    return result


def demanded(commands: Vector, path: CommandPath, fields: Mapping[str, float]) -> Vector:
    """Return voltages [V], or wheel speeds [rad/s] with a speed loop; shape (n, 2)."""
    forward, yaw = commands[:, 0], commands[:, 1]
    if fields['loop'] > 0.5:
        radius = 0.5 * (fields['radius_left'] + fields['radius_right'])
        split = fields['half_track'] * path.loop_yaw_ratio * yaw
        return np.column_stack([(forward - split) / radius, (forward + split) / radius])
    volts = fields['supply'] * fields['command_gain']
    return np.column_stack([volts * (forward - fields['turn_ratio'] * yaw),
                            volts * (forward + fields['turn_ratio'] * yaw)])
