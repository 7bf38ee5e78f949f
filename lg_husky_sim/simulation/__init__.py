# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Stepping: no clock, no ROS."""

from lg_husky_sim.simulation.simulator import rollout, Simulator, SimulatorState

__all__ = ['Simulator', 'SimulatorState', 'rollout']
