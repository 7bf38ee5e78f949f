# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Which sensor is at fault, where streams contradict each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from lg_husky_sim.diagnosis.result import Estimate
from lg_husky_sim.diagnosis.sensors.regression import Number
from lg_husky_sim.diagnosis.sensors.relations import by_names, Relation
from lg_husky_sim.diagnosis.sensors.standing import standing
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.errors import ModelFileError
from lg_husky_sim.husky.effects import Effect
from lg_husky_sim.recording import Segment
from lg_husky_sim.reporting.words import number
from lg_husky_sim.resources import config_path
from lg_husky_sim.yaml_files import read_yaml

#: What the streams are called.
WORDS: Mapping[str, str] = {'imu': 'the IMU', 'wheels': 'the wheels (joint states)',
                            'command': 'the commands',
                            'pose': 'the pose (tf or odometry)'}
_RATE = 'yaw rate'
Known = Mapping[tuple[str, str, str], Relation]


@dataclass(frozen=True)
class Fault:
    """
    A fault of a sensor that needs no model to be seen.

    Parameters
    ----------
    effect : Effect or None
        Of the catalogue; None where it has none.
    stream : str
        imu, wheels, pose or command; empty where two contradict each other and no third one
        decides.
    number : Estimate or None
    certainty : float
        How many standard deviations it is beyond its tolerance.
    statement : str

    """

    effect: Effect | None
    stream: str
    number: Estimate | None
    certainty: float
    statement: str


def effect_of(fault: str, stream: str = '') -> Effect:
    """Return the effect of the catalogue that a fault is, by ``config/sensor_faults.yaml``."""
    return Effect(str(_table()['faults'][fault]), shape=stream)


@cache
def _table() -> Mapping[str, Any]:
    path = config_path('sensor_faults.yaml')
    data = read_yaml(path, ModelFileError)
    if data.get('schema') != 'lg_husky_sim/sensor_faults/1':
        raise ModelFileError(f'{path}: not a table of faults of sensors '
                             '(schema lg_husky_sim/sensor_faults/1)')
    return data


def unit_of(ratio: float) -> str | None:
    """
    Return the unit in which a rate seems to be that reads as if it were in rad/s.

    Parameters
    ----------
    ratio : float
        What should be read over what is.

    Returns
    -------
    str or None
        None where it is near none.

    """
    for name, size in _table()['units'].items():
        if abs(abs(ratio) / float(size) - 1.0) < setting('other_radius'):
            return str(name)
    return None


def faults(found: Sequence[Relation], parts: Sequence[Segment] = ()) -> tuple[Fault, ...]:
    """
    Say which sensor is at fault.

    Parameters
    ----------
    found : sequence of Relation
        Comparisons of the streams with each other.
    parts : sequence of Segment
        The streams themselves: what stands still has no relation to anything.

    Returns
    -------
    tuple of Fault
        Most serious first: a wrong sign, then late stamps, factors and offsets.

    """
    every = by_names(found)
    known = {key: one for key, one in every.items()
             if one.explained > setting('least_explained')}
    wrong = [*_standing(parts), *_signs(known), *_dead(every)]
    return (*wrong, *_late(known), *(() if wrong else (
        *_gain(known), *_bias(known), *_commanded(known))))


def _number(effect: Effect, value: Number) -> Estimate:
    # The effects of sensors have one number each.
    parameter, = effect.parameters()
    return Estimate(parameter.name, value.value, parameter.unit, value.low, value.high)


def _beyond(value: Number, right: float, tolerance: float) -> float:
    return (abs(value.value - right) - tolerance) / max(value.deviation, 1e-12)


def _signs(known: Known) -> list[Fault]:
    gyro, turn, both = (known.get((_RATE, *names)) for names in (
        ('imu', 'pose'), ('wheels', 'pose'), ('wheels', 'imu')))
    speed = known.get(('speed', 'wheels', 'pose'))

    def reversed_(one: Relation | None) -> bool:
        return one is not None and one.factor.is_off(0.0, 0.0) and one.factor.value < 0.0
    made: list[Fault] = []
    sides = {side: known.get(('speed', f'{side} wheels', 'pose')) for side in ('left', 'right')}
    for side, one in sides.items():
        other = sides['right' if side == 'left' else 'left']
        if one is not None and reversed_(one) and other is not None and (
                other.factor.is_off(0.0, 0.0) and not reversed_(other)):
            made.append(Fault(None, 'wheels', None, _beyond(one.factor, 0.0, 0.0),
                              f'The {side} wheels turn backwards while the pose moves forward, '
                              'and the others do not: the sign of their rates is wrong (a motor '
                              'that is mounted the other way round)'))
    if speed is not None and reversed_(speed):
        # Both signs would turn the yaw rate about as well.
        turns = both or turn
        made.append(Fault(None, 'pose' if turns and not reversed_(turns) else 'wheels', None,
                          _beyond(speed.factor, 0.0, 0.0),
                          'The wheels turn backwards while the pose moves forward: ' + (
                              'both wheel rates have the wrong sign, or the x axis of the pose '
                              'points backwards' if not turns else
                              'both wheel rates have the wrong sign' if reversed_(turns) else
                              'the x axis of the pose points backwards, or its axes are '
                              'interchanged')))
    count = [reversed_(one) for one in (gyro, both, turn)]
    if gyro is not None and count[0] and (both is None or count[1] or not count[2]):
        made.append(_reversed_gyro(gyro, 1.0, 'the pose'))
    elif gyro is not None and count[0]:
        made.append(Fault(None, 'pose', None, _beyond(gyro.factor, 0.0, 0.0),
                          'The pose turns against the gyro and the wheels: the sign of its '
                          'heading is wrong (the frames of the localisation)'))
    elif gyro is None and both is not None and count[1]:
        made.append(_reversed_gyro(both, both.factor.value, 'the wheels'))
    elif turn is not None and count[2] and not reversed_(speed):
        made.append(Fault(None, 'wheels', None, _beyond(turn.factor, 0.0, 0.0),
                          'The robot turns to the left when its left wheels turn faster: the '
                          'wheels of the two sides are interchanged'))
    return made


def _standing(parts: Sequence[Segment]) -> list[Fault]:
    sides, seconds = standing(parts)
    if not sides:
        return []
    wheels = 'wheels' if len(sides) == 2 else f'{sides[0]} wheels'
    return [Fault(None, 'wheels', None, seconds / setting('relation_window'),
                  f'The {wheels} stand still while the pose moves for {seconds:.0f} s: their '
                  'encoders are dead, or something blocks them')]


def _dead(every: Known) -> list[Fault]:
    # What does not follow anything, while the others follow each other.
    turn, both = every.get((_RATE, 'wheels', 'pose')), every.get((_RATE, 'wheels', 'imu'))
    least = setting('least_explained')
    if turn is None or both is None or turn.explained < least or both.explained > least:
        return []
    if max(abs(both.factor.low), abs(both.factor.high)) > setting('no_reaction') * abs(
            turn.factor.value):
        return []
    return [Fault(None, 'imu', None, _beyond(turn.factor, 0.0, 0.0),
                  'The gyro does not turn while the wheels and the heading of the pose do: it is '
                  'dead, or the yaw axis of the robot is another one of the IMU')]


def _commanded(known: Known) -> list[Fault]:
    # Commands of yaw against how the robot turns.
    one = known.get((_RATE, 'command', 'pose')) or known.get((_RATE, 'command', 'imu'))
    if one is None or not one.factor.is_off(0.0, 0.0):
        return []
    sure = _beyond(one.factor, 0.0, 0.0)
    if one.factor.value < 0.0:
        return [Fault(None, 'command', None, sure,
                      'The robot turns against its commands: the sign of the commanded yaw rate '
                      'is wrong')]
    unit = unit_of(one.factor.value)
    if unit is None or one.factor.value > setting('no_reaction'):
        return []
    return [Fault(None, 'command', None, sure,
                  f'The robot turns {one.factor.value:.3f} of what it is told to: commanded yaw '
                  f'rates seem to be in {unit}, and a Twist has them in rad/s')]


def _reversed_gyro(one: Relation, scale: float, reference: str) -> Fault:
    # The gyro over what it should read, or only its sign where wheels are the reference.
    factor = one.factor
    value, ends = 1.0 / factor.value, (1.0 / factor.high, 1.0 / factor.low)
    if one.source == 'wheels':
        value, ends = -1.0, (factor.low / abs(scale), factor.high / abs(scale))
    effect = effect_of('reversed')
    return Fault(effect, 'imu', _number(effect, Number(value, min(ends), max(ends))),
                 _beyond(factor, 0.0, 0.0),
                 f'The gyro turns against {reference}: its yaw rate has the wrong sign (the IMU '
                 'is mounted upside down, or its frame is wrong)')


def _gain(known: Known) -> list[Fault]:
    one = known.get((_RATE, 'imu', 'pose'))
    tolerance = setting('gain_tolerance')
    if one is None or not one.factor.is_off(1.0, tolerance):
        return []
    factor = Number(1.0 / one.factor.value, 1.0 / one.factor.high, 1.0 / one.factor.low)
    effect, unit = effect_of('gain'), unit_of(one.factor.value)
    sure = _beyond(one.factor, 1.0, tolerance)
    said = (f'The gyro reads {factor.value:.3f} ({factor.low:.3f} to {factor.high:.3f}) of '
            'the rate at which the heading of the pose changes')
    if unit is not None:
        return [Fault(None, 'imu', None, sure,
                      f'{said}: it seems to be in {unit}, and an Imu has it in rad/s')]
    return [Fault(effect, 'imu', _number(effect, factor), sure, said)]


def _bias(known: Known) -> list[Fault]:
    one, both = known.get((_RATE, 'imu', 'pose')), known.get((_RATE, 'wheels', 'imu'))
    turn = known.get((_RATE, 'wheels', 'pose'))
    tolerance = setting('bias_tolerance')
    if one is None or not one.offset.is_off(0.0, tolerance):
        return []
    if both is not None and turn is not None and not (
            abs(turn.offset.value) < abs(both.offset.value)
            and both.offset.value * one.offset.value < 0.0):
        return []  # the pose, or a robot that drifts: wheels and gyro agree
    scale = -1.0 / one.factor.value
    low, high = sorted((one.offset.low * scale, one.offset.high * scale))
    bias = Number(one.offset.value * scale, low, high)
    effect = effect_of('bias')
    return [Fault(effect, 'imu', _number(effect, bias),
                  _beyond(one.offset, 0.0, tolerance),
                  f'The gyro reads {number(bias.value)} rad/s ({number(bias.low)} to '
                  f'{number(bias.high)}) at rest, against the heading of the pose')]


def _late(known: Known) -> list[Fault]:
    # Gyro and pose see one rate. The body follows the wheels by up to a fraction of a second, but
    # never leads them: whichever of two contradicting streams does, or lags too far, is at fault.
    gyro = known.get((_RATE, 'imu', 'pose'))
    wheels = {name: known.get((_RATE, 'wheels', name)) for name in ('imu', 'pose')}
    if gyro is not None:
        if not gyro.late.is_off(0.0, max(setting('late_tolerance'), gyro.interval)):
            bad = [name for name, one in wheels.items() if _unphysical(one)]
            return [_late_wheels(wheels)] if len(bad) == len(wheels) else []
        bad = [name for name, one in wheels.items() if _unphysical(one)]
        if len(bad) == 1:
            other = 'pose' if bad[0] == 'imu' else 'imu'
            late = _turned_about(gyro.late, bad[0] == 'pose')
            by_wheels = wheels[bad[0]]
            if by_wheels is not None:
                # Clocks that drift: no better than the two others agree.
                second = _turned_about(by_wheels.late, True)
                late = Number(late.value, min(late.low, second.low), max(late.high, second.high))
            return [_stamps(bad[0], late, (other, 'wheels'))]
        return [_pair('imu', 'pose', gyro, (
            'both turn with the robot. The wheels do not tell which of them is at fault: a body '
            'may follow them by as much' if len([w for w in wheels.values() if w]) == len(wheels)
            else 'both turn with the robot; a third stream would tell which of them is at fault'))]
    return [_pair('wheels', name, one, 'further than a robot lags its wheels; a third stream '
                  'would tell which of them is at fault') for name, one in wheels.items()
            if one is not None and _unphysical(one)]


def _turned_about(late: Number, swap: bool) -> Number:
    return Number(-late.value, -late.high, -late.low) if swap else late


def _unphysical(one: Relation | None) -> bool:
    # Whether wheels are later than the body, or earlier than it can follow.
    if one is None:
        return False
    tolerance = max(setting('late_tolerance'), one.interval)
    middle = -0.5 * setting('body_lag')
    return one.late.is_off(middle, 0.5 * setting('body_lag') + tolerance)


def _late_wheels(wheels: Mapping[str, Relation | None]) -> Fault:
    found = [one.late for one in wheels.values() if one is not None]
    late = Number(sum(n.value for n in found) / len(found), min(n.low for n in found),
                  max(n.high for n in found))
    return _stamps('wheels', late, ('imu', 'pose'))


def _stamps(stream: str, late: Number, others: tuple[str, ...]) -> Fault:
    low, high = sorted((abs(late.low), abs(late.high)))
    how = 'later' if late.value > 0.0 else 'earlier'
    effect = effect_of('late', stream)
    return Fault(
        effect, stream, _number(effect, late),
        _beyond(late, 0.0, setting('late_tolerance')),
        f'The stamps of {WORDS[stream]} are {number(abs(late.value))} s ({number(low)} to '
        f'{number(high)}) '
        f'{how} than those of {" and ".join(WORDS[other] for other in others)}')


def _pair(first: str, second: str, one: Relation, why: str) -> Fault:
    late = one.late
    if late.value < 0.0:
        first, second, late = second, first, _turned_about(late, True)
    return Fault(None, '', _number(effect_of('late'), late),
                 _beyond(late, 0.0, setting('late_tolerance')),
                 f'The stamps of {WORDS[first]} are {number(late.value)} s '
                 f'({number(late.low)} to {number(late.high)}) later than those of '
                 f'{WORDS[second]}: {why}')
