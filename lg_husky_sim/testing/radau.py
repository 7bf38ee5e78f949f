# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
An independent integrator for the accuracy of the event-driven kernel.

It shares the plant's matrices and the laws' formulas with the kernel, and nothing else: states are
physical, pose and memories are states, and scipy's integrator stops at every event.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

from lg_husky_sim.husky.laws import CONTEXT, evaluate, Law, MEMORY
from lg_husky_sim.husky.plant import Plant, PlantSet
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np

#: What is compared, and the nominal noise of its sensor: wheel rates and gyro [rad/s], place [m],
#: heading [rad] (a Husky's encoders, an UM7 and a good odometry).
NOISE = {'wheel_left': 0.0065, 'wheel_right': 0.0065, 'yaw_rate': 0.0025, 'x': 0.003, 'y': 0.003,
         'heading': 0.003}


@dataclass(frozen=True)
class Reference:
    """
    A plant's continuous equations.

    Parameters
    ----------
    plant : Plant
    rtol, atol : float
        Of the integrator.
    method : str
        Scipy's name of it. Radau suits any law; DOP853, of order 8 and explicit, is the faster one
        to very small errors where nothing is faster than the electrical modes.

    """

    plant: Plant
    rtol: float = 1e-9
    atol: float = 1e-11
    method: str = 'Radau'

    def _efforts(self, one: PlantSet, time: float, s: FloatArray, u: FloatArray
                 ) -> tuple[FloatArray, FloatArray]:
        n = one.a.shape[0]
        f, z = np.zeros(one.laws.size), one.h @ s[:n] + one.k @ u
        if f.size:
            memory = np.concatenate([s[n + 6:n + 8], np.zeros(MEMORY - 2)])
            context = np.zeros(CONTEXT)
            context[:6] = time, s[n + 3], s[n + 4], s[n + 5], s[n], s[n + 1]
            evaluate(0, one.laws[None], one.coefficients[None],
                     one.offsets[None], z, context, memory, f)
        return f, z

    def _voltages(self, one: PlantSet, shaped: FloatArray) -> FloatArray:
        stage = one.command
        half = stage.volts_per_rate * shaped[1]
        u = stage.volts_per_speed * shaped[0] + np.array([-half, half])
        clamp = stage.clamp if stage.clamp > 0.0 else np.inf
        clipped: FloatArray = np.clip(u, -clamp, clamp)
        return clipped

    def _rates(self, time: float, s: FloatArray, one: PlantSet, begin: float,
               shaped: FloatArray, slope: FloatArray) -> FloatArray:
        n = one.a.shape[0]
        u = self._voltages(one, shaped + (time - begin) * slope)
        f, z = self._efforts(one, time, s, u)
        y = one.rows[:4] @ s[:n] + one.rows_u[:4] @ u + one.rows_f[:4] @ f
        heat = np.zeros(2)
        for j in np.flatnonzero(one.laws == Law.HEATING):
            side, cooling = int(one.coefficients[j, 2]), one.coefficients[j, 1]
            heat[side] = z[one.offsets[j]] ** 2 - s[n + 6 + side] / cooling
        return np.concatenate([
            one.a @ s[:n] + one.b @ u + one.g @ f, y,
            [y[2] * math.cos(s[n + 3]), y[2] * math.sin(s[n + 3])], heat])

    def trajectory(self, commands: TimeSeries, times: FloatArray) -> TimeSeries:
        """
        Drive the plant from rest at the origin with commands.

        Parameters
        ----------
        commands : TimeSeries
            Names forward [m/s], yaw [rad/s].
        times : numpy.ndarray, shape (n_times,)
            Sorted, not before the first command [s].

        Returns
        -------
        TimeSeries
            The channels of :data:`NOISE`.

        """
        from scipy.integrate import solve_ivp

        one = self.plant.sets[0]
        n, stage = one.a.shape[0], one.command
        s, shaped, goal = np.zeros(n + 8), np.zeros(2), np.zeros(2)
        limit = np.array([stage.limit_forward, stage.limit_yaw])
        slew = np.array([stage.slew_forward, stage.slew_yaw])
        t, end = float(commands.times[0]), float(times[-1])
        seen: list[FloatArray] = []
        given = 0
        while t < end or len(seen) < len(times):
            while given < len(commands) and commands.times[given] + stage.latency <= t:
                goal = np.clip(commands.values[given], -limit, limit)
                given += 1
            shaped = np.where(np.isinf(slew), goal, shaped)
            gap = goal - shaped
            slope = np.where(gap != 0.0, np.sign(gap) * np.where(np.isinf(slew), 0.0, slew), 0.0)
            until = end
            if given < len(commands):
                until = min(until, float(commands.times[given]) + stage.latency)
            for ramp, missing in zip(slope, gap, strict=True):
                until = min(until, t + missing / ramp) if ramp else until
            inside = times[(times > t) & (times <= until)] if t > commands.times[0] else times[
                (times >= t) & (times <= until)]
            found = solve_ivp(
                self._rates, (t, until), s, self.method, np.unique(np.append(inside, until)),
                args=(one, t, shaped, slope), rtol=self.rtol, atol=self.atol)
            seen.extend(found.y[:, k] for k in range(inside.size))
            s = found.y[:, -1]
            moved = shaped + (until - t) * slope
            shaped = np.where(np.abs(goal - moved) < 1e-12, goal, moved)
            t = until
        states = np.array(seen)
        rates = states[:, :n] @ one.rows[:4].T
        return TimeSeries(times, np.column_stack([
            rates[:, 0], rates[:, 1], rates[:, 3], states[:, n + 4], states[:, n + 5],
            states[:, n + 3]]), tuple(NOISE))
