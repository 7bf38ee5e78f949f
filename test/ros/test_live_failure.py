# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A node that is waited for in vain leaves nothing behind."""

from __future__ import annotations

from lg_husky_sim.errors import SettingsError
from lg_husky_sim.testing.live import LiveHusky, Probe
import pytest


def test_a_node_that_does_not_come_up_in_time_is_ended(probe: Probe) -> None:
    """It would go on publishing into every test that comes after."""
    husky = LiveHusky(probe)
    with pytest.raises(SettingsError, match='the node does not come up'):
        husky.ready([], timeout=0.2)
    assert husky.node.process.poll() is not None
