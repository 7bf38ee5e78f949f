# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Who is in the graph: topics with their types, and the nodes behind each endpoint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast, TYPE_CHECKING

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import (
    DDSException,
    InstanceState,
    Policy,
    ReadCondition,
    SampleState,
    ViewState,
)
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from lg_husky_sim.ros.embedded.idl import sample_type
from lg_husky_sim.ros.embedded.messages import deserialise
from lg_husky_sim.ros.embedded.qos import (
    dds_qos,
    DurabilityPolicy,
    QoSProfile,
    ReliabilityPolicy,
)
from rosbags.serde import SerdeError

if TYPE_CHECKING:
    from cyclonedds.domain import DomainParticipant

_INFO = 'rmw_dds_common/msg/ParticipantEntitiesInfo'
#: Endpoints and participants that are taken at once.
_MOST = 1000
_NEWS = SampleState.NotRead | ViewState.Any | InstanceState.Any


@dataclass(frozen=True)
class TopicEndpointInfo:
    """One end of a topic: its node, type and quality of service; rclpy's names."""

    node_name: str
    node_namespace: str
    topic_type: str
    qos_profile: QoSProfile


def _ros_type(name: str) -> str:
    package, kind, rest = [*name.split('::', 2), '', ''][:3]
    return f'{package}/{kind}/{rest.removeprefix("dds_::").removesuffix("_")}'


def _profile(qos: Any) -> QoSProfile:
    reliable = qos[Policy.Reliability]
    durability = qos[Policy.Durability]
    return QoSProfile(
        reliability=ReliabilityPolicy.BEST_EFFORT if reliable == Policy.Reliability.BestEffort
        else ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.VOLATILE if durability == Policy.Durability.Volatile
        else DurabilityPolicy.TRANSIENT_LOCAL)


class _Ends:
    """The endpoints of one kind that are alive; only what has changed is read again."""

    def __init__(self, participant: DomainParticipant, builtin: Any) -> None:
        """Begin to read what discovery says."""
        self._reader = BuiltinDataReader(participant, builtin)
        self._news = ReadCondition(self._reader, _NEWS)
        #: Topic, type and quality of service by the endpoint's key.
        self._alive: dict[bytes, tuple[str, str, QoSProfile]] = {}

    def alive(self) -> dict[bytes, tuple[str, str, QoSProfile]]:
        """Return those of topics of ROS."""
        while self._news.triggered:
            try:
                samples: list[Any] = self._reader.take(_MOST, self._news)
            except DDSException as error:
                if error.code != DDSException.DDS_RETCODE_NO_DATA:
                    raise
                break
            for sample in samples:
                key = sample.key.bytes
                # One that is gone has no more than its key.
                if sample.sample_info.instance_state != InstanceState.Alive:
                    self._alive.pop(key, None)
                elif sample.sample_info.valid_data and str(sample.topic_name).startswith('rt/'):
                    self._alive[key] = (sample.topic_name[2:], _ros_type(sample.type_name),
                                        _profile(sample.qos))
        return self._alive


class Graph:
    """
    Looks at discovery; made when somebody asks for the first time.

    A look takes as long as there are news, and not as there are endpoints: a node's messages wait
    meanwhile.

    Parameters
    ----------
    participant : DomainParticipant

    """

    def __init__(self, participant: DomainParticipant) -> None:
        """Begin to read what discovery says."""
        self._ends = {'publisher': _Ends(participant, BuiltinTopicDcpsPublication),
                      'subscription': _Ends(participant, BuiltinTopicDcpsSubscription)}
        topic = Topic(participant, 'ros_discovery_info', cast('Any', sample_type(_INFO)))
        profile = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._infos = DataReader(participant, topic, dds_qos(profile, '', writer=False))
        self._said = ReadCondition(self._infos, _NEWS)
        self._nodes: dict[bytes, dict[bytes, tuple[str, str]]] = {}
        self._owned: dict[bytes, tuple[str, str]] = {}

    def _owners(self) -> dict[bytes, tuple[str, str]]:
        # Endpoint to (name, namespace) of its node; the last word of each participant counts.
        if not self._said.triggered:
            return self._owned
        for sample in self._infos.take(10 * _MOST):
            if not sample.sample_info.valid_data:
                continue
            try:
                message: Any = deserialise(sample.raw, _INFO)
            except SerdeError:
                continue
            owned: dict[bytes, tuple[str, str]] = {}
            for node in message.node_entities_info_seq:
                for gid in (*node.reader_gid_seq, *node.writer_gid_seq):
                    owned[bytes(gid.data)] = (node.node_name, node.node_namespace)
            self._nodes[bytes(message.gid.data)] = owned
        self._owned = {gid: node for owned in self._nodes.values()
                       for gid, node in owned.items()}
        return self._owned

    def topics(self) -> list[tuple[str, list[str]]]:
        """Return each topic's name with its types, in order of the names."""
        found: dict[str, set[str]] = {}
        for ends in self._ends.values():
            for name, kind, _ in ends.alive().values():
                found.setdefault(name, set()).add(kind)
        return [(name, sorted(found[name])) for name in sorted(found)]

    def endpoints(self, kind: str, topic: str) -> list[TopicEndpointInfo]:
        """
        Return the ends of a topic.

        Parameters
        ----------
        kind : str
            ``publisher`` or ``subscription``.
        topic : str
            Full name.

        """
        owners = self._owners()
        unknown = ('_NODE_NAME_UNKNOWN_', '_NODE_NAMESPACE_UNKNOWN_')
        return [TopicEndpointInfo(*owners.get(gid, unknown), of, profile)
                for gid, (name, of, profile) in self._ends[kind].alive().items()
                if name == topic]
