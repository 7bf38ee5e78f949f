# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""T11: std_srvs and simulation_interfaces, where the backend carries services."""

from __future__ import annotations

from collections.abc import Callable
import importlib
from importlib.util import find_spec
import time
from typing import Any

from lg_husky_sim.ros import api
from lg_husky_sim.ros.standard_control import FEATURES, service_name, SERVICES
from lg_husky_sim.testing.live import LiveHusky, Probe
import pytest

Start = Callable[..., LiveHusky]


class Caller:
    """Calls services from the probe; rclpy only."""

    def __init__(self, probe: Probe) -> None:
        """Keep the probe."""
        self.probe = probe
        self.clients: dict[str, Any] = {}

    def __call__(self, kind: str, name: str, **fields: object) -> Any:
        """Call a service and return its response."""
        package, middle, word = kind.split('/')
        cls = getattr(importlib.import_module(f'{package}.{middle}'), word)
        node: Any = self.probe.node
        client = self.clients.setdefault(name, None) or node.create_client(cls, name)
        self.clients[name] = client
        assert client.wait_for_service(timeout_sec=20.0), name
        request = cls.Request()
        for field, value in fields.items():
            setattr(request, field, value)
        future = client.call_async(request)
        assert self.probe.until(future.done, 10.0), name
        return future.result()


def test_service_names_follow_their_types() -> None:
    """Names are the types' in the usual spelling, and the feature list holds no repetition."""
    assert service_name('GetSimulatorFeatures') == 'get_simulator_features'
    assert [service_name(kind) for kind in SERVICES][4] == 'step_simulation'
    assert len(set(FEATURES)) == len(FEATURES)


@pytest.mark.skipif(not api.HAVE_RCLPY, reason='the embedded subset has no service clients')
def test_std_srvs(probe: Probe, start: Start) -> None:
    """Pause, step and reset as services, with truthful answers."""
    call = Caller(probe)
    truth = probe.listen('nav_msgs/msg/Odometry', '/ground_truth')
    husky = start()
    husky.ready(truth)
    assert not call('std_srvs/srv/Trigger', '/sim_node/step').success
    assert call('std_srvs/srv/SetBool', '/sim_node/pause', data=True).message == 'paused'
    probe.spin(0.1)
    truth.clear()
    assert call('std_srvs/srv/Trigger', '/sim_node/step').success
    assert probe.until(lambda: len(truth) == 1)
    assert call('std_srvs/srv/Trigger', '/sim_node/reset').success
    assert call('std_srvs/srv/Trigger', '/sim_node/reset_time').success
    assert call('std_srvs/srv/SetBool', '/sim_node/pause', data=False).message == 'running'
    assert husky.node.stop() == 0


@pytest.mark.skipif(not api.HAVE_RCLPY or find_spec('simulation_interfaces') is None,
                    reason='simulation_interfaces is not installed')
def test_simulation_interfaces(probe: Probe, start: Start) -> None:
    """Features first and truthful; states, steps, scopes and entities with standard codes."""
    call = Caller(probe)
    package = 'simulation_interfaces/srv'
    truth = probe.listen('nav_msgs/msg/Odometry', '/ground_truth')
    clock = probe.listen('rosgraph_msgs/msg/Clock', '/clock')
    husky = start(publish_clock=True, initial_x=2.0)
    husky.ready(truth)
    features = call(f'{package}/GetSimulatorFeatures', 'get_simulator_features').features
    assert list(features.features) == [10, 11, 20, 21, 22, 24, 25, 26, 31, 32]

    def state() -> int:
        return int(call(f'{package}/GetSimulationState', 'get_simulation_state').state.state)

    def change(wanted: int) -> int:
        value = api.message_type('simulation_interfaces/msg/SimulationState')(state=wanted)
        answer = call(f'{package}/SetSimulationState', 'set_simulation_state', state=value)
        return int(answer.result.result)

    def step(count: int) -> int:
        answer = call(f'{package}/StepSimulation', 'step_simulation', steps=count)
        return int(answer.result.result)

    def reset(scope: int) -> int:
        answer = call(f'{package}/ResetSimulation', 'reset_simulation', scope=scope)
        return int(answer.result.result)

    assert (state(), step(1), change(1), change(9)) == (1, 3, 101, 0)
    assert (change(2), state()) == (1, 2)
    probe.spin(0.1)
    truth.clear()
    assert (step(5), step(0)) == (1, 4)
    assert probe.until(lambda: len(truth) == 5)

    def now() -> int:
        told = call(f'{package}/GetEntityState', 'get_entity_state', entity='husky').state
        return int(told.header.stamp.sec * 10**9 + told.header.stamp.nanosec)

    begun = now()
    # Far longer than a bunch of 20 ms: others are served meanwhile, the node's own timer too.
    assert (step(1000), now() - begun, state()) == (1, 20 * 10**9, 2)
    assert call(f'{package}/GetEntities', 'get_entities').entities == ['husky']
    unknown = call(f'{package}/GetEntityState', 'get_entity_state', entity='dog')
    assert unknown.result.result == 2
    entity = api.message_type('simulation_interfaces/msg/EntityState')()
    entity.pose.position.x, entity.pose.orientation.w = 7.0, 1.0
    entity.twist.linear.x = 0.25
    put = call(f'{package}/SetEntityState', 'set_entity_state', entity='husky', state=entity)
    assert put.result.result == 1
    told = call(f'{package}/GetEntityState', 'get_entity_state', entity='husky').state
    assert (told.pose.position.x, told.header.frame_id) == (7.0, 'odom')
    assert told.twist.linear.x == pytest.approx(0.25)
    entity.pose.position.x = float('nan')
    put = call(f'{package}/SetEntityState', 'set_entity_state', entity='husky', state=entity)
    assert put.result.result == 101
    assert reset(1) == 1
    clock.clear()
    assert step(1) == 1
    assert probe.until(lambda: bool(clock))
    assert clock[-1].clock.nanosec == 20_000_000
    # /clock comes first, and the thousand steps may wait to be heard.
    assert probe.until(lambda: truth[-1].pose.pose.position.x > 7.0)
    assert (reset(4), reset(2), reset(0)) == (0, 1, 1)
    told = call(f'{package}/GetEntityState', 'get_entity_state', entity='husky').state
    assert told.pose.position.x == 2.0
    assert (change(0), state(), change(1), state()) == (1, 0, 1, 1)
    assert change(3) == 1
    end = time.monotonic() + 10.0
    while husky.node.process.poll() is None and time.monotonic() < end:
        probe.spin(0.1)
    assert husky.node.process.poll() == 0
