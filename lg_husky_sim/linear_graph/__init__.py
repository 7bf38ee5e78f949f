# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""State-space models of multi-domain systems from linear graphs; no robots, no ROS."""

from lg_husky_sim.linear_graph.elements import (
    Branch,
    Characteristic,
    default_form,
    Domain,
    Form,
    Kind,
    TwoPort,
)
from lg_husky_sim.linear_graph.graph import LinearGraph
from lg_husky_sim.linear_graph.normal_tree import normal_tree, NormalTree
from lg_husky_sim.linear_graph.numeric import compile_numeric, NumericModel
from lg_husky_sim.linear_graph.state_space import equation_forms, StateSpace
from lg_husky_sim.linear_graph.symbolic import derive, SymbolicStateSpace

__all__ = [
    'Branch',
    'Characteristic',
    'Domain',
    'Form',
    'Kind',
    'LinearGraph',
    'NormalTree',
    'NumericModel',
    'StateSpace',
    'SymbolicStateSpace',
    'TwoPort',
    'compile_numeric',
    'default_form',
    'derive',
    'equation_forms',
    'normal_tree',
]
