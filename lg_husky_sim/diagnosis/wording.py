# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Sentences of a diagnosis."""

from __future__ import annotations

from collections.abc import Sequence
import math

from lg_husky_sim.diagnosis.result import Estimate
from lg_husky_sim.husky.effects import Effect, Onset, OnsetKind

_STREAMS = {'wheels': 'of the wheels (joint states)', 'imu': 'of the IMU',
            'pose': 'of the pose (tf or odometry)'}
#: The number of an effect that says how late stamps are, or how early.
LATENESS = 'stamp_delay'


def onset_words(onset: Onset | None) -> str:
    """Return an onset in words, with a leading comma; empty without one."""
    if onset is None:
        return ''
    if onset.kind is OnsetKind.TIME:
        where = f' of {onset.recording}' if onset.recording else ' of each recording'
        return f', from {onset.value:.1f} s{where} on'
    side = 'above' if onset.kind is OnsetKind.PLACE_ABOVE else 'below'
    return f', where x is {side} {onset.value:.2f} m'


def in_words(numbers: Sequence[Estimate]) -> str:
    """Return estimates as text with their intervals."""
    return ', '.join(
        lateness_words(e) if e.name == LATENESS else
        f'{e.name.replace("_", " ")} {e.value:.3g}{"" if e.unit == "1" else " " + e.unit} '
        f'({e.low:.3g} to {e.high:.3g})' for e in numbers)


def lateness_words(late: Estimate, digits: int = 3) -> str:
    """Return how late or early stamps are, such as ``0.24 s early (0.22 to 0.25)``."""
    sign = math.copysign(1.0, late.value)
    low, high = sorted((sign * late.low, sign * late.high))
    return (f'{abs(late.value):.{digits}g} {late.unit} {"late" if sign > 0.0 else "early"} '
            f'({low:.{digits}g} to {high:.{digits}g})')


def effect_words(effect: Effect) -> str:
    """Return what an effect is and where, in words."""
    side = '' if effect.side in ('none', '') else {
        'both': ' (both sides)', 'left': ' (left side)', 'right': ' (right side)'}[effect.side]
    if effect.id == 'sensor_time_offset':
        return f'the stamps {_STREAMS[effect.shape]} are off'
    return f'{effect.kind.title}{side}'


def sentence(effect: Effect, onset: Onset | None, numbers: Sequence[Estimate], regime: str,
             changed: bool = False) -> str:
    """Return a finding in one plain sentence with numbers."""
    mainly = '' if regime.startswith('everywhere') else 'mainly '
    text = (f'{"changed: " if changed else ""}{effect_words(effect)}'
            f'{onset_words(onset)}: {in_words(numbers)}. It shows {mainly}{regime}.')
    return text[0].upper() + text[1:]
