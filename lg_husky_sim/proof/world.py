# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
The numbers of a hidden robot: one flat vector, so that a compiled loop can read it.

Their values, units and sources stand in `config/blind_trial.yaml` (robot). Every effect is
a change of entries of this vector; an effect that starts at a time or at a place is
two vectors and a gate between them.
"""

from __future__ import annotations

from collections.abc import Mapping

from lg_husky_sim.proof.settings import settings
import numpy as np
from numpy.typing import NDArray

GRAVITY = 9.81
NEVER = 1e8
"""Limits beyond this do not act (the file has 1e9 for none)."""

(
    MASS, YAW_INERTIA, HALF_TRACK, HALF_BASE, RADIUS_LEFT, RADIUS_RIGHT, INERTIA_MOTOR,
    INERTIA_REAR, INERTIA_FRONT, RESISTANCE, INDUCTANCE, TORQUE_CONSTANT, COMMAND_GAIN,
    TURN_RATIO, SUPPLY, CREEP, YAW_DAMPING, LATERAL, FORCE_LIMIT, FORM_FORCE, TYRE,
    TYRE_FRICTION, TYRE_STIFFNESS, BATTERY_RESISTANCE, POLARISATION, POLARISATION_TIME,
    DROOP_DEPTH, DROOP_TIME, FORM_DROOP, DEADBAND, DEADBAND_EDGE, FORM_DEADBAND, CLIP,
    FORM_CLIP, CURRENT_LIMIT, CURRENT_CONTINUOUS, CURRENT_TIME, FORM_CURRENT, REVERSE_GAIN,
    HEATING, COOLING_TIME, MAGNET_LOSS, FRICTION_LEFT, FRICTION_RIGHT, FORM_FRICTION,
    STRIBECK_RATIO, STRIBECK_SPEED, FRICTION_WIDTH, VISCOUS_LEFT, VISCOUS_RIGHT,
    VISCOUS_EXPONENT, BELT_STIFFNESS, BELT_DAMPING, BELT_LIMIT, BELT_CUBIC, GAP,
    GEAR_STIFFNESS, GEAR_DAMPING, RIPPLE_LEFT, RIPPLE_RIGHT, RIPPLE_PHASE, RIPPLE_SECOND,
    COGGING, COGGING_COUNT, ECCENTRICITY, ECCENTRICITY_PHASE, GRAVITY_X, GRAVITY_Y, ROLLING,
    ROLLING_LEFT, ROLLING_RIGHT, FORM_DRY, DRAG, DRAG_EXPONENT, SCRUB, SCRUB_SPEED,
    SCRUB_EXPONENT, PULL, PULL_SPEED, CENTRE_FORWARD, UNDULATION, UNDULATION_PITCH, LOOP,
    LOOP_GAIN, LOOP_INTEGRAL, LOOP_FORWARD, LOOP_PERIOD, ROUGH_SPEED,
) = range(88)


def fields() -> tuple[str, ...]:
    """Return the names of the entries, in the vector's order."""
    return tuple(settings()['robot'])


def nominal() -> dict[str, float]:
    """Return the paper's robot, by field name, with nothing extra."""
    return {name: float(row['value']) for name, row in settings()['robot'].items()}


def vector(values: Mapping[str, float]) -> NDArray[np.float64]:
    """
    Return a robot as the vector that the compiled loop reads.

    Parameters
    ----------
    values
        All of `fields()`, by name, SI units.

    Raises
    ------
    KeyError
        A field is missing or unknown.

    """
    names = fields()
    unknown = set(values) - set(names)
    if unknown:
        raise KeyError(f'no field {sorted(unknown)[0]!r} in a hidden robot')
    return np.array([float(values[name]) for name in names])
