# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""How many steps are due; pure functions of clock readings."""

from __future__ import annotations

from dataclasses import dataclass, replace

_SECOND = 1_000_000_000
#: Slowest speed but 0: at less, a few steps are years on the clock of the stamps.
SLOWEST = 0.001
#: Last stamp that a message holds [ns]: builtin_interfaces/Time has 31 bits for its seconds.
LAST_STAMP = (2 ** 31 - 1) * _SECOND


@dataclass(frozen=True)
class Pace:
    """
    Where the simulation stands against the steady clock.

    Parameters
    ----------
    anchor_ns : int
        Steady clock [ns] at ``anchor_step``.
    anchor_step : int
    rate : float
        Steps in a simulated second [Hz].
    speed : float
        Simulated seconds in a second; positive.

    """

    anchor_ns: int
    anchor_step: int
    rate: float
    speed: float

    def due(self, now_ns: int, done: int) -> int:
        """
        Return how many steps are due.

        Counted from the anchor, so that neither jitter nor rounding adds up: after any number
        of late calls, exactly as many steps are done as periods have passed.

        Parameters
        ----------
        now_ns : int
            Steady clock [ns].
        done : int
            Steps done so far.

        """
        passed = (now_ns - self.anchor_ns) * self.rate * self.speed / _SECOND
        return max(0, self.anchor_step + int(passed + 1e-6) - done)

    def moment(self, step: int) -> int:
        """Return when a step is due on the steady clock [ns]."""
        return self.anchor_ns + round(
            (step - self.anchor_step) * _SECOND / (self.rate * self.speed))

    def changed(self, now_ns: int, done: int, speed: float) -> Pace:
        """Return the pace from now on at another speed."""
        return replace(self, anchor_ns=now_ns, anchor_step=done, speed=speed)


@dataclass(frozen=True)
class Stamps:
    """
    Stamps of messages: one for each step, evenly spaced.

    Parameters
    ----------
    anchor_ns : int
        Stamp [ns] of ``anchor_step``.
    anchor_step : int
    spacing : float
        Between steps [ns].

    """

    anchor_ns: int
    anchor_step: int
    spacing: float

    def of(self, step: int) -> int:
        """Return the stamp of a step [ns]."""
        return self.anchor_ns + round((step - self.anchor_step) * self.spacing)
