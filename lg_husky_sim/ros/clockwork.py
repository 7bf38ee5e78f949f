# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""When each step is due and which stamp it gets; knows clocks as functions, and no node."""

from __future__ import annotations

from collections.abc import Callable
import time

from lg_husky_sim.ros.pacing import LAST_STAMP, Pace, Stamps
from lg_husky_sim.ros.settings import Settings

_SECOND = 1_000_000_000
#: A ROS clock that moves against the steady one by this much between two looks has jumped [ns].
_JUMP = 100_000_000
#: Silence on /clock after which it is said that the robot waits for it [ns]; Fast DDS may tell of
#: its publisher after 3 s only.
_SILENCE = 5 * _SECOND


class Clockwork:
    """
    Pace and stamps of the node.

    The steady clock paces, so that no jump of another clock makes the robot stand or run. Only
    where somebody else is the authority on time (``use_sim_time`` without ``publish_clock``) the
    steps follow /clock. Stamps go backwards only with simulated time.

    Parameters
    ----------
    ros_now : callable
        The node's clock [ns].
    follows : callable
        Whether that clock is the authority.
    warn : callable
        Is told of jumps, and of a /clock that does not come.

    """

    def __init__(self, ros_now: Callable[[], int], follows: Callable[[], bool],
                 warn: Callable[[str], object]) -> None:
        """Stand still until :meth:`resume`."""
        self._ros_now, self._follows, self._warn = ros_now, follows, warn
        self._following = self._heard = self._missed = False
        self._since = 0
        self._last = 0
        self._offset = 0

    def resume(self, settings: Settings, total: int) -> None:
        """
        Go on from now.

        Parameters
        ----------
        settings : Settings
            Rate and speed.
        total : int
            Steps done so far.

        """
        self._settings = settings
        self._following = self._follows()
        self._since = time.monotonic_ns()
        speed = 1.0 if self._following else settings.speed or 1.0
        now = self._ros_now()
        self._heard = now > 0
        self._pace = Pace(now if self._following else time.monotonic_ns(), total, settings.rate,
                          speed)
        if self._following:
            # A clock that goes back before the next step goes back, too.
            self._last = now
        else:
            # Steps made while paused may have gone ahead of the clock.
            now = max(now, self._last)
        self._stamps = Stamps(now, total, _SECOND / (settings.rate * speed))
        self._offset = self._ros_now() - time.monotonic_ns()

    def _now(self) -> int:
        return self._ros_now() if self._following else time.monotonic_ns()

    @property
    def free(self) -> bool:
        """Whether steps are made as fast as possible."""
        return self._settings.speed == 0.0 and not self._following

    def look(self, total: int) -> None:
        """Notice jumps of the clocks; call before asking what is due."""
        if self._follows() != self._following:
            if not self._following:
                # Stamps of another clock; /clock does not run back from them.
                self._last, self._missed = 0, False
            self.resume(self._settings, total)
            return
        now = self._ros_now()
        if self._following:
            if now > 0 and not self._heard:
                # The first word of /clock says where time stands, not that it has passed.
                self.resume(self._settings, total)
            elif not self._heard:
                self._miss()
            elif now < self._last:
                self._warn(f'/clock went back by {(self._last - now) / _SECOND:.3f} s; steps and '
                           'stamps restart there')
                self._last = 0
                self.resume(self._settings, total)
            return
        moved = now - time.monotonic_ns() - self._offset
        if abs(moved) <= _JUMP:
            return
        self._offset += moved
        if moved > 0:
            self._warn(f'the clock jumped by {moved / _SECOND:+.3f} s; stamps follow it')
            self._stamps = Stamps(self._stamps.anchor_ns + moved, self._stamps.anchor_step,
                                  self._stamps.spacing)
        else:
            self._warn(f'the clock jumped by {moved / _SECOND:+.3f} s; stamps never go '
                       'backwards and continue as before')

    def _miss(self) -> None:
        if not self._missed and time.monotonic_ns() - self._since >= _SILENCE:
            self._missed = True
            self._warn(f'use_sim_time is set and nothing has come on /clock for '
                       f'{_SILENCE / _SECOND:g} s: the robot stands still until it does')

    def due(self, total: int) -> int:
        """Return how many steps are due."""
        return self._pace.due(self._now(), total)

    def lateness(self, step: int) -> int:
        """Return for how long a step has been due [ns]."""
        return self._now() - self._pace.moment(step)

    def stamp(self, total: int) -> int:
        """Return the stamp of the step that was done last [ns]."""
        if self.free:
            # More steps than time: each gets its moment, and no two the same.
            self._stamps = Stamps(max(self._ros_now(), self._last + 1), total,
                                  self._stamps.spacing)
        self._last = min(max(self._last, self._stamps.of(total)), LAST_STAMP)
        return self._last
