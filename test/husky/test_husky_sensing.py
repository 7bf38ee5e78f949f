# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What sensors feel and count: specific force, increments of angles, each its own side."""

from __future__ import annotations

from collections.abc import Callable

from lg_husky_sim.husky.effects import Effect, Onset, OnsetKind
from lg_husky_sim.husky.model_file import load_model
from lg_husky_sim.husky.plant import Plant
from lg_husky_sim.signals import Pose, TimeSeries
from lg_husky_sim.simulation import Simulator
from lg_husky_sim.simulation.events import trajectory
import numpy as np
import pytest

Maker = Callable[..., Plant]
NAMES = ('forward', 'yaw')


def series(*rows: tuple[float, float, float]) -> TimeSeries:
    """Return commands of rows of stamp, forward speed and yaw rate."""
    given = np.array(rows)
    return TimeSeries(given[:, 0], given[:, 1:], NAMES)


@pytest.mark.parametrize(('heading', 'sign'), [(0.0, 1.0), (np.pi, -1.0)])
def test_an_accelerometer_on_a_slope_gives_specific_force(robot: Maker, heading: float,
                                                          sign: float) -> None:
    """Gravity pulls along x with 60 N; at steady speed the robot holds against it."""
    plant = robot('slope', slope_x=60.0, slope_y=0.0)
    end = trajectory(plant, series((0.0, 0.4, 0.0)), [8.0], pose=Pose(0.0, 0.0, heading))
    mass = load_model().parameters['mass']
    assert end.column('accel_x')[0] == pytest.approx(-sign * 60.0 / mass, rel=1e-3)


@pytest.mark.parametrize('effects', [(), ('rolling_resistance',), ('belt_compliance',)])
def test_on_the_flat_it_is_the_derivative_of_the_speed(robot: Maker, effects: tuple[str, ...]
                                                       ) -> None:
    """Sign and efforts included: positive when speeding up, negative when braking."""
    times = np.linspace(0.02, 1.9, 400)
    step = 1e-5
    drive = series((0.0, 0.6, 0.0), (1.0, -0.4, 0.0))
    after, before = (trajectory(robot(*effects), drive, times + shift, start=0.0)
                     for shift in (step, -step))
    slope = (after.column('forward') - before.column('forward')) / (2.0 * step)
    seen = trajectory(robot(*effects), drive, times).column('accel_x')
    away = np.abs(times - 1.0) > 2.0 * step
    np.testing.assert_allclose(seen[away], slope[away], rtol=0, atol=2e-3)
    assert seen[5] > 0.3
    assert seen[np.searchsorted(times, 1.02)] < -0.3


def test_another_encoder_factor_does_not_move_what_was_counted(robot: Maker) -> None:
    """From the onset on the left encoder counts a tenth more; its angle does not jump."""
    plant = robot(Effect('encoder_scale', 'left', late=True), onset=Onset(OnsetKind.TIME, 4.0),
                  encoder_factor=1.1)
    times = np.linspace(0.0, 8.0, 801)
    truth = trajectory(plant, series((0.0, 0.6, 0.0)), times)
    seen = plant.observe(truth)
    counted, turned = (np.diff(one.column('angle_left')) for one in (seen, truth))
    late = times[1:] >= 4.0
    np.testing.assert_allclose(counted[~late], turned[~late], rtol=0, atol=1e-9)
    np.testing.assert_allclose(counted[late], 1.1 * turned[late], rtol=0, atol=1e-9)
    np.testing.assert_allclose(seen.column('angle_right'), truth.column('angle_right'),
                               rtol=1e-13)


def test_angles_and_plays_stay_on_their_sides(robot: Maker) -> None:
    """Start angles are not exchanged, and an encoder runs ahead by the play of its own gear."""
    drive = series((0.0, 0.0, 0.8))
    start = trajectory(robot(), drive, [0.0], wheel_angles=(3.0, -7.0))
    assert start.column('angle_left')[0] == 3.0
    assert start.column('angle_right')[0] == -7.0
    plain, loose = (trajectory(robot(*effects, **values), drive, [2.0], wheel_angles=(3.0, -7.0))
                    for effects, values in (((), {}), (('gear_backlash',), {'play': 0.2})))
    # Turning to the left, the left motor runs back by half of its play, the right one ahead.
    for side, sign in (('left', -1.0), ('right', 1.0)):
        gained = loose.column(f'angle_{side}')[0] - plain.column(f'angle_{side}')[0]
        assert np.sign(gained) == sign
        assert abs(gained) < 0.1


def test_late_poses_are_late_in_heading_too(robot: Maker) -> None:
    plant = robot(Effect('sensor_time_offset', shape='pose'), stamp_delay=0.1)
    times = np.linspace(0.0, 3.0, 301)
    truth = trajectory(plant, series((0.0, 0.5, 0.6)), times)
    seen = plant.observe(truth)
    for name in ('x', 'y', 'heading'):
        np.testing.assert_allclose(seen.column(name)[10:], truth.column(name)[:-10], atol=1e-9)
        assert abs(seen.column(name)[-1] - truth.column(name)[-1]) > 5e-3
    np.testing.assert_array_equal(seen.column('yaw_rate'), truth.column('yaw_rate'))


def test_a_ripple_does_not_drive_a_robot_that_rests(robot: Maker) -> None:
    """A minute without a command: it stays where it is, and ripples when it drives."""
    plant = robot(Effect('torque_ripple', 'left'), ripple_cos=3.0, ripple_sin=1.0)
    still = trajectory(plant, series((0.0, 0.0, 0.0)), [60.0])
    for name in ('x', 'y', 'heading', 'angle_left'):
        assert still.column(name)[0] == 0.0
    moving = trajectory(plant, series((0.0, 0.5, 0.0)), np.linspace(3.0, 6.0, 200))
    assert np.ptp(moving.column('yaw_rate')) > 1e-3


def test_a_late_set_begins_at_its_time_and_no_step_later(robot: Maker) -> None:
    """Stepped at 20 ms, with an onset in the middle of a step: half a step of it shows."""
    onset = Onset(OnsetKind.TIME, 0.51)
    plant = robot(Effect('yaw_pull', late=True), onset=onset, pull_moment=20.0)
    simulator = Simulator(plant, 0.02)
    _, out = simulator.run(simulator.initial(), np.tile([0.6, 0.0], (30, 1)))
    same = trajectory(plant, series((0.0, 0.6, 0.0)), 0.02 * np.arange(1, 31))
    np.testing.assert_allclose(out[:, :13], same.values[:, :13], rtol=0, atol=1e-6)
    assert np.all(out[:25, 3] == pytest.approx(0.0, abs=1e-9))
    assert abs(out[25, 3]) > 1e-3


def test_wheel_rates_are_means_over_the_time_that_the_docs_say() -> None:
    from pathlib import Path

    import lg_husky_sim as lg
    from lg_husky_sim.husky.plant import ENCODER_WINDOW
    seen = lg.Husky().simulate('straight', rate=200.0)
    rates, angles = seen.wheels.values[:, 0], seen.wheel_angles.values[:, 0]
    back = round(200.0 * ENCODER_WINDOW)
    np.testing.assert_allclose(
        rates[back:], (angles[back:] - angles[:-back]) / ENCODER_WINDOW, atol=1e-9)
    page = Path(__file__).resolve().parents[2] / 'docs' / 'simulate_and_compare.md'
    words = f'{1e3 * ENCODER_WINDOW:g} ms before its stamp'
    assert words in page.read_text(encoding='utf-8')
    assert words in (lg.Husky.simulate.__doc__ or '')
