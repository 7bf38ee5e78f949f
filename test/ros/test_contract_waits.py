# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""How long the live tools and the tests' own node wait for what is ready."""

from __future__ import annotations

from typing import Any

from lg_husky_sim.ros.tool import Orderly, Tool
from lg_husky_sim.testing.live import Probe
import pytest


def test_all_waits_of_a_tool_are_alike(probe: Probe, monkeypatch: pytest.MonkeyPatch) -> None:
    """Row 53: rclpy drops who is ready whenever the wait changes, and serves the first only."""
    tool = Tool('lg_husky_recorder', Orderly())
    waits: list[float] = []
    for one in (tool, probe):
        def spin_once(timeout_sec: float, once: Any = one._executor.spin_once) -> None:
            waits.append(timeout_sec)
            once(timeout_sec=timeout_sec)
        monkeypatch.setattr(one._executor, 'spin_once', spin_once)
    try:
        tool.serve()
        tool.serve_until(tool.now() + 0.137)
        probe.spin(0.033)
        probe.until(lambda: len(waits) > 20, 0.5)
    finally:
        tool.close()
    assert len(waits) > 8
    assert len(set(waits)) == 1
