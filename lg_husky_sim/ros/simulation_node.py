# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The node's class; :mod:`lg_husky_sim.ros.sim_node` runs it."""

from __future__ import annotations

import math
import time
from typing import Any

from lg_husky_sim.ros import conversions
from lg_husky_sim.ros.api import describe_backend, leave, message_type, Node
from lg_husky_sim.ros.control import Control
from lg_husky_sim.ros.diagnostics import Diagnostics
from lg_husky_sim.ros.engine import Engine, Reading
from lg_husky_sim.ros.outputs import Outputs
from lg_husky_sim.ros.pacing import Pace, Stamps
from lg_husky_sim.ros.parameters import declare_settings, LiveSettings
from lg_husky_sim.ros.settings import Settings
from lg_husky_sim.ros.standard_control import StandardControl
from lg_husky_sim.signals import BodyTwist, Pose

_SECOND = 1_000_000_000
#: Shortest time between two looks at the clock [s]; above it, steps come in bunches.
_TICK = 0.001
#: Longest stay in one callback while catching up or running free [ns].
_BUNCH = 20_000_000
#: A ROS clock that is off by this much has jumped [ns].
_JUMP = 100_000_000


class SimNode(Node):
    """
    A Husky in a ROS graph.

    Parameters
    ----------
    name : str
    started : float, optional
        When the process began on ``time.monotonic`` [s], to log how long the start took.
    **kwargs
        For the node, such as ``namespace``.

    Raises
    ------
    SettingsError
        If parameters or model file are wrong.

    """

    def __init__(self, name: str, *, started: float | None = None, **kwargs: Any) -> None:
        """Declare, load, publish the first odometry and start the clockwork."""
        super().__init__(name, **kwargs)
        log = self.get_logger()
        log.info(describe_backend())
        self.settings = declare_settings(self)
        self.engine = Engine(self.settings)
        self.outputs = Outputs(self, self.settings)
        self.diagnostics: Diagnostics | None = None
        if self.settings.publish_diagnostics:
            self.diagnostics = Diagnostics(self)
        self.paused = self.settings.start_paused
        self._timer: Any = None
        # Who waits for the first odometry expects the robot to answer from then on, and without
        # machine code on disk compiling takes seconds.
        self._warm_up()
        self._publish()
        self._live = LiveSettings(self, self.settings, self._apply)
        self._subscribe()
        self.stopped = False
        self.control = Control(self, self)
        self.standard = StandardControl(self, self)
        self._resume()
        if started is not None:
            took = time.monotonic() - started
            log.info(f'running with preset {self.settings.preset} at '
                     f'{self.settings.rate:g} Hz, {took:.2f} s after the start')

    def _subscribe(self) -> None:
        one = self.settings
        stamped = one.command_type == 'TwistStamped'
        kind = message_type(f'geometry_msgs/msg/{one.command_type}')
        self.create_subscription(kind, one.command_topic,
                                 self._on_stamped if stamped else self._on_twist, 10)
        self.create_subscription(
            message_type('geometry_msgs/msg/PoseWithCovarianceStamped'), one.initial_pose_topic,
            self._on_initial_pose, 10)

    def _warm_up(self) -> None:
        # The first step compiles or loads machine code.
        spare = Engine(self.settings)
        spare.step()

    # --- commands ---------------------------------------------------------------------------

    def _on_twist(self, msg: Any) -> None:
        if not self.engine.command(conversions.twist_from_msg(msg)):
            self.get_logger().warning(
                f'command linear.x = {msg.linear.x}, angular.z = {msg.angular.z} refused: not '
                'finite', throttle_duration_sec=1.0)

    def _on_stamped(self, msg: Any) -> None:
        stamp = conversions.stamp_nanoseconds(msg.header.stamp)
        timeout = self.settings.command_timeout
        age = (self._now_stamp() - stamp) / _SECOND
        if stamp and timeout > 0.0 and age > timeout:
            self.get_logger().warning(
                f'command ignored: its stamp is {age:.3f} s old, more than command_timeout = '
                f'{timeout:g} s', throttle_duration_sec=1.0)
            return
        self._on_twist(msg.twist)

    def _on_initial_pose(self, msg: Any) -> None:
        frame = msg.header.frame_id
        pose = conversions.pose_from_msg(msg.pose.pose)
        if frame not in ('', 'map', self.settings.odom_frame):
            self.get_logger().warning(
                f'initial pose ignored: frame {frame!r} is neither {self.settings.odom_frame!r} '
                "nor 'map'", throttle_duration_sec=1.0)
        elif not all(math.isfinite(v) for v in (pose.x, pose.y, pose.heading)):
            self.get_logger().warning('initial pose refused: not finite',
                                      throttle_duration_sec=1.0)
        else:
            self._restart(pose, time=False)

    # --- time -------------------------------------------------------------------------------

    def _now_stamp(self) -> int:
        if self.settings.publish_clock:
            return round(self.engine.reading.time * _SECOND)
        return self.get_clock().now().nanoseconds

    def _resume(self) -> None:
        one, now = self.settings, time.monotonic_ns()
        speed = one.speed or 1.0
        self._pace = Pace(now, self.engine.total, one.rate, speed)
        self._stamps = Stamps(self.get_clock().now().nanoseconds, self.engine.total,
                              _SECOND / (one.rate * speed))
        if self._timer is not None:
            self.destroy_timer(self._timer)
        period = _TICK if one.speed == 0.0 else max(_TICK, one.period / speed)
        self._timer = self.create_timer(period, self._tick)

    def _stamp(self) -> int:
        if self.settings.publish_clock:
            return round(self.engine.reading.time * _SECOND)
        return self._stamps.of(self.engine.total)

    def _follow_clock_jumps(self) -> None:
        behind = self._pace.due(time.monotonic_ns(), self.engine.total)
        expected = self._stamps.of(self.engine.total + behind)
        now: int = self.get_clock().now().nanoseconds
        if abs(now - expected) > _JUMP:
            self.get_logger().warning(
                f'the clock jumped by {(now - expected) / _SECOND:+.3f} s; stamps follow it',
                throttle_duration_sec=1.0)
            self._stamps = Stamps(now, self.engine.total + behind, self._stamps.spacing)

    def _tick(self) -> None:
        if not self.paused:
            if self.settings.speed == 0.0:
                self._run_free()
            else:
                if not self.settings.publish_clock:
                    self._follow_clock_jumps()
                self._catch_up()
        if self.diagnostics is not None:
            self.diagnostics.report(
                time.monotonic_ns(), self._stamp(), self.settings.rate * self.settings.speed,
                paused=self.paused)

    def _catch_up(self) -> None:
        now = time.monotonic_ns()
        count = self._pace.due(now, self.engine.total)
        end = now + _BUNCH
        for _ in range(count):
            moment = self._pace.moment(self.engine.total + 1)
            self._step(now - moment)
            now = time.monotonic_ns()
            if now > end:
                # The rest stays due; commands are listened to in between.
                break

    def _run_free(self) -> None:
        end = time.monotonic_ns() + _BUNCH
        now = 0
        self._stamps = Stamps(self.get_clock().now().nanoseconds, self.engine.total,
                              _SECOND / self.settings.rate)
        while now < end:
            self._step(0)
            now = time.monotonic_ns()

    def _step(self, lateness_ns: int) -> None:
        self.engine.step()
        self._publish()
        if self.diagnostics is not None:
            one = self.settings
            self.diagnostics.count(
                lateness_ns, _SECOND / (one.rate * (one.speed or 1.0)), one.period)

    def _publish(self) -> None:
        stamp = self._stamp() if self._timer is not None else self._now_stamp()
        self.outputs.publish(self.engine.reading, stamp)

    # --- control ----------------------------------------------------------------------------

    def pause(self, paused: bool) -> None:
        """Pause or resume; simulated time stands while paused."""
        self.stopped = False
        if self.paused and not paused:
            self.paused = False
            self._resume()
        self.paused = paused

    def advance(self, count: int) -> None:
        """Make steps while paused, as fast as possible."""
        self.stopped = False
        for _ in range(count):
            self._step(0)

    def reset(self, *, time: bool) -> None:
        """Go to the initial pose at rest; optionally begin simulated time anew."""
        self._restart(None, time=time)

    def reset_clock(self) -> None:
        """Begin simulated time anew and leave the robot as it is."""
        self.engine.rewind()
        self.outputs.forget()

    def place(self, pose: Pose, twist: BodyTwist) -> None:
        """Put the robot somewhere in some motion."""
        self._restart(pose, time=False, twist=twist)

    def stop(self) -> None:
        """Pause, in the initial state at time zero."""
        self.paused = True
        self.reset(time=True)
        self.stopped = True

    def end(self) -> None:
        """End the node as Ctrl-C does, once the answer to the request is out."""
        self.create_timer(0.2, lambda: leave(self))

    @property
    def reading(self) -> Reading:
        """Return the last step."""
        return self.engine.reading

    @property
    def odom_frame(self) -> str:
        """Frame of poses."""
        return self.settings.odom_frame

    def _restart(self, pose: Pose | None, *, time: bool, twist: BodyTwist | None = None) -> None:
        self.engine.reset(pose, time=time, twist=twist)
        self.outputs.forget()
        if self.paused:
            self._publish()

    def change(self, **values: object) -> None:
        """
        Change live settings and the parameters of the same names.

        Raises
        ------
        SettingsError
            If a value is not allowed.

        """
        self._live.changed(**values)

    def _apply(self, settings: Settings) -> None:
        before = self.settings
        self.engine.configure(settings)
        self.settings = settings
        self.outputs.configure(settings)
        if settings.speed != before.speed:
            self._resume()
        if settings.model != before.model:
            self.get_logger().info(f'model {settings.model!r} runs now')
