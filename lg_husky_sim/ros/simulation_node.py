# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The node's class; :mod:`lg_husky_sim.ros.sim_node` runs it."""

from __future__ import annotations

from collections.abc import Callable
import math
import time
from typing import Any

from lg_husky_sim.ros import conversions
from lg_husky_sim.ros.api import describe_backend, message_type, Node, steady_timer
from lg_husky_sim.ros.clockwork import Clockwork
from lg_husky_sim.ros.control import Control
from lg_husky_sim.ros.diagnostics import Diagnostics
from lg_husky_sim.ros.engine import Engine, Reading
from lg_husky_sim.ros.navigation import Navigation
from lg_husky_sim.ros.neighbours import announce, Neighbours, refuse_doubled
from lg_husky_sim.ros.outputs import Outputs
from lg_husky_sim.ros.parameters import declare_settings, LiveSettings
from lg_husky_sim.ros.settings import Settings
from lg_husky_sim.ros.standard_control import StandardControl
from lg_husky_sim.signals import BodyTwist, Pose
from lg_husky_sim.simulation.compiling import make_ready

_SECOND = 1_000_000_000
#: Shortest time between two looks at the clock [s]; above it, steps come in bunches.
_TICK = 0.001
#: Longest stay in one callback while catching up or running free [ns].
_BUNCH = 20_000_000
#: Time between two messages on /clock while paused, for who joins late [ns].
_REMINDER = 200_000_000
#: Part of the time between two steps that one may take in plain Python while the kernel is
#: compiled for the first time.
_PLAIN = 0.5


class SimNode(Node):
    """
    A Husky in a ROS graph.

    Parameters
    ----------
    name : str
    started : float, optional
        When the process began on ``time.monotonic`` [s], to log how long the start took.
    leave : callable, optional
        Ends the process that runs the node, when a service asks for it; without it, the node is
        a guest in somebody's process and refuses.
    **kwargs
        For the node, such as ``namespace``.

    Raises
    ------
    SettingsError
        If parameters or model file are wrong.

    """

    def __init__(self, name: str, *, started: float | None = None,
                 leave: Callable[[Node], None] | None = None, **kwargs: Any) -> None:
        """Declare, load, publish the first odometry and start the clockwork."""
        super().__init__(name, **kwargs)
        log = self.get_logger()
        log.info(describe_backend())
        self.settings = declare_settings(self)
        refuse_doubled(self, self.settings)
        self.engine = Engine(self.settings)
        self.outputs = Outputs(self, self.settings)
        self.navigation = Navigation(self, self.settings)
        self.diagnostics: Diagnostics | None = None
        if self.settings.publish_diagnostics:
            self.diagnostics = Diagnostics(self)
        self.paused = self.settings.start_paused
        self._leave = leave
        self._timer: Any = None
        self._pending = 0
        self._when_done: list[Callable[[bool], None]] = []
        self._reminded = 0
        self._clockwork = Clockwork(
            lambda: int(self.get_clock().now().nanoseconds), self._follows_clock,
            lambda text: log.warning(text, throttle_duration_sec=1.0))
        # Who waits for the first odometry expects the robot to answer from then on.
        if make_ready(Engine(self.settings).step, _PLAIN / (
                self.settings.rate * (self.settings.speed or 1.0))):
            log.info('the kernel is compiled in the background for the first time; until then '
                     'steps are made without it, and take longer')
        self._publish()
        self._live = LiveSettings(self, self.settings, self._apply)
        self._subscribe()
        self.stopped = False
        self.control = Control(self, self)
        self.standard = StandardControl(self, self)
        self._resume()
        announce(self, self.settings)
        self._neighbours = Neighbours(self, self.settings)
        if started is not None:
            took = time.monotonic() - started
            model = f' and model {self.settings.model}' if self.settings.model else ''
            log.info(f'running with preset {self.settings.preset}{model} at '
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
        one, frame = self.settings, msg.header.frame_id
        pose = conversions.pose_from_msg(msg.pose.pose)
        known = (one.map_frame,) if one.publish_map_tf else (one.map_frame, one.odom_frame)
        if frame not in ('', *known):
            self.get_logger().warning(
                f'initial pose ignored: frame {frame!r} is not {" or ".join(map(repr, known))}',
                throttle_duration_sec=1.0)
        elif not all(math.isfinite(v) for v in (pose.x, pose.y, pose.heading)):
            self.get_logger().warning('initial pose refused: not finite',
                                      throttle_duration_sec=1.0)
        elif one.publish_map_tf:
            self.navigation.correct(pose)
            if self.paused:
                self.navigation.locate(self.engine.reading, self._stamp())
        else:
            self._restart(pose, time=False)

    # --- time -------------------------------------------------------------------------------

    def _follows_clock(self) -> bool:
        """Return whether somebody else's /clock is the authority on time."""
        return not self.settings.publish_clock and bool(
            self.get_parameter('use_sim_time').value)

    def _now_stamp(self) -> int:
        if self.settings.publish_clock:
            return round(self.engine.reading.time * _SECOND)
        return int(self.get_clock().now().nanoseconds)

    def _resume(self) -> None:
        one = self.settings
        self._clockwork.resume(one, self.engine.total)
        if self._timer is not None:
            self.destroy_timer(self._timer)
        period = _TICK if one.speed == 0.0 else max(_TICK, one.period / one.speed)
        self._timer = steady_timer(self, period, self._tick)

    def _stamp(self) -> int:
        if self.settings.publish_clock:
            return round(self.engine.reading.time * _SECOND)
        return self._clockwork.stamp(self.engine.total)

    def _tick(self) -> None:
        if not self.settings.publish_clock:
            self._clockwork.look(self.engine.total)
        if self.paused:
            self._make_pending()
        elif self._clockwork.free:
            self._run_free()
        else:
            self._catch_up()
        if self.diagnostics is not None:
            self.diagnostics.report(
                time.monotonic_ns(), self._now_stamp(), self.settings.rate * self.settings.speed,
                paused=self.paused)

    def _catch_up(self) -> None:
        count = self._clockwork.due(self.engine.total)
        end = time.monotonic_ns() + _BUNCH
        for _ in range(count):
            self._step(self._clockwork.lateness(self.engine.total + 1))
            if time.monotonic_ns() > end:
                # The rest stays due; commands are listened to in between.
                break

    def _run_free(self) -> None:
        end = time.monotonic_ns() + _BUNCH
        while time.monotonic_ns() < end:
            self._step(0)

    def _make_pending(self) -> None:
        # In bunches, so that a long request can be interrupted.
        end = time.monotonic_ns() + _BUNCH
        while self._pending and time.monotonic_ns() < end:
            self._pending -= 1
            self._step(0)
        if not self._pending:
            self._tell_done(True)
        now = time.monotonic_ns()
        if now - self._reminded > _REMINDER:
            self._reminded = now
            self.outputs.remind()

    def _tell_done(self, done: bool) -> None:
        waiting, self._when_done = self._when_done, []
        for tell in waiting:
            tell(done)

    def _interrupt(self) -> None:
        self._pending = 0
        self._tell_done(False)

    def _step(self, lateness_ns: int) -> None:
        self.engine.step()
        self._publish()
        if self.diagnostics is not None:
            one = self.settings
            self.diagnostics.count(
                lateness_ns, _SECOND / (one.rate * (one.speed or 1.0)), one.period)

    def _publish(self) -> None:
        stamp = self._stamp() if self._timer is not None else self._now_stamp()
        # Time first, and the transforms before what they are looked up for.
        self.outputs.clock(stamp)
        self.navigation.locate(self.engine.reading, stamp)
        self.outputs.publish(self.engine.reading, stamp)
        self.navigation.publish(self.engine.reading, stamp)

    # --- control ----------------------------------------------------------------------------

    def pause(self, paused: bool) -> None:
        """Pause or resume; simulated time stands while paused. Ends what is left of steps."""
        self.stopped = False
        self._interrupt()
        if self.paused and not paused:
            self.paused = False
            self._resume()
        self.paused = paused

    def advance(self, count: int, done: Callable[[bool], None] | None = None) -> None:
        """
        Make steps while paused, as fast as possible; others are listened to in between.

        Parameters
        ----------
        count : int
            Number of steps.
        done : callable, optional
            Is told True once all are made, or False if a pause, resume or reset came between.

        """
        self.stopped = False
        self._pending += count
        if done is not None:
            self._when_done.append(done)
        # What takes no time is done when the request is answered.
        self._make_pending()

    def reset(self, *, time: bool) -> None:
        """Go to the initial pose at rest; optionally begin simulated time anew."""
        self.navigation.forget(time=time)
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

    def end(self) -> bool:
        """End the process as Ctrl-C does, once the answer is out; not that of somebody else."""
        leave = self._leave
        if leave is None:
            return False
        steady_timer(self, 0.2, lambda: leave(self))
        return True

    @property
    def reading(self) -> Reading:
        """Return the last step."""
        return self.engine.reading

    @property
    def odom_frame(self) -> str:
        """Frame of poses."""
        return self.settings.odom_frame

    def _restart(self, pose: Pose | None, *, time: bool, twist: BodyTwist | None = None) -> None:
        self._interrupt()
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
        self.navigation.configure(settings)
        if settings.speed != before.speed:
            self._resume()
        if settings.model != before.model:
            self.get_logger().info(f'model {settings.model!r} runs now')
