# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Close a wheel-speed loop around the graph's two voltage sources."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from lg_husky_sim.husky.laws import CEILING, Law, PLACES, WIDTH, WINDING
from lg_husky_sim.husky.plant import PlantSet
from lg_husky_sim.signals import FloatArray
import numpy as np

#: States that the loop adds.
STATES = ('reference(left)', 'reference(right)', 'integral(left)', 'integral(right)')


def close_speed_loop(plant: PlantSet, values: Mapping[str, float]) -> PlantSet:
    """
    Replace the open-loop voltages by a follower with a PI law.

    For each side, with the transmission T, the reference voltage r of eqs. (24), (25) and the
    wheel rate w::

        w_f' = (r/T - w_f) / loop_lag
        V    = loop_forward_share T w_f + loop_gain (w_f - w) + I,   clipped to the supply
        I'   = loop_integral (w_f - w) + (V_clipped - V) loop_integral / (loop_gain + T)

    Effects that act on the driver's voltage see it clipped.

    Parameters
    ----------
    plant : PlantSet
        Open loop.
    values : mapping of str to float
        Must hold torque_constant, gear_ratio, supply_voltage, loop_lag, loop_gain,
        loop_integral, loop_forward_share.

    Returns
    -------
    PlantSet
        With four more states; inputs are the reference voltages.

    """
    n, efforts = plant.a.shape[0], plant.laws.size
    transmission = values['torque_constant'] * values['gear_ratio']
    gain, integral = values['loop_gain'], values['loop_integral']
    lag = values['loop_lag']
    unwind = integral / (gain + transmission)
    wheels = plant.rows[:2]
    forward = values['loop_forward_share'] * transmission
    volts = np.hstack([-gain * wheels, (forward + gain) * np.eye(2), np.eye(2)])
    a = np.zeros((n + 4, n + 4))
    a[:n, :n] = plant.a
    a[:n] += plant.b @ volts
    a[n:n + 2, n:n + 2] = -np.eye(2) / lag
    a[n + 2:, :n] = -integral * wheels
    a[n + 2:, n:n + 2] = integral * np.eye(2)
    b = np.zeros((n + 4, 2))
    b[n:n + 2] = np.eye(2) / (transmission * lag)
    open_loop = replace(
        plant, a=a, b=b, g=np.vstack([plant.g, np.zeros((4, efforts))]),
        h=np.hstack([plant.h, np.zeros((plant.h.shape[0], 4))]) + plant.k @ volts,
        rows=np.hstack([plant.rows, np.zeros((9, 4))]) + plant.rows_u @ volts,
        k=np.zeros_like(plant.k), rows_u=np.zeros_like(plant.rows_u))
    return clipped(open_loop, volts, np.vstack([plant.b, np.zeros((2, 2)), unwind * np.eye(2)]),
                   plant.rows_u, values['supply_voltage'])


def clipped(plant: PlantSet, volts: FloatArray, enters: FloatArray, reads: FloatArray,
            limit: float) -> PlantSet:
    """
    Clip voltages that states make.

    Parameters
    ----------
    plant : PlantSet
        Where they are not clipped; its inputs act on states only.
    volts : numpy.ndarray, shape (2, n)
        Voltages of the motors [V] by the states.
    enters, reads : numpy.ndarray, shapes (n, 2), (9, 2)
        What voltages do to the states, and to the outputs.
    limit : float
        [V]

    Returns
    -------
    PlantSet
        With two more laws; what else acts on the driver's voltage sees it clipped.

    """
    arguments = plant.h.shape[0]
    inner = np.array(plant.coefficients)
    places = PLACES[plant.laws]
    inner[(places > 0) & (places < WINDING), CEILING] = limit
    clip = np.zeros((2, WIDTH))
    clip[:, 0] = limit
    return replace(
        plant, g=np.hstack([plant.g, enters]), h=np.vstack([plant.h, volts]),
        k=np.zeros((arguments + 2, 2)), rows_f=np.hstack([plant.rows_f, reads]),
        laws=np.concatenate([plant.laws, np.full(2, int(Law.CLIP), dtype=np.int64)]),
        offsets=np.concatenate([plant.offsets,
                                np.array([arguments, arguments + 1], dtype=np.int64)]),
        coefficients=np.vstack([inner, clip]),
        command=replace(plant.command, clamp=0.0))
