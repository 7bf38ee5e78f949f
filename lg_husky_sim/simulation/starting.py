# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether a base is at rest where a simulation of it begins, and what it follows there."""

from __future__ import annotations

from lg_husky_sim.signals import BodyTwist, TimeSeries
import numpy as np

#: Below these a base is at rest, as far as sensors with noise can tell: its forward speed [m/s]
#: and yaw rate [rad/s], and the rates of its wheels [rad/s].
SLOW, SLOW_WHEEL = 0.05, 0.3
#: A moving base has been told already what comes so soon after a start: bases forget commands that
#: are older than this [s].
SOON = 0.5


def at_rest(twist: BodyTwist, wheel_rates: tuple[float, float] | None = None) -> bool:
    """
    Return whether a base is at rest, as far as sensors with noise can tell.

    Parameters
    ----------
    twist : BodyTwist
        Decides where the wheel rates are not known: a speed that is the slope of a pose has
        more noise than they have.
    wheel_rates : tuple of float, optional
        Left and right [rad/s].

    """
    if wheel_rates is not None:
        return max(map(abs, wheel_rates)) < SLOW_WHEEL
    return abs(twist.forward) < SLOW and abs(twist.yaw) < SLOW


def commanded_until(start: float, commands: TimeSeries, twist: BodyTwist,
                    wheel_rates: tuple[float, float] | None = None, timeout: float = 0.0
                    ) -> BodyTwist:
    """
    Return what a base had been told until a start, and still follows there.

    A base that moves has had the command that is in force at the start for long enough. A base
    at rest has not obeyed it yet, so it is new there: nothing was commanded before, and dead
    time and limits of the acceleration begin with it.

    Parameters
    ----------
    start : float
        [s]
    commands : TimeSeries
        Names forward [m/s], yaw [rad/s]; each value holds until the next stamp. A first one
        within :data:`SOON` of the start is in force there.
    twist : BodyTwist
        Velocity of the base at the start.
    wheel_rates : tuple of float, optional
        Left and right at the start [rad/s], where they were measured.
    timeout : float
        Time after which the base forgets a command [s]; 0 for never.

    Returns
    -------
    BodyTwist
        Zero where nothing was commanded, or nothing that is known or remembered.

    """
    if (at_rest(twist, wheel_rates) or len(commands) == 0
            or commands.times[0] > start + SOON):
        return BodyTwist()
    place = max(int(np.searchsorted(commands.times, start, side='right')) - 1, 0)
    if 0.0 < timeout < start - commands.times[place]:
        return BodyTwist()
    forward, yaw = commands.values[place].tolist()
    return BodyTwist(forward, yaw)
