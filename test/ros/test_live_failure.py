# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A node that is waited for in vain leaves nothing behind; a type that is missing is named."""

from __future__ import annotations

from lg_husky_sim.errors import MissingExtraError, SettingsError
from lg_husky_sim.testing.live import isolated_domain, LiveHusky, Probe
import pytest


def test_a_node_that_does_not_come_up_in_time_is_ended(probe: Probe) -> None:
    """It would go on publishing into every test that comes after."""
    husky = LiveHusky(probe)
    with pytest.raises(SettingsError, match='the node did not start'):
        husky.ready([], timeout=0.2)
    assert husky.node.process.poll() is not None


def test_a_message_whose_package_is_missing_is_named(
        probe: Probe, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not rclpy's remark about ROS 1 at a class that is None."""
    monkeypatch.setattr('lg_husky_sim.ros.api.message_type', lambda name: None)
    wanted = '^/tf: message package tf2_msgs is needed for tf2_msgs/msg/TFMessage and is not'
    with pytest.raises(MissingExtraError, match=wanted):
        probe.listen('tf2_msgs/msg/TFMessage', '/tf')
    with pytest.raises(MissingExtraError, match=wanted):
        probe.talk('tf2_msgs/msg/TFMessage', '/tf')


def test_the_domain_of_the_user_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Row 58: a robot may be in the domain of the shell from which tests are run."""
    with isolated_domain() as free:
        pass
    monkeypatch.setenv('ROS_DOMAIN_ID', str(free))
    with isolated_domain() as other:
        assert other != free
