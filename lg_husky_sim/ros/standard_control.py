# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The services of ``simulation_interfaces``, where that package is installed."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
import math
from typing import Any, Protocol

from lg_husky_sim.ros import api, conversions
from lg_husky_sim.ros.api import message_type, Node, service_type
from lg_husky_sim.ros.control import MOST_STEPS
from lg_husky_sim.ros.engine import Reading
from lg_husky_sim.signals import BodyTwist, Pose

#: The one entity that there is.
ENTITY = 'husky'
_PACKAGE = 'simulation_interfaces'
#: simulation_interfaces/msg/Result.
_UNSUPPORTED, _OK, _NOT_FOUND, _INCORRECT_STATE, _FAILED = range(5)
_INVALID_POSE, _ALREADY = 101, 101
#: simulation_interfaces/msg/SimulationState.
_STOPPED, _PLAYING, _PAUSED, _QUITTING = range(4)
#: simulation_interfaces/srv/ResetSimulation: scopes are bits.
_TIME, _STATE, _SPAWNED, _ALL = 1, 2, 4, 255
#: What is truly there, of simulation_interfaces/msg/SimulatorFeatures.
FEATURES = ('ENTITY_STATE_GETTING', 'ENTITY_STATE_SETTING', 'SIMULATION_RESET',
            'SIMULATION_RESET_TIME', 'SIMULATION_RESET_STATE', 'SIMULATION_STATE_GETTING',
            'SIMULATION_STATE_SETTING', 'SIMULATION_STATE_PAUSE', 'STEP_SIMULATION_SINGLE',
            'STEP_SIMULATION_MULTIPLE')
SERVICES = ('GetSimulatorFeatures', 'GetSimulationState', 'SetSimulationState',
            'ResetSimulation', 'StepSimulation', 'GetEntities', 'GetEntityState',
            'SetEntityState')


class Simulation(Protocol):
    """What the services need of the node."""

    paused: bool
    stopped: bool

    @property
    def reading(self) -> Reading:
        """Return the last step."""

    @property
    def odom_frame(self) -> str:
        """Return the frame of poses."""

    def pause(self, paused: bool) -> None:
        """Pause or resume."""

    def advance(self, count: int, done: Callable[[bool], None] | None = None) -> None:
        """Make steps while paused, and tell whether all were made."""

    def reset(self, *, time: bool) -> None:
        """Go back to the initial pose."""

    def reset_clock(self) -> None:
        """Begin simulated time anew and leave the robot as it is."""

    def place(self, pose: Pose, twist: BodyTwist) -> None:
        """Put the robot somewhere in some motion."""

    def stop(self) -> None:
        """Pause, in the initial state at time zero."""

    def end(self) -> bool:
        """End the process, if it is the node's own."""


def service_name(kind: str) -> str:
    """Return the name of a service by its type: GetEntityState is get_entity_state."""
    return ''.join(f'_{c.lower()}' if c.isupper() else c for c in kind).lstrip('_')


class StandardControl:
    """
    Offers the standard's services in the node's namespace.

    Parameters
    ----------
    node : Node
    simulation : Simulation

    """

    def __init__(self, node: Node, simulation: Simulation) -> None:
        """Offer the services, or say that the package is missing."""
        self._simulation = simulation
        self._asked: deque[tuple[int, Any]] = deque()
        answers = {
            'GetSimulatorFeatures': self._features, 'GetSimulationState': self._get_state,
            'SetSimulationState': self._set_state, 'ResetSimulation': self._reset,
            'StepSimulation': self._step, 'GetEntities': self._entities,
            'GetEntityState': self._get_entity, 'SetEntityState': self._set_entity}
        for kind in SERVICES:
            service = service_type(f'{_PACKAGE}/srv/{kind}')
            if service is None:
                node.get_logger().info(f'no services of {_PACKAGE}: not available here')
                return
            if kind == 'StepSimulation':
                self._trigger = api.trigger(node, self._begin)
                api.waiting_service(node, service, service_name(kind), answers[kind])
            else:
                node.create_service(service, service_name(kind), answers[kind])

    def _features(self, request: Any, response: Any) -> Any:
        kind = message_type(f'{_PACKAGE}/msg/SimulatorFeatures')
        response.features.features = [getattr(kind, name) for name in FEATURES]
        response.features.custom_info = 'lg_husky_sim: one Husky from a linear graph'
        return response

    def _get_state(self, request: Any, response: Any) -> Any:
        one = self._simulation
        response.state.state = _STOPPED if one.stopped else _PAUSED if one.paused else _PLAYING
        response.result.result = _OK
        return response

    def _set_state(self, request: Any, response: Any) -> Any:
        one, wanted = self._simulation, request.state.state
        now = _STOPPED if one.stopped else _PAUSED if one.paused else _PLAYING
        response.result.result = _OK
        if wanted == now:
            response.result.result = _ALREADY
            response.result.error_message = 'already in this state'
        elif wanted == _QUITTING:
            if not one.end():
                response.result.result = _UNSUPPORTED
                response.result.error_message = 'the node is a guest in this process'
        elif wanted == _STOPPED:
            one.stop()
        elif wanted in (_PLAYING, _PAUSED):
            one.pause(wanted == _PAUSED)
        else:
            response.result.result = _UNSUPPORTED
            response.result.error_message = f'state {wanted} is none of 0, 1, 2, 3'
        return response

    def _reset(self, request: Any, response: Any) -> Any:
        scope = request.scope or _ALL
        response.result.result = _OK
        if scope != _ALL and scope & ~(_TIME | _STATE):
            response.result.result = _UNSUPPORTED
            response.result.error_message = (
                f'scope {scope}: nothing is spawned; there are 0, 1, 2, 3 and 255')
        elif scope & _STATE:
            self._simulation.reset(time=bool(scope & _TIME))
        else:
            self._simulation.reset_clock()
        return response

    async def _step(self, request: Any, response: Any) -> Any:
        # The answer waits for the steps and others are served meanwhile.
        response.result.result = _OK
        if not self._simulation.paused:
            response.result.result = _INCORRECT_STATE
            response.result.error_message = 'steps need a paused simulation'
        elif not 0 < request.steps <= MOST_STEPS:
            response.result.result = _FAILED
            response.result.error_message = f'steps = {request.steps}: from 1 to {MOST_STEPS}'
        else:
            future = api.future()
            self._asked.append((int(request.steps), future))
            self._trigger()
            if not await future:
                response.result.result = _FAILED
                response.result.error_message = 'interrupted by a pause, a resume or a reset'
        return response

    def _begin(self) -> None:
        while self._asked:
            steps, future = self._asked.popleft()
            if self._simulation.paused:
                self._simulation.advance(steps, future.set_result)
            else:
                future.set_result(False)

    def _entities(self, request: Any, response: Any) -> Any:
        response.entities = [ENTITY]
        response.result.result = _OK
        return response

    def _known(self, name: str, result: Any) -> bool:
        if name != ENTITY:
            result.result = _NOT_FOUND
            result.error_message = f'no entity {name!r}; there is {ENTITY}'
        return name == ENTITY

    def _get_entity(self, request: Any, response: Any) -> Any:
        if not self._known(request.entity, response.result):
            return response
        reading, state = self._simulation.reading, response.state
        state.header.frame_id = self._simulation.odom_frame
        conversions.set_stamp(state.header.stamp, round(reading.time * 1e9))
        state.pose.position.x, state.pose.position.y = reading.pose.x, reading.pose.y
        conversions.set_heading(state.pose.orientation, reading.pose.heading)
        state.twist.linear.x = reading.twist.forward
        state.twist.angular.z = reading.twist.yaw
        response.result.result = _OK
        return response

    def _set_entity(self, request: Any, response: Any) -> Any:
        if not self._known(request.entity, response.result):
            return response
        pose = conversions.pose_from_msg(request.state.pose)
        twist = conversions.twist_from_msg(request.state.twist)
        q = request.state.pose.orientation
        numbers = (pose.x, pose.y, q.x, q.y, q.z, q.w, twist.forward, twist.yaw)
        if not all(map(math.isfinite, numbers)) or q.z == q.w == 0.0:
            response.result.result = _INVALID_POSE
            response.result.error_message = 'pose and twist must be finite, the quaternion a turn'
        else:
            self._simulation.place(pose, twist)
            response.result.result = _OK
        return response
