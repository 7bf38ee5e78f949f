# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The numbers of ``config/before_after.yaml``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import chain
from typing import Any

from lg_husky_sim.diagnosis.before_after.base_names import ROBOT
from lg_husky_sim.errors import DiagnosisError
from lg_husky_sim.husky.robot_size import RobotSize
from lg_husky_sim.resources import config_path
from lg_husky_sim.yaml_files import read_yaml, shown

SCHEMA = 'lg_husky_sim/before_after/1'


@dataclass(frozen=True)
class Quantity:
    """
    A parameter of the base robot or of what records it.

    Parameters
    ----------
    name, unit, meaning : str
    logarithmic : bool
        Whether it is estimated as its natural logarithm.
    start : float or None
        Mean of the prior; None where the model in doubt gives it under the name ``nominal``.
    nominal : str
    sd, recording, change, delta : float
        On the scale of the estimate: of the prior, between recordings, of a change; step of a
        difference quotient.
    lower, upper : float
        Bounds [unit].

    """

    name: str
    unit: str
    meaning: str
    logarithmic: bool
    start: float | None
    nominal: str
    sd: float
    recording: float
    change: float
    delta: float
    lower: float
    upper: float

    def of(self, robot: RobotSize) -> Quantity:
        """Return it for a robot of another size."""
        factor = robot.factor(self.unit)
        steps = 1.0 if self.logarithmic else factor
        return self if factor == 1.0 else replace(
            self, start=None if self.start is None else factor * self.start,
            sd=steps * self.sd, recording=steps * self.recording, change=steps * self.change,
            delta=steps * self.delta, lower=factor * self.lower, upper=factor * self.upper)


@dataclass(frozen=True)
class Change:
    """
    A hypothesis: some parameters differ between the sets.

    Parameters
    ----------
    effect, side, subsystem : str
        As in a finding.
    block : str
        body or loop: where it shows.
    parameters : tuple of str
        Names of those that differ.
    more : tuple of str
        Of those that differ as well, and show in the loop only.
    aside : tuple of str
        Of those that may differ as well, by how the recordings were made, and are not told.
    title, regime : str
        In words.
    elements : tuple of str
        Of the linear graph.

    """

    effect: str
    side: str
    subsystem: str
    block: str
    parameters: tuple[str, ...]
    more: tuple[str, ...]
    aside: tuple[str, ...]
    title: str
    regime: str
    elements: tuple[str, ...]


@dataclass(frozen=True)
class Separation:
    """What tells names apart: sensors and drives, in words."""

    effects: frozenset[str]
    sensors: tuple[str, ...]
    drives: tuple[str, ...]


@dataclass(frozen=True)
class Settings:
    """
    Everything in the file.

    Parameters
    ----------
    robot, record : tuple of Quantity
        Of the robot, in the order of ``ROBOT``; of the command path and the sensors.
    simulation : mapping of str to float
    bins, noise : mapping of str to float
        Of each kind of channel: width of a bin [s], residual to begin with [unit].
    runs_as : mapping of str to (str, str, str)
        Effect, its number and its side by which a model has a parameter of the base that changed.
    not_told : mapping of str to str
        Effects of the catalogue of which a change is not told, and why.

    """

    robot: tuple[Quantity, ...]
    record: tuple[Quantity, ...]
    simulation: Mapping[str, float]
    bins: Mapping[str, float]
    noise: Mapping[str, float]
    body: frozenset[str]
    limits: frozenset[str]
    of_a_kind: frozenset[str]
    starts: tuple[tuple[Mapping[str, float], ...], ...]
    kinds: tuple[Mapping[str, float], ...]
    fit: Mapping[str, float]
    decision: Mapping[str, float]
    changes: tuple[Change, ...]
    aliases: Mapping[str, tuple[str, ...]]
    runs_as: Mapping[str, tuple[str, str, str]]
    not_told: Mapping[str, str]
    separations: tuple[Separation, ...]
    advice: Mapping[str, tuple[str, ...]]
    names: Mapping[str, str]

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """All that is estimated, in order."""
        return (*self.robot, *self.record)

    def of(self, robot: RobotSize) -> Settings:
        """Return them for a robot of another size."""
        known = {q.name: q for q in self.quantities}

        def values(entry: Mapping[str, float], added: bool) -> dict[str, float]:
            return {name: value if added and known[name].logarithmic else
                    robot.factor(known[name].unit) * value for name, value in entry.items()}
        return replace(
            self, robot=tuple(q.of(robot) for q in self.robot),
            record=tuple(q.of(robot) for q in self.record),
            starts=tuple(tuple(values(entry, True) for entry in kind) for kind in self.starts),
            kinds=tuple(values(entry, False) for entry in self.kinds),
            fit={**self.fit, 'current_shows': robot.factor('A') * self.fit['current_shows']})


def _number(where: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise DiagnosisError(f'before_after.yaml: {where} = {shown(value)} is not a number')
    return float(value)


def _entries(section: str, found: Sequence[Mapping[str, object]]
             ) -> tuple[Mapping[str, float], ...]:
    return tuple({name: _number(f'{section}.{name}', value) for name, value in entry.items()}
                 for entry in found)


def _quantity(name: str, entry: Mapping[str, Any]) -> Quantity:
    scale = entry['scale']
    if scale not in ('log', 'linear'):
        raise DiagnosisError(f'before_after.yaml: {name}: scale = {shown(scale)} is neither log '
                             'nor linear')
    numbers = {key: _number(f'{name}.{key}', entry[key])
               for key in ('sd', 'recording', 'change', 'delta', 'lower', 'upper')}
    start = _number(f'{name}.start', entry['start']) if 'start' in entry else None
    return Quantity(name, str(entry['unit']), str(entry['meaning']), scale == 'log', start,
                    str(entry.get('nominal', '')), **numbers)


def _change(entry: Mapping[str, Any], known: frozenset[str]) -> Change:
    for name in (*entry['parameters'], *entry.get('more', ()), *entry.get('aside', ())):
        if name not in known:
            raise DiagnosisError(f'before_after.yaml: change {entry["effect"]}: unknown parameter '
                                 f'{shown(name)}')
    if entry['block'] not in ('body', 'loop'):
        raise DiagnosisError(f'before_after.yaml: change {entry["effect"]}: block = '
                             f'{shown(entry["block"])} is neither body nor loop')
    return Change(entry['effect'], entry['side'], entry['subsystem'], entry['block'],
                  tuple(entry['parameters']), tuple(entry.get('more', ())),
                  tuple(entry.get('aside', ())), entry['title'],
                  entry['regime'], tuple(entry['elements']))


def _values(content: Mapping[str, Any], section: str) -> dict[str, float]:
    return {name: _number(f'{section}.{name}', entry['value'])
            for name, entry in content[section].items()}


@cache
def settings() -> Settings:
    """
    Read ``config/before_after.yaml``.

    Returns
    -------
    Settings

    Raises
    ------
    DiagnosisError
        If an entry is missing, unknown or no number.

    """
    path = config_path('before_after.yaml')
    content = read_yaml(path, DiagnosisError)
    try:
        robot = {name: _quantity(name, entry) for name, entry in content['robot'].items()}
        if set(robot) != set(ROBOT):
            odd = sorted(set(robot) ^ set(ROBOT))
            raise DiagnosisError(f'{path}: robot lacks or should not have {", ".join(odd)}')
        record = tuple(_quantity(name, entry) for name, entry in content['record'].items())
        channels = content['channels'].items()
        bins = {name: _number(f'{name}.bin', entry['bin']) for name, entry in channels}
        noise = {name: _number(f'{name}.noise', entry['noise']) for name, entry in channels}
        known = frozenset((*robot, *(q.name for q in record)))
        groups = {key: frozenset(content[key]) for key in ('body', 'limits', 'of_a_kind')}
        kinds = _entries('kinds', content['kinds'])
        starts = tuple(_entries('starts', kind) for kind in content['starts'])
        for name in sorted({*(name for group in groups.values() for name in group),
                            *chain(*chain(*starts), *kinds)} - known):
            raise DiagnosisError(f'{path}: unknown parameter {shown(name)}')
        return Settings(tuple(robot[name] for name in ROBOT), record,
                        _values(content, 'simulation'), bins, noise, groups['body'],
                        groups['limits'], groups['of_a_kind'], starts, kinds,
                        _values(content, 'fit'),
                        _values(content, 'decision'),
                        tuple(_change(entry, known) for entry in content['changes']),
                        {name: tuple(others) for name, others in content['aliases'].items()},
                        {name: (str(effect), str(number), str(side))
                         for name, (effect, number, side) in content['runs_as'].items()},
                        {name: str(why) for name, why in content['not_told'].items()},
                        tuple(Separation(frozenset(e['effects']), tuple(e['sensors']),
                                         tuple(e['drives'])) for e in content['separations']),
                        {name: tuple(lines) for name, lines in content['advice'].items()},
                        dict(content['names']))
    except (KeyError, TypeError, AttributeError) as error:
        raise DiagnosisError(f'{path} cannot be understood: {error!r}') from error
