# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What messages hold, against physics that is written down here once more."""

from __future__ import annotations

import math
from pathlib import Path

from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.husky.model_file import load_model, ModelFile, save_model
from lg_husky_sim.ros import conversions
from lg_husky_sim.ros.settings import make_settings
from lg_husky_sim.signals import BodyTwist
from lg_husky_sim.testing.lockstep import LockStepHusky
import numpy as np
import pytest

TURN = BodyTwist(0.3, 0.8)


def test_efforts_are_those_of_the_motors_in_the_order_of_the_names() -> None:
    """Row 43: a wheel's torque is half of k·N·i with R·i = V − k·N·ω of its own side."""
    husky = LockStepHusky(command_timeout=0.0)
    husky.drive(TURN, 8.0)
    values = load_model().parameters
    settings = make_settings()
    message = conversions.joint_state_message(settings)
    conversions.fill_joint_state(message, 0, husky.reading)
    constant = values['torque_constant'] * values['gear_ratio']
    for name, rate, effort in zip(message.name, message.velocity, message.effort, strict=True):
        volts = husky.engine.state.voltages['right' in name]
        current = (volts - constant * rate) / values['motor_resistance']
        assert effort == pytest.approx(0.5 * constant * current, rel=1e-6), name
    left, right = message.effort[:2]
    assert right > left + 1.0
    assert list(message.velocity[2:]) == list(message.velocity[:2])
    assert message.velocity[1] > message.velocity[0]


def test_covariances_of_the_imu_are_squares_of_its_deviations() -> None:
    """Row 43: orientation, rate and acceleration, each its own; nothing beside the diagonal."""
    settings = make_settings(orientation_stddev=0.2, gyro_stddev=0.03, accel_stddev=0.5)
    message = conversions.imu_message(settings)
    for covariance, deviation in ((message.orientation_covariance, 0.2),
                                  (message.angular_velocity_covariance, 0.03),
                                  (message.linear_acceleration_covariance, 0.5)):
        matrix = np.asarray(covariance).reshape(3, 3)
        assert matrix == pytest.approx(np.eye(3) * deviation ** 2)


@pytest.mark.parametrize(('ahead', 'aside'), [(0.4, 0.0), (0.0, 0.4), (-0.3, 0.2)])
def test_an_imu_off_the_centre_feels_its_own_place_move(ahead: float, aside: float) -> None:
    """Row 43: twice the difference quotient of where the IMU is, in the base's axes."""
    husky = LockStepHusky(command_timeout=0.0, rate=1000.0, imu_x=ahead, imu_y=aside,
                          max_yaw_acceleration=2.0, max_forward_acceleration=1.0)
    places, felt, headings = [], [], []
    for _ in range(1200):
        reading = husky.step(BodyTwist(0.6, 1.5))
        pose = reading.pose
        cos, sin = math.cos(pose.heading), math.sin(pose.heading)
        places.append((pose.x + cos * ahead - sin * aside, pose.y + sin * ahead + cos * aside))
        felt.append(reading.measured.accel[:2])
        headings.append(pose.heading)
    wide = 20
    track = np.array(places)
    second = (track[2 * wide:] - 2.0 * track[wide:-wide] + track[:-2 * wide]) / (
        wide * 1e-3) ** 2
    turn = np.array(headings)[wide:-wide]
    own = np.stack([np.cos(turn) * second[:, 0] + np.sin(turn) * second[:, 1],
                    np.cos(turn) * second[:, 1] - np.sin(turn) * second[:, 0]], axis=1)
    # Means over 40 ms: a twice differenced place is one of the acceleration's.
    means = np.stack([np.convolve(column, np.ones(2 * wide + 1) / (2 * wide + 1), 'valid')
                      for column in np.array(felt).T], axis=1)
    later = slice(100, None)
    assert np.abs(own[later]).max() > 0.2
    assert means[later] == pytest.approx(own[later], abs=0.03)


@pytest.mark.parametrize(('names', 'seconds'), [
    (('battery_sag',), 8.0), (('battery_droop',), 60.0), (('battery_sag', 'battery_droop'), 60.0),
    ((), 8.0)])
def test_the_battery_says_the_voltage_that_the_motors_get(
        tmp_path: Path, names: tuple[str, ...], seconds: float) -> None:
    """Row 34: at a steady speed the motors' equation tells it from rates and torques."""
    model = load_model()
    structure = model.structure
    for name in names:
        structure = structure.with_effect(Effect(name))
    parameters = model.parameters.with_entries(*(
        p.parameter(p.starts[0]) for e in structure.effects for p in e.parameters()))
    save_model(ModelFile(structure, parameters), tmp_path / 'model.yaml')
    husky = LockStepHusky(command_timeout=0.0, model=str(tmp_path / 'model.yaml'))
    reading = husky.reading
    assert reading.voltage == 24.0
    husky.drive(TURN, seconds)
    reading = husky.reading
    plain = LockStepHusky(command_timeout=0.0)
    plain.drive(TURN, 8.0)
    constant = parameters['torque_constant'] * parameters['gear_ratio']
    drawn = 0.0
    for side in (0, 1):
        current = 2.0 * reading.torques[side] / constant
        # A driver's bridge passes on a share of the pack's voltage, whatever that is.
        duty = plain.engine.state.voltages[side] / parameters['supply_voltage']
        voltage = (parameters['motor_resistance'] * current
                   + constant * reading.measured.wheel_rates[side]) / duty
        assert reading.voltage == pytest.approx(voltage, rel=1e-4)
        drawn += duty * current
    assert (reading.voltage < 23.99) == bool(names)
    assert reading.current == pytest.approx(-drawn, rel=1e-3)
    message = conversions.battery_message(make_settings())
    conversions.fill_battery(message, 0, reading)
    assert (message.voltage, message.current) == pytest.approx((reading.voltage, reading.current))
