# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The names that a node needs: rclpy's where it is installed, the embedded subset's elsewhere.

The choice is made by whether rclpy can be *found*, not by whether it can be imported: a broken
ROS installation must show its error and not be hidden by a fallback.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import importlib
from importlib.util import find_spec
import os
import re
from typing import Any, TYPE_CHECKING

from lg_husky_sim.errors import LgHuskyError, MissingExtraError

HAVE_RCLPY = find_spec('rclpy') is not None

if TYPE_CHECKING or not HAVE_RCLPY:
    if find_spec('cyclonedds') is None:
        raise MissingExtraError(
            'neither rclpy nor cyclonedds is installed: source a ROS 2 setup file, or '
            'pip install cyclonedds rosbags')
    from lg_husky_sim.ros.embedded.clock import Duration, Time
    from lg_husky_sim.ros.embedded.context import (
        ExternalShutdownException,
        init,
        ok,
        shutdown,
        try_shutdown,
    )
    from lg_husky_sim.ros.embedded.environment import read_discovery
    from lg_husky_sim.ros.embedded.messages import message_class
    from lg_husky_sim.ros.embedded.node import Node, services_work
    from lg_husky_sim.ros.embedded.parameters import (
        Parameter,
        ParameterException,
        ParameterType,
    )
    from lg_husky_sim.ros.embedded.qos import (
        DurabilityPolicy,
        HistoryPolicy,
        qos_profile_sensor_data,
        QoSProfile,
        ReliabilityPolicy,
    )
    from lg_husky_sim.ros.embedded.spin import SingleThreadedExecutor, spin, spin_once

    #: What ROS itself raises at a user's mistake.
    ROS_ERRORS: tuple[type[Exception], ...] = (ParameterException,)
else:
    from rclpy import init, ok, shutdown, spin, spin_once, try_shutdown
    from rclpy.duration import Duration
    from rclpy.exceptions import NameValidationException, ParameterException
    from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
    from rclpy.impl.implementation_singleton import rclpy_implementation
    from rclpy.node import Node
    from rclpy.parameter import Parameter
    from rclpy.qos import (
        DurabilityPolicy,
        HistoryPolicy,
        qos_profile_sensor_data,
        QoSProfile,
        ReliabilityPolicy,
    )
    from rclpy.time import Time
    ParameterType = Parameter.Type
    _errors = rclpy_implementation
    ROS_ERRORS = (
        NameValidationException, ParameterException, _errors.RCLError,
        _errors.UnknownROSArgsError)

    def services_work() -> bool:
        """Return True: with rclpy every middleware carries services."""
        return True

#: What a user's mistake raises; its message is one line.
USER_ERRORS: tuple[type[Exception], ...] = (LgHuskyError, *ROS_ERRORS)


def message_type(name: str) -> Any:
    """
    Return a message class by its full name, or None if its package is not installed.

    Parameters
    ----------
    name : str
        Such as ``nav_msgs/msg/Odometry``.

    """
    package, _, kind = name.split('/')
    if not HAVE_RCLPY:
        return message_class(name)
    if find_spec(package) is None:
        return None
    return getattr(importlib.import_module(f'{package}.msg'), kind)


def serialised(message: Any) -> bytes:
    """Return a message as CDR, as a bag stores it."""
    if not HAVE_RCLPY:
        from lg_husky_sim.ros.embedded.messages import serialise
        return serialise(message)
    from rclpy.serialization import serialize_message
    return bytes(serialize_message(message))


def raw_subscription(node: Node, kind: str, topic: str, callback: Callable[[bytes, int], None],
                     profile: QoSProfile) -> Any:
    """
    Subscribe to messages as CDR, as a bag stores them.

    rclpy hands them on as they came; to make objects of them and bytes of these took two thirds
    of a recorder's time.

    The callback receives a message and when its publisher sent it, by the publisher's clock [ns];
    of a middleware that does not tell that, a number that is far from every time.
    """
    of = message_type(kind)

    def sent(info: Mapping[str, Any]) -> int:
        return int(info['source_timestamp'])
    if HAVE_RCLPY:
        real: Any = node
        return real.create_subscription(
            of, topic, lambda raw, info: callback(raw, sent(info)), profile, raw=True)
    return node.create_subscription(
        of, topic, lambda message, info: callback(serialised(message), sent(info)), profile)


def service_type(name: str) -> Any:
    """
    Return what ``create_service`` takes for a service type, or None if it cannot be offered.

    Parameters
    ----------
    name : str
        Such as ``std_srvs/srv/Trigger``.

    """
    package, _, kind = name.split('/')
    if not HAVE_RCLPY:
        from lg_husky_sim.ros.embedded.definitions import SERVICES
        return name if name in SERVICES and services_work() else None
    if find_spec(package) is None:
        return None
    return getattr(importlib.import_module(f'{package}.srv'), kind)


def parameter(name: str, value: object) -> Parameter:
    """Return a parameter of the type that the value has."""
    return Parameter(name, value=value)


def parameter_overrides(node: Node) -> dict[str, Parameter]:
    """Return the parameters that command line and files give to a node, declared or not."""
    if not HAVE_RCLPY:
        return node.parameter_store.overrides
    overrides: dict[str, Parameter] = node._parameter_overrides  # type: ignore[attr-defined]
    return overrides


def join(arguments: Sequence[str]) -> None:
    """Join the graph as :func:`init` does, and leave the process's signals alone."""
    if HAVE_RCLPY:
        from rclpy.signals import SignalHandlerOptions
        init(args=[*arguments],
             signal_handler_options=SignalHandlerOptions.NO)  # type: ignore[call-arg]
    else:
        init(args=[*arguments], signals=False)


def future() -> Any:
    """Return what a callback of a service can wait for while others are served; rclpy only."""
    from rclpy.task import Future
    return Future()


def waiting_service(node: Node, kind: Any, name: str, callback: Callable[[Any, Any], Any]
                    ) -> None:
    """
    Offer a service whose callback waits for others of the node; rclpy only.

    It has a group of its own: in that of the others, which excludes each other, none of them would
    be called until it ends. What it starts must therefore be left to :func:`trigger`.
    """
    from rclpy.callback_groups import ReentrantCallbackGroup
    real: Any = node
    real.create_service(kind, name, callback, callback_group=ReentrantCallbackGroup())


def trigger(node: Node, callback: Callable[[], None]) -> Callable[[], None]:
    """Return what has a callback called soon, excluding all others of the node; rclpy only."""
    real: Any = node
    found: Callable[[], None] = real.create_guard_condition(callback).trigger
    return found


def own_arguments(words: Sequence[str]) -> list[str]:
    """Return what of a command line is outside its --ros-args sections."""
    own, inside = [], False
    for word in words:
        if not inside and word != '--ros-args':
            own.append(word)
        inside = (inside or word == '--ros-args') and not (inside and word == '--')
    return own


def _of_parameter_services(error: BaseException) -> bool:
    # Whether rclpy's own services of parameters raised it.
    frame = error.__traceback__
    while frame is not None:
        if frame.tb_frame.f_globals.get('__name__') == 'rclpy.parameter_service':
            return True
        frame = frame.tb_next
    return False


def keep_spinning(node: Node) -> None:
    """
    Spin until the graph is left, whatever others ask of the node's parameters.

    A request with a type of parameter that is unknown ends every node of rclpy: its services of
    parameters raise, and nobody catches that.

    Parameters
    ----------
    node : Node
        To be spun.

    """
    while True:
        try:
            spin(node)
        except Exception as error:
            if not _of_parameter_services(error):
                raise
            node.get_logger().warning(f'request of a parameter refused: {error}',
                                      throttle_duration_sec=1.0)
        else:
            return


def steady_timer(node: Node, period: float, callback: Callable[[], None]) -> Any:
    """
    Return a timer on the steady clock, whatever time the node goes by.

    rclpy's timers go by the node's clock: they stand while /clock does, and for as long as the
    system's clock was set back.

    Parameters
    ----------
    node : Node
        Serves the timer.
    period : float
        [s]
    callback : callable
        Is called at the end of each period.

    """
    if not HAVE_RCLPY:
        return node.create_timer(period, callback)
    from rclpy.clock import Clock, ClockType
    return node.create_timer(  # type: ignore[call-arg]
        period, callback, clock=Clock(clock_type=ClockType.STEADY_TIME))


def leave(node: Node) -> None:
    """End spinning from inside a callback, as a signal does."""
    if HAVE_RCLPY:
        try_shutdown(context=node.context)  # type: ignore[call-arg]
    else:
        node.context.stop()


def reason(error: Exception) -> str:
    """Return a user's mistake in one line, also where rclpy says only what it does not know."""
    # rcl adds where in its own source each function of its stack saw the mistake.
    text = re.sub(r',? at \S+\.c:\d+', '', ' '.join(str(error).split()))
    if type(error).__name__ == 'UnknownROSArgsError':
        return f'unknown ROS argument {text.strip("[]")}'
    return text


def describe_backend(environment: Mapping[str, str] = os.environ) -> str:
    """Return backend, domain and discovery range in a line, for the first log message."""
    if HAVE_RCLPY:
        from rclpy.utilities import get_rmw_implementation_identifier
        name = f'rclpy over {get_rmw_implementation_identifier()}'
        domain = environment.get('ROS_DOMAIN_ID', '') or '0'
        span = environment.get('ROS_AUTOMATIC_DISCOVERY_RANGE', '') or 'SUBNET'
    else:
        name = 'embedded DDS (Cyclone)'
        discovery = read_discovery(environment)
        domain, span = str(discovery.domain), discovery.range
    return f'backend {name}, domain {domain}, discovery range {span}'


__all__ = [
    'HAVE_RCLPY',
    'ROS_ERRORS',
    'USER_ERRORS',
    'DurabilityPolicy',
    'Duration',
    'ExternalShutdownException',
    'HistoryPolicy',
    'Node',
    'Parameter',
    'ParameterType',
    'QoSProfile',
    'ReliabilityPolicy',
    'SingleThreadedExecutor',
    'Time',
    'describe_backend',
    'future',
    'init',
    'join',
    'keep_spinning',
    'leave',
    'message_type',
    'ok',
    'own_arguments',
    'parameter',
    'parameter_overrides',
    'qos_profile_sensor_data',
    'raw_subscription',
    'reason',
    'serialised',
    'service_type',
    'services_work',
    'shutdown',
    'spin',
    'spin_once',
    'steady_timer',
    'trigger',
    'try_shutdown',
    'waiting_service',
]
