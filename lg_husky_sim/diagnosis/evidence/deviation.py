# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The slow part of a robot's linear model, as the deviation model of the whitener needs it."""

from __future__ import annotations

from collections.abc import Mapping

from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.edits import axles
from lg_husky_sim.husky.model import Structure
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.linear_graph.expressions import evaluate
from lg_husky_sim.signals import FloatArray
import numpy as np

#: States of the graph that carry the motion of the base.
SLOW = ('v(M_H)', 'omega(J_H)')


def axle_inertias(structure: Structure, numbers: Mapping[str, float]) -> dict[str, float]:
    """Return the inertia that turns with each motor's wheels [kg·m²], by the state of its rate."""
    return {f'omega({axle.name})': evaluate(axle.value, numbers)
            for _, axle in axles(structure.network().graph, 'both')}


def _in_balance(a: FloatArray) -> FloatArray:
    # Inverse of a, without the modes that settle so slowly that they keep what they were.
    rates, modes = np.linalg.eig(a)
    kept = np.abs(rates) * setting('slowest_balance') > 1.0
    if np.all(kept):
        return np.asarray(np.linalg.inv(a), dtype=np.float64)
    inverse = np.zeros_like(rates)
    inverse[kept] = 1.0 / rates[kept]
    return np.asarray(np.real((modes * inverse) @ np.linalg.inv(modes)), dtype=np.float64)


def slow_model(plant: Plant, mass: float, yaw_inertia: float, inertias: Mapping[str, float]
               ) -> FloatArray:
    """
    Reduce a plant to forward speed and yaw rate.

    The other states are in balance at every moment: with x = (s, f), ``0 = A_fs s + A_ff f +
    E_f d``, so that ``s' = (A_ss - A_sf A_ff^-1 A_fs) s + (E_s - A_sf A_ff^-1 E_f) d``, and the
    wheels read ``W s + W_d d`` likewise; voltages enter like d. Modes of A_ff that settle slowly
    (the integral of a controller) keep what they were instead. Only for linear deviations from a
    simulation.

    Parameters
    ----------
    plant : Plant
        Its first set is taken.
    mass, yaw_inertia : float
        [kg], [kg·m²].
    inertias : mapping of str to float
        Of :func:`axle_inertias`: a torque on the wheels of a side acts there.

    Returns
    -------
    numpy.ndarray, shape (28,)
        In the order of :data:`whitener.MODEL`.

    """
    one, states = plant.sets[0], plant.states
    n = len(states)
    slow = [states.index(name) for name in SLOW]
    fast = [i for i in range(n) if i not in slow]
    force, moment = np.zeros(n), np.zeros(n)
    force[slow[0]], moment[slow[1]] = 1.0 / mass, 1.0 / yaw_inertia
    torques = np.zeros((n, len(inertias)))
    for side, (name, inertia) in enumerate(inertias.items()):
        torques[states.index(name), side] = 1.0 / inertia
    inputs = np.column_stack([force, moment, torques])
    a_ff = one.a[np.ix_(fast, fast)]
    inputs = np.hstack([inputs, one.b])
    follow = -_in_balance(a_ff) @ np.hstack([one.a[np.ix_(fast, slow)], inputs[fast]])
    by_itself = np.hstack([one.a[np.ix_(slow, slow)], inputs[slow]])
    a_sf = one.a[np.ix_(slow, fast)]
    both = by_itself + a_sf @ follow
    # What sides that are alike do to each other's balance cancels, but for rounding.
    parts = np.abs(by_itself) + np.abs(a_sf) @ np.abs(follow)
    both = np.where(np.abs(both) > setting('cancelled') * parts, both, 0.0)
    a_slow, e_slow = both[:, :2], both[:, 2:]
    wheels = one.rows[:2, fast] @ follow
    wheels[:, 6:] += one.rows_u[:2]
    wheels[:, :2] += one.rows[:2, slow]
    left, right = wheels[:, [0, 1, 4, 5]]
    # A decay within half a step of the filter counts as one that takes it: Euler's rule is stable.
    rates = np.abs(np.diag(a_slow))[:, None]
    slowed = np.minimum(1.0, 0.5 / (setting('longest_step') * np.maximum(rates, 1e-9)))
    a_slow, e_slow = slowed * a_slow, slowed * e_slow
    return np.concatenate([a_slow.ravel(), e_slow[0, :4], e_slow[1, :4], left, right,
                           e_slow[:, 4:].ravel(), wheels[:, 6:].ravel()])
