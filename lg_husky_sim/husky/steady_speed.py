# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Speeds at which the graph of a robot settles, in parts of those that are commanded.

With the back-EMF at the wheel T = torque_constant gear_ratio, nothing but inertia loads straight
driving, so that the back-EMF takes the whole voltage ``command_gain supply_voltage v`` (eqs. 24
and 25)::

    v = r voltage / T

In a turn with yaw rate w each side pushes with ``yaw_damping w / track`` at the radius r; its
two tyres slip by half of that torque over wheel_damping, and the winding takes the rest::

    voltage = T (track/2 + slip) w / r,
    slip = yaw_damping r**2 / track * (1/(2 wheel_damping) + motor_resistance / T**2)
"""

from __future__ import annotations

from collections.abc import Mapping


def steady_shares(values: Mapping[str, float]) -> tuple[float, float]:
    """
    Return what a robot without effects reaches of a commanded speed and yaw rate.

    Parameters
    ----------
    values : mapping of str to float
        Parameters of its model.

    Returns
    -------
    forward, yaw : float
        1 where it does what is commanded; the supply's limit is not seen.

    """
    back_emf = values['torque_constant'] * values['gear_ratio']
    radius, track = values['wheel_radius'], values['track']
    forward = values['command_gain'] * values['supply_voltage'] * radius / back_emf
    slip = values['yaw_damping'] * radius ** 2 / track * (
        0.5 / values['wheel_damping'] + values['motor_resistance'] / back_emf ** 2)
    return forward, forward * values['turn_ratio'] / (0.5 * track + slip)
