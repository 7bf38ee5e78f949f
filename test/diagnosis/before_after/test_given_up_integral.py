# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What becomes of the integral of the base's wheel loop while nothing is asked for."""

from __future__ import annotations

from lg_husky_sim.diagnosis.before_after.base import base_of
from lg_husky_sim.diagnosis.before_after.base_names import OUTPUTS
from lg_husky_sim.diagnosis.before_after.drives import drives
from lg_husky_sim.diagnosis.before_after.motion import moved
from lg_husky_sim.diagnosis.before_after.settings import settings
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.recording import Recording
from lg_husky_sim.signals import FloatArray, TimeSeries
import numpy as np
import pytest

KNOWN = settings()
SECONDS, STOP = 12.0, 6.0
#: Given up within a step or two where the wheels stand.
GIVEN_UP = {'rest_leak': 100.0, 'rest_speed': 0.05}


def rates(read: float | None, **values: float) -> FloatArray:
    """
    Return the rate of the left wheels [rad/s]: 6 s at 0.8 m/s, then rest.

    The encoders read `read` at rest; without it there are none.
    """
    of = base_of(KNOWN, load_model().parameters, False)
    times = np.arange(0.0, SECONDS, 0.05)
    command = np.column_stack([np.where(times < STOP, 0.8, 0.0), np.zeros(times.size)])
    at = np.arange(0.0, SECONDS, 0.02)
    streams = {'command': TimeSeries(times, command, ('forward', 'yaw')),
               'imu': TimeSeries(at, np.zeros((at.size, 3)), ('yaw_rate', 'accel_x', 'accel_y'))}
    if read is not None:
        seen = np.where(at < 0.5, 0.0, np.where(at < STOP, 4.8, read))
        streams['wheels'] = TimeSeries(at, np.column_stack([seen, seen]), ('left', 'right'))
    (drive,) = drives(Recording('rec1', 'rec1', streams, 0), KNOWN.simulation['step'], KNOWN.bins,
                      0.5, 3.0)
    robot = dict(zip(of.names, of.values(of.start), strict=True))
    robot.update(loop_gain=1.0, loop_integral=8.0, slew_forward=50.0, dead_time=0.0, **values)
    motion = moved(of, drive, np.array([[robot[name] for name in of.names]]))
    found: FloatArray = motion[:, OUTPUTS.index('left'), 0]
    return found


def begun(read: float | None, **values: float) -> float:
    """Return the rate at which the wheels still roll half a second after the stop [rad/s]."""
    after = int((STOP + 0.5) / KNOWN.simulation['step'])
    return float(rates(read, **values)[after])


def test_an_integral_is_kept_as_long_as_the_wheels_are_seen_to_turn() -> None:
    kept = begun(0.3, rest_leak=0.0001)
    assert abs(kept) > 0.05
    assert begun(0.3, **GIVEN_UP) == pytest.approx(kept, rel=0.01)


def test_it_is_given_up_where_they_stand() -> None:
    kept = begun(0.0, rest_leak=0.0001)
    assert abs(begun(0.0, **GIVEN_UP)) < 0.2 * abs(kept)


def test_a_driver_that_only_looks_at_the_command_does_not_wait_for_the_wheels() -> None:
    at_once = {'rest_leak': 100.0, 'rest_speed': 30.0}
    assert np.allclose(rates(0.3, **at_once), rates(0.0, **at_once), rtol=0.0, atol=1e-9)


def test_without_encoders_a_stop_is_what_is_asked_for() -> None:
    assert np.array_equal(rates(None, **GIVEN_UP), rates(0.0, **GIVEN_UP))


def test_nothing_is_given_up_while_something_is_asked_for() -> None:
    until = int(STOP / KNOWN.simulation['step'])
    kept, given_up = (rates(0.0, **one)[:until] for one in ({'rest_leak': 0.0001}, GIVEN_UP))
    assert np.array_equal(kept, given_up)
