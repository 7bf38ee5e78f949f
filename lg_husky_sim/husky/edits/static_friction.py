# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Static friction: what holds a robot at rest, and lets go of it when its wheels turn.

The motors' axles, and the tyres against the ground, are held by a damped spring each that gives
way a little (the presliding of dry contacts), carries the break-away torque at most, and is gone
at the release rate. A robot at rest stays there, without the creep of a smooth sign of the rate.
"""

from __future__ import annotations

from lg_husky_sim.husky.edits.network import axles, Edit, EditedNetwork, LawRow
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.laws import Law


def _hold(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    for place, (letter, axle) in enumerate(axles(network.graph, 'both')):
        rate = f'omega({axle.name})'
        row = LawRow(Law.STICTION, ('break_away_torque', 'presliding', float(place),
                                    'release_rate', 'settling_time'))
        network = network.with_effort_on(f'T_static_{letter}', axle, row, rate, rate)
        # The driven wheel stands for its side; a torque of the slip has the sign of its damper.
        # Tyres hold more than gears, as stiffly: the robot rolls away.
        row = LawRow(Law.STICTION, ('-tyre_share*break_away_torque', 'tyre_share*presliding',
                                    2.0 + place, 'release_rate', 'settling_time'))
        network = network.with_slip_torque(f'T_tyre_{letter}', f'R{letter}', row, rate)
    return network


EDITS = {'static_friction': Edit(_hold)}
