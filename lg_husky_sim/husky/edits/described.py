# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Smooth efforts of one quantity, which describe physics without a name."""

from __future__ import annotations

from lg_husky_sim.husky.edits.network import (
    axles,
    branch_of,
    Edit,
    EditedNetwork,
    LawRow,
    MOTORS,
)
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.laws import Law

#: Argument of a smooth effort to the context entry that it reads; the others are variables.
_CONTEXT = {'time': 0.0, 'heading': 1.0, 'x': 2.0, 'y': 3.0, 'angle_left': 4.0,
            'angle_right': 5.0}
_VARIABLES = {'forward': ('v(M_H)',), 'yaw': ('omega(J_H)',)}
_KNOTS = tuple(f'knot_{i}' for i in range(1, 10))


def _table(argument: str) -> LawRow:
    count = float(len(_KNOTS))
    periodic = argument in ('heading', 'angle_left', 'angle_right')
    return LawRow(Law.TABLE, (_CONTEXT.get(argument, -1.0), 'range_low', 'range_high',
                              -count if periodic else count, *_KNOTS))


def _on_base(store: str) -> Edit:
    def apply(network: EditedNetwork, effect: Effect) -> EditedNetwork:
        return network.with_effort_on(
            f'F_{effect.id}', branch_of(network.graph, store), _table(effect.shape),
            *_VARIABLES.get(effect.shape, ()))
    return Edit(apply)


def _torque(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    for letter, inertia in axles(network.graph, effect.side):
        side = {'L': 'left', 'R': 'right'}[letter]
        row = _table(f'angle_{side}' if effect.shape == 'angle' else effect.shape)
        of = (f'omega({inertia.name})',) if effect.shape == 'wheel_rate' else ()
        network = network.with_effort_on(f'T_{effect.id}_{letter}', inertia, row, *of)
    return network


def _voltage(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    chosen = [letter for letter, _ in axles(network.graph, effect.side)]
    for number, letter, _, _ in MOTORS:
        if letter in chosen:
            of = (f'V(V_S{number})',) if effect.shape == 'voltage' else ()
            network = network.with_voltage(effect.id, number, _table(effect.shape), of)
    return network


EDITS = {
    'smooth_force': _on_base('M_H'),
    'smooth_moment': _on_base('J_H'),
    'smooth_torque': Edit(_torque),
    'smooth_voltage': Edit(_voltage),
}
