# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Effects between the wheels and the ground."""

from __future__ import annotations

from lg_husky_sim.husky.edits.network import (
    branch_of,
    Edit,
    EditedNetwork,
    element_of,
    LawRow,
    scrubbing,
    Stage,
    WHEELS,
)
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.laws import Law
from lg_husky_sim.linear_graph import Domain


def _saturation(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    for wheel in (*WHEELS['left'], *WHEELS['right']):
        damping = branch_of(network.graph, f'B_{wheel}').value
        if effect.shape == 'circle':
            network = _with_circle(network, wheel, str(damping))
            continue
        row = LawRow(Law.SLIP_SATURATION, (f'traction_torque{network.grip}', str(damping)))
        network = network.with_slip_torque(f'T_slip_{wheel}', wheel, row)
    return network


def _with_circle(network: EditedNetwork, wheel: str, damping: str) -> EditedNetwork:
    # Adhesion of a wheel, shared by its slip and by a quarter of the scrubbing, whose force acts
    # half a wheelbase from the middle.
    scrub, inertia = f'({branch_of(network.graph, "B_H").value})/4', scrubbing(network.graph)
    arm, limit = '(wheelbase/(2*wheel_radius))', f'traction_torque{network.grip}'
    rate = f'omega({inertia.name})'
    row = LawRow(Law.FRICTION_CIRCLE, (limit, damping, f'{scrub}/{arm}'))
    network = network.with_slip_torque(f'T_slip_{wheel}', wheel, row, rate)
    row = LawRow(Law.FRICTION_CIRCLE,
                 (f'{limit}*{arm}', f'-{scrub}', f'({damping})*{arm}'))
    return network.with_effort_on(f'T_scrub_{wheel}', inertia, row, rate, f'omega(B_{wheel})')


def _radius(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    numbers = range(1, 5) if effect.side == 'left' else range(5, 9)
    radius = '(wheel_radius*(1+radius_change))'
    network = network.with_values({
        f'TF_{n}': str(element_of(network.graph, f'TF_{n}').value).replace(
            'wheel_radius', radius) for n in numbers})
    if effect.shape.endswith('contact'):
        network = network.with_values({
            f'B_{wheel}': f'({branch_of(network.graph, f"B_{wheel}").value})*(1+radius_change)**2'
            for wheel in WHEELS[effect.side]})
    if effect.shape.startswith('firm'):
        return network
    # What holds a soft tyre back acts at its tread: on the chassis, with half the track as its
    # arm. A source's own rate is that of its node with the other sign.
    for wheel in WHEELS[effect.side]:
        name = f'T_drag_{wheel}'
        row = LawRow(Law.COULOMB, (f'-(tyre_drag/2)*{radius}', f'tyre_drag_speed/{radius}', 0.0,
                                   1.0))
        network = network.with_force(name, Domain.ROTATIONAL, f'tread{wheel}', 'r', row,
                                     (f'omega({name})',))
    return network


EDITS = {
    'traction_saturation': Edit(_saturation),
    'wheel_radius_mismatch': Edit(_radius, Stage.VALUES),
}
