# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The demo with a node that does not come up."""

from __future__ import annotations

from pathlib import Path

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.manoeuvres import Manoeuvre, Step
from lg_husky_sim.ros import api, demo
from lg_husky_sim.ros.settings import make_settings
from lg_husky_sim.testing.live import isolated_domain
import pytest


def test_a_node_that_dies_ends_the_demo_with_an_error(tmp_path: Path) -> None:
    """It is reported, no bag is left, and the graph is left as well."""
    short = Manoeuvre('short', (Step(0.2, 0.0, 0.0),))
    with isolated_domain(), pytest.raises(RecordingError, match='no odometry from sim_node'):
        demo.run_demo(short, tmp_path / 'bag', make_settings(), model='/no/model.yaml')
    assert list(tmp_path.iterdir()) == []
    assert not api.ok()


def test_isolation_respects_the_users_choice() -> None:
    """A domain or range that is set stays; otherwise a private one on this machine is taken."""
    chosen = {'ROS_DOMAIN_ID': '3', 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET'}
    demo.isolate(chosen, 50)
    assert chosen == {'ROS_DOMAIN_ID': '3', 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET'}
    free: dict[str, str] = {}
    demo.isolate(free, 50)
    assert free == {'ROS_DOMAIN_ID': '50', 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}
