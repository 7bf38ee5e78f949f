# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The published catalogue of effects, and kinds that are deliberately not in it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

SUBSYSTEM: Mapping[str, str] = {
    'battery_sag': 'electrical', 'battery_droop': 'electrical',
    'current_limit': 'electrical', 'driver_deadband': 'electrical',
    'voltage_saturation': 'electrical', 'motor_heating': 'electrical',
    'command_latency': 'command', 'command_slew': 'command', 'command_limit': 'command',
    'speed_loop': 'command', 'coulomb_drivetrain': 'drivetrain',
    'viscous_asymmetry': 'drivetrain', 'belt_compliance': 'drivetrain',
    'gear_backlash': 'drivetrain', 'torque_ripple': 'drivetrain',
    'wheel_radius_mismatch': 'traction', 'traction_saturation': 'traction',
    'payload': 'translation', 'slope': 'translation', 'rolling_resistance': 'translation',
    'quadratic_drag': 'translation', 'yaw_scrub_coulomb': 'rotation',
    'yaw_scrub_speed': 'rotation', 'yaw_pull': 'rotation', 'terrain_change': 'rotation',
    'gyro_bias': 'sensor', 'gyro_scale': 'sensor', 'gyro_sign': 'sensor',
    'encoder_scale': 'sensor', 'sensor_time_offset': 'sensor',
}

OUTSIDE: Mapping[str, str] = {
    'wheel_eccentricity': 'traction', 'wavy_floor': 'translation',
    'reverse_gain': 'electrical', 'motor_cogging': 'drivetrain',
    'wind_gusts': 'translation', 'command_stutter': 'command',
    'gyro_clipping': 'sensor', 'com_shift': 'rotation', 'wheel_loop_retuned': 'command',
    'periodic_cutback': 'command',
}

SEVERITIES = ('weak', 'medium', 'strong')

# Effects that a floor has, and so may begin at a place.
OF_THE_FLOOR = frozenset({
    'slope', 'rolling_resistance', 'yaw_scrub_coulomb', 'yaw_scrub_speed',
    'traction_saturation', 'terrain_change'})
# Effects that cannot begin half way: they change the structure, or the whole recording.
WHOLE_ONLY = frozenset({
    'speed_loop', 'belt_compliance', 'gear_backlash', 'battery_droop', 'motor_heating',
    'sensor_time_offset', 'gyro_sign', 'torque_ripple'})
# Effects that a closed speed loop hides or contains.
_HIDDEN_BY_LOOP = frozenset({
    'speed_loop', 'belt_compliance', 'motor_heating', 'battery_droop', 'viscous_asymmetry'})
# Effects that the rigid-body engine's robot has no part for.
_WITHOUT_ENGINE = frozenset({
    'speed_loop', 'belt_compliance', 'motor_heating', 'gear_backlash', 'motor_cogging',
    'wheel_eccentricity', 'wheel_loop_retuned'})
_WITHOUT_LOOP = frozenset({'wheel_loop_retuned'})


def needs(effects: Iterable[str]) -> frozenset[str]:
    """Return the streams without which effects cannot be seen at all."""
    streams = {'gyro_bias': 'imu', 'gyro_scale': 'imu', 'gyro_sign': 'imu',
               'gyro_clipping': 'imu', 'encoder_scale': 'wheels'}
    return frozenset(streams[name] for name in effects if name in streams)


def absent_from(world: str) -> frozenset[str]:
    """Return the effects that a world cannot hide."""
    return {'g1': _WITHOUT_LOOP, 'g2': _WITHOUT_ENGINE, 'g4': _WITHOUT_ENGINE,
            'g3': _HIDDEN_BY_LOOP}.get(world, frozenset())


def subsystem(effect: str) -> str:
    """
    Return the subsystem of an effect, known or outside the catalogue.

    Raises
    ------
    KeyError
        There is no such effect.

    """
    return SUBSYSTEM[effect] if effect in SUBSYSTEM else OUTSIDE[effect]
