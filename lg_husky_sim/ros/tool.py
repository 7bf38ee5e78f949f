# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What the live tools share: a node found its robot, a clock, and an orderly end."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
import math
import os
import signal
import time
from types import FrameType, TracebackType
from typing import Any

from lg_husky_sim.errors import CommandError, SettingsError
from lg_husky_sim.ros import api
from lg_husky_sim.ros.graph import find_robots, NAMED, Robot, the_one
from lg_husky_sim.ros.parameters import given_settings
from lg_husky_sim.ros.settings import BY_NAME, DEFAULT_PRESET, make_settings, Settings

#: What a tool says to its user.
Say = Callable[[str], object]
#: Longest stay in one wait [s]; constant, for rclpy forgets who is ready when it changes.
WAIT = 0.01
#: Time between two looks at who is in the graph [s].
LOOK = 0.1
#: Longest time between the first and the last robot that are told of [s]. Fast DDS announces a
#: process every 3 s (its `leaseAnnouncement`): of three robots that were there, one was told of at
#: once and the others after 2 s. Cyclone tells of all at once.
OTHERS = 3.5
_ENDS = ('SIGINT', 'SIGTERM', 'SIGHUP')


class Ended(Exception):
    """Somebody asked the tool to end: a signal, or the death of the process that started it."""


class Orderly:
    """
    Turns signals, and the death of the parent process, into a request to end.

    A tool that moves a robot must still be in the graph when it is asked to end, so that it can
    stop the robot; the middleware's own handlers would take it out. Use it as a context.
    """

    def __init__(self) -> None:
        """Remember who started this process."""
        self._before: dict[int, Any] = {}
        self._parent = os.getppid()
        self._asked = False
        self._last: Tool | None = None
        self._since = math.inf

    def _ask(self, number: int, frame: FrameType | None) -> None:
        self._asked = True

    def __enter__(self) -> Orderly:
        """Take the signals."""
        for name in _ENDS:
            if hasattr(signal, name):
                number = getattr(signal, name)
                if name != 'SIGHUP' or signal.getsignal(number) != signal.SIG_IGN:
                    self._before[number] = signal.signal(number, self._ask)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        """Give them back."""
        for number, handler in self._before.items():
            signal.signal(number, handler)

    @property
    def over(self) -> bool:
        """Whether the tool was asked to end."""
        return self._asked or os.getppid() != self._parent

    def check(self) -> None:
        """
        Go on, or end.

        Raises
        ------
        Ended
            If the tool was asked to.

        """
        if self.over:
            raise Ended

    def entered(self) -> None:
        """Take note that the process is in the graph from now on, if it was not before."""
        self._since = min(self._since, time.monotonic())

    @property
    def acquainted(self) -> bool:
        """Whether the process has been in the graph for so long that it was told of all others."""
        return time.monotonic() >= self._since + OTHERS

    def hand_over(self, tool: Tool | None) -> None:
        """
        Keep a tool in the graph until the next one has joined; leave with the one kept so far.

        Fast DDS leaves the graph with the last node of a process, and is told of the others
        again only within the 3 s of :data:`OTHERS`; a tool would miss what they say until then.
        """
        last, self._last = self._last, tool
        if last is not None:
            last.close()


class Tool:
    """
    A node in the graph that serves a robot of a preset.

    Parameters
    ----------
    name : str
        Of the node.
    orderly : Orderly
    namespace : str, optional
        Of the robot.

    """

    def __init__(self, name: str, orderly: Orderly, namespace: str | None = None) -> None:
        """Join the graph."""
        self.orderly = orderly
        self.node = api.Node(name, namespace=namespace or '')
        orderly.entered()
        self._executor = api.SingleThreadedExecutor()
        self._executor.add_node(self.node)
        orderly.hand_over(None)
        self.simulated = bool(self.node.get_parameter('use_sim_time').value)

    def now(self) -> float:
        """Return the steady clock [s], or with ``use_sim_time`` the time of /clock."""
        if self.simulated:
            return float(self.node.get_clock().now().nanoseconds) * 1e-9
        return time.monotonic()

    def wait_for_time(self, seconds: float) -> None:
        """
        Wait until simulated time is known: what is paced from zero on would come all at once.

        Raises
        ------
        CommandError
            If nobody publishes /clock.

        """
        end = time.monotonic() + seconds
        while self.simulated and self.now() == 0.0:
            self.serve()
            if time.monotonic() > end:
                raise CommandError(f'use_sim_time is set and nothing was received on /clock for '
                                   f'{seconds:g} s')

    def serve(self) -> None:
        """
        Serve what is ready, waiting for a short while.

        Raises
        ------
        Ended
            If the tool was asked to end.

        """
        self.orderly.check()
        self._executor.spin_once(timeout_sec=WAIT)

    def serve_until(self, moment: float) -> None:
        """
        Serve callbacks until :meth:`now` has come to a moment [s].

        Raises
        ------
        CommandError
            If /clock goes back meanwhile: what is paced by it would be silent until it is there
            again.

        """
        last = self.now()
        while True:
            now = self.now()
            left = moment - now
            if left <= 0.0:
                return
            if now < last:
                raise CommandError(f'/clock went back by {last - now:.3f} s')
            last = now
            if not self.simulated and left < 2.0 * WAIT:
                self.orderly.check()
                time.sleep(left)
            else:
                self.serve()

    def settings(self, given: Mapping[str, object]) -> Settings:
        """
        Return the settings of the robot, with what ``-p`` gives over what the caller gives.

        Parameters of other nodes are none of ours, as everywhere in ROS; a warning names them.
        """
        return make_settings({**given, **given_settings(self.node)})

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self.node.destroy_node()


class Elapsed:
    """
    The time that has passed on a clock [s], counted whenever it is called.

    A clock that is set back, as /clock with a simulation that begins anew, goes on from there.

    Parameters
    ----------
    now : callable
        The clock [s], such as :meth:`Tool.now`.

    """

    def __init__(self, now: Callable[[], float]) -> None:
        """Begin now."""
        self._now, self._last, self._passed = now, now(), 0.0

    def __call__(self) -> float:
        """Return the time since the beginning [s]."""
        last, self._last = self._last, self._now()
        self._passed += max(0.0, self._last - last)
        return self._passed


def _said(arguments: Sequence[str], name: str) -> str | None:
    # The value of a remapping such as __ns:=/a, or of a parameter, in --ros-args.
    for word in arguments:
        left, mark, right = word.partition(':=')
        if mark and left == name:
            return right
    return None


@contextmanager
def joined(arguments: Sequence[str] = ()) -> Iterator[Orderly]:
    """
    Join the graph and leave it again, whatever happens.

    Parameters
    ----------
    arguments : sequence of str
        What stands behind ``--ros-args``.

    """
    with Orderly() as orderly:
        try:
            api.join(['lg_husky', '--ros-args', *arguments])
            yield orderly
        except api.ROS_ERRORS as error:
            raise SettingsError(api.reason(error)) from error
        finally:
            orderly.hand_over(None)
            api.try_shutdown()


def look_for(orderly: Orderly, *, preset: str | None, namespace: str | None, wait: float,
             named: Mapping[str, object]) -> Robot | None:
    """
    Look for the Husky in the graph.

    Parameters
    ----------
    orderly : Orderly
        Says when the tool was asked to end.
    preset, namespace : str, optional
        Look for these only.
    wait : float
        How long to look for the first [s]; for others, :data:`OTHERS` longer.
    named : mapping of str to object
        Topics and types by which to look for it, by setting.

    Returns
    -------
    Robot or None
        None where there is none.

    Raises
    ------
    SettingsError
        If there are several.

    """
    tool = Tool('lg_husky_look', orderly)
    try:
        end = time.monotonic() + wait
        seen = False
        while True:
            topics = dict(tool.node.get_topic_names_and_types())
            robots = find_robots(topics, preset=preset, namespace=namespace, named=named)
            if robots and not seen:
                seen = True
                end = time.monotonic() + OTHERS
            if time.monotonic() >= end:
                robot = the_one(robots)
                orderly.hand_over(tool)
                return robot
            until = time.monotonic() + LOOK
            while time.monotonic() < until:
                tool.serve()
    except BaseException:
        tool.close()
        raise


def choose(orderly: Orderly, arguments: Sequence[str], *, preset: str | None = None,
           namespace: str | None = None, wait: float = 10.0, say: Say = print
           ) -> tuple[str, str | None]:
    """
    Return preset and namespace of the robot to serve.

    What the command line says counts, then what ROS arguments say, then ``ROS_NAMESPACE``, then
    the only robot in the graph.

    Parameters
    ----------
    orderly : Orderly
        Says when the tool was asked to end.
    arguments : sequence of str
        What stands behind ``--ros-args``.
    preset, namespace : str, optional
        From the command line.
    wait : float
        How long to look for a robot [s].
    say : callable
        Is told what is looked for, before it takes its time, and what was found.

    Raises
    ------
    CommandError
        If there is no Husky in the graph.
    SettingsError
        If there are several, or the preset is unknown.

    """
    preset = preset or _said(arguments, 'preset')
    if preset is not None:
        BY_NAME['preset'].checked(preset)
    remapped = _said(arguments, '__ns')
    place = namespace or remapped or os.environ.get('ROS_NAMESPACE') or None
    if preset is None or place is None:
        named = {name: said for name in NAMED if (said := _said(arguments, name)) is not None}
        wait = wait if preset is None else min(wait, OTHERS)
        say(f'looking for the robot (up to {wait:g} s), then for others ({OTHERS:g} s)')
        robot = look_for(orderly, preset=preset, namespace=place, wait=wait, named=named)
        if robot is not None:
            say(f'found {robot.words()}')
            preset, place = robot.preset, place or robot.namespace
        elif preset is None:
            where = f'below {place} ' if place else ''
            by = ', '.join(f'{name} {said}' for name, said in named.items())
            raise CommandError(
                f'no robot {f"with {by} " if by else ""}is {where}in the graph '
                f'({api.describe_backend()}) after {wait:g} s; '
                f'start it, or name its topics: --preset {DEFAULT_PRESET} or '
                f'{", ".join(BY_NAME["preset"].choices[1:])}')
    return preset, None if remapped and not namespace else place
