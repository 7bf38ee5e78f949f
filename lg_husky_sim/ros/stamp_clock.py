# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The clock of a robot's stamps, seen from when its messages arrive."""

from __future__ import annotations

from collections import deque
import math

#: How much of the past is remembered [s], and samples at most.
_WINDOW, _MOST = 2.0, 400


class StampClock:
    """
    Tells what a robot's stamps would say now.

    A robot may live in simulated time, at any speed, or stand still: what has no stamp (a Twist)
    is placed among what has one. It is never put further ahead than the next message is due.
    """

    def __init__(self) -> None:
        """Know nothing yet."""
        self._seen: deque[tuple[float, float]] = deque(maxlen=_MOST)

    def observe(self, arrival: float, stamp: float) -> bool:
        """
        Take in a message.

        Parameters
        ----------
        arrival : float
            On a steady clock [s].
        stamp : float
            Of its header [s].

        Returns
        -------
        bool
            False if the robot's time has begun anew since the last message.

        """
        again = bool(self._seen) and stamp < self._seen[-1][1] - 0.5
        if again:
            self._seen.clear()
        if not self._seen or stamp > self._seen[-1][1]:
            self._seen.append((arrival, stamp))
        while len(self._seen) > 2 and arrival - self._seen[0][0] > _WINDOW:
            self._seen.popleft()
        return not again

    def now(self, arrival: float) -> float:
        """Return the stamp that belongs to a moment on the steady clock [s]; NaN if unknown."""
        if not self._seen:
            return math.nan
        (first, begun), (last, latest) = self._seen[0], self._seen[-1]
        if last <= first:
            return latest
        pace = (latest - begun) / (last - first)
        gap = (latest - begun) / (len(self._seen) - 1)
        # The message that came through fastest says where the stamps stand.
        ahead = max(stamp - pace * moment for moment, stamp in self._seen)
        return min(max(pace * arrival + ahead, latest), latest + gap)
