# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The catalogue of physics that the nominal graph leaves out, as values."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
import difflib
import enum
from functools import cache
import math
from typing import Any

from lg_husky_sim.errors import ModelFileError, ParameterError
from lg_husky_sim.husky.parameters import Parameter
from lg_husky_sim.husky.robot_size import HUSKY, RobotSize
from lg_husky_sim.resources import config_path
from lg_husky_sim.yaml_files import read_yaml, shown


class Subsystem(enum.Enum):
    """Part of the robot that an effect belongs to."""

    ELECTRICAL = 'electrical'
    COMMAND = 'command'
    DRIVETRAIN = 'drivetrain'
    TRACTION = 'traction'
    TRANSLATION = 'translation'
    ROTATION = 'rotation'
    SENSOR = 'sensor'


class OnsetKind(enum.Enum):
    """What switches a late effect on."""

    TIME = 'time'
    PLACE_ABOVE = 'place_above'
    PLACE_BELOW = 'place_below'


#: Most effects that an unknown name is taken to mean; a part of more names means none of them.
MOST_MEANT = 3
#: What the names of a changed effect's numbers end in.
LATER = '_later'


@dataclass(frozen=True)
class Onset:
    """
    When or where an effect begins.

    Parameters
    ----------
    kind : OnsetKind
    value : float
        Time in a recording [s], or x in the world [m].
    recording : str
        Name of the recording in which a time onset lies: the effect is absent in earlier ones
        and stays in later ones. Empty where it begins at that time in each. With a place, the
        first recording in which the place matters; empty for all.
    earlier : tuple of str
        Names of the recordings that are known to be earlier.

    """

    kind: OnsetKind
    value: float
    recording: str = ''
    earlier: tuple[str, ...] = ()

    @property
    def recordings(self) -> tuple[str, ...]:
        """Names of the recordings that it tells apart."""
        return (*self.earlier, self.recording) if self.recording else self.earlier

    def before(self, names: Sequence[str]) -> tuple[str, ...]:
        """Return the recordings before its own: in the order of `names`, or known to be so."""
        if self.recording not in names:
            return self.earlier
        return (*names[:names.index(self.recording)], *self.earlier)


@dataclass(frozen=True)
class EffectParameter:
    """
    One number of an effect.

    Parameters
    ----------
    name : str
    unit : str
    lower, upper : float
        Bounds [unit].
    starts : tuple of float
        Sizes from which an estimation begins [unit].
    source : str
    fixed : bool
        A smoothing or shape constant that is not estimated.
    negligible : float
        How far from none of it a robot may be without anything missing from its model [unit]; 0
        where every size counts.
    none_from : float
        Of a limit or a stiffness: the size from which nothing is missing; estimates reach a little
        further [unit].
    shapes : tuple of str
        Forms that have it; empty for all.
    linear : bool
        Whether it is estimated on a linear scale though it has one sign only.
    jitter, delays : mapping of str to str
        By the effect's shape, of a delay: which jitter of a log it may come of; and, of one that
        is always there, which delay of a log does the same.
    limits : str
        What it is the largest size of: 'voltage' or 'current' of a motor, or the commanded
        'forward' speed or 'yaw' rate; empty for no limit.
    label : str
        What sentences call it; its name in words if empty.

    """

    name: str
    unit: str
    lower: float
    upper: float
    starts: tuple[float, ...]
    source: str
    fixed: bool = False
    negligible: float = 0.0
    none_from: float = math.inf
    shapes: tuple[str, ...] = ()
    linear: bool = False
    jitter: Mapping[str, str] = field(default_factory=dict)
    delays: Mapping[str, str] = field(default_factory=dict)
    limits: str = ''
    label: str = ''

    def of(self, robot: RobotSize) -> EffectParameter:
        """Return it for a robot of another size: bounds and sizes are in proportion."""
        factor = robot.factor(self.unit)
        return self if factor == 1.0 else replace(
            self, lower=factor * self.lower, upper=factor * self.upper,
            starts=tuple(factor * start for start in self.starts),
            negligible=factor * self.negligible, none_from=factor * self.none_from)

    def parameter(self, value: float | None = None) -> Parameter:
        """Return it as a parameter with ``value``, or with its first start."""
        return Parameter(self.name, self.starts[0] if value is None else value, self.unit,
                         self.lower, self.upper, self.source, tolerance=10.0,
                         free=not self.fixed)


@dataclass(frozen=True)
class Remedy:
    """
    What a person should do when an effect is found.

    Parameters
    ----------
    robot, simulator : tuple of str
        Sentences; names of parameters, and side, where, wheels, stream, stand in braces.
    instead : tuple of str
        Parameters of sim_node to set in place of loading the model with the effect.

    """

    robot: tuple[str, ...] = ()
    simulator: tuple[str, ...] = ()
    instead: tuple[str, ...] = ()


@dataclass(frozen=True)
class EffectKind:
    """
    One entry of the catalogue.

    Parameters
    ----------
    id : str
        Name on the interface.
    subsystem : Subsystem
    title : str
        What it is, in words.
    elements : tuple of str
        Elements of the graph that it touches.
    parameters : tuple of EffectParameter
    sides, shapes : tuple of str
        Sides it can act on and forms it can take; the first is the default.
    onset : str
        ``required`` where it only makes sense with one, ``never`` where it is always on, since
        it adds states; else empty.
    always : tuple of str
        Forms that are always on, since they add states.
    drivetrain : str
        The drivetrain that has it; empty for any.
    needs : mapping of str to str
        Effect that a form only makes sense with, by the form.
    stands_for : mapping of str to tuple of str
        Forms without a number that it has not, which a diagnosis tries in a form's place.
    tried : bool
        Whether a diagnosis tries it.
    sensors, manoeuvres : tuple of str
        What tells it apart from others: a sensor that sees it directly, a drive that brings it
        out.
    advice : Remedy
    name : str
        What reports call it.

    """

    id: str  # noqa: A003
    subsystem: Subsystem
    title: str
    elements: tuple[str, ...]
    parameters: tuple[EffectParameter, ...]
    sides: tuple[str, ...] = ('none',)
    shapes: tuple[str, ...] = ('',)
    onset: str = ''
    always: tuple[str, ...] = ()
    drivetrain: str = ''
    needs: Mapping[str, str] = field(default_factory=dict)
    stands_for: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    tried: bool = True
    sensors: tuple[str, ...] = ()
    manoeuvres: tuple[str, ...] = ()
    advice: Remedy = Remedy()
    name: str = ''

    @property
    def needs_onset(self) -> bool:
        """Whether it only makes sense with an onset."""
        return self.onset == 'required'

    @property
    def always_on(self) -> bool:
        """Whether all of its forms add states, so that none can begin at an onset."""
        return self.onset == 'never'


@dataclass(frozen=True)
class Effect:
    """
    An effect of the catalogue, applied to a structure.

    Parameters
    ----------
    id : str
        Entry of the catalogue.
    side : str
        ``none``, ``both``, ``left`` or ``right``.
    shape : str
        Variant of form; empty where there is one only.
    late : bool
        Whether it begins at the structure's onset instead of being there always.
    again : bool
        Whether it takes the place of the same effect of the same side, with numbers of its own:
        what was there already and changes at the onset.
    robot : RobotSize
        Of the robot that may have it: its numbers are in proportion.

    Raises
    ------
    ParameterError
        If the id, side or shape is unknown.

    """

    id: str  # noqa: A003
    side: str = ''
    shape: str = ''
    late: bool = False
    again: bool = False
    robot: RobotSize = field(default=HUSKY, compare=False)

    def __post_init__(self) -> None:
        """Fill defaults and check against the catalogue."""
        kind = effect_kind(self.id)
        if not self.side:
            object.__setattr__(self, 'side', kind.sides[0])
        if not self.shape:
            object.__setattr__(self, 'shape', kind.shapes[0])
        for what, value, allowed in (('side', self.side, kind.sides),
                                     ('shape', self.shape, kind.shapes)):
            if value not in allowed:
                known = ', '.join(one for one in allowed if one not in ('', 'none'))
                raise ParameterError(f'{what} {shown(value)} of effect {self.id} is not one of '
                                     f'{known}' if known else f'{self.id} has no {what}s')

    @property
    def kind(self) -> EffectKind:
        """Entry of the catalogue."""
        return effect_kind(self.id)

    @property
    def always_on(self) -> bool:
        """Whether it adds states, so that it cannot begin at an onset."""
        return self.kind.always_on or self.shape in self.kind.always

    def parameters(self) -> tuple[EffectParameter, ...]:
        """Return the numbers that this side and shape have."""
        own = tuple(p.of(self.robot) for p in self.kind.parameters
                    if not p.shapes or self.shape in p.shapes)
        return tuple(replace(p, name=p.name + LATER) for p in own) if self.again else own

    @property
    def renamed(self) -> dict[str, str]:
        """Names of its numbers by those that the edits of the graph know."""
        return {p.name.removesuffix(LATER): p.name for p in self.parameters()} if (
            self.again) else {}


def check_distinct(effects: Iterable[Effect]) -> None:
    """
    Check that no two effects of a model share a parameter.

    Parameters
    ----------
    effects : iterable of Effect
        All those of one model.

    Raises
    ------
    ParameterError
        If two do: it cannot be two numbers.

    """
    owners: dict[str, Effect] = {}
    for effect in effects:
        for name in (p.name for p in effect.parameters()):
            other = owners.setdefault(name, effect)
            if other is not effect:
                raise ParameterError(
                    f'effects {other.id}:{other.side} and {effect.id}:{effect.side} share the '
                    f'parameter {name}; a model can hold one of them')


def _read_kind(name: str, entry: Mapping[str, Any]) -> EffectKind:
    parameters = tuple(
        EffectParameter(key, str(p['unit']), float(p['lower']), float(p['upper']),
                        tuple(float(s) for s in p['starts']), str(p['source']),
                        bool(p.get('fixed', False)), float(p.get('negligible', 0.0)),
                        float(p.get('none_from', math.inf)), tuple(p.get('shapes', ())),
                        bool(p.get('linear', False)), dict(p.get('jitter', {})),
                        dict(p.get('delays', {})), str(p.get('limits', '')),
                        str(p.get('label', '')))
        for key, p in entry['parameters'].items())
    return EffectKind(
        name, Subsystem(entry['subsystem']), str(entry['title']), tuple(entry['elements']),
        parameters, tuple(entry.get('sides', ('none',))), tuple(entry.get('shapes', ('',))),
        str(entry.get('onset', '')), tuple(entry.get('always', ())),
        str(entry.get('drivetrain', '')),
        dict(entry.get('needs', {})),
        {form: tuple(others) for form, others in entry.get('stands_for', {}).items()},
        bool(entry.get('tried', True)), tuple(entry.get('sensors', ())),
        tuple(entry.get('manoeuvres', ())),
        Remedy(*(tuple(entry.get('advice', {}).get(place, ())) for place in (
            'robot', 'simulator', 'instead'))), str(entry.get('name', name.replace('_', ' '))))


@cache
def catalogue() -> Mapping[str, EffectKind]:
    """Return the catalogue of ``config/effects.yaml`` by id; ModelFileError if it is none."""
    path = config_path('effects.yaml')
    data = read_yaml(path, ModelFileError)
    if data.get('schema') != 'lg_husky_sim/effects/1':
        raise ModelFileError(f'{path}: not a catalogue of effects (schema lg_husky_sim/effects/1)')
    return {name: _read_kind(name, entry) for name, entry in data['effects'].items()}


def always_on() -> list[str]:
    """Return the effects, or forms of them, that add states and cannot begin at an onset."""
    return [name for kind in catalogue().values() for name in (
        [kind.id] if kind.always_on else [f'{kind.id}:{form}' for form in kind.always])]


@cache
def descriptions() -> Mapping[str, EffectKind]:
    """Return the smooth efforts of ``config/effects.yaml``, which describe unknown effects."""
    data = read_yaml(config_path('effects.yaml'), ModelFileError)
    return {name: _read_kind(name, entry) for name, entry in data['descriptions'].items()}


def effect_kind(name: str) -> EffectKind:
    """
    Return one entry of the catalogue.

    Raises
    ------
    ParameterError
        If there is none of that id; a near one is suggested.

    """
    known = {**catalogue(), **descriptions()}
    if name not in known:
        offered = catalogue()
        word = str(name)
        near = difflib.get_close_matches(word, offered, n=1) or [
            one for one, kind in offered.items() if word and (word in one or word in kind.name)]
        hint = f'; did you mean {" or ".join(near)}?' if 0 < len(near) <= MOST_MEANT else ''
        raise ParameterError(f'unknown effect {shown(name)}{hint} (known: {", ".join(offered)})')
    return known[name]
