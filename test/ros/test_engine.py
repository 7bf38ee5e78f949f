# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The robot in lock step: command timeout, limits, odometry, sensors; no middleware."""

from __future__ import annotations

from dataclasses import replace
import math
from pathlib import Path

from lg_husky_sim.errors import SettingsError
from lg_husky_sim.husky.effects import Effect, Onset, OnsetKind
from lg_husky_sim.husky.model_file import load_model, ModelFile, save_model
from lg_husky_sim.ros.engine import limited
from lg_husky_sim.ros.settings import make_settings
from lg_husky_sim.signals import BodyTwist
from lg_husky_sim.testing.lockstep import LockStepHusky
import numpy as np
import pytest

AHEAD = BodyTwist(0.5, 0.0)


def test_timeout_zeroes_the_voltage_and_the_model_coasts() -> None:
    """T5: after the timeout the voltage is zero; the speed falls by the model's own dynamics."""
    husky = LockStepHusky(command_timeout=0.25)
    husky.drive(AHEAD, 2.0)
    speeds, volts = [], []
    for _ in range(40):
        speeds.append(husky.step().twist.forward)
        volts.append(husky.engine.state.voltages)
    driven = sum(1 for left, _ in volts if left != 0.0)
    # The last command was at step 0 of its 0.25 s; 12 more periods of 20 ms fit into it.
    assert driven == 12
    assert all(v == (0.0, 0.0) for v in volts[12:])
    ratios = np.array(speeds[20:39]) / np.array(speeds[19:38])
    assert np.all((ratios > 0.5) & (ratios < 1.0))


def test_zero_timeout_never_times_out() -> None:
    """T5: command_timeout = 0 holds a command for ever."""
    husky = LockStepHusky(command_timeout=0.0)
    husky.step(AHEAD)
    for _ in range(1000):
        husky.step()
    assert husky.reading.twist.forward == pytest.approx(0.507, abs=1e-3)


@pytest.mark.parametrize(('name', 'value', 'expected'), [
    ('max_forward', 0.5, BodyTwist(0.5, 2.0)),
    ('max_forward_acceleration', 3.0, BodyTwist(0.06, 2.0)),
    ('max_yaw', 1.5, BodyTwist(1.0, 1.5)),
    ('max_yaw_acceleration', 6.0, BodyTwist(1.0, 0.12)),
])
def test_each_limit_works_alone(name: str, value: float, expected: BodyTwist) -> None:
    """T6: speed and acceleration limits are independent, and off at zero."""
    settings = make_settings({'preset': 'paper', name: value})
    assert limited(BodyTwist(), BodyTwist(1.0, 2.0), settings, settings.period) == expected
    assert limited(BodyTwist(), BodyTwist(-1.0, -2.0), settings, settings.period) == BodyTwist(
        -expected.forward, -expected.yaw)
    assert limited(BodyTwist(), BodyTwist(1.0, 2.0), make_settings(preset='paper'), 0.02) == (
        BodyTwist(1.0, 2.0))


def test_preset_limits_shape_the_motion() -> None:
    """T6: under husky_ros1 the speed rises by at most 3 m/s² and ends at 1 m/s."""
    free = LockStepHusky(preset='paper').drive(BodyTwist(2.0, 0.0), 3.0)
    held = LockStepHusky(preset='husky_ros1').drive(BodyTwist(2.0, 0.0), 3.0)
    assert free.column('forward')[-1] > 1.1  # the supply's 24 V allow no more
    assert held.column('forward')[-1] == pytest.approx(1.014, abs=0.01)
    assert np.max(np.diff(held.column('forward'))) * 50.0 < 3.0


def test_rest_is_rest() -> None:
    """No creep: without a command nothing moves, to the last bit."""
    husky = LockStepHusky()
    drive = husky.drive(BodyTwist(), 60.0)
    assert np.all(drive.values == 0.0)
    # Row 58: -0.0 A were shown.
    assert math.copysign(1.0, husky.reading.current) == 1.0


def test_wheel_angles_integrate_the_rates_to_a_nanoradian() -> None:
    """T3: the angle equals the integral of the published rate (Simpson on a fine grid)."""
    husky = LockStepHusky(rate=1000.0, command_timeout=0.0)
    rates, angles = [husky.reading.measured.wheel_rates[0]], [0.0]
    husky.drive(BodyTwist(0.4, 0.3), 0.5)
    start = husky.reading.measured.wheel_angles[0]
    rates = [husky.reading.measured.wheel_rates[0]]
    for _ in range(400):
        reading = husky.step()
        rates.append(reading.measured.wheel_rates[0])
        angles.append(reading.measured.wheel_angles[0] - start)
    weights = np.ones(401)
    weights[1:-1:2], weights[2:-1:2] = 4.0, 2.0
    simpson = float(np.dot(weights, rates)) * 0.001 / 3.0
    assert angles[-1] == pytest.approx(simpson, abs=1e-9)


def test_wheel_odometry_is_the_controllers_arithmetic() -> None:
    """T14: twist from radius, track and multiplier; pose by exact arcs of the wheel ways."""
    husky = LockStepHusky(command_timeout=0.0, odometry_window=1)
    husky.drive(BodyTwist(0.4, 0.6), 3.0)
    before = husky.reading
    after = husky.step()
    left, right = (b - a for a, b in zip(
        before.measured.wheel_angles, after.measured.wheel_angles, strict=True))
    track = 0.5708 * 1.875
    assert after.wheel_twist.yaw == pytest.approx(0.1651 * (right - left) / track * 50.0)
    assert after.wheel_twist.forward == pytest.approx(0.1651 * (right + left) / 2.0 * 50.0)
    turn = after.wheel_pose.heading - before.wheel_pose.heading
    radius = after.wheel_twist.forward / after.wheel_twist.yaw
    x = before.wheel_pose.x + radius * (
        math.sin(before.wheel_pose.heading + turn) - math.sin(before.wheel_pose.heading))
    assert after.wheel_pose.x == pytest.approx(x, abs=1e-12)
    assert abs(after.pose.heading - after.wheel_pose.heading) > 0.01


def test_nan_is_refused_and_the_last_command_stays() -> None:
    """T1: the engine says no and keeps what it had."""
    husky = LockStepHusky()
    assert husky.engine.command(AHEAD)
    assert not husky.engine.command(BodyTwist(math.nan, 0.0))
    assert not husky.engine.command(BodyTwist(0.0, math.inf))
    husky.step()
    assert husky.engine.state.voltages[0] > 0.0


def test_reset_keeps_time_unless_asked() -> None:
    """T12: reset goes to the initial pose at rest; simulated time only with ``time``."""
    husky = LockStepHusky(initial_x=1.0, initial_heading=0.5)
    husky.drive(AHEAD, 1.0)
    reading = husky.engine.reset()
    assert (reading.pose.x, reading.pose.heading, reading.time) == (1.0, 0.5, 1.0)
    assert reading.twist == BodyTwist()
    assert husky.engine.reset(time=True).time == 0.0
    first = husky.drive(AHEAD, 1.0)
    husky.engine.reset(time=True)
    assert np.array_equal(first.values, husky.drive(AHEAD, 1.0).values)


def test_noise_is_seeded_and_as_large_as_its_covariance() -> None:
    """T4: generated noise has the standard deviation that the covariance states."""
    def gyro(seed: int) -> list[float]:
        husky = LockStepHusky(sensor_noise=True, gyro_stddev=0.02, accel_stddev=0.3, seed=seed)
        return [husky.step().measured.gyro for _ in range(4000)]
    one, same, other = gyro(1), gyro(1), gyro(2)
    assert one == same
    assert one != other
    assert np.std(one) == pytest.approx(0.02, rel=0.05)
    assert np.mean(one) == pytest.approx(0.0, abs=0.02 / math.sqrt(4000) * 4.0)


def test_bias_rounding_and_mounting_of_the_imu() -> None:
    """Bias is added, readings are rounded, an IMU off the centre feels the turn."""
    husky = LockStepHusky(command_timeout=0.0, gyro_bias=0.1, gyro_resolution=0.01,
                          encoder_ticks=100, imu_x=0.5)
    husky.drive(BodyTwist(0.0, 1.0), 4.0)
    measured, yaw = husky.reading.measured, husky.reading.twist.yaw
    assert measured.gyro == pytest.approx(round((yaw + 0.1) / 0.01) * 0.01)
    assert measured.accel[0] == pytest.approx(-0.5 * yaw * yaw, rel=1e-6)
    tick = 2.0 * math.pi / 100.0
    ratio = measured.wheel_angles[1] / tick
    assert ratio == pytest.approx(round(ratio), abs=1e-9)


def test_a_minute_takes_milliseconds() -> None:
    """Sixty simulated seconds in lock step are quicker than a second."""
    import time
    husky = LockStepHusky()
    husky.step(AHEAD)
    begun = time.process_time()
    husky.drive(AHEAD, 60.0)
    assert time.process_time() - begun < 5.0


def test_unusable_models_leave_the_running_one() -> None:
    """A missing model file is refused by name, and the drive goes on as before."""
    husky = LockStepHusky(command_timeout=0.0)
    husky.drive(AHEAD, 1.0)
    bad = make_settings(command_timeout=0.0, model='/no/model.yaml')
    with pytest.raises(SettingsError, match=r"model = '/no/model\.yaml' cannot be used"):
        husky.engine.configure(bad)
    assert husky.engine.settings == husky.settings
    assert husky.step().twist.forward > 0.4


def test_an_imu_that_is_early_reads_what_is_now(tmp_path: Path) -> None:
    """Nothing can be read ahead of time; a model with early stamps runs all the same."""
    model, early = load_model(), Effect('sensor_time_offset', shape='imu')
    numbers = model.parameters.with_entries(*(one.parameter() for one in early.parameters()))
    save_model(ModelFile(replace(model.structure, effects=(early,)),
                         numbers.replacing({'stamp_delay': -0.24})), tmp_path / 'early.yaml')
    husky = LockStepHusky(model=str(tmp_path / 'early.yaml'))
    for _ in range(60):
        reading = husky.step(BodyTwist(0.0, 0.5))
        assert reading.measured.gyro == pytest.approx(reading.twist.yaw)


@pytest.mark.parametrize('late', [True, False])
def test_another_encoder_factor_moves_no_angle_and_no_odometry(late: bool, tmp_path: Path) -> None:
    """Neither at an onset nor where a model is exchanged live, after twenty turns of a wheel."""
    model = load_model()
    effect = Effect('encoder_scale', 'left', late=late)
    numbers = model.parameters.with_entries(*(one.parameter() for one in effect.parameters()))
    onset = Onset(OnsetKind.TIME, 30.0) if late else None
    path = tmp_path / 'scaled.yaml'
    save_model(ModelFile(replace(model.structure, effects=(effect,), onset=onset),
                         numbers.replacing({'encoder_factor': 1.1})), path)
    husky = LockStepHusky(command_timeout=0.0, model=str(path) if late else '')
    for step in range(1, 1600):
        before = husky.reading
        if step == 1500 and not late:
            husky.engine.configure(make_settings(command_timeout=0.0, model=str(path)))
        now = husky.step(AHEAD)
        turned = [new - old for new, old in zip(now.measured.wheel_angles,
                                                before.measured.wheel_angles, strict=True)]
        # 0.5 m/s on wheels of 0.165 m, in 20 ms.
        assert 0.0 <= min(turned) <= max(turned) < 0.075
        assert abs(now.wheel_twist.yaw) < 0.2
    assert turned[0] == pytest.approx(1.1 * turned[1], rel=1e-3)
