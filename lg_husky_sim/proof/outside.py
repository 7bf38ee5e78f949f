# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Hidden effects that are not in the catalogue: a diagnosis should call them unknown."""

from __future__ import annotations

from collections.abc import Mapping

from lg_husky_sim.proof.hidden import Builder, Change, draw, Rng, Setting, sign


def _wheel_eccentricity(s: Setting, rng: Rng) -> Change:
    part = draw(rng, s, (0.015, 0.025), (0.04, 0.06), (0.09, 0.14))
    return Change({'eccentricity': part, 'eccentricity_phase': float(rng.uniform(0.5, 2.5))},
                  side='both', parameters={'run_out_fraction': part})


def _wavy_floor(s: Setting, rng: Rng) -> Change:
    force = draw(rng, s, (12.0, 18.0), (30.0, 45.0), (70.0, 100.0))
    return Change({'undulation': force, 'undulation_pitch': float(rng.uniform(0.7, 1.6))},
                  parameters={'force': force})


def _reverse_gain(s: Setting, rng: Rng) -> Change:
    part = draw(rng, s, (0.05, 0.07), (0.12, 0.18), (0.25, 0.4)) * sign(rng)
    return Change({'reverse_gain': part}, parameters={'gain_change_fraction': part})


def _motor_cogging(s: Setting, rng: Rng) -> Change:
    torque = draw(rng, s, (2.0, 3.0), (5.0, 8.0), (12.0, 20.0))
    return Change({'cogging': torque, 'cogging_count': float(rng.integers(5, 14))},
                  side='both', parameters={'torque': torque})


def _wind_gusts(s: Setting, rng: Rng) -> Change:
    force = draw(rng, s, (12.0, 18.0), (28.0, 40.0), (60.0, 90.0))
    return Change(gusts=force, parameters={'force_rms': force})


def _command_stutter(s: Setting, rng: Rng) -> Change:
    hold = draw(rng, s, (0.2, 0.3), (0.4, 0.6), (0.8, 1.2))
    return Change(command={'stutter_period': float(rng.uniform(2.0, 3.5)),
                           'stutter_hold': hold}, parameters={'hold': hold})


def _gyro_clipping(s: Setting, rng: Rng) -> Change:
    rate = s.most_yaw * draw(rng, s, (0.8, 0.9), (0.6, 0.7), (0.35, 0.5))
    return Change(senses={'gyro_clip': rate}, parameters={'rate': rate})


def _offset_mass(s: Setting, rng: Rng) -> Change:
    ahead = draw(rng, s, (0.05, 0.07), (0.1, 0.14), (0.18, 0.24)) * sign(rng)
    return Change({'centre_forward': ahead}, parameters={'centre_forward': ahead})


def _periodic_cutback(s: Setting, rng: Rng) -> Change:
    part = draw(rng, s, (0.08, 0.12), (0.2, 0.3), (0.45, 0.6))
    return Change(command={'cutback': part}, parameters={'cutback': part})


BUILDERS: Mapping[str, Builder] = {
    'wheel_eccentricity': _wheel_eccentricity,
    'wavy_floor': _wavy_floor,
    'reverse_gain': _reverse_gain,
    'motor_cogging': _motor_cogging,
    'wind_gusts': _wind_gusts,
    'command_stutter': _command_stutter,
    'gyro_clipping': _gyro_clipping,
    'offset_mass': _offset_mass,
    'periodic_cutback': _periodic_cutback,
}
