# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The state from which a simulation starts, from what is known of pose, motion and commands."""

from __future__ import annotations

from functools import cached_property

from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import BodyTwist, FloatArray, Pose
from lg_husky_sim.simulation.event_kernel import SHAPED, TAIL, WANTED
import numpy as np


class InitialStates:
    """
    States of a plant to start from.

    Parameters
    ----------
    plant : Plant

    """

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._set = plant.sets[0]

    @cached_property
    def steady(self) -> FloatArray:
        """States per volt of steady driving, shape (n, 2)."""
        return np.asarray(np.linalg.lstsq(-self._set.a, self._set.b, rcond=None)[0],
                          dtype=np.float64)

    @cached_property
    def _gains(self) -> FloatArray:
        # Wheel rates, speed and yaw rate per volt of steady driving.
        found: FloatArray = self._set.rows[:4] @ self.steady
        return found

    @cached_property
    def _nearest(self) -> FloatArray:
        # States of the steady drive that comes nearest to wheel rates, speed and yaw rate.
        found: FloatArray = self.steady @ _inverse(self._gains)
        return found

    @cached_property
    def _onto(self) -> FloatArray:
        # The least change of states that changes wheel rates, speed and yaw rate.
        return _inverse(self._set.rows[:4])

    @cached_property
    def _without_slip(self) -> tuple[float, float]:
        # Wheel rates per speed, and their difference per yaw rate.
        left, right = self.rates_without_slip(BodyTwist(0.0, 1.0))
        return sum(self.rates_without_slip(BodyTwist(1.0, 0.0))) / 2.0, right - left

    def flat(self, pose: Pose | None = None, twist: BodyTwist | None = None, time: float = 0.0,
             wheel_rates: tuple[float, float] | None = None,
             wheel_angles: tuple[float, float] = (0.0, 0.0),
             command: BodyTwist | None = None) -> FloatArray:
        """
        Return a flat state of :mod:`lg_husky_sim.simulation.event_kernel`.

        Parameters
        ----------
        pose : Pose, optional
            Place [m] and heading [rad] of the base; the origin if not given.
        twist : BodyTwist, optional
            Velocity of the base; at rest if not given.
        time : float
            Simulated time [s].
        wheel_rates : tuple of float, optional
            Left and right [rad/s]; those that roll without slip at ``twist`` if not given.
        wheel_angles : tuple of float
            Left and right [rad].
        command : BodyTwist, optional
            What has been commanded for long until then; nothing if not given.

        Returns
        -------
        numpy.ndarray, shape (n + TAIL,)
            Other states (currents, controllers) are those of the nearest steady drive.

        """
        pose, twist = pose or Pose(), twist or BodyTwist()
        one = self._set
        n = one.a.shape[0]
        flat = np.zeros(n + TAIL)
        if wheel_rates is None and (twist.forward or twist.yaw):
            wheel_rates = self.rates_without_slip(twist)
        wanted = np.array([*(wheel_rates or (0.0, 0.0)), twist.forward, twist.yaw])
        if np.any(wanted):
            # The nearest steady drive, so that controllers and belts start where they would be,
            # and the least change that makes it agree with what is wanted.
            flat[:n] = self._moved_to(self._nearest @ wanted, wanted)
        flat[n:n + 2] = wheel_angles
        flat[n + 3:n + 7] = pose.heading, pose.x, pose.y, time
        if command is not None:
            late = self._plant.late(np.array([time]), np.array([pose.x]))[0]
            limit = self._plant.sets[-1 if late else 0].command
            flat[n + SHAPED] = max(-limit.limit_forward,
                                   min(limit.limit_forward, command.forward))
            flat[n + SHAPED + 1] = max(-limit.limit_yaw, min(limit.limit_yaw, command.yaw))
            flat[n + WANTED:] = command.forward, command.yaw
        return flat

    def run_in(self, before: FloatArray, start: FloatArray) -> FloatArray:
        """
        Return a state to start from that remembers how it came there.

        Parameters
        ----------
        before : numpy.ndarray, shape (n + TAIL,)
            Of a simulation of what was commanded until then.
        start : numpy.ndarray, shape (n + TAIL,)
            As the sensors have it, of :meth:`flat`.

        Returns
        -------
        numpy.ndarray, shape (n + TAIL,)
            The latter's pose, rates and time; currents, controllers, belts and the stages of the
            command of the former.

        """
        n = self._set.a.shape[0]
        flat = np.array(before)
        flat[:n] = self._moved_to(before[:n], self._set.rows[:4] @ start[:n])
        flat[n:n + 7] = start[n:n + 7]
        return flat

    def _moved_to(self, states: FloatArray, wanted: FloatArray) -> FloatArray:
        # With the least change that makes wheel rates, speed and yaw rate those that are wanted.
        found: FloatArray = states + self._onto @ (wanted - self._set.rows[:4] @ states)
        return found

    def rates_without_slip(self, twist: BodyTwist) -> tuple[float, float]:
        """Return the wheel rates [rad/s] at which the wheels' dampers carry no torque."""
        one = self._set
        rates = np.array([twist.forward * one.command.volts_per_speed
                          + sign * twist.yaw * one.command.volts_per_rate
                          for sign in (-1.0, 1.0)])
        gains = self._gains
        body = gains[2:] @ rates
        share = [twist.forward / body[0] if body[0] else 1.0,
                 twist.yaw / body[1] if body[1] else 1.0]
        mean, half = 0.5 * (rates[0] + rates[1]), 0.5 * (rates[1] - rates[0])
        left, right = gains[:2] @ np.array([share[0] * mean - share[1] * half,
                                            share[0] * mean + share[1] * half])
        return float(left), float(right)

    def twist_without_slip(self, left: float, right: float) -> BodyTwist:
        """Return the velocity of the base whose wheels turn at such rates [rad/s]."""
        ahead, turning = self._without_slip
        return BodyTwist(0.5 * (left + right) / ahead, (right - left) / turning)


def _inverse(matrix: FloatArray) -> FloatArray:
    # Of least squares, with what is a rounding error taken for zero.
    return np.asarray(np.linalg.pinv(matrix, rcond=max(matrix.shape) * np.finfo(float).eps),
                      dtype=np.float64)
