# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Free play of the gears, with an inertia on either side of it.

What a graph of one inertia a side lumps together is parted: a share of it turns with the motor,
the rest with the wheels. Between them are the teeth, a spring beside a damper whose torque t first
has to take up the play::

    J_M w_M' = T i - d(t),   J_W w_W' = d(t) - load,   t = K twist + B (w_M - w_W)
    d(t) = sgn(t) max(|t| - K play / 2, 0)

An encoder on the motor's shaft counts what the motor turns, one on the wheel what that does.
"""

from __future__ import annotations

from dataclasses import replace

from lg_husky_sim.husky.edits.network import (
    axles,
    Edit,
    EditedNetwork,
    element_of,
    LawRow,
    Stage,
)
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.laws import Law
from lg_husky_sim.linear_graph import Branch, Kind, TwoPort


def _play(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    for letter, axle in axles(network.graph, 'both'):
        shaft, domain = f'shaft{letter}', axle.domain
        motor = element_of(network.graph, f'T_M{letter}')
        assert isinstance(motor, TwoPort)
        rotor = Branch(f'J_rotor_{letter}', Kind.A_TYPE, domain, shaft, axle.head,
                       f'rotor_share*({axle.value})')
        spring = Branch(f'K_teeth_{letter}', Kind.T_TYPE, domain, shaft, axle.tail,
                        'tooth_stiffness')
        damper = Branch(f'B_teeth_{letter}', Kind.D_TYPE, domain, shaft, axle.tail,
                        'tooth_damping')
        graph = network.graph.replacing(
            replace(motor, port2=(domain, shaft, axle.head))).replacing(
            replace(axle, value=f'(1-rotor_share)*({axle.value})')).with_branches(
            rotor, spring, damper)
        row = LawRow(Law.BACKLASH, ('tooth_stiffness*play/2', 'tooth_damping'))
        network = replace(network, graph=graph).with_torque_beside(
            f'T_play_{letter}', spring, row, f'tau({spring.name})', f'omega({damper.name})')
        if effect.shape == 'motor':
            network = replace(network, counted={**network.counted, letter: rotor.name})
    return network


EDITS = {'gear_backlash': Edit(_play, Stage.ELEMENTS)}
