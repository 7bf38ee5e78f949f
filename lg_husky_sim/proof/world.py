# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The numbers of a hidden robot: one flat vector, so that a compiled loop can read it.

Every effect is a change of entries of this vector; an effect that starts at a time
or at a place is two vectors and a gate between them.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

# One line a field: name, paper's robot with nothing extra, unit and meaning.
_TABLE: tuple[tuple[str, float, str], ...] = (
    ('mass', 48.39, 'kg'),
    ('yaw_inertia', 3.0556, 'kg·m², about the centre of mass'),
    ('half_track', 0.2854, 'm, wheel plane to centre line'),
    ('half_base', 0.256, 'm, axle to centre'),
    ('radius_left', 0.1651, 'm, rolling radius'),
    ('radius_right', 0.1651, 'm'),
    ('inertia_motor', 0.03, 'kg·m², rotor and gears seen from the wheel shaft, a side'),
    ('inertia_rear', 0.025, 'kg·m², driven axle, a side'),
    ('inertia_front', 0.025, 'kg·m², belt-driven axle, a side'),
    ('resistance', 0.46, 'ohm, winding'),
    ('inductance', 0.22e-3, 'H, winding'),
    ('torque_constant', 0.044488 * 78.71, 'N·m/A at the wheel shaft, also V·s/rad'),
    ('creep', 1.3016 / 0.1651 ** 2, 'N·s/m, contact force per slip speed, a wheel'),
    ('force_limit', 1e9, 'N, longitudinal adhesion of a wheel (brush model)'),
    ('lateral', 2.0e4, 'N·s/m, resistance of the whole robot to side slip'),
    ('yaw_damping', 12.8650, 'N·m·s/rad, scrub of the four wheels'),
    ('tyre', 0.0, '0: creep as above; 1: brush tyres, longitudinal and lateral share adhesion'),
    ('tyre_friction', 0.6, 'adhesion coefficient of the brush tyres'),
    ('emf', 24.0, 'V, battery at rest'),
    ('battery_resistance', 0.0, 'ohm, shared by both choppers'),
    ('polarisation', 0.0, 'ohm, slow part of the battery resistance'),
    ('polarisation_time', 8.0, 's'),
    ('droop_depth', 0.0, 'fraction of the emf lost in the end'),
    ('droop_time', 120.0, 's, time constant of the loss'),
    ('droop_start', 0.0, 's, battery age at the start of the recording'),
    ('deadband', 0.0, 'V, lost by the chopper around zero'),
    ('clip', 24.0, 'V, largest mean voltage of the chopper'),
    ('current_limit', 0.0, 'A, 0: none'),
    ('reverse_gain', 0.0, 'fraction by which negative voltages are stronger'),
    ('heating', 0.0, 'ohm/(A²·s), rise of the winding resistance'),
    ('cooling_time', 200.0, 's'),
    ('friction_left', 0.0, 'N·m, dry friction of the drivetrain'),
    ('friction_right', 0.0, 'N·m'),
    ('stribeck_ratio', 1.2, 'static over sliding friction'),
    ('stribeck_speed', 0.3, 'rad/s'),
    ('viscous_left', 0.0, 'N·m·s/rad, loss to the frame'),
    ('viscous_right', 0.0, 'N·m·s/rad'),
    ('viscous_exponent', 0.92, 'shear thinning of that loss'),
    ('belt_stiffness', 0.0, 'N·m/rad between the axles of a side, 0: rigid'),
    ('belt_damping', 0.3, 'N·m·s/rad'),
    ('gap', 0.0, 'rad, free play at the wheel shaft, 0: none'),
    ('gear_stiffness', 1500.0, 'N·m/rad beyond the free play'),
    ('gear_damping', 3.0, 'N·m·s/rad beyond the free play'),
    ('ripple_left', 0.0, 'N·m, once per wheel turn'),
    ('ripple_right', 0.0, 'N·m'),
    ('ripple_phase', 0.0, 'rad'),
    ('cogging', 0.0, 'N·m at the wheel shaft'),
    ('cogging_count', 23.0, 'periods per wheel turn'),
    ('eccentricity', 0.0, 'fraction of the radius'),
    ('eccentricity_phase', 0.0, 'rad'),
    ('gravity_x', 0.0, 'm/s², along the world, downhill'),
    ('gravity_y', 0.0, 'm/s²'),
    ('rolling', 0.0, 'N, constant against motion'),
    ('drag', 0.0, 'N·s²/m²'),
    ('scrub', 0.0, 'N·m, constant against turning'),
    ('scrub_speed', 0.0, 'N·m·s/rad per (m/s)^exponent'),
    ('scrub_exponent', 1.0, ''),
    ('pull', 0.0, 'N·m to the left while driving'),
    ('centre_forward', 0.0, 'm, centre of mass ahead of the middle of the wheels'),
    ('undulation', 0.0, 'N, force of a wavy floor'),
    ('undulation_pitch', 1.1, 'm'),
    ('loop', 0.0, '1: the demand is a wheel speed and a PI controller follows it'),
    ('loop_gain', 0.6, 'V·s/rad'),
    ('loop_integral', 30.0, 'V/rad'),
    ('loop_forward', 1.0, 'fraction of the no-load voltage fed forward'),
    ('loop_period', 0.02, 's'),
)

FIELDS: tuple[str, ...] = tuple(row[0] for row in _TABLE)
UNITS: Mapping[str, str] = {row[0]: row[2] for row in _TABLE}

(
    MASS, YAW_INERTIA, HALF_TRACK, HALF_BASE, RADIUS_LEFT, RADIUS_RIGHT,
    INERTIA_MOTOR, INERTIA_REAR, INERTIA_FRONT, RESISTANCE, INDUCTANCE, TORQUE_CONSTANT,
    CREEP, FORCE_LIMIT, LATERAL, YAW_DAMPING, TYRE, TYRE_FRICTION,
    EMF, BATTERY_RESISTANCE, POLARISATION, POLARISATION_TIME,
    DROOP_DEPTH, DROOP_TIME, DROOP_START, DEADBAND, CLIP, CURRENT_LIMIT, REVERSE_GAIN,
    HEATING, COOLING_TIME, FRICTION_LEFT, FRICTION_RIGHT, STRIBECK_RATIO, STRIBECK_SPEED,
    VISCOUS_LEFT, VISCOUS_RIGHT, VISCOUS_EXPONENT, BELT_STIFFNESS, BELT_DAMPING,
    GAP, GEAR_STIFFNESS, GEAR_DAMPING, RIPPLE_LEFT, RIPPLE_RIGHT, RIPPLE_PHASE,
    COGGING, COGGING_COUNT, ECCENTRICITY, ECCENTRICITY_PHASE, GRAVITY_X, GRAVITY_Y,
    ROLLING, DRAG, SCRUB, SCRUB_SPEED, SCRUB_EXPONENT, PULL, CENTRE_FORWARD,
    UNDULATION, UNDULATION_PITCH, LOOP, LOOP_GAIN, LOOP_INTEGRAL, LOOP_FORWARD, LOOP_PERIOD,
) = range(66)

# Command law of the paper, eqs. (24), (25), with the turn ratio's sign corrected.
NOMINAL_SUPPLY = 24.0
COMMAND_GAIN = 0.8961
TURN_RATIO = 0.541
GRAVITY = 9.81


def nominal() -> dict[str, float]:
    """Return the paper's robot, by field name, with nothing extra."""
    return {name: value for name, value, _ in _TABLE}


def vector(fields: Mapping[str, float]) -> NDArray[np.float64]:
    """
    Return `fields` as the vector that the compiled loop reads.

    Parameters
    ----------
    fields
        All of `FIELDS`, by name.

    Raises
    ------
    KeyError
        A field is missing or unknown.

    """
    unknown = set(fields) - set(FIELDS)
    if unknown:
        raise KeyError(f'no field {sorted(unknown)[0]!r} in a hidden robot')
    return np.array([float(fields[name]) for name in FIELDS])
