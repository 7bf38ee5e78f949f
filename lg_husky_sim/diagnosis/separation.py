# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Which sensor or manoeuvre tells effects apart that a recording cannot."""

from __future__ import annotations

from collections.abc import Sequence

#: Effects to the sensor that sees them directly.
SENSORS = (
    ({'battery_sag', 'battery_droop'}, 'bus voltage'),
    ({'current_limit', 'motor_heating', 'coulomb_drivetrain', 'rolling_resistance',
      'quadratic_drag', 'payload', 'viscous_asymmetry', 'yaw_scrub_coulomb', 'yaw_scrub_speed',
      'traction_saturation', 'gear_backlash'}, 'motor current'),
    ({'voltage_saturation', 'driver_deadband', 'speed_loop', 'command_latency', 'command_slew',
      'command_limit'}, 'motor voltage'),
    ({'slope'}, 'accelerometer or inclinometer'),
    ({'wheel_radius_mismatch', 'encoder_scale'}, 'ticks per wheel turn, or the wheel measured'),
    ({'gyro_bias', 'gyro_scale', 'gyro_sign'}, 'a second heading source'),
    ({'sensor_time_offset'}, 'a common clock'),
    ({'belt_compliance', 'torque_ripple'}, 'encoder on the front axle'),
)
#: Effects to the manoeuvre that brings them out.
MANOEUVRES = (
    ({'rolling_resistance', 'quadratic_drag', 'coulomb_drivetrain', 'payload'},
     'coast-down from full speed'),
    ({'rolling_resistance', 'quadratic_drag', 'wheel_radius_mismatch'},
     'straight at 0.2 m/s and at 1 m/s'),
    ({'driver_deadband', 'coulomb_drivetrain', 'gear_backlash'},
     'slow sine through zero speed'),
    ({'command_latency', 'command_slew', 'speed_loop', 'sensor_time_offset'},
     'sharp steps of the command from rest'),
    ({'yaw_scrub_coulomb', 'yaw_scrub_speed', 'terrain_change', 'traction_saturation',
      'viscous_asymmetry', 'yaw_pull'}, 'turning on the spot at several rates, both ways'),
    ({'voltage_saturation', 'battery_sag', 'current_limit', 'command_limit'},
     'reversals at full speed'),
    ({'encoder_scale', 'wheel_radius_mismatch', 'yaw_pull'}, 'long straight run, both ways'),
    ({'gyro_bias', 'gyro_scale', 'gyro_sign'}, 'stand still for 5 s, then ten turns on the spot'),
    ({'slope'}, 'the same straight run in four headings'),
    ({'battery_droop', 'motor_heating'}, 'several minutes under load'),
)


def separated_by(effects: Sequence[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """
    Return what would separate effects.

    Parameters
    ----------
    effects : sequence of str
        Ids.

    Returns
    -------
    tuple of str
        Sensors that see one of them and not all in the same way.
    tuple of str
        Manoeuvres that bring one of them out.
    """
    wanted = set(effects)
    sensors = [text for ids, text in SENSORS if wanted & ids and not wanted <= ids]
    manoeuvres = [text for ids, text in MANOEUVRES if wanted & ids]
    return tuple(sensors or [text for ids, text in SENSORS if wanted & ids]), tuple(manoeuvres)
