# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Pause, step, reset, speed and model: as topics everywhere, as services where they work."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from lg_husky_sim.errors import SettingsError
from lg_husky_sim.ros.api import message_type, Node, service_type

#: Control topics below the node's name: topic, type, what it does.
TOPICS = (
    ('pause', 'std_msgs/msg/Bool', 'true pauses, false resumes'),
    ('step', 'std_msgs/msg/UInt32', 'while paused: this many steps'),
    ('reset', 'std_msgs/msg/Bool', 'to the initial pose at rest; true: time starts anew as well'),
    ('speed', 'std_msgs/msg/Float64', 'sets the parameter speed'),
    ('load_model', 'std_msgs/msg/String', 'sets the parameter model'),
)
#: Services below the node's name: name, type, what it does.
SERVICES = (
    ('pause', 'std_srvs/srv/SetBool', 'true pauses, false resumes'),
    ('step', 'std_srvs/srv/Trigger', 'while paused: one step'),
    ('reset', 'std_srvs/srv/Trigger', 'to the initial pose at rest; time goes on'),
    ('reset_time', 'std_srvs/srv/Trigger', 'likewise, and simulated time starts anew'),
)
#: Most steps that one request may ask for.
MOST_STEPS = 1_000_000


class Controlled(Protocol):
    """What can be controlled: the node's simulation."""

    paused: bool

    def pause(self, paused: bool) -> None:
        """Pause or resume."""

    def advance(self, count: int) -> None:
        """Make steps while paused."""

    def reset(self, *, time: bool) -> None:
        """Go back to the initial pose."""

    def change(self, **values: object) -> None:
        """Change live settings; raises SettingsError."""


class Control:
    """
    Connects topics and services to a simulation.

    Parameters
    ----------
    node : Node
    simulation : Controlled

    """

    def __init__(self, node: Node, simulation: Controlled) -> None:
        """Subscribe, and offer what services there can be."""
        self._simulation = simulation
        self._log = node.get_logger()
        answers: dict[str, Callable[[Any], Any]] = {
            'pause': lambda msg: simulation.pause(bool(msg.data)),
            'step': lambda msg: self._step(int(msg.data)),
            'reset': lambda msg: simulation.reset(time=bool(msg.data)),
            'speed': lambda msg: self._change(speed=float(msg.data)),
            'load_model': lambda msg: self._change(model=str(msg.data)),
        }
        for name, kind, _ in TOPICS:
            node.create_subscription(message_type(kind), f'~/{name}', answers[name], 10)
        offers: dict[str, Callable[[Any, Any], Any]] = {
            'pause': self._serve_pause, 'step': self._serve_step, 'reset': self._serve_reset,
            'reset_time': self._serve_reset_time}
        missing = []
        for name, kind, _ in SERVICES:
            service = service_type(kind)
            if service is None:
                missing.append(f'~/{name}')
            else:
                node.create_service(service, f'~/{name}', offers[name])
        if missing:
            self._log.info(f'no services ({", ".join(missing)}) in this setting; topics of the '
                           'same names do the same')

    def _step(self, count: int) -> bool:
        if not self._simulation.paused:
            self._log.warning('step refused: the simulation is not paused',
                              throttle_duration_sec=1.0)
            return False
        if not 0 < count <= MOST_STEPS:
            self._log.warning(f'step = {count} refused: from 1 to {MOST_STEPS}',
                              throttle_duration_sec=1.0)
            return False
        self._simulation.advance(count)
        return True

    def _change(self, **values: object) -> None:
        try:
            self._simulation.change(**values)
        except SettingsError as error:
            self._log.warning(f'refused: {error}', throttle_duration_sec=1.0)

    def _serve_pause(self, request: Any, response: Any) -> Any:
        self._simulation.pause(bool(request.data))
        response.success = True
        response.message = 'paused' if request.data else 'running'
        return response

    def _serve_step(self, request: Any, response: Any) -> Any:
        response.success = self._step(1)
        response.message = 'one step done' if response.success else 'not paused'
        return response

    def _serve_reset(self, request: Any, response: Any) -> Any:
        self._simulation.reset(time=False)
        response.success, response.message = True, 'reset; time goes on'
        return response

    def _serve_reset_time(self, request: Any, response: Any) -> Any:
        self._simulation.reset(time=True)
        response.success, response.message = True, 'reset; time starts anew'
        return response
