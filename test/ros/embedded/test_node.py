# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The subset's node on real DDS: topics, timers, parameters, services, graph, shutdown."""

from __future__ import annotations

from collections.abc import Iterator
import gc
import struct
import threading
import time
from typing import Any

from cyclonedds.builtin import BuiltinDataReader
from cyclonedds.core import Policy, Qos
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from lg_husky_sim.ros.embedded.clock import Duration, Time
from lg_husky_sim.ros.embedded.context import (
    default_context,
    ExternalShutdownException,
    init,
    ok,
    shutdown,
    try_shutdown,
)
from lg_husky_sim.ros.embedded.messages import deserialise, message_class, serialise
from lg_husky_sim.ros.embedded.node import Node
from lg_husky_sim.ros.embedded.parameters import (
    Parameter,
    parameter_type,
    ParameterException,
    ParameterStore,
)
from lg_husky_sim.ros.embedded.qos import DurabilityPolicy, QoSProfile
from lg_husky_sim.ros.embedded.spin import SingleThreadedExecutor, spin, spin_once
from lg_husky_sim.testing.live import isolated_domain
import pytest

STRING = message_class('std_msgs/msg/String')
RESULT = message_class('rcl_interfaces/msg/SetParametersResult')


@pytest.fixture
def graph() -> Iterator[None]:
    """Join a private domain."""
    with isolated_domain():
        init(args=[])
        yield
        try_shutdown()


def spin_for(executor: SingleThreadedExecutor, seconds: float) -> None:
    """Serve for some time."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        executor.spin_once(timeout_sec=0.02)


def test_messages_go_from_node_to_node(graph: None) -> None:
    """Two nodes of a process; latched samples reach a late reader."""
    talker, listener = Node('talker'), Node('listener', namespace='/deep/er')
    latched = QoSProfile(depth=2, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    publisher = talker.create_publisher(STRING, '/words', latched)
    for word in ('one', 'two', 'three'):
        publisher.publish(STRING(data=word))
    got: list[str] = []
    listener.create_subscription(STRING, '/words', lambda m: got.append(m.data), latched)
    executor = SingleThreadedExecutor()
    executor.add_node(talker)
    executor.add_node(listener)
    spin_for(executor, 0.3)
    assert got == ['two', 'three']
    assert publisher.get_subscription_count() == 1
    with pytest.raises(TypeError, match='takes std_msgs/msg/String, not Bool'):
        publisher.publish(message_class('std_msgs/msg/Bool')())
    assert listener.get_fully_qualified_name() == '/deep/er/listener'


def test_the_graph_is_announced(graph: None) -> None:
    """ros_discovery_info tells nodes and endpoints, and forgets a node that leaves."""
    kind = 'rmw_dds_common/msg/ParticipantEntitiesInfo'
    context = default_context()
    reader = DataReader(context.participant, context.topic('ros_discovery_info', kind), Qos(
        Policy.Durability.TransientLocal, Policy.Reliability.Reliable(0),
        Policy.History.KeepLast(1)))

    def announced() -> Any:
        time.sleep(0.05)
        return deserialise(reader.read(1)[-1].raw, kind)

    node = Node('one', namespace='/ns')
    publisher = node.create_publisher(STRING, 'words', 1)
    entry = announced().node_entities_info_seq[0]
    assert (entry.node_namespace, entry.node_name) == ('/ns', 'one')
    assert publisher.writer.guid.bytes in [bytes(g.data) for g in entry.writer_gid_seq]
    assert bytes(announced().gid.data) == context.participant.guid.bytes
    node.destroy_node()
    assert announced().node_entities_info_seq == []


def test_a_look_reads_only_what_is_new(graph: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """To read all ends for each topic took 0.2 s with 100 publishers: messages came in bursts."""
    node, other = Node('looker'), Node('talker')
    read = list[Any]()

    def counting(real: Any) -> Any:
        def found(*words: Any) -> Any:
            samples = real(*words)
            read.extend(samples)
            return samples
        return found
    for name in ('read', 'take'):
        monkeypatch.setattr(BuiltinDataReader, name, counting(getattr(BuiltinDataReader, name)))

    def owners() -> list[str]:
        return [one.node_name for one in node.get_publishers_info_by_topic('/words')]

    publisher = other.create_publisher(STRING, '/words', 1)
    assert owners() == ['talker']
    read.clear()
    for _ in range(3):
        assert owners() == ['talker']
        assert ('/words', ['std_msgs/msg/String']) in node.get_topic_names_and_types()
    # The first look of all that asked for subscriptions was that of the topics.
    assert not [one for one in read if one.topic_name == 'rt/words']
    read.clear()
    second = node.create_publisher(STRING, '/words', 1)
    assert sorted(owners()) == ['looker', 'talker']
    other.destroy_publisher(publisher)
    del publisher
    gc.collect()
    assert owners() == ['looker']
    assert second.topic_name == '/words'
    assert len(read) == 2
    assert '/words' in dict(node.get_topic_names_and_types())


@pytest.mark.realtime
def test_timers_keep_their_period_on_average(graph: None) -> None:
    """A timer neither drifts nor makes up missed calls in a burst."""
    node = Node('timed')
    moments: list[float] = []
    timer = node.create_timer(0.01, lambda: moments.append(time.monotonic()))
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    spin_for(executor, 0.5)
    assert 40 <= len(moments) <= 51
    time.sleep(0.2)
    before = len(moments)
    executor.spin_once(timeout_sec=0.0)
    executor.spin_once(timeout_sec=0.0)
    assert len(moments) - before <= 2
    timer.cancel()
    count = len(moments)
    spin_for(executor, 0.05)
    assert len(moments) == count
    assert timer.is_canceled()


def test_parameters_are_typed_ranged_and_watched(graph: None) -> None:
    """Declaration, range, type, read-only, callbacks before and after."""
    node = Node('watched')
    limits = message_class('rcl_interfaces/msg/FloatingPointRange')(
        from_value=0.0, to_value=2.0)
    descriptor = message_class('rcl_interfaces/msg/ParameterDescriptor')(
        description='d', floating_point_range=[limits])
    node.declare_parameter('gain', 1.0, descriptor)
    fixed = message_class('rcl_interfaces/msg/ParameterDescriptor')(read_only=True)
    node.declare_parameter('fixed', 'a', fixed)
    after: list[Any] = []
    node.add_on_set_parameters_callback(
        lambda ps: RESULT(successful=all(p.value != 1.5 for p in ps), reason='not 1.5'))
    node.add_post_set_parameters_callback(lambda ps: after.extend(p.value for p in ps))

    def outcome(name: str, value: object) -> str:
        return str(node.set_parameters([Parameter.of(name, value)])[0].reason)

    assert outcome('gain', 0.5) == ''
    assert outcome('gain', 3.0) == 'Parameter gain = 3.0 is out of its range [0.0, 2.0]'
    assert outcome('gain', 'x') == "Parameter gain = 'x' is STRING, not DOUBLE"
    assert outcome('gain', 1.5) == 'not 1.5'
    assert outcome('fixed', 'b') == 'Parameter fixed is read-only'
    assert outcome('none', 1) == 'Parameter none is not declared'
    assert after == [0.5]
    assert node.get_parameter('gain').value == 0.5
    assert node.describe_parameter('gain').description == 'd'
    with pytest.raises(ParameterException, match="'gain' is declared already"):
        node.declare_parameter('gain', 2.0)
    with pytest.raises(TypeError, match='is no parameter value'):
        parameter_type([1, 'a'])


def test_services_answer_with_the_request_identity(
        graph: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """As rmw_cyclonedds: 16 bytes of identity before request and reply come back unchanged."""
    monkeypatch.setenv('RMW_IMPLEMENTATION', 'rmw_cyclonedds_cpp')
    node = Node('server')

    def answer(request: Any, response: Any) -> Any:
        response.success, response.message = bool(request.data), 'done'
        return response

    node.create_service('std_srvs/srv/SetBool', '~/switch', answer)
    context = default_context()
    kind = 'std_srvs/srv/SetBool'
    qos = Qos(Policy.Reliability.Reliable(0), Policy.History.KeepLast(10),
              Policy.DataRepresentation(use_cdrv0_representation=True))
    writer = DataWriter(context.participant, context.topic(
        'rq/server/switchRequest', f'{kind}_Request', header=True), qos)
    reader = DataReader(context.participant, context.topic(
        'rr/server/switchReply', f'{kind}_Response', header=True), qos)
    identity = struct.pack('<Qq', 0x1122334455667788, 42)
    request = serialise(message_class(f'{kind}_Request')(data=True))
    writer.write(writer.data_type(request[:4] + identity + request[4:]))
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    spin_for(executor, 0.2)
    (reply,) = reader.take(5)
    assert reply.raw[4:20] == identity
    response: Any = deserialise(reply.raw[:4] + reply.raw[20:], f'{kind}_Response')
    assert (response.success, response.message) == (True, 'done')
    assert '/server/get_parameters' in [s.srv_name for s in node._services]


def test_without_cyclone_peers_there_are_no_services(
        graph: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a Fast DDS graph a service would match and hang its caller: none is offered."""
    monkeypatch.delenv('RMW_IMPLEMENTATION', raising=False)
    assert Node('quiet')._services == []


def test_simulated_time_follows_the_clock_topic(graph: None) -> None:
    """use_sim_time takes /clock, forwards and backwards."""
    node = Node('dreamer')
    publisher = node.create_publisher(message_class('rosgraph_msgs/msg/Clock'), '/clock', 1)
    assert abs(node.get_clock().now().nanoseconds - time.time_ns()) < 10**9
    assert node.set_parameters([Parameter.of('use_sim_time', True)])[0].successful
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    clock: Any = message_class('rosgraph_msgs/msg/Clock')()
    for second in (100, 50):
        clock.clock.sec = second
        publisher.publish(clock)
        spin_for(executor, 0.1)
        assert node.get_clock().now() == Time(seconds=second)


def test_a_node_that_takes_the_place_of_another_is_heard(graph: None) -> None:
    """Row 38: without timers, one that has as many ends as the other had was not waited for."""
    talker = Node('talker')
    executor = SingleThreadedExecutor()
    nodes, heard = [Node('first'), Node('second')], list[str]()
    for node in nodes:
        # A topic of its own: what also reaches the first would end the wait.
        topic = f'{node.get_fully_qualified_name()}/text'
        publisher = talker.create_publisher(STRING, topic, 10)
        node.create_subscription(STRING, topic, lambda one: heard.append(one.data), 10)
        executor.add_node(node)
        spin_for(executor, 0.3)
        # While it waits: what is there already is found by a first look.
        later = threading.Timer(0.3, publisher.publish, [STRING(data=topic)])
        later.start()
        executor.spin_once(timeout_sec=5.0)
        later.join()
        executor.remove_node(node)
    assert heard == ['/first/text', '/second/text']


@pytest.mark.realtime
def test_shutdown_ends_spinning(graph: None) -> None:
    """Spinning stops with ExternalShutdownException when the context goes."""
    node = Node('spinner')
    node.create_timer(0.05, lambda: default_context().stop())
    begun = time.monotonic()
    with pytest.raises(ExternalShutdownException):
        spin(node)
    assert time.monotonic() - begun < 2.0
    assert not ok()
    with pytest.raises(ExternalShutdownException):
        spin_once(node)


def test_init_and_shutdown_pair_up() -> None:
    """Twice the one or the other is an error of the programmer."""
    with isolated_domain():
        init(args=[])
        with pytest.raises(RuntimeError, match='called before'):
            init(args=[])
        shutdown()
        with pytest.raises(RuntimeError, match='has not been called'):
            shutdown()
        with pytest.raises(RuntimeError, match='has not been called'):
            Node('late')


def test_a_reader_survives_the_death_of_a_writer(graph: None) -> None:
    """The sample that tells of a writer's end carries no data and is passed over."""
    listener = Node('listener')
    got: list[Any] = []
    listener.create_subscription(STRING, '/words', got.append, 10)
    executor = SingleThreadedExecutor()
    executor.add_node(listener)
    for word in ('a', 'b'):
        talker = Node('talker')
        publisher = talker.create_publisher(STRING, '/words', 10)
        publisher.publish(STRING(data=word))
        spin_for(executor, 0.05)
        talker.destroy_node()
        del talker, publisher
        spin_for(executor, 0.05)
    assert [m.data for m in got] == ['a', 'b']


def test_time_arithmetic() -> None:
    """Moments and spans add and subtract in whole nanoseconds."""
    moment = Time(seconds=1, nanoseconds=5)
    assert moment + Duration(seconds=0.5) == Time(nanoseconds=1_500_000_005)
    assert (moment - Time(nanoseconds=5)).nanoseconds == 10**9
    assert Time.from_msg(moment.to_msg()) == moment
    assert Duration(nanoseconds=-1).to_msg().nanosec == 999_999_999


def test_a_parameter_takes_its_type_from_its_value() -> None:
    """As rclpy's; a user's own process ended with a TypeError without ROS 2."""
    assert Parameter('preset', value='paper') == Parameter.of('preset', 'paper')
    assert Parameter('empty').type_ == Parameter.Type.NOT_SET
    assert Parameter('rates', Parameter.Type.DOUBLE_ARRAY, []).value == []
    assert Parameter('rate', Parameter.Type.DOUBLE, 2.0).type_ == Parameter.Type.DOUBLE
    with pytest.raises(ValueError, match="parameter 'rate' = 2 is not DOUBLE"):
        Parameter('rate', Parameter.Type.DOUBLE, 2)
    with pytest.raises(TypeError, match='is no parameter value'):
        Parameter('rate', value={})
    odd: Any = 'paper'
    with pytest.raises(TypeError, match="type 'paper' of parameter 'preset' is no ParameterType"):
        Parameter('preset', odd)


def test_a_parameter_of_an_unknown_type_is_refused() -> None:
    """Anybody's request of such a one ended the node."""
    store = ParameterStore({})
    store.declare('speed', 1.0, None, False)
    kind = message_class('rcl_interfaces/msg/Parameter')
    sound, odd = (Parameter.of('speed', 2.0).to_parameter_msg() for _ in range(2))
    odd.value.type = 255
    assert isinstance(sound, kind)
    result = store.set_messages([sound, odd])
    assert not result.successful
    assert result.reason == "parameter 'speed' has a type 255 that is unknown"
    assert store.get('speed').value == 1.0
    assert store.set_messages([sound]).successful
