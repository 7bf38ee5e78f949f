# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects of gears, axles and belts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from lg_husky_sim.errors import ParameterError
from lg_husky_sim.husky.edits.network import (
    axles,
    branch_of,
    Edit,
    EditedNetwork,
    LawRow,
    MOTORS,
    Stage,
    WHEELS,
)
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.laws import Law
from lg_husky_sim.linear_graph import Branch, Kind


def _belt(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    if all(branch.name != 'K_BeltL' for branch in network.graph.branches):
        raise ParameterError(
            f'effect {effect.id} needs the expanded drivetrain (structure.drivetrain)')
    if effect.shape == 'elastic':
        return network
    # A belt jumps or slips on its pulley where it is stretched by more than it can hold.
    for letter in 'LR':
        spring = f'K_Belt{letter}'
        row = LawRow(Law.YIELDING, ('belt_hold', 'belt_slip_damping'))
        network = network.with_rate_before(f'W_slip_{letter}', (spring, f'B_Belt{letter}'), row,
                                           (f'tau({spring})',))
    return network


def _asymmetry(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    if effect.shape == 'slip':
        # Whatever changed these tyres before, such as the ground, goes on.
        return network.with_values({
            f'B_{wheel}': f'({branch_of(network.graph, f"B_{wheel}").value})*(1+damping_change)'
            for wheel in WHEELS[effect.side]})
    letter, inertia = axles(network.graph, effect.side)[0]
    bearing = Branch(f'B_bearing_{letter}', Kind.D_TYPE, inertia.domain, inertia.tail,
                     inertia.head, 'extra_damping')
    return replace(network, graph=network.graph.with_branches(bearing))


def _on_axles(describe: Callable[[str, str, float, str], tuple[LawRow, tuple[str, ...]]]) -> Edit:
    # A law on the axles of a side, from its shape, the number of its motor, its place and the
    # axle's rate.
    def apply(network: EditedNetwork, effect: Effect) -> EditedNetwork:
        motors = {letter: (number, side) for number, letter, side, _ in MOTORS}
        for letter, inertia in axles(network.graph, effect.side):
            number, side = motors[letter]
            row, of = describe(effect.shape, number, side, f'omega({inertia.name})')
            network = network.with_effort_on(f'T_{effect.id}_{letter}', inertia, row, *of)
        return network
    return Edit(apply)


def _dry(shape: str, number: str, side: float, rate: str) -> tuple[LawRow, tuple[str, ...]]:
    row = LawRow(Law.COULOMB, ('dry_torque', 'dry_speed', 'breakaway_share', 'breakaway_speed'))
    return row, (rate,)


def _ripple(shape: str, number: str, side: float, rate: str) -> tuple[LawRow, tuple[str, ...]]:
    twice = (0.0, 0.0) if shape == 'once' else ('ripple_cos_twice', 'ripple_sin_twice')
    thrice = ('ripple_cos_thrice', 'ripple_sin_thrice') if shape == 'thrice' else (0.0, 0.0)
    return LawRow(Law.WHEEL_PHASE, (
        'ripple_cos', 'ripple_sin', side, 'ripple_speed', *twice, *thrice)), (rate,)


EDITS = {
    'belt_compliance': Edit(_belt),
    'viscous_asymmetry': Edit(_asymmetry, Stage.VALUES),
    'coulomb_drivetrain': _on_axles(_dry),
    'torque_ripple': _on_axles(_ripple),
}
