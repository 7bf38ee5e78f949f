# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Stepping: no clock, no ROS."""

from lg_husky_sim.simulation.simulator import Simulator, SimulatorState, rollout

__all__ = ['Simulator', 'SimulatorState', 'rollout']
