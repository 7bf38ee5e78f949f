# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What a process shares: the DDS participant, the graph announcement, signals, shutdown."""

from __future__ import annotations

from collections.abc import Sequence
import gc
import os
import signal
import sys
import threading
from types import FrameType
from typing import Any, cast, TYPE_CHECKING

from cyclonedds.core import GuardCondition, Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from lg_husky_sim.ros.embedded.arguments import Arguments, parse
from lg_husky_sim.ros.embedded.definitions import type_hash
from lg_husky_sim.ros.embedded.environment import Discovery, read_discovery
from lg_husky_sim.ros.embedded.graph import Graph
from lg_husky_sim.ros.embedded.idl import sample_type
from lg_husky_sim.ros.embedded.messages import message_class, serialise
from lg_husky_sim.ros.embedded.qos import dds_qos, DurabilityPolicy, QoSProfile

if TYPE_CHECKING:
    from lg_husky_sim.ros.embedded.node import Node

_GRAPH = 'rmw_dds_common/msg/ParticipantEntitiesInfo'


class ExternalShutdownException(Exception):
    """The context was shut down, by a signal or by a call, while spinning."""


class Context:
    """One participant in one domain, and the nodes on it."""

    def __init__(self, arguments: Arguments, discovery: Discovery) -> None:
        """Join the domain."""
        self.arguments = arguments
        self.discovery = discovery
        self.running = True
        self.nodes: list[Node] = []
        self._topics: dict[tuple[str, str, bool], Topic[Any]] = {}
        self._lock = threading.Lock()
        self._look: Graph | None = None
        xml = discovery.xml(os.environ.get('CYCLONEDDS_URI', ''))
        self._domain = Domain(discovery.domain, xml or None)
        self.participant = DomainParticipant(
            discovery.domain, Qos(Policy.Userdata(b'enclave=/;')))
        self.guard = GuardCondition(self.participant)
        topic = Topic(self.participant, 'ros_discovery_info', cast('Any', sample_type(_GRAPH)))
        profile = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._graph = DataWriter(self.participant, topic, dds_qos(
            profile, f'typehash={type_hash(_GRAPH)};', writer=True))

    def topic(self, name: str, kind: str, *, header: bool = False) -> Topic[Any]:
        """Return the DDS topic of a full DDS name; one object for each name and type."""
        key = name, kind, header
        if key not in self._topics:
            self._topics[key] = Topic(
                self.participant, name, cast('Any', sample_type(kind, header=header)))
        return self._topics[key]

    def look(self) -> Graph:
        """Return the view of the graph; the first call begins to look."""
        if self._look is None:
            self._look = Graph(self.participant)
        return self._look

    def announce(self) -> None:
        """Tell the graph which node owns which endpoint, as rmw_dds_common does."""
        gid, entry = message_class('rmw_dds_common/msg/Gid'), message_class(
            'rmw_dds_common/msg/NodeEntitiesInfo')
        with self._lock:
            entries = [entry(
                node_namespace=node.get_namespace(), node_name=node.get_name(),
                reader_gid_seq=[gid(data=list(e.guid.bytes)) for e in node.readers()],
                writer_gid_seq=[gid(data=list(e.guid.bytes)) for e in node.writers()],
            ) for node in self.nodes]
            message = message_class(_GRAPH)(
                gid=gid(data=list(self.participant.guid.bytes)), node_entities_info_seq=entries)
            self._graph.write(self._graph.data_type(serialise(message)))

    def stop(self) -> None:
        """Make every spin of this context end."""
        self.running = False
        self.guard.set(True)

    def close(self) -> None:
        """Leave the domain; entities that are still referred to go when their owners do."""
        self.stop()
        for node in tuple(self.nodes):
            node.destroy_node()
        self._topics.clear()
        self._look = None
        del self._graph, self.guard, self.participant, self._domain
        gc.collect()


_default: list[Context] = []
_before: dict[signal.Signals, Any] = {}


def _on_signal(number: int, frame: FrameType | None) -> None:
    if _default:
        _default[0].running = False


def init(*, args: Sequence[str] | None = None, domain_id: int | None = None,
         signals: bool = True) -> None:
    """
    Join the ROS graph.

    Parameters
    ----------
    args : sequence of str, optional
        Command line; ``sys.argv`` if not given.
    domain_id : int, optional
        Instead of ROS_DOMAIN_ID.
    signals : bool
        Whether SIGINT and SIGTERM shall end spinning.

    Raises
    ------
    RuntimeError
        If called twice without a shutdown between.
    SettingsError
        If arguments or environment are wrong.

    """
    if _default:
        raise RuntimeError('init() was called before; call shutdown() first')
    arguments = parse(sys.argv if args is None else args)
    environment = dict(os.environ)
    if domain_id is not None:
        environment['ROS_DOMAIN_ID'] = str(domain_id)
    _default.append(Context(arguments, read_discovery(environment)))
    if signals and threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            _before[number] = signal.signal(number, _on_signal)


def default_context() -> Context:
    """
    Return the context that :func:`init` made.

    Raises
    ------
    RuntimeError
        If there is none.

    """
    if not _default:
        raise RuntimeError('init() has not been called')
    return _default[0]


def ok() -> bool:
    """Return whether the process is in the graph and not asked to leave."""
    return bool(_default) and _default[0].running


def shutdown() -> None:
    """
    Leave the graph and give the signals back.

    Raises
    ------
    RuntimeError
        If :func:`init` was not called.

    """
    context = default_context()
    _default.clear()
    context.close()
    if threading.current_thread() is threading.main_thread():
        while _before:
            number, handler = _before.popitem()
            signal.signal(number, handler)


def try_shutdown() -> None:
    """Leave the graph if in it."""
    if _default:
        shutdown()
