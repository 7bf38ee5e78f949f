# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A node with rclpy's methods."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import os
from typing import Any

from cyclonedds.core import DDSException
from lg_husky_sim.ros.embedded.arguments import NodeNames
from lg_husky_sim.ros.embedded.clock import Clock, Time
from lg_husky_sim.ros.embedded.context import default_context
from lg_husky_sim.ros.embedded.endpoints import Publisher, Service, Subscription, Timer
from lg_husky_sim.ros.embedded.graph import TopicEndpointInfo
from lg_husky_sim.ros.embedded.logger import RcutilsLogger
from lg_husky_sim.ros.embedded.messages import Message, message_class
from lg_husky_sim.ros.embedded.parameter_services import offer_parameter_services
from lg_husky_sim.ros.embedded.parameters import Parameter, ParameterStore
from lg_husky_sim.ros.embedded.qos import (
    as_profile,
    qos_profile_parameter_events,
    qos_profile_rosout,
    QoSProfile,
)

#: Peers whose services can be answered; Fast DDS peers would match and then wait for ever.
SERVICE_RMW = 'rmw_cyclonedds_cpp'


def services_work() -> bool:
    """Return whether RMW_IMPLEMENTATION promises peers that services can be offered to."""
    return os.environ.get('RMW_IMPLEMENTATION', '') == SERVICE_RMW


class Node:
    """
    A node in the graph.

    Parameters
    ----------
    node_name : str
    namespace : str
    parameter_overrides : sequence of Parameter, optional
        Count more than the command line.

    """

    def __init__(self, node_name: str, *, namespace: str = '',
                 parameter_overrides: Sequence[Parameter] | None = None) -> None:
        """Join the graph."""
        self.context = default_context()
        self._names = NodeNames.resolve(node_name, namespace, self.context.arguments)
        self._clock = Clock()
        self._publishers: list[Publisher] = []
        self._subscriptions: list[Subscription] = []
        self._services: list[Service] = []
        self._timers: list[Timer] = []
        self._clock_subscription: Subscription | None = None
        #: Grows with each endpoint, so that a spin loop knows when to look again.
        self.version = 0
        self.parameter_store = ParameterStore(self._names.parameters() | {
            one.name: one.value for one in parameter_overrides or ()})
        self.context.nodes.append(self)
        self._rosout = self.create_publisher(
            message_class('rcl_interfaces/msg/Log'), '/rosout', qos_profile_rosout)
        name = self._names.full.strip('/').replace('/', '.')
        self._logger = RcutilsLogger(name, self.context.arguments.log_level, self._to_rosout)
        self._events = self.create_publisher(
            message_class('rcl_interfaces/msg/ParameterEvent'), '/parameter_events',
            qos_profile_parameter_events)
        self.parameter_store.publish = self._tell_parameters
        self.declare_parameter('use_sim_time', False)
        self._follow_clock([self.get_parameter('use_sim_time')])
        self.add_post_set_parameters_callback(self._follow_clock)
        if services_work():
            offer_parameter_services(self, self.parameter_store)

    def _to_rosout(self, level: int, text: str, file: str, function: str) -> None:
        self._rosout.publish(message_class('rcl_interfaces/msg/Log')(
            stamp=self._clock.now().to_msg(), level=level, name=self._logger.name, msg=text,
            file=file, function=function, line=0))

    def _tell_parameters(self, new: Sequence[Parameter], changed: Sequence[Parameter]) -> None:
        self._events.publish(message_class('rcl_interfaces/msg/ParameterEvent')(
            stamp=self._clock.now().to_msg(), node=self._names.full,
            new_parameters=[p.to_parameter_msg() for p in new],
            changed_parameters=[p.to_parameter_msg() for p in changed],
            deleted_parameters=[]))

    def _follow_clock(self, parameters: Sequence[Parameter]) -> None:
        for parameter in parameters:
            if parameter.name != 'use_sim_time':
                continue
            if not parameter.value:
                self._clock.simulated = None
            else:
                self._clock.simulated = self._clock.simulated or 0
                if self._clock_subscription is None:
                    self._clock_subscription = self.create_subscription(
                        message_class('rosgraph_msgs/msg/Clock'), '/clock', self._on_clock, 1)

    def _on_clock(self, msg: Any) -> None:
        if self._clock.simulated is not None:
            self._clock.simulated = Time.from_msg(msg.clock).nanoseconds

    def _changed(self) -> None:
        self.version += 1
        self.context.announce()

    def get_name(self) -> str:
        """Return the name without namespace."""
        return self._names.name

    def get_namespace(self) -> str:
        """Return the namespace; ``/`` at the root."""
        return self._names.namespace

    def get_fully_qualified_name(self) -> str:
        """Return namespace and name."""
        return self._names.full

    def resolve_topic_name(self, topic: str) -> str:
        """Return the full name of a topic after remapping."""
        return self._names.expand(topic)

    def get_topic_names_and_types(self) -> list[tuple[str, list[str]]]:
        """Return what topics there are in the graph, and their types."""
        return self.context.look().topics()

    def get_publishers_info_by_topic(self, topic_name: str) -> list[TopicEndpointInfo]:
        """Return who publishes a topic."""
        return self.context.look().endpoints('publisher', self._names.expand(topic_name))

    def get_subscriptions_info_by_topic(self, topic_name: str) -> list[TopicEndpointInfo]:
        """Return who subscribes to a topic."""
        return self.context.look().endpoints('subscription', self._names.expand(topic_name))

    def get_logger(self) -> RcutilsLogger:
        """Return the node's logger."""
        return self._logger

    def get_clock(self) -> Clock:
        """Return the node's clock."""
        return self._clock

    def create_publisher(self, msg_type: type[Message], topic: str,
                         qos_profile: QoSProfile | int) -> Publisher:
        """Return a publisher; a number as quality of service is the depth."""
        publisher = Publisher(self.context, msg_type, self._names.expand(topic),
                              as_profile(qos_profile))
        self._publishers.append(publisher)
        self._changed()
        return publisher

    def create_subscription(self, msg_type: type[Message], topic: str,
                            callback: Callable[..., None],
                            qos_profile: QoSProfile | int) -> Subscription:
        """
        Return a subscription; a number as quality of service is the depth.

        A callback of two arguments receives what is known of a message as well, such as its
        ``source_timestamp`` [ns].
        """
        subscription = Subscription(self.context, msg_type, self._names.expand(topic), callback,
                                    as_profile(qos_profile))
        self._subscriptions.append(subscription)
        self._changed()
        return subscription

    def create_service(self, srv_type: str, srv_name: str,
                       callback: Callable[[Any, Any], Any]) -> Service:
        """Return a service; ``srv_type`` is a full name such as std_srvs/srv/Trigger."""
        service = Service(self.context, srv_type, self._names.expand(srv_name), callback)
        self._services.append(service)
        self._changed()
        return service

    def create_timer(self, timer_period_sec: float, callback: Callable[[], None]) -> Timer:
        """Return a timer on the steady clock; period in seconds."""
        timer = Timer(timer_period_sec, callback)
        self._timers.append(timer)
        self.version += 1
        return timer

    def destroy_publisher(self, publisher: Publisher) -> bool:
        """Take a publisher out of the graph."""
        if publisher not in self._publishers:
            return False
        self._publishers.remove(publisher)
        self._changed()
        return True

    def destroy_subscription(self, subscription: Subscription) -> bool:
        """Take a subscription out of the graph."""
        if subscription not in self._subscriptions:
            return False
        self._subscriptions.remove(subscription)
        self._changed()
        return True

    def destroy_timer(self, timer: Timer) -> bool:
        """Stop a timer for good."""
        if timer not in self._timers:
            return False
        timer.cancel()
        self._timers.remove(timer)
        self.version += 1
        return True

    def destroy_node(self) -> None:
        """Leave the graph."""
        if self not in self.context.nodes:
            return
        self.context.nodes.remove(self)
        for group in (self._publishers, self._subscriptions, self._services, self._timers):
            group.clear()
        self._clock_subscription = None
        self.version += 1
        try:
            self.context.announce()
        except DDSException as error:
            if error.code != DDSException.DDS_RETCODE_TIMEOUT:
                raise

    def readers(self) -> list[Any]:
        """Return the DDS readers of this node."""
        return [entity.reader for entity in self.waitables()]

    def writers(self) -> list[Any]:
        """Return the DDS writers of this node."""
        return [*(p.writer for p in self._publishers), *(s.writer for s in self._services)]

    def waitables(self) -> list[Subscription | Service]:
        """Return what messages can arrive at."""
        return [*self._subscriptions, *self._services]

    def timers(self) -> list[Timer]:
        """Return the timers."""
        return list(self._timers)

    def declare_parameter(self, name: str, value: object = None, descriptor: Any = None,
                          ignore_override: bool = False) -> Parameter:
        """Add a parameter; see :class:`ParameterStore`."""
        return self.parameter_store.declare(name, value, descriptor, ignore_override)

    def has_parameter(self, name: str) -> bool:
        """Return whether a parameter is declared."""
        return name in self.parameter_store.values

    def get_parameter(self, name: str) -> Parameter:
        """Return a declared parameter."""
        return self.parameter_store.get(name)

    def set_parameters(self, parameter_list: Sequence[Parameter]) -> list[Any]:
        """Set one after the other; return a result for each."""
        return [self.parameter_store.set_atomically([one]) for one in parameter_list]

    def describe_parameter(self, name: str) -> Any:
        """Return a parameter's descriptor."""
        self.parameter_store.get(name)
        return self.parameter_store.descriptors[name]

    def add_on_set_parameters_callback(self, callback: Callable[[list[Parameter]], Any]) -> None:
        """Ask ``callback`` before parameters change; it returns a SetParametersResult."""
        self.parameter_store.on_set.append(callback)

    def add_post_set_parameters_callback(self, callback: Callable[[list[Parameter]], None]
                                         ) -> None:
        """Tell ``callback`` after parameters have changed."""
        self.parameter_store.post_set.append(callback)
