# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Wind-up of the tyres: an elastic torsion between base and ground, in series with the scrub.

What scrubs over the ground is no longer the base but the contact patches, which have a little
inertia and are tied to the base by the tyres' carcasses, a spring beside a damper. The scrub holds
the patches when a turn ends, and the base swings on the tyres.
"""

from __future__ import annotations

from dataclasses import replace

from lg_husky_sim.husky.edits.network import branch_of, Edit, EditedNetwork, Stage
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.linear_graph import Branch, Kind


def _wind_up(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    scrub = branch_of(network.graph, 'B_H')
    base, ground, domain = scrub.tail, scrub.head, scrub.domain
    return replace(network, graph=network.graph.replacing(
        replace(scrub, tail='patches')).with_branches(
            Branch('J_patch', Kind.A_TYPE, domain, 'patches', ground, 'patch_inertia'),
            Branch('K_carcass', Kind.T_TYPE, domain, base, 'patches', 'windup_stiffness'),
            Branch('B_carcass', Kind.D_TYPE, domain, base, 'patches', 'windup_damping')))


EDITS = {'tyre_windup': Edit(_wind_up, Stage.ELEMENTS)}
