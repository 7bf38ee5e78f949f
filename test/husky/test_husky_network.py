# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Which elements of the graph belong to a side."""

from __future__ import annotations

from lg_husky_sim.diagnosis.before_after.settings import settings
from lg_husky_sim.husky.network import expanded, on_side, simplified
from lg_husky_sim.linear_graph import Branch, LinearGraph, TwoPort
import pytest


@pytest.mark.parametrize('graph', [simplified(), expanded()], ids=['simplified', 'expanded'])
def test_elements_of_a_side_are_those_that_hang_on_its_nodes(graph: LinearGraph) -> None:
    elements: list[Branch | TwoPort] = [*graph.branches, *graph.two_ports]
    for element in elements:
        nodes = (*element.port1[1:], *element.port2[1:]) if isinstance(element, TwoPort) else (
            element.tail, element.head)
        assert not any(node.endswith('L') for node in nodes) or not any(
            node.endswith('R') for node in nodes), 'one that joins both sides'
        assert bool(on_side([element.name], 'left')) != any(n.endswith('R') for n in nodes)
        assert bool(on_side([element.name], 'right')) != any(n.endswith('L') for n in nodes)
    assert on_side(['J_LW', 'J_RW', 'imu'], 'both') == ('J_LW', 'J_RW', 'imu')


def test_a_change_of_one_side_names_elements_of_that_side_only() -> None:
    sided = [change for change in settings().changes if change.side in ('left', 'right')]
    assert len(sided) > 5
    for change in sided:
        assert on_side(change.elements, change.side) == change.elements, change
