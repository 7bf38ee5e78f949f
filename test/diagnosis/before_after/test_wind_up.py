# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What the integral of the base's wheel loop does while the motors cannot do as it asks."""

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
SECONDS = 12.0


def rates(**values: float) -> FloatArray:
    """Return the rate of the left wheels [rad/s] in steps of 10 ms: 6 s at 0.8 m/s, then rest."""
    of = base_of(KNOWN, load_model().parameters, False)
    times = np.arange(0.0, SECONDS, 0.05)
    command = np.column_stack([np.where(times < 6.0, 0.8, 0.0), np.zeros(times.size)])
    at = np.arange(0.0, SECONDS, 0.02)
    streams = {'command': TimeSeries(times, command, ('forward', 'yaw')),
               'wheels': TimeSeries(at, np.zeros((at.size, 2)), ('left', 'right')),
               'imu': TimeSeries(at, np.zeros((at.size, 3)), (
                   'yaw_rate', 'accel_x', 'accel_y'))}
    (drive,) = drives(Recording('rec1', 'rec1', streams, 0), KNOWN.simulation['step'], KNOWN.bins,
                      0.5, 3.0)
    robot = dict(zip(of.names, of.values(of.start), strict=True))
    robot.update(loop_gain=1.0, loop_integral=20.0, slew_forward=50.0, **values)
    motion = moved(of, drive, np.array([[robot[name] for name in of.names]]))
    found: FloatArray = motion[:, OUTPUTS.index('left'), 0]
    return found


def overshoot(rate: FloatArray) -> float:
    """Return by how much the rate is beyond the one that is reached."""
    until = int(6.0 / KNOWN.simulation['step'])
    return float(rate[:until].max() - rate[until - 100:until].mean())


def test_a_loop_that_is_not_told_of_the_limit_of_the_current_winds_up() -> None:
    limited = {'current_limit': 5.0}
    told, half, not_told = (overshoot(rates(**limited, windup=share)) for share in (0.0, 0.5, 1.0))
    assert not_told > half + 0.3
    assert half > told + 0.3
    free = rates(current_limit=100.0, windup=0.0)
    assert np.array_equal(free, rates(current_limit=100.0, windup=1.0))


@pytest.mark.parametrize('windup', [0.0, 1.0])
def test_a_limit_of_the_voltage_winds_nothing_up(windup: float) -> None:
    saturated = rates(voltage_limit=10.0, windup=windup)
    until = int(6.0 / KNOWN.simulation['step'])
    reached = saturated[until - 1]
    assert 1.0 < reached < 0.8 * 0.8 / 0.165
    # It lets go as soon as less is asked for: three quarters of the rate are gone within 0.4 s.
    assert saturated[until + int(0.4 / KNOWN.simulation['step'])] < 0.25 * reached
