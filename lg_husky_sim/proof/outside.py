# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Hidden effects that are not in the catalogue: a diagnosis should call them unknown."""

from __future__ import annotations

from collections.abc import Mapping

from lg_husky_sim.proof.hidden import Builder, Change, Rng, Setting, sign


def _wheel_eccentricity(s: Setting, rng: Rng) -> Change:
    return Change({'eccentricity': s.size, 'eccentricity_phase': float(rng.uniform(0.5, 2.5))},
                  side='both', parameters={'run_out_fraction': s.size})


def _wavy_floor(s: Setting, rng: Rng) -> Change:
    return Change({'undulation': s.size, 'undulation_pitch': float(rng.uniform(0.7, 1.6))},
                  parameters={'force': s.size})


def _reverse_gain(s: Setting, rng: Rng) -> Change:
    part = s.size * sign(rng)
    return Change({'reverse_gain': part}, parameters={'gain_change_fraction': part})


def _motor_cogging(s: Setting, rng: Rng) -> Change:
    return Change({'cogging': s.size, 'cogging_count': float(rng.integers(5, 14))},
                  side='both', parameters={'torque': s.size})


def _wind_gusts(s: Setting, rng: Rng) -> Change:
    return Change(gusts=s.size, parameters={'force_rms': s.size})


def _command_stutter(s: Setting, rng: Rng) -> Change:
    return Change(command={'stutter_period': float(rng.uniform(2.0, 3.5)),
                           'stutter_hold': s.size}, parameters={'hold': s.size})


def _gyro_clipping(s: Setting, rng: Rng) -> Change:
    rate = s.most_yaw * s.size
    return Change(senses={'gyro_clip': rate}, parameters={'rate': rate})


def _com_shift(s: Setting, rng: Rng) -> Change:
    ahead = s.size * sign(rng)
    return Change({'centre_forward': ahead}, parameters={'centre_forward': ahead})


def _wheel_loop_retuned(s: Setting, rng: Rng) -> Change:
    factor = s.size if rng.random() < 0.5 else 1.0 / s.size
    return Change({'loop_gain': s.fields['loop_gain'] * factor,
                   'loop_integral': s.fields['loop_integral'] * factor},
                  parameters={'gain_factor': factor}, form='both gains')


def _periodic_cutback(s: Setting, rng: Rng) -> Change:
    return Change(command={'cutback': s.size}, parameters={'cutback': s.size})


BUILDERS: Mapping[str, Builder] = {
    'wheel_eccentricity': _wheel_eccentricity,
    'wavy_floor': _wavy_floor,
    'reverse_gain': _reverse_gain,
    'motor_cogging': _motor_cogging,
    'wind_gusts': _wind_gusts,
    'command_stutter': _command_stutter,
    'gyro_clipping': _gyro_clipping,
    'com_shift': _com_shift,
    'wheel_loop_retuned': _wheel_loop_retuned,
    'periodic_cutback': _periodic_cutback,
}
