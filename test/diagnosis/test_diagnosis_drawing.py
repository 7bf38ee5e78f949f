# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The graph of a report draws whatever was added, however many elements that is."""

from __future__ import annotations

from lg_husky_sim.diagnosis.report_of_case import _short_names
from lg_husky_sim.husky.effects import catalogue, Effect
from lg_husky_sim.husky.model import Structure
import pytest


@pytest.mark.parametrize('name', list(catalogue()))
def test_new_elements_get_names_of_their_own(name: str) -> None:
    """A belt adds two springs and two dampers, whose short names must not collide."""
    final = Structure().with_effect(Effect(name))
    graph = final.network().graph
    before = set(Structure().network().graph.names)
    added = [branch.name for branch in graph.branches if branch.name not in before]
    drawn, names = _short_names(graph, added)
    assert len(set(names)) == len(added)
    assert len(drawn.branches) == len(graph.branches)
    if name == 'belt_compliance':
        assert len(added) >= 4
