# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Nodes in the test's own process: clock jumps, missing packages, several robots in one."""

from __future__ import annotations

from collections.abc import Iterator
import itertools
from pathlib import Path
import time
from typing import Any

from lg_husky_sim import Husky
from lg_husky_sim.ros import api, diagnostics, neighbours, outputs
from lg_husky_sim.ros.settings import make_settings
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


def add(probe: Probe, nodes: list[SimNode], name: str, namespace: str = '', **values: Any
        ) -> SimNode:
    """Make a node that the probe serves, with parameters of its own."""
    overrides = [api.parameter(key, value) for key, value in values.items()]
    node = SimNode(name, namespace=namespace, parameter_overrides=overrides)
    nodes.append(node)
    probe._executor.add_node(node)
    return node


@pytest.mark.parametrize('jump', [-3600, 3600])
def test_a_clock_jump_moves_the_stamps_ahead_only_and_nothing_else(
        probe: Probe, made: list[SimNode], jump: int) -> None:
    """Rows 35, 52: stamps follow a jump ahead, never run back, and no step is lost or invented."""
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
    followed = clock.now().nanoseconds - min(0, jump) * SECOND
    assert abs(stamp(truth[-1]) - followed) < SECOND // 5
    gaps = [stamp(b) - stamp(a) for a, b in itertools.pairwise(truth)]
    # The first message stands for the initial state, a little before the clockwork starts.
    assert min(gaps) >= 0
    assert sum(1 for gap in gaps[1:] if abs(gap - 20_000_000) > 1) == (jump > 0)
    xs = [m.pose.pose.position.x for m in truth]
    assert max(abs(b - a) for a, b in itertools.pairwise(xs)) < 0.011


def test_stamps_go_on_after_steps_while_paused(probe: Probe, made: list[SimNode]) -> None:
    """Row 35: pause, 500 steps, resume: −9.5 s before."""
    truth = probe.listen('nav_msgs/msg/Odometry', '/on/ground_truth', 5000)
    node = add(probe, made, 'on', '/on')
    assert probe.until(lambda: len(truth) > 5)
    node.pause(True)
    done = node.engine.total
    node.advance(500)
    assert probe.until(lambda: node.engine.total == done + 500)
    node.pause(False)
    assert probe.until(lambda: node.engine.total > done + 510)
    # Not held until the clock has come as far, either.
    probe.spin(0.1)
    held = [stamp(b) - stamp(a) for a, b in itertools.pairwise(truth[-6:])]
    assert held == [pytest.approx(20_000_000, abs=1)] * 5
    node.change(speed=0.0)
    probe.spin(0.1)
    node.change(speed=1.0)
    probe.spin(0.3)
    gaps = [stamp(b) - stamp(a) for a, b in itertools.pairwise(truth)]
    assert min(gaps) >= 0


def test_a_long_request_of_steps_can_be_interrupted(probe: Probe, made: list[SimNode]) -> None:
    """Row 35: a million steps blocked the node, its topics and Ctrl-C for minutes."""
    node = add(probe, made, 'long', '/long')
    pause, boolean = probe.talk('std_msgs/msg/Bool', '/long/long/pause')
    assert probe.until(lambda: pause.get_subscription_count() > 0)
    node.pause(True)
    told: list[bool] = []
    before = time.monotonic()
    node.advance(1_000_000, told.append)
    probe.spin(0.3)
    assert node.engine.total > 20
    assert told == []
    pause.publish(boolean(data=True))
    assert probe.until(lambda: told == [False])
    done = node.engine.total
    probe.spin(0.1)
    assert node.engine.total == done
    assert time.monotonic() - before < 10.0
    node.advance(3, told.append)
    assert (node.engine.total, told) == (done + 3, [False, True])


def test_time_of_ones_own_and_of_somebody_else(
        probe: Probe, made: list[SimNode]) -> None:
    """Row 51: use_sim_time with publish_clock runs; without it, the steps follow /clock."""
    own = probe.listen('rosgraph_msgs/msg/Clock', '/clock', 500)
    node = add(probe, made, 'authority', '/authority', publish_clock=True, use_sim_time=True)
    assert probe.until(lambda: len(own) > 30)
    node.pause(True)
    probe.spin(0.2)
    own.clear()
    # Row 58: who joins while the clock stands gets its time as well.
    assert probe.until(lambda: len(own) > 2, 3.0)
    truth = probe.listen('nav_msgs/msg/Odometry', '/follower/ground_truth', 500)
    other = add(probe, made, 'follower', '/follower', use_sim_time=True)
    probe.spin(0.3)
    assert other.engine.total < 3
    node.pause(False)
    assert probe.until(lambda: other.engine.total > 20)
    assert abs(stamp(truth[-1]) - node.engine.reading.time * 1e9) < 0.3e9


def test_another_publisher_is_named_once(probe: Probe, made: list[SimNode]) -> None:
    """Row 21: a second sim or the real robot on one's topics; and the log says in and out."""
    log = probe.listen('rcl_interfaces/msg/Log', '/rosout', 500)
    probe.talk('nav_msgs/msg/Odometry', '/crowd/husky_velocity_controller/odom')
    add(probe, made, 'crowd', '/crowd')

    def said(text: str) -> list[str]:
        return [m.msg for m in log if text in m.msg and m.name == 'crowd.crowd']
    assert probe.until(lambda: said('/probe publishes'), 10.0)
    probe.spin(2.2)
    assert said('publishes') == ['/probe publishes /crowd/husky_velocity_controller/odom as well: '
                                 'subscribers receive both']
    assert said('in: ') == ['in: /crowd/husky_velocity_controller/cmd_vel (Twist), '
                            '/crowd/initialpose']
    # common_interfaces has no tf2_msgs; what is not there is not announced.
    tf = ', /crowd/tf' if api.message_type('tf2_msgs/msg/TFMessage') else ''
    assert said('out: ')[0].endswith(
        f'/crowd/joint_states, /crowd/imu_um7/data, /crowd/battery_state{tf}, /crowd/diagnostics')


def test_parameters_of_others_are_left_alone(probe: Probe, made: list[SimNode]) -> None:
    """Row 57: what a whole launch is given ends no node; a typo is hinted at."""
    log = probe.listen('rcl_interfaces/msg/Log', '/rosout', 500)
    node = add(probe, made, 'guest', '/guest', robot_description='<robot/>', spede=2.0,
               **{'qos_overrides./tf.publisher.depth': 3})
    assert node.settings.speed == 1.0
    assert probe.until(lambda: any(m.msg.startswith('parameter spede') for m in log))
    texts = [m.msg for m in log]
    assert 'parameter spede is unknown; did you mean speed?; it is ignored' in texts
    assert any(text.startswith('qos_overrides have no effect') for text in texts)


def test_a_guest_does_not_end_its_hosts_process(probe: Probe, made: list[SimNode]) -> None:
    """Row 58: the service that quits a simulator shut down the whole process's context."""
    node = add(probe, made, 'visitor', '/visitor')
    assert node.end() is False
    probe.spin(0.3)
    assert api.ok()


def test_several_robots_in_one_process(probe: Probe, made: list[SimNode]) -> None:
    """T8: two nodes of one process live in their namespaces and keep their own rates."""
    left = probe.listen('nav_msgs/msg/Odometry', '/left/ground_truth', 500)
    right = probe.listen('nav_msgs/msg/Odometry', '/right/ground_truth', 500)
    # Row 55: two robots published one odom to base_link on one /tf.
    kind = 'tf2_msgs/msg/TFMessage'
    frames = {topic: probe.listen(kind, topic) for topic in ('/left/tf', '/right/tf', '/tf')
              if api.message_type(kind)}
    one, two = add(probe, made, 'sim', '/left'), add(probe, made, 'sim', '/right')
    one.engine.command(BodyTwist(0.5, 0.0))
    assert probe.until(lambda: min(len(left), len(right)) > 30)
    assert [bool(heard) for heard in frames.values()] == [True, True, False][:len(frames)]
    assert left[-1].pose.pose.position.x > 0.05
    assert right[-1].pose.pose.position.x == 0.0
    assert abs(one.engine.total - two.engine.total) < 60
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


def test_what_a_topic_sets_is_the_parameter(
        probe: Probe, made: list[SimNode], tmp_path: Path) -> None:
    """`ros2 param get /sim_node speed` said 1.0 of a node at twice the speed."""
    node = add(probe, made, 'topical', '/topical')
    path = tmp_path / 'uneven.yaml'
    Husky().replacing(side_gain_ratio=1.04).save(str(path))
    speed, number = probe.talk('std_msgs/msg/Float64', '/topical/topical/speed')
    model, text = probe.talk('std_msgs/msg/String', '/topical/topical/load_model')
    assert probe.until(lambda: min(
        one.get_subscription_count() for one in (speed, model)) > 0)
    speed.publish(number(data=2.0))
    model.publish(text(data=str(path)))
    assert probe.until(lambda: node.get_parameter('model').value == str(path))
    assert node.get_parameter('speed').value == node.settings.speed == 2.0
    assert node.settings.model == str(path)
    speed.publish(number(data=-1.0))
    model.publish(text(data='/no/file.yaml'))
    probe.spin(0.5)
    assert (node.get_parameter('speed').value, node.get_parameter('model').value) == (
        2.0, str(path))
    assert (node.settings.speed, node.settings.model) == (2.0, str(path))


def test_what_cannot_be_published_is_not_announced(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without tf2_msgs, which is not in common_interfaces, the start-up log lists no tf."""
    settings = make_settings({'scan': 'free', 'publish_scan_tf': True})
    monkeypatch.setattr(neighbours, 'message_type', lambda name: object)
    assert neighbours.shared(settings) == ('tf', 'tf_static')
    monkeypatch.setattr(neighbours, 'message_type', lambda name: None)
    assert neighbours.shared(settings) == ()
