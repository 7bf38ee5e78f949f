# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Sentences of a diagnosis."""

from __future__ import annotations

from collections.abc import Sequence
import math

from lg_husky_sim.diagnosis.result import Estimate, Finding
from lg_husky_sim.husky.effects import catalogue, Effect, LATER, Onset, OnsetKind, Subsystem
from lg_husky_sim.reporting.words import with_interval

_STREAMS = {'wheels': 'of the wheels (joint states)', 'imu': 'of the IMU',
            'pose': 'of the pose (tf or odometry)'}
AMPLITUDE, PHASE = 'amplitude', 'phase'
#: Ends of the names of a ripple's numbers, and those of its harmonics' amplitudes and phases.
_HARMONICS = {'': '', '_twice': ' of the second harmonic', '_thrice': ' of the third harmonic'}
#: The number of an effect that says how late stamps are, or how early.
LATENESS = 'stamp_delay'
#: What to check on a robot, by the quantity that an effort or an error follows.
CHECKS = {
    'angle': 'With the motors off, turn the wheels of that side by hand: feel for detents, a rub '
             'or a tight spot that repeats as often; look at motor, gears, bearings and tyres.',
    'distance': 'Look at the floor for joints or waves that repeat as often, and at the tyres.',
    'voltage': 'Look at the output of the motor driver, or its duty cycle: it seems to move in '
               'steps of this size (few levels, or a command that is rounded).',
    'driving current': 'Let the robot coast, brake and drive at one speed, and compare: the '
                       'driver may not brake as it drives (coast instead of brake mode, a limit '
                       'of what it feeds back).',
    'scattered times': 'While it drives slowly, move the connectors and cables of motor, encoder '
                       'and battery of that side, and read the fault log of its driver.',
    'sensor': 'Hold this sensor against another one over its whole range: it may end at some '
              'rate, lose counts, or be filtered.',
}


def onset_words(onset: Onset | None) -> str:
    """Return an onset in words, with a leading comma; empty without one."""
    if onset is None:
        return ''
    if onset.kind is OnsetKind.TIME:
        where = f' of {onset.recording}' if onset.recording else ' of each recording'
        return f', from {onset.value:.1f} s{where} on'
    side = 'above' if onset.kind is OnsetKind.PLACE_ABOVE else 'below'
    return f', where x is {side} {onset.value:.2f} m'


def sized(numbers: Sequence[Estimate]) -> tuple[Estimate, ...]:
    """
    Return the numbers of a finding; cosines and sines of a ripple as amplitudes and phases.

    Parameters
    ----------
    numbers : sequence of Estimate
        Parameters of a finding, with their intervals.

    Returns
    -------
    tuple of Estimate
        Intervals of amplitude and phase by propagation, cosine and sine taken as independent.

    """
    known = {one.name: one for one in numbers}
    found = list(numbers)
    for harmonic, words in _HARMONICS.items():
        cosine, sine = (known.get(f'{part}{harmonic}') for part in ('ripple_cos', 'ripple_sin'))
        if cosine is not None and sine is not None:
            place = min(found.index(cosine), found.index(sine))
            found = [one for one in found if one not in (cosine, sine)]
            found[place:place] = _polar(cosine, sine, words)
    return tuple(found)


def _polar(cosine: Estimate, sine: Estimate, words: str) -> tuple[Estimate, Estimate]:
    size = math.hypot(cosine.value, sine.value)
    half = [0.5 * (one.high - one.low) for one in (cosine, sine)]
    parts = (cosine.value / size, sine.value / size) if size else (1.0, 0.0)
    wide = math.hypot(parts[0] * half[0], parts[1] * half[1])
    turn = math.hypot(parts[1] * half[0], parts[0] * half[1]) / size if size else math.pi
    angle = math.atan2(sine.value, cosine.value)
    return (Estimate(f'{AMPLITUDE}{words}', size, cosine.unit, max(0.0, size - wide), size + wide),
            Estimate(f'{PHASE}{words}', angle, 'rad', angle - turn, angle + turn))


def number_words(name: str) -> str:
    """Return what sentences call a number of an effect, or any other one."""
    labels = (one.label for kind in catalogue().values() for one in kind.parameters
              if one.name == name.removesuffix(LATER))
    return next(labels, '') or name.replace('_', ' ')


def in_words(numbers: Sequence[Estimate]) -> str:
    """Return estimates as text with their intervals."""
    return ', '.join(
        lateness_words(e) if e.name == LATENESS else
        f'{number_words(e.name)} {with_interval(e.value, e.low, e.high, e.unit)}'
        for e in sized(numbers))


def lateness_words(late: Estimate) -> str:
    """Return how late or early stamps are, such as ``0.24 s early (0.22 to 0.25)``."""
    sign = math.copysign(1.0, late.value)
    low, high = sorted((sign * late.low, sign * late.high))
    return with_interval(abs(late.value), low, high, late.unit, 'late' if sign > 0.0 else 'early')


def effect_words(effect: Effect) -> str:
    """Return what an effect is and where, in words."""
    side = '' if effect.side in ('none', '') else {
        'both': ' (both sides)', 'left': ' (left side)', 'right': ' (right side)'}[effect.side]
    if effect.id == 'sensor_time_offset':
        return f'the stamps {_STREAMS[effect.shape]} are off'
    return f'{effect.kind.title}{side}'


def sentence(effect: Effect, onset: Onset | None, numbers: Sequence[Estimate], regime: str,
             changed: bool = False, undetermined: Sequence[str] = ()) -> str:
    """Return a finding in plain sentences with numbers, and with those that are not known."""
    mainly = '' if regime.startswith('everywhere') else 'mainly '
    words = f': {in_words(numbers)}' if numbers else ''
    text = (f'{"changed: " if changed else ""}{effect_words(effect)}'
            f'{onset_words(onset)}{words}. It shows {mainly}{regime}.')
    if undetermined:
        names = ' and '.join(map(number_words, undetermined))
        text += f' These recordings do not determine {names}.'
    return text[0].upper() + text[1:]


def what_to_check(finding: Finding) -> str:
    """Return what to look at on a robot where something is missing that has no name."""
    kind = 'sensor' if finding.subsystem == Subsystem.SENSOR.value else finding.regime
    if kind == 'scattered times' and finding.side == 'none':
        kind = ''
    return CHECKS.get(kind, 'Check the part of the robot that the report names, at the times that '
                            'it lists: no effect of the catalogue behaves like this.')
