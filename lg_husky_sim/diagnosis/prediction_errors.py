# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
What differs between a recording and a model's prediction, and what to change.

Sensors are compared with each other first, without a model; then each channel with its
prediction: sign, delay, gain. The texts are in ``config/prediction_errors.yaml``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
import math
from typing import Any

from lg_husky_sim.diagnosis.sensors.faults import Fault, faults
from lg_husky_sim.diagnosis.sensors.prediction import (
    body_fits,
    ChannelFit,
    mean,
    Predicted,
    ratio,
    wheel_fits,
    WheelFit,
)
from lg_husky_sim.diagnosis.sensors.regression import Number
from lg_husky_sim.diagnosis.sensors.relations import relations
from lg_husky_sim.diagnosis.sensors.robot import differences
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.errors import ModelFileError
from lg_husky_sim.husky.effects import effect_kind, Subsystem
from lg_husky_sim.husky.parameters import Parameters
from lg_husky_sim.reporting.advice import filled
from lg_husky_sim.reporting.data import Advice
from lg_husky_sim.reporting.words import number, quantity
from lg_husky_sim.resources import config_path
from lg_husky_sim.yaml_files import read_yaml

_STREAM_OF = {'forward': 'pose', 'turn': 'pose', 'yaw_rate': 'imu', 'wheel_speed': 'wheels'}
_STREAMS = {'wheels': 'the wheels (`/joint_states`)', 'imu': 'the IMU',
            'pose': 'the pose (`/tf`, odometry)'}


@dataclass(frozen=True)
class PredictionError:
    """
    Something in which a recording differs from a prediction.

    Parameters
    ----------
    kind : str
        Key of ``config/prediction_errors.yaml``.
    quantity : str
        Key of the channel; empty for several.
    value : Number
    unit : str
    statement : str
    robot, simulator : tuple of str
        What to change there.

    """

    kind: str
    quantity: str
    value: Number
    unit: str
    statement: str
    robot: tuple[str, ...] = ()
    simulator: tuple[str, ...] = ()

    def data(self) -> dict[str, object]:
        """Return it as plain data for JSON."""
        ends = (self.value.value, self.value.low, self.value.high)
        value, low, high = (end if math.isfinite(end) else None for end in ends)
        return {'kind': self.kind, 'channel': self.quantity or None, 'value': value, 'low': low,
                'high': high, 'unit': self.unit, 'statement': self.statement}


@cache
def _table() -> Mapping[str, Any]:
    path = config_path('prediction_errors.yaml')
    data: Mapping[str, Any] = read_yaml(path, ModelFileError)
    if data.get('schema') != 'lg_husky_sim/prediction_errors/1':
        raise ModelFileError(f'{path}: not a table of prediction errors '
                             '(schema lg_husky_sim/prediction_errors/1)')
    return data


def _error(kind: str, value: Number, channel: str = '', **values: float | str) -> PredictionError:
    entry = _table()['errors'][kind]
    known = {'value': value.value, 'low': value.low, 'high': value.high,
             'quantity': quantity(channel), **values}
    statement, = filled([entry['statement']], known)
    return PredictionError(kind, channel, value, entry['unit'], statement,
                           filled(entry['robot'], known), filled(entry['simulator'], known))


@dataclass(frozen=True)
class Assessment:
    """
    Everything in which recordings differ from a model's prediction.

    Parameters
    ----------
    label : str
        Of the model.
    errors : tuple of PredictionError
        Most serious first.
    compared : bool
        Whether any channel could be compared.

    """

    label: str
    errors: tuple[PredictionError, ...]
    compared: bool

    def advice(self, where: str = '') -> tuple[Advice, ...]:
        """
        Return what to change on the robot and in the simulator.

        Parameters
        ----------
        where : str
            Put behind the headings, such as the name of a case.

        """
        remarks = _table()['remarks']
        behind = f', {where}' if where else ''
        if not self.errors:
            text = remarks['agreement' if self.compared else 'nothing_comparable']
            title = 'Gains and delays agree' if self.compared else 'Too little to compare'
            return (Advice(f'{title}{behind}', filled([text], {
                'label': self.label, 'gain': setting('gain_tolerance'),
                'delay': setting('late_tolerance'), 'seconds': setting('least_compared'),
                'motion': setting('least_moved')})),)
        found = Advice(f'What differs from {self.label}{behind}', tuple(
            error.statement for error in self.errors))
        parts = (('On the robot', [line for error in self.errors for line in error.robot]),
                 ('In the simulator', [line for error in self.errors for line in error.simulator]))
        return (found, *(Advice(f'{name}{behind}', tuple(dict.fromkeys(lines)))
                         for name, lines in parts if lines),
                Advice(f'The cause{behind}', (remarks['cause'],)))

    def data(self) -> dict[str, object]:
        """Return it as plain data for JSON."""
        return {'model': self.label, 'compared': self.compared,
                'differences': [error.data() for error in self.errors],
                'advice': [{'where': one.where, 'sentences': list(one.sentences)}
                           for one in self.advice()]}

    def __str__(self) -> str:
        """Return it as text."""
        lines = ['what to change']
        for one in self.advice():
            lines += [f'  {one.where}', *(f'    - {line}' for line in one.sentences)]
        return '\n'.join(lines)


def assess(parts: Predicted, label: str, parameters: Parameters) -> Assessment:
    """
    Say in what recordings differ from a model's prediction, and what to change.

    Parameters
    ----------
    parts : sequence of (Segment, TimeSeries)
        Segments with what the model predicts: columns of the simulator.
    label : str
        Of the model.
    parameters : Parameters
        Of the model.

    Returns
    -------
    Assessment

    """
    stretches = [segment for segment, _ in parts]
    related = relations(stretches)
    accused: set[str] = set()
    found = []
    for fault in faults(related, stretches):
        accused.add(fault.stream)
        found.append(_sensor(fault))
    others = differences(related, parameters)
    for other in others:
        radius = other.numbers.get('wheel_radius', math.nan)
        kind = 'other_robot' if other.comparable else (
            'sensor' if other.subsystem == Subsystem.SENSOR.value else 'off_ground')
        found.append(_error(kind, Number(radius, math.nan, math.nan), words=other.statement,
                            wheel_radius=radius))
    if any(not other.comparable for other in others):
        return Assessment(label, tuple(found), compared=True)
    fits = {name: fit for name, fit in body_fits(parts).items()
            if _STREAM_OF[name] not in accused}
    wheels = None if 'wheels' in accused else wheel_fits(parts)
    everything: dict[str, ChannelFit | WheelFit] = dict(fits)
    if wheels is not None:
        everything['wheel_speed'] = wheels
    poor = [name for name, fit in everything.items()
            if fit.explained < setting('least_explained')]
    found += [_error('unexplained', Number(max(0.0, everything[name].explained), math.nan,
                                           math.nan), name) for name in poor]
    sound = {name: fit for name, fit in everything.items() if name not in poor}
    # A limit shifts edges: what it cuts off has no delay of its own.
    delays = list(_delays({name: fit for name, fit in sound.items() if not (
        isinstance(fit, ChannelFit) and _is_limited(fit))}))
    gains = list(_gains(
        {name: fit for name, fit in fits.items() if name not in poor},
        wheels if 'wheel_speed' in sound else None, parameters, other_radius=bool(others)))
    found += [*delays, *(_settled_first(gains) if delays else gains)]
    return Assessment(label, tuple(found), compared=bool(everything))


def _sensor(fault: Fault) -> PredictionError:
    # With the advice of its effect.
    found = fault.number
    if found is None or fault.effect is None:
        return _error('sensor', Number(math.nan, math.nan, math.nan), words=fault.statement)
    values: dict[str, float | str] = {
        found.name: found.value, 'stream': _STREAMS.get(fault.stream, fault.stream),
        'offset': f'{number(abs(found.value))} s {"late" if found.value > 0.0 else "early"}'}
    value = Number(found.value, found.low, found.high)
    return replace(_error('sensor', value, words=fault.statement), unit=found.unit,
                   robot=filled(effect_kind(fault.effect.id).advice.robot, values))


def _delays(sound: Mapping[str, ChannelFit | WheelFit]) -> Iterator[PredictionError]:
    off = {name: fit.delay for name, fit in sound.items() if fit.delay.is_off(
        0.0, max(setting('late_tolerance'), fit.interval))}
    if off and len(off) == len(sound) and len({value.value > 0.0 for value in off.values()}) == 1:
        middle = sorted(off.values(), key=lambda value: abs(value.value))[(len(off) - 1) // 2]
        if middle.value > 0.0:
            yield _error('late', middle)
        else:
            yield _error('early', Number(-middle.value, -middle.high, -middle.low))
        return
    unlike = _table()['remarks']['unlike'] if len(off) == 1 else ''
    for name, value in off.items():
        if value.value > 0.0:
            yield _error('channel_delay', value, name, how='later', unlike=unlike)
        else:
            yield _error('channel_delay', Number(-value.value, -value.high, -value.low), name,
                         how='earlier', unlike=unlike)


def _settled_first(gains: Sequence[PredictionError]) -> list[PredictionError]:
    # What a gain would be calibrated to is not said where dynamics may be behind it.
    return [replace(error, robot=(_table()['remarks']['dynamic'],), simulator=())
            for error in gains]


def _off(gain: Number) -> bool:
    return gain.is_off(1.0, setting('gain_tolerance'))


def _is_limited(fit: ChannelFit) -> bool:
    # Whether large rates are followed less than small ones.
    low, high = fit.small, fit.large
    difference = mean(low, Number(-high.value, -high.high, -high.low))
    return _off(fit.gain) and difference.value > 0.0 and difference.is_off(
        0.0, 0.5 * setting('limited'))


def _limit(name: str, fit: ChannelFit) -> PredictionError:
    return _error('speed_limit' if name == 'forward' else 'yaw_limit',
                  Number(fit.reached, math.nan, math.nan), name)


def _gains(fits: Mapping[str, ChannelFit], wheels: WheelFit | None, parameters: Parameters, *,
           other_radius: bool) -> Iterator[PredictionError]:
    reversed_ = [name for name, fit in fits.items()
                 if fit.gain.value < 0.0 and fit.gain.is_off(0.0, 0.0)]
    for name in reversed_:
        yield _error('sign', fits[name].gain, name)
    ahead, yaw = fits.get('forward'), fits.get('yaw_rate', fits.get('turn'))
    turns = 'yaw_rate' if 'yaw_rate' in fits else 'turn'
    if wheels is None:
        yield from _without_wheels(ahead, yaw, turns, parameters, reversed_)
        return
    speed = mean(wheels.left, wheels.right)
    if speed.value < 0.0 and speed.is_off(0.0, 0.0):
        yield _error('sign', speed, 'wheel_speed')
        return
    sides = ratio(wheels.left, wheels.right)
    if _off(sides):
        yield _sides(wheels, sides, speed, ahead)
        return
    if _off(speed):
        yield _error('speed_gain', speed, 'wheel_speed',
                     command_gain=parameters['command_gain'] * speed.value)
    if yaw is not None and turns not in reversed_ and _is_limited(yaw):
        yield _limit(turns, yaw)
    elif math.isfinite(wheels.turning.value) and _off(ratio(wheels.turning, speed)):
        turning = ratio(wheels.turning, speed)
        yield _error('turn_gain', turning, turn_ratio=parameters['turn_ratio'] * turning.value)
    if ahead is not None and 'forward' not in reversed_ and not other_radius and (
            _off(ratio(ahead.gain, speed))):
        rolls = ratio(ahead.gain, speed)
        yield _error('rolling', rolls, wheel_radius=parameters['wheel_radius'] * rolls.value)
    if yaw is not None and turns not in reversed_ and math.isfinite(wheels.turning.value) and (
            wheels.turning.value > 0.0 and _off(ratio(yaw.gain, wheels.turning))):
        yield _error('slip', ratio(yaw.gain, wheels.turning), turns)


def _sides(wheels: WheelFit, sides: Number, speed: Number, ahead: ChannelFit | None
           ) -> PredictionError:
    # One side differs: its encoder, if the speed of the robot does not go with it.
    gains = {'left': wheels.left, 'right': wheels.right}
    off = [side for side, gain in gains.items() if _off(gain)]
    if len(off) == 1 and ahead is not None and not _off(ahead.gain) and _off(
            ratio(ahead.gain, speed)):
        return _error('encoder', gains[off[0]], f'wheel_{off[0]}', side=off[0])
    return _error('sides', sides, left=_pace(wheels.left.value), right=_pace(wheels.right.value))


def _pace(gain: float) -> str:
    # A factor that is rounded to one is none.
    said = number(gain)
    return f'{"" if said == number(1.0) else f"{said} times "}as fast as predicted'


def _without_wheels(ahead: ChannelFit | None, yaw: ChannelFit | None, turns: str,
                    parameters: Parameters, reversed_: Sequence[str]
                    ) -> Iterator[PredictionError]:
    for name, fit in (('forward', ahead), (turns, yaw)):
        if fit is None or name in reversed_ or not _off(fit.gain):
            continue
        if _is_limited(fit):
            yield _limit(name, fit)
        elif name == 'forward':
            yield _error('speed_gain', fit.gain, name,
                         command_gain=parameters['command_gain'] * fit.gain.value)
        else:
            yield _error('yaw_gain', fit.gain, name)
