# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""A base that smooths its commands by a first-order low pass."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.errors import ParameterError
from lg_husky_sim.husky.effects import Effect, Onset, OnsetKind
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import BodyTwist, FloatArray, TimeSeries
from lg_husky_sim.simulation.events import COLUMNS, Events, Propagator
import numpy as np
import pytest

Maker = Callable[..., Plant]
LAG = Effect('command_slew', shape='lag')
STAMPS = np.array([0.0, 0.37, 0.91, 1.3])
VALUES = np.array([[0.6, 0.0], [0.2, 0.5], [-0.4, -0.3], [0.0, 0.0]])
TIMES = np.linspace(0.01, 2.0, 87)


def driven(plant: Plant, stamps: FloatArray, values: FloatArray) -> FloatArray:
    propagator = Propagator(plant)
    events = Events(TimeSeries(stamps, values, ('forward', 'yaw')), TIMES, start=0.0)
    return propagator.run(events, propagator.initial())


@pytest.mark.parametrize('lag', [0.02, 0.3])
def test_the_voltage_follows_a_step_exponentially(robot: Maker, lag: float) -> None:
    out = driven(robot(LAG, command_lag=lag), np.zeros(1), np.array([[0.5, 0.0]]))
    expected = 24.0 * 0.8961 * 0.5 * -np.expm1(-TIMES / lag)
    for name in ('voltage_left', 'voltage_right'):
        np.testing.assert_allclose(out[:, COLUMNS.index(name)], expected, rtol=1e-9)


@pytest.mark.parametrize('effects', [(), ('speed_loop',), ('coulomb_drivetrain', 'slope'),
                                     ('battery_sag',)])
@pytest.mark.parametrize('times', [1.0, 2.5], ids=['usual', 'clipped'])
def test_it_is_the_same_robot_behind_a_low_pass(
    robot: Maker, effects: tuple[str, ...], times: float,
) -> None:
    """The plain robot, told every half millisecond what the low pass says, does the same."""
    lag, fine = 0.15, np.linspace(0.0, 2.0, 4000, endpoint=False)
    values = np.asarray(VALUES * times, dtype=np.float64)
    held = values[np.searchsorted(STAMPS, fine, side='right') - 1]
    smooth, last = np.empty_like(held), np.zeros(2)
    for k, wanted in enumerate(held):
        # The mean over the half millisecond that the value is held for.
        nearer = np.exp(-0.0005 / lag)
        mean = (1.0 - nearer) * lag / 0.0005
        smooth[k] = wanted + (last - wanted) * mean
        last = wanted + (last - wanted) * nearer
    out = driven(robot(LAG, *effects, command_lag=lag), STAMPS, values)
    same = driven(robot(*effects), fine, smooth)
    for name in ('wheel_left', 'wheel_right', 'yaw_rate', 'x', 'y', 'heading'):
        k = COLUMNS.index(name)
        np.testing.assert_allclose(out[:, k], same[:, k], atol=2e-3 * times, err_msg=name)
    if times > 1.0 and 'speed_loop' not in effects:
        volts = np.abs(out[:, COLUMNS.index('voltage_left')])
        assert 23.0 < volts.max() < 24.001
    without = driven(robot(*effects), STAMPS, values)
    assert np.abs(without[:, 0] - out[:, 0]).max() > 0.5


def test_it_is_there_from_the_start_and_others_may_begin_later(robot: Maker) -> None:
    onset = Onset(OnsetKind.TIME, 0.5)
    with pytest.raises(ParameterError, match='command_slew:lag'):
        robot(Effect('command_slew', shape='lag', late=True), onset=onset)
    late = Effect('coulomb_drivetrain', late=True)
    both = driven(robot(LAG, late, onset=onset), STAMPS, VALUES)
    alone = driven(robot(LAG), STAMPS, VALUES)
    np.testing.assert_allclose(both[TIMES < 0.5], alone[TIMES < 0.5], atol=1e-9)
    assert np.abs(both[-1] - alone[-1]).max() > 1e-3


def test_a_base_that_moves_has_settled_on_its_command(robot: Maker) -> None:
    plant = robot(LAG, command_lag=0.4)
    propagator = Propagator(plant)
    told = BodyTwist(0.5, 0.0)
    events = Events(TimeSeries(np.zeros(1), np.array([[0.5, 0.0]]), ('forward', 'yaw')), TIMES,
                    start=0.0)
    out = propagator.run(events, propagator.initial(twist=told, command=told))
    start = out[0, COLUMNS.index('voltage_left')]
    assert start == pytest.approx(24.0 * 0.8961 * 0.5, rel=0.2)
