# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What another participant may ask of a node without ending it."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

from lg_husky_sim.ros import api
from lg_husky_sim.testing.live import LiveHusky, Probe
import pytest


class _Mute:
    """Stands for a node whose warnings are kept."""

    def __init__(self) -> None:
        self.said: list[str] = []

    def get_logger(self) -> _Mute:
        """Return itself."""
        return self

    def warning(self, text: str, **words: object) -> None:
        """Keep a line."""
        self.said.append(text)


def test_what_services_of_parameters_raise_ends_no_node(monkeypatch: pytest.MonkeyPatch) -> None:
    """All else is raised."""
    space: dict[str, Any] = {'__name__': 'rclpy.parameter_service'}
    exec("def answer():\n raise ValueError('255 is not a valid Parameter.Type')", space)
    turns = iter([space['answer'], space['answer'], lambda: None, {}.popitem])
    node: Any = _Mute()
    monkeypatch.setattr(api, 'spin', lambda node: next(turns)())
    api.keep_spinning(node)
    assert node.said == ['request of a parameter refused: 255 is not a valid Parameter.Type'] * 2
    with pytest.raises(KeyError):
        api.keep_spinning(node)


@pytest.mark.skipif(not api.HAVE_RCLPY, reason='the embedded backend has no service clients; '
                    'its own services have a test of their own')
def test_a_parameter_of_an_unknown_type_ends_no_node_of_rclpy(
        probe: Probe, start: Callable[..., LiveHusky]) -> None:
    """It ended with a traceback of rclpy's parameter service."""
    truth = probe.listen('nav_msgs/msg/Odometry', '/ground_truth')
    husky = start()
    husky.ready(truth)
    messages, services = (import_module(f'rcl_interfaces.{name}') for name in ('msg', 'srv'))
    real: Any = probe.node
    client = real.create_client(services.SetParameters, '/sim_node/set_parameters')
    assert probe.until(client.service_is_ready)
    client.call_async(services.SetParameters.Request(parameters=[messages.Parameter(
        name='speed', value=messages.ParameterValue(type=255))]))
    assert probe.until(lambda: 'is not a valid' in husky.node.log())
    truth.clear()
    assert probe.until(lambda: len(truth) > 20)
    assert husky.node.stop() == 0
