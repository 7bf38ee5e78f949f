# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What the integrator of the base reads and fills in, in its order."""

from __future__ import annotations

from typing import Final

#: Parameters of the robot, in the order in which the integrator reads them; units and meanings
#: stand in ``config/before_after.yaml``.
ROBOT: Final = (
    'slew_forward', 'slew_yaw', 'limit_forward', 'limit_yaw', 'speed_gain', 'turn_width',
    'loop_feedforward', 'loop_gain', 'loop_integral', 'voltage_limit', 'current_limit',
    'wheel_inertia', 'dry_left', 'dry_right', 'viscous_left', 'viscous_right',
    'grip_along', 'grip_across', 'creep_speed', 'creep_share', 'rolling', 'yaw_damping',
    'mass', 'yaw_inertia', 'com_x', 'com_y', 'com_height', 'radius_left', 'radius_right',
    'slope_x', 'slope_y', 'track', 'deflection', 'rest_leak', 'reference_lag',
    'drag', 'pull', 'scrub', 'scrub_speed', 'dead_voltage', 'bus_resistance', 'droop_rate',
    'windup', 'stiffness_ratio', 'encoder_left', 'encoder_right', 'rest_speed', 'creep_shape')
#: Numbers that are not estimated.
FIXED: Final = ('wheelbase', 'motor_resistance', 'transmission', 'wheel_radius',
                'load_time', 'dry_speed', 'rolling_speed', 'gravity', 'rest_rate', 'least_share',
                'scrub_rate', 'pull_speed')
#: Columns of what is simulated: base_link's velocity, wheel rates, specific force at the centre,
#: and what they have come to since the start: base_link's place, the angles of the wheels. Rates
#: and angles of the wheels are as their encoders read them.
OUTPUTS: Final = ('forward', 'lateral', 'yaw', 'left', 'right', 'accel_x', 'accel_y',
                  'x', 'y', 'heading', 'angle_left', 'angle_right')
