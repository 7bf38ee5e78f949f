# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects on the base: its mass, forces along its way and moments against its turning."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from lg_husky_sim.husky.edits.network import (
    branch_of,
    Edit,
    EditedNetwork,
    LawRow,
    scrubbing,
    Stage,
    WHEELS,
)
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.laws import Law
from lg_husky_sim.linear_graph import Branch, LinearGraph

_FORWARD = 'v(M_H)'


def _ground(network: EditedNetwork, slip: str, yaw: str) -> dict[str, str]:
    # Values of what the ground does to wheels and chassis, times a factor each.
    changed = {f'B_{wheel}': f'({branch_of(network.graph, f"B_{wheel}").value})*{slip}'
               for side in WHEELS for wheel in WHEELS[side]}
    return changed | {'B_H': f'({branch_of(network.graph, "B_H").value})*{yaw}'}


def _payload(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    heavier = {'M_H': 'mass+payload_mass', 'J_H': 'yaw_inertia+payload_inertia'}
    if effect.shape == 'ground':
        weight = '(1+payload_mass/mass)'
        heavier |= _ground(network, weight, weight)
        network = replace(network, grip=f'{network.grip}*{weight}')
    return network.with_values(heavier)


def _base(graph: LinearGraph) -> Branch:
    return branch_of(graph, 'M_H')


def _terrain(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    if effect.shape == 'grip':
        return replace(network, grip=f'{network.grip}*(1+grip_change)')
    slip, scrub = '(1+wheel_damping_change)', '(1+yaw_damping_change)'
    network = replace(network.with_values(_ground(network, slip, scrub)),
                      grip=f'{network.grip}*{scrub}')
    if effect.shape == 'damping':
        return network
    row = LawRow(Law.COULOMB, ('floor_drag', 'floor_drag_speed', 0.0, 1.0))
    return network.with_effort_on(f'F_{effect.id}', _base(network.graph), row, _FORWARD)


def _turning(graph: LinearGraph) -> Branch:
    return branch_of(graph, 'J_H')


def _pushing(store: Callable[[LinearGraph], Branch], row: LawRow, *of: str) -> Edit:
    # An effort on the mass, the inertia or what scrubs, whose own rate is called {own}.
    def apply(network: EditedNetwork, effect: Effect) -> EditedNetwork:
        pushed = store(network.graph)
        return network.with_effort_on(f'F_{effect.id}', pushed, row, *(
            one.format(own=pushed.name) for one in of))
    return Edit(apply)


def _pull(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    # What drags on one side turns the other way in reverse.
    row = LawRow(Law.WHILE_MOVING, ('pull_moment', 'pull_speed'))
    if effect.shape == 'dragging':
        row = LawRow(Law.COULOMB, ('-pull_moment', 'pull_speed', 0.0, 1.0))
    return _pushing(_turning, row, _FORWARD).apply(network, effect)


EDITS = {
    'payload': Edit(_payload, Stage.VALUES),
    'terrain_change': Edit(_terrain, Stage.VALUES),
    'slope': _pushing(_base, LawRow(Law.HEADING, ('slope_x', 'slope_y'), felt=False)),
    'rolling_resistance': _pushing(
        _base, LawRow(Law.COULOMB, ('rolling_force', 'rolling_speed', 0.0, 1.0)), _FORWARD),
    'quadratic_drag': _pushing(_base, LawRow(Law.QUADRATIC, ('drag',)), _FORWARD),
    'yaw_scrub_coulomb': _pushing(
        scrubbing, LawRow(Law.COULOMB, ('yaw_coulomb_moment', 'yaw_coulomb_rate', 0.0, 1.0)),
        'omega({own})'),
    'yaw_scrub_speed': _pushing(
        scrubbing, LawRow(Law.MODULATED_DAMPING, ('scrub_slope',)), 'omega({own})', _FORWARD),
    'yaw_pull': Edit(_pull),
}
