# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A node that waits for somebody else's /clock says so, and once."""

from __future__ import annotations

from types import SimpleNamespace

from lg_husky_sim.errors import SettingsError
from lg_husky_sim.ros import clockwork
from lg_husky_sim.ros.clockwork import Clockwork
from lg_husky_sim.ros.settings import make_settings
import pytest

SECOND = 10**9


class Times:
    """The steady clock and the node's, and who is the authority."""

    def __init__(self) -> None:
        """Begin by the system's clock, in 2026."""
        self.steady = 7 * SECOND
        self.ros = 1_795_949_000 * SECOND
        self.follows = False


@pytest.fixture
def times(monkeypatch: pytest.MonkeyPatch) -> Times:
    """Return clocks that a test sets."""
    one = Times()
    monkeypatch.setattr(clockwork, 'time', SimpleNamespace(monotonic_ns=lambda: one.steady))
    return one


def started(times: Times) -> tuple[Clockwork, list[str]]:
    """Return a clockwork at 50 Hz that runs, and what it says."""
    said: list[str] = []
    one = Clockwork(lambda: times.ros, lambda: times.follows, said.append)
    one.resume(make_settings(), 0)
    return one, said


def test_a_clock_that_does_not_come_is_missed_once(times: Times) -> None:
    """The node stood still in silence, with nothing in its log."""
    times.follows, times.ros = True, 0
    one, said = started(times)
    for _ in range(49):
        times.steady += SECOND // 10
        one.look(0)
    assert said == []
    for _ in range(200):
        times.steady += SECOND // 10
        one.look(0)
        assert one.due(0) == 0
    assert said == ['use_sim_time is set and nothing has come on /clock for 5 s: the robot stands '
                    'still until it does']
    times.ros = 50 * SECOND
    one.look(0)
    assert one.due(0) == 0
    times.ros += SECOND
    one.look(0)
    assert (one.due(0), len(said)) == (50, 1)


@pytest.mark.parametrize('known', [False, True])
def test_time_of_another_clock_has_not_gone_back(times: Times, known: bool) -> None:
    """Setting use_sim_time was said to be a /clock that "went back by 1795949549.832 s"."""
    one, said = started(times)
    assert one.stamp(0) == times.ros
    times.follows, times.ros = True, 50 * SECOND if known else 0
    one.look(0)
    times.ros = 51 * SECOND
    one.look(0)
    one.look(0)
    times.ros = 52 * SECOND
    one.look(0)
    assert one.due(0) == (100 if known else 50)
    assert one.stamp(50) == (51 if known else 52) * SECOND
    assert said == []
    times.ros = 10 * SECOND
    one.look(50)
    assert said == [f'/clock went back by {41 if known else 42}.000 s; steps and stamps restart '
                    'there']


def test_stamps_end_where_messages_cannot_hold_them(times: Times) -> None:
    """A slow node that was asked for many steps while paused ended: its stamps had no room."""
    one, _ = started(times)
    one.resume(make_settings(rate=1.0, speed=0.001), 0)
    assert one.stamp(1) == times.ros + 1000 * SECOND
    assert one.stamp(10**6) == (2**31 - 1) * SECOND
    for speed in (5e-324, 1e-10, 0.0009):
        with pytest.raises(SettingsError, match=r'is not allowed: 0, or from 0\.001$'):
            make_settings(speed=speed)


def test_a_clock_that_goes_back_before_a_step_is_followed(times: Times) -> None:
    """The node stood still until /clock had come that far again."""
    times.follows, times.ros = True, 2 * 10**9 * SECOND
    one, said = started(times)
    times.ros = 5 * SECOND
    one.look(0)
    assert said == ['/clock went back by 1999999995.000 s; steps and stamps restart there']
    times.ros += SECOND
    one.look(0)
    assert one.due(0) == 50
