# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What is estimated: numbers of the model, of how the log was made, and of effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
import math

from lg_husky_sim.diagnosis.evidence.drives import Drive
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.effects import Effect, EffectParameter
from lg_husky_sim.husky.parameters import Parameter, Parameters
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Numbers of the model that a recalibration moves within their tolerances.
RECALIBRATED = ('wheel_damping', 'yaw_damping', 'command_gain', 'turn_ratio', 'mass',
                'yaw_inertia', 'wheel_inertia', 'motor_resistance', 'motor_inductance',
                'wheel_radius', 'track', 'side_gain_ratio')
#: Value at which a number of an effect does nothing, where that is not zero.
NEUTRAL = {'gyro_factor': 1.0, 'encoder_factor': 1.0}


@dataclass(frozen=True)
class Unknown:
    """
    One estimated number.

    Parameters
    ----------
    name : str
    kind : str
        ``model`` (a parameter of the robot), ``log`` (how the log was made) or ``effect``.
    logarithmic : bool
        Whether it is estimated on a logarithmic scale.
    centre, deviation : float
        Gaussian prior on that scale; an infinite deviation is none.
    lower, upper : float
        Bounds on that scale.
    step : float
        Step of a difference quotient on that scale.
    prompt, own, room : float
        Of a delay: its centre, its deviation, and how far its bounds are from the centre, if no
        stamp jitters [s].

    """

    name: str
    kind: str
    logarithmic: bool
    centre: float
    deviation: float
    lower: float
    upper: float
    step: float
    prompt: float = 0.0
    own: float = 0.0
    room: float = 0.0

    def value(self, place: float) -> float:
        """Return the number at a place on the scale [its unit]."""
        return math.exp(place) if self.logarithmic else place

    def place(self, value: float) -> float:
        """Return where a number stands on the scale, inside the bounds."""
        at = math.log(max(value, 1e-300)) if self.logarithmic else value
        return min(max(at, self.lower), self.upper)


def model_unknown(entry: Parameter) -> Unknown:
    """Return a parameter of the robot as an unknown with its tolerance as the prior."""
    wide = entry.tolerance >= 1.0
    deviation = setting('wide_prior') if wide else entry.tolerance
    centre = math.log(entry.value)
    return Unknown(entry.name, 'model', True, centre, deviation, math.log(max(entry.lower, 1e-9)),
                   math.log(entry.upper), setting('model_step'))


def log_unknown(name: str, centre: float, deviation: float, lower: float, upper: float
                ) -> Unknown:
    """Return a number of how the log was made as an unknown."""
    return Unknown(name, 'log', False, centre, deviation, lower, upper, 0.2 * deviation)


def delay_unknown(name: str, centre: float, deviation: float, period: float) -> Unknown:
    """
    Return a delay as an unknown.

    Parameters
    ----------
    name : str
        Of the delay, such as ``delay_imu``.
    centre, deviation : float
        Gaussian prior of what its transport takes [s].
    period : float
        Of its stream [s]: a stamp stands for some moment of it, any alike.

    Returns
    -------
    Unknown

    """
    own = math.hypot(deviation, period / math.sqrt(12.0))
    room = 0.5 * period + setting('log_reach') * deviation
    return Unknown(name, 'log', False, centre, own, centre - room, centre + room,
                   0.2 * deviation, centre, own, room)


def window_unknown(name: str, usual: float, longest: float) -> Unknown:
    """Return the length of the window over which a rate is taken as an unknown."""
    return Unknown(name, 'log', True, math.log(usual), setting('window_spread'),
                   math.log(setting('shortest_window')), math.log(longest),
                   setting('effect_step'))


def effect_unknown(parameter: EffectParameter, start: float) -> Unknown:
    """Return a number of an effect as an unknown; most positive ones on a logarithmic scale."""
    upper = min(parameter.upper, setting('none_reach') * parameter.none_from)
    positive = parameter.lower >= 0.0 and parameter.name not in NEUTRAL and not parameter.linear
    if positive:
        least = max(parameter.lower, 1e-4 * abs(start))
        return Unknown(parameter.name, 'effect', True, math.log(abs(start)), math.inf,
                       math.log(least), math.log(upper), setting('effect_step'))
    size = parameter.starts[0] if parameter.linear else abs(
        start - NEUTRAL.get(parameter.name, 0.0))
    return Unknown(parameter.name, 'effect', False, start, math.inf, parameter.lower,
                   upper, setting('effect_step') * max(size, 1e-9))


def effect_unknowns(effect: Effect, start: Mapping[str, float]) -> tuple[Unknown, ...]:
    """Return the free numbers of an effect as unknowns, scaled by where they start."""
    return tuple(effect_unknown(p, start[p.name]) for p in effect.parameters() if not p.fixed)


def base_unknowns(parameters: Parameters, drives: Sequence[Drive]) -> tuple[Unknown, ...]:
    """
    Return what a recalibration of a model may move.

    Parameters
    ----------
    parameters : Parameters
        Nominal: the centres of the priors; one without tolerance is exact.
    drives : sequence of Drive
        Numbers of streams that none has are left out.

    Returns
    -------
    tuple of Unknown

    """
    found = [model_unknown(parameters.entry(name)) for name in RECALIBRATED
             if name in parameters and parameters.entry(name).tolerance > 0.0]
    wheels = any(d.wheel_times.size for d in drives)
    gyro = any(d.imu_times.size for d in drives)
    pose = any(d.pose_times.size for d in drives)

    def add(name: str, deviation: float, centre: float = 0.0) -> None:
        reach = setting('log_reach') * deviation
        found.append(log_unknown(name, centre, deviation, centre - reach, centre + reach))

    def late_by(name: str, streams: Sequence[FloatArray]) -> None:
        # Any moment of its period may be the one that a stamp stands for.
        period = max((float(np.median(np.diff(t))) for t in streams if t.size > 1), default=0.0)
        found.append(delay_unknown(name, 0.0, setting('stamp_offset'), period))
    late = setting('transport') if all(d.stamped for d in drives) else -setting('receipt')
    found.append(delay_unknown('command_delay', late, setting('transport_spread'),
                               setting('base_period')))
    lags = list(dict.fromkeys(d.own_lag for d in drives))
    for lag in lags if len(lags) > 1 else ():
        add(lag, setting('recording_lag'))
    if wheels:
        late_by('delay_wheels', [d.wheel_times for d in drives])
        if any(d.wheel_times.size and not d.counted for d in drives):
            found.append(window_unknown('wheel_window', setting('wheel_window'),
                                        setting('longest_window')))
    if gyro:
        late_by('delay_imu', [d.imu_times for d in drives])
        add('gyro_offset', setting('gyro_offset'))
        if pose:
            add('gyro_gain', setting('gyro_gain'))
    if pose:
        late_by('delay_pose', [d.pose_times for d in drives])
        add('pose_turn', setting('pose_turn'))
        add('pose_lever', setting('pose_lever'))
    return tuple(found)


def tick_unknowns(drives: Sequence[Drive]) -> tuple[Unknown, ...]:
    """Return how much later than at the likeliest phase the base ticks, in each recording."""
    periods = {d.late: d.clock.period for d in drives if d.clock is not None}
    return tuple(log_unknown(name, 0.0, setting('clock_phase') * period, -0.5 * period,
                             0.5 * period) for name, period in periods.items())


def loosened(unknowns: Sequence[Unknown], jitter: Mapping[str, float]) -> tuple[Unknown, ...]:
    """
    Return unknowns whose delays are as large as the jitter of their stamps suggests.

    What is late by anything from 0 to T, as commands are at a base that looks for them at its own
    rate 1/T, varies by s = T/sqrt(12) and is late by T/2 = sqrt(3) s on the mean; what varies
    about its stamp is not late at all. With either, and all between, alike, a jitter s makes a
    delay later by sqrt(3)/2 s, with a standard deviation of s/2.

    Parameters
    ----------
    unknowns : sequence of Unknown
        Of a fit; those that are no delays of the log stay as they are.
    jitter : mapping of str to float
        Standard deviation [s] of what each delay varies by.

    Returns
    -------
    tuple of Unknown

    """
    found = []
    for one in unknowns:
        if one.kind == 'log' and one.name in jitter:
            latest = setting('late_by_jitter') * jitter[one.name]
            spread = latest / math.sqrt(12.0)
            centre = one.prompt + 0.5 * latest
            reach = math.hypot(one.room, setting('log_reach') * spread)
            one = replace(one, centre=centre, deviation=math.hypot(one.own, spread),
                          lower=centre - reach, upper=centre + reach)
        found.append(one)
    return tuple(found)


def values_of(unknowns: Sequence[Unknown], places: FloatArray, kind: str) -> dict[str, float]:
    """Return the numbers of one kind at places on their scales, by name."""
    return {u.name: u.value(float(p)) for u, p in zip(unknowns, places, strict=True)
            if u.kind == kind}


def start_of(unknowns: Sequence[Unknown]) -> FloatArray:
    """Return the centres as places, inside the bounds."""
    return np.array([min(max(u.centre, u.lower), u.upper) for u in unknowns])
