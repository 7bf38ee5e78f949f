# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Command scripts: what is driven, as a list of steps in YAML.

A script of one's own::

    schema: lg_husky_sim/commands/1
    about: a left turn
    rate: 20
    steps:
      - {duration: 2.0, forward: 0.5, yaw: 0.0, ramp: 0.5}
      - {duration: 3.0, forward: 0.5, yaw: 0.4}

Times in s, speeds in m/s and rad/s; positive yaw turns to the left (REP-103).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import difflib
import math
from numbers import Real
from pathlib import Path
from typing import Any

from lg_husky_sim.errors import CommandError
from lg_husky_sim.resources import config_path
from lg_husky_sim.signals import TimeSeries
from lg_husky_sim.yaml_files import read_yaml, shown, wrong_schema
import numpy as np

SCHEMA = 'lg_husky_sim/commands/1'
BUILTIN_SCHEMA = 'lg_husky_sim/manoeuvres/1'
DEFAULT_RATE = 20.0
"""Commands sent per second [Hz], as a teleoperation node does."""

LARGEST_RATE = 1000.0
LONGEST = 100_000.0
"""Longest script [s]."""
MOST_SAMPLES = 5_000_000
FASTEST = 100.0
"""Largest speed [m/s] or yaw rate [rad/s] that is no slip of the pen."""

_SPEED = {'type': 'number', 'minimum': -FASTEST, 'maximum': FASTEST, 'default': 0.0}
STEP: dict[str, Any] = {
    'type': 'object', 'additionalProperties': False, 'required': ['duration'],
    'properties': {
        'duration': {'type': 'number', 'exclusiveMinimum': 0.0, 'maximum': LONGEST,
                     'description': 'How long the step lasts [s], the ramp included.'},
        'forward': {**_SPEED, 'description': 'Commanded forward speed [m/s].'},
        'yaw': {**_SPEED, 'description': 'Commanded yaw rate [rad/s], positive to the left.'},
        'ramp': {'type': 'number', 'minimum': 0.0, 'maximum': LONGEST, 'default': 0.0,
                 'description': 'Time [s] in which the command moves there linearly from the '
                 'step before; 0 for a jump.'}}}
"""What a step may hold, as JSON schema; the order is that of :class:`Step`."""
SCRIPT: dict[str, Any] = {
    'type': 'object', 'additionalProperties': False, 'required': ['schema', 'steps'],
    'properties': {
        'schema': {'const': SCHEMA},
        'about': {'type': ['string', 'number', 'boolean', 'null'],
                  'description': 'One line on what it is.'},
        'rate': {'type': 'number', 'exclusiveMinimum': 0.0, 'maximum': LARGEST_RATE,
                 'default': DEFAULT_RATE, 'description': 'Commands sent per second [Hz].'},
        'steps': {'type': 'array', 'minItems': 1, 'items': STEP}}}
"""What a script may hold, as JSON schema."""


@dataclass(frozen=True)
class Step:
    """
    One step of a script.

    Parameters
    ----------
    duration : float
        How long the step lasts [s], the ramp included.
    forward : float
        Commanded forward speed [m/s].
    yaw : float
        Commanded yaw rate [rad/s], positive to the left.
    ramp : float
        Within this time [s] the command moves there linearly from the step before (from rest
        for the first one); 0 for a jump.

    Raises
    ------
    CommandError
        If a number is not finite, the duration is not positive or the ramp is longer.

    """

    duration: float
    forward: float
    yaw: float
    ramp: float = 0.0

    def __post_init__(self) -> None:
        """Check the numbers."""
        for name in ('duration', 'forward', 'yaw', 'ramp'):
            if not math.isfinite(getattr(self, name)):
                raise CommandError(f'{name} = {getattr(self, name)} is not finite')
        for name, unit in (('forward', 'm/s'), ('yaw', 'rad/s')):
            if abs(getattr(self, name)) > FASTEST:
                raise CommandError(
                    f'{name} = {getattr(self, name):g} {unit} is beyond ±{FASTEST:g} {unit}')
        if not 0.0 < self.duration <= LONGEST:
            raise CommandError(
                f'duration = {self.duration:g} s must be positive and at most {LONGEST:g} s')
        if not 0.0 <= self.ramp <= self.duration:
            raise CommandError(
                f'ramp = {self.ramp:g} s must lie between 0 and the duration {self.duration:g} s')


@dataclass(frozen=True)
class Manoeuvre:
    """
    A script with a name.

    Parameters
    ----------
    name : str
    steps : tuple of Step
        At least one.
    rate : float
        Commands sent per second [Hz].
    about : str
        One line on what it is.

    Raises
    ------
    CommandError
        If there is no step, or rate and length are out of range.

    """

    name: str
    steps: tuple[Step, ...]
    rate: float = DEFAULT_RATE
    about: str = ''

    def __post_init__(self) -> None:
        """Check length and rate."""
        if not self.steps:
            raise CommandError('steps is empty; at least one is needed')
        checked_rate(self.rate)
        if self.duration > LONGEST or self.duration * self.rate > MOST_SAMPLES:
            raise CommandError(
                f'{self.duration:g} s at {self.rate:g} Hz is too long: at most {LONGEST:g} s and '
                f'{MOST_SAMPLES} commands')

    @property
    def duration(self) -> float:
        """Length of all steps together [s]."""
        return math.fsum(step.duration for step in self.steps)

    def commands(self) -> TimeSeries:
        """
        Return the commands as they are sent.

        Returns
        -------
        TimeSeries
            Names forward [m/s] and yaw [rad/s]; times [s] from 0 at the script's rate, and a
            last one at the end, so that the series is as long as the script.

        """
        count = math.ceil(self.duration * self.rate - 1e-9)
        times = np.append(np.arange(count) / self.rate, self.duration)
        ends = np.cumsum([step.duration for step in self.steps])
        # A stamp on the edge of two steps belongs to the later one, whatever its rounding.
        which = np.minimum(np.searchsorted(ends, times + 1e-9, side='right'), len(ends) - 1)
        targets = np.array([(step.forward, step.yaw) for step in self.steps])
        before = np.vstack([np.zeros(2), targets[:-1]])
        elapsed = times - np.concatenate(([0.0], ends[:-1]))[which]
        ramps = np.array([step.ramp for step in self.steps])[which]
        share = np.clip(elapsed / np.maximum(ramps, 1e-9), 0.0, 1.0)
        share[ramps == 0.0] = 1.0
        values = before[which] + share[:, None] * (targets[which] - before[which])
        return TimeSeries(times, values, ('forward', 'yaw'))


def checked_rate(rate: object) -> float:
    """
    Return a rate [Hz] that is in range.

    Raises
    ------
    CommandError
        If it is not positive or too high.

    """
    if not isinstance(rate, Real) or not 0.0 < float(rate) <= LARGEST_RATE:
        said = f'{float(rate):g}' if isinstance(rate, Real) else shown(rate)
        raise CommandError(
            f'rate = {said} Hz must be positive and at most {LARGEST_RATE:g} Hz')
    return float(rate)


def builtin_manoeuvres() -> dict[str, Manoeuvre]:
    """Return the manoeuvres of ``config/manoeuvres.yaml`` by name, in its order."""
    data = read_yaml(config_path('manoeuvres.yaml'), CommandError)
    _check_schema(data, BUILTIN_SCHEMA)
    return {name: _manoeuvre(name, entry)
            for name, entry in _mapping('manoeuvres', data.get('manoeuvres')).items()}


def load_manoeuvre(path: Path) -> Manoeuvre:
    """
    Read a command script.

    Parameters
    ----------
    path : pathlib.Path
        A YAML file with schema ``lg_husky_sim/commands/1``.

    Returns
    -------
    Manoeuvre
        Named after the file.

    Raises
    ------
    CommandError
        If it cannot be read as a script; the message names file, place, value and what is
        allowed.

    """
    try:
        data = read_yaml(path, CommandError)
        _check_schema(data, SCHEMA)
        return _manoeuvre(path.stem, {k: v for k, v in data.items() if k != 'schema'})
    except CommandError as error:
        raise CommandError(f'{path}: {error}') from error


def find_manoeuvre(name: str) -> Manoeuvre:
    """
    Return a built-in manoeuvre.

    Raises
    ------
    CommandError
        If there is none of that name; the message lists those there are.

    """
    known = builtin_manoeuvres()
    if name not in known:
        near = difflib.get_close_matches(name, known, n=1)
        hint = f'; did you mean {near[0]}?' if near else ''
        raise CommandError(f'no manoeuvre {name!r}{hint} (there are {", ".join(known)})')
    return known[name]


def _check_schema(data: Mapping[str, Any], schema: str) -> None:
    wrong = wrong_schema(data, schema)
    if wrong:
        raise CommandError(wrong)


def _mapping(what: str, value: object) -> dict[str, Any]:
    if not isinstance(value, dict) or not all(isinstance(key, str) for key in value):
        raise CommandError(f'{what} is not a mapping of names')
    return value


def _manoeuvre(name: str, entry: object) -> Manoeuvre:
    data = _mapping(f'manoeuvre {name}', entry)
    _known(data, tuple(key for key in SCRIPT['properties'] if key != 'schema'))
    steps = data.get('steps')
    if not isinstance(steps, list):
        raise CommandError('steps is not a list')
    return Manoeuvre(
        name, tuple(_step(place + 1, step) for place, step in enumerate(steps)),
        _number('rate', data.get('rate', DEFAULT_RATE)), _text('about', data.get('about')))


def _step(place: int, entry: object) -> Step:
    try:
        data = _mapping('the step', entry)
        _known(data, tuple(STEP['properties']))
        if 'duration' not in data:
            raise CommandError('duration is missing')
        return Step(*(_number(key, data.get(key, 0.0))
                      for key in STEP['properties']))
    except CommandError as error:
        raise CommandError(f'step {place}: {error}') from error


def _known(data: Mapping[str, Any], keys: tuple[str, ...]) -> None:
    for key in data:
        if key not in keys:
            raise CommandError(f'unknown key {shown(key)} (allowed: {", ".join(keys)})')


def _text(name: str, value: object) -> str:
    if isinstance(value, (dict, list)):
        raise CommandError(f'{name} = {shown(value)} is not a text')
    return '' if value is None else str(value)


def _number(name: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise CommandError(f'{name} = {shown(value)} is not a number')
    try:
        return float(value)
    except OverflowError as error:
        raise CommandError(f'{name} is too large') from error


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of a command script."""
    return {'title': 'Command script of lg_husky', **SCRIPT}
