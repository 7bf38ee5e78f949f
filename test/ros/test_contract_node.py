# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Nodes in the test's own process: clock jumps, missing packages, several robots in one."""

from __future__ import annotations

from collections.abc import Iterator
import itertools
import time
from typing import Any

from lg_husky_sim.ros import api, diagnostics, outputs
from lg_husky_sim.ros.simulation_node import SimNode
from lg_husky_sim.signals import BodyTwist
from lg_husky_sim.testing.live import Probe
import pytest

SECOND = 10**9


def stamp(message: Any) -> int:
    """Return the header's stamp [ns]."""
    return int(message.header.stamp.sec) * SECOND + int(message.header.stamp.nanosec)


class JumpingClock:
    """The system clock with an offset that a test can change."""

    def __init__(self) -> None:
        """Start without an offset."""
        self.offset = 0

    def now(self) -> Any:
        """Return the shifted time."""
        return api.Time(nanoseconds=time.time_ns() + self.offset)


@pytest.fixture
def made(probe: Probe) -> Iterator[list[SimNode]]:
    """Collect nodes that are to end with the test; the probe's executor serves them."""
    nodes: list[SimNode] = []
    yield nodes
    for node in nodes:
        probe._executor.remove_node(node)
        node.destroy_node()


def add(probe: Probe, nodes: list[SimNode], name: str, namespace: str = '') -> SimNode:
    """Make a node that the probe serves."""
    node = SimNode(name, namespace=namespace)
    nodes.append(node)
    probe._executor.add_node(node)
    return node


@pytest.mark.parametrize('jump', [-3600, 3600])
def test_a_clock_jump_moves_the_stamps_and_nothing_else(
        probe: Probe, made: list[SimNode], jump: int) -> None:
    """The system clock jumps an hour either way: stamps follow, no step is lost or invented."""
    truth = probe.listen('nav_msgs/msg/Odometry', '/jump/ground_truth', 500)
    node = add(probe, made, f'jump_{"back" if jump < 0 else "ahead"}', '/jump')
    clock = JumpingClock()
    node.get_clock = lambda: clock  # type: ignore[assignment, method-assign, return-value]
    assert probe.until(lambda: len(truth) > 10)
    begun, done = time.monotonic(), node.engine.total
    node.engine.command(BodyTwist(0.5, 0.0))
    clock.offset = jump * SECOND
    probe.spin(0.5)
    steps = node.engine.total - done
    assert steps == pytest.approx((time.monotonic() - begun) * 50.0, abs=2)
    assert abs(stamp(truth[-1]) - clock.now().nanoseconds) < SECOND // 5
    gaps = [stamp(b) - stamp(a) for a, b in itertools.pairwise(truth)]
    # The first message stands for the initial state, a little before the clockwork starts.
    assert sum(1 for gap in gaps[1:] if abs(gap - 20_000_000) > 1) == 1
    xs = [m.pose.pose.position.x for m in truth]
    assert max(abs(b - a) for a, b in itertools.pairwise(xs)) < 0.011


def test_several_robots_in_one_process(probe: Probe, made: list[SimNode]) -> None:
    """T8: two nodes of one process live in their namespaces and keep their own rates."""
    left = probe.listen('nav_msgs/msg/Odometry', '/left/ground_truth', 500)
    right = probe.listen('nav_msgs/msg/Odometry', '/right/ground_truth', 500)
    one, two = add(probe, made, 'sim', '/left'), add(probe, made, 'sim', '/right')
    one.engine.command(BodyTwist(0.5, 0.0))
    probe.spin(0.8)
    assert left[-1].pose.pose.position.x > 0.05
    assert right[-1].pose.pose.position.x == 0.0
    assert abs(one.engine.total - two.engine.total) < 60
    assert min(len(left), len(right)) > 30
    two.engine.configure(two.settings)
    assert one.engine.state is not two.engine.state


def test_missing_message_packages_take_only_their_feature(
        probe: Probe, made: list[SimNode], monkeypatch: pytest.MonkeyPatch) -> None:
    """T16: without tf2_msgs and diagnostic_msgs the node runs, and a warning names each."""
    found = api.message_type

    def without(name: str) -> Any:
        return None if name.startswith(('tf2_msgs', 'diagnostic_msgs')) else found(name)

    monkeypatch.setattr(outputs, 'message_type', without)
    monkeypatch.setattr(diagnostics, 'message_type', without)
    log = probe.listen('rcl_interfaces/msg/Log', '/rosout', 100)
    truth = probe.listen('nav_msgs/msg/Odometry', '/poor/ground_truth', 500)
    add(probe, made, 'poor', '/poor')
    assert probe.until(lambda: len(truth) > 70)
    texts = [m.msg for m in log]
    assert any('message package tf2_msgs is missing' in text for text in texts)
    assert any('message package diagnostic_msgs is missing' in text for text in texts)


def test_a_parameter_can_change_by_the_api_and_is_checked(
        probe: Probe, made: list[SimNode]) -> None:
    """T17: live parameters apply at once; others and bad values are refused with the range."""
    node = add(probe, made, 'tuned', '/tuned')

    def outcome(name: str, value: object) -> str:
        kind = type(value)
        types = {float: api.ParameterType.DOUBLE, str: api.ParameterType.STRING}
        parameter: Any = api.Parameter
        made_one = parameter(name, types[kind], value)
        return str(node.set_parameters([made_one])[0].reason)

    assert outcome('command_timeout', 1.5) == ''
    assert node.engine.settings.command_timeout == 1.5
    assert '3600' in outcome('command_timeout', 1e6)
    assert 'read-only' in outcome('rate', 10.0)
    assert 'cannot be used' in outcome('model', '/no/file.yaml')
    assert node.settings.model == ''
    assert node.engine.settings.command_timeout == 1.5
