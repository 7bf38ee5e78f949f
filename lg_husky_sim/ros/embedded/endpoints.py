# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Publishers, subscriptions, services and timers of a node."""

from __future__ import annotations

from collections.abc import Callable
import inspect
import time
from typing import Any, TYPE_CHECKING
import uuid

from cyclonedds.core import DDSException, InstanceState, ReadCondition, SampleState, ViewState
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from lg_husky_sim.ros.embedded.definitions import type_hash
from lg_husky_sim.ros.embedded.messages import deserialise, Message, message_class, serialise
from lg_husky_sim.ros.embedded.qos import dds_qos, qos_profile_services_default, QoSProfile
from rosbags.serde import SerdeError

if TYPE_CHECKING:
    from lg_husky_sim.ros.embedded.context import Context

_ANY = SampleState.Any | ViewState.Any | InstanceState.Any
#: Samples taken from a reader at once.
_BATCH = 64


class Publisher:
    """Writes messages of one type to one topic."""

    def __init__(self, context: Context, msg_type: type[Message], topic: str,
                 qos: QoSProfile) -> None:
        """Make the writer."""
        self.topic_name = topic
        self.qos_profile = qos
        self.dropped = 0
        self._type = msg_type
        self.writer = DataWriter(
            context.participant, context.topic(f'rt{topic}', msg_type.__msgtype__),
            dds_qos(qos, f'typehash={type_hash(msg_type.__msgtype__)};', writer=True))
        self._sample = self.writer.data_type

    def publish(self, msg: Message) -> None:
        """
        Send a message.

        A write that a stalled reliable reader holds up for too long is given up and counted in
        ``dropped``: a stopped peer must not stop the simulation.

        Raises
        ------
        TypeError
            If the message or one of its fields is of another type.

        """
        if not isinstance(msg, self._type):
            raise TypeError(f'{self.topic_name} takes {self._type.__msgtype__}, not '
                            f'{type(msg).__name__}')
        try:
            self.writer.write(self._sample(serialise(msg)))
        except DDSException as error:
            if error.code != DDSException.DDS_RETCODE_TIMEOUT:
                raise
            self.dropped += 1

    def get_subscription_count(self) -> int:
        """Return how many readers are matched."""
        return len(self.writer.get_matched_subscriptions())


def _takes_two(callback: Callable[..., None]) -> bool:
    # As rclpy finds out.
    try:
        signature = inspect.signature(callback)
    except (TypeError, ValueError):
        return False
    for count in (1, 2):
        try:
            signature.bind(*range(count))
        except TypeError:
            continue
        return count == 2
    return False


class Subscription:
    """Hands the messages of a topic to a callback."""

    def __init__(self, context: Context, msg_type: type[Message], topic: str,
                 callback: Callable[..., None], qos: QoSProfile) -> None:
        """Make the reader."""
        self.topic_name = topic
        self.qos_profile = qos
        self.malformed = 0
        self._name = msg_type.__msgtype__
        self._callback = callback
        self._informed = _takes_two(callback)
        self.reader = DataReader(
            context.participant, context.topic(f'rt{topic}', self._name),
            dds_qos(qos, f'typehash={type_hash(self._name)};', writer=False))
        self.condition = ReadCondition(self.reader, _ANY)

    def serve(self) -> int:
        """Take what has arrived and call back; return the number of messages."""
        count = 0
        for sample in self.reader.take(_BATCH):
            if sample.sample_info.valid_data:
                try:
                    message = deserialise(sample.raw, self._name)
                except SerdeError:
                    self.malformed += 1
                    continue
                if self._informed:
                    # As rmw_cyclonedds, which does not tell when a sample was received.
                    self._callback(message, {
                        'source_timestamp': sample.sample_info.source_timestamp,
                        'received_timestamp': 0})
                else:
                    self._callback(message)
                count += 1
        return count

    def get_publisher_count(self) -> int:
        """Return how many writers are matched."""
        return len(self.reader.get_matched_publications())


class Service:
    """Answers requests of rmw_cyclonedds peers; the request's identity precedes each body."""

    def __init__(self, context: Context, srv_type: str, name: str,
                 callback: Callable[[Any, Any], Any]) -> None:
        """Make reader and writer."""
        self.srv_name = name
        self.malformed = 0
        self._callback = callback
        self._request = f'{srv_type}_Request'
        self._response = message_class(f'{srv_type}_Response')
        message_class(self._request)
        requests = context.topic(f'rq{name}Request', self._request, header=True)
        replies = context.topic(f'rr{name}Reply', f'{srv_type}_Response', header=True)
        writer_hash, reader_hash = type_hash(f'{srv_type}_Response'), type_hash(self._request)
        identity = '.'.join(f'{byte:x}' for byte in uuid.uuid4().bytes)
        data = f'serviceid={identity};typehash='
        qos = qos_profile_services_default
        self.writer = DataWriter(context.participant, replies, dds_qos(
            qos, f'{data}{writer_hash};', writer=True))
        self.reader = DataReader(context.participant, requests, dds_qos(
            qos, f'{data}{reader_hash};', writer=False))
        self.condition = ReadCondition(self.reader, _ANY)

    def serve(self) -> int:
        """Answer the requests that have arrived; return their number."""
        count = 0
        for sample in self.reader.take(_BATCH):
            if not sample.sample_info.valid_data:
                continue
            head, identity, body = sample.raw[:4], sample.raw[4:20], sample.raw[20:]
            try:
                request = deserialise(head + body, self._request)
            except SerdeError:
                self.malformed += 1
                continue
            response = self._callback(request, self._response())
            if head[1] != 1:
                identity = identity[7::-1] + identity[:7:-1]
            data = serialise(response)
            self.writer.write(self.writer.data_type(data[:4] + identity + data[4:]))
            count += 1
        return count


class Timer:
    """Calls back at a fixed period of the steady clock; missed calls are not made up."""

    def __init__(self, period: float, callback: Callable[[], None]) -> None:
        """
        Start the timer.

        Parameters
        ----------
        period : float
            [s]
        callback : callable
            Called without arguments.

        """
        self.timer_period_ns = round(period * 1e9)
        self._callback = callback
        self._canceled = False
        self.due = time.monotonic_ns() + self.timer_period_ns

    def cancel(self) -> None:
        """Stop calling back."""
        self._canceled = True

    def reset(self) -> None:
        """Start anew from now."""
        self._canceled = False
        self.due = time.monotonic_ns() + self.timer_period_ns

    def is_canceled(self) -> bool:
        """Return whether the timer is stopped."""
        return self._canceled

    def serve(self) -> int:
        """Call back if it is time."""
        now = time.monotonic_ns()
        if self._canceled or now < self.due:
            return 0
        self.due += max(self.timer_period_ns, 1)
        if self.due <= now and self.timer_period_ns:
            self.due += (now - self.due) // self.timer_period_ns * self.timer_period_ns
            self.due += self.timer_period_ns
        self._callback()
        return 1
