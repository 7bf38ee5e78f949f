# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Model files as a person may write them: what is left out is filled in, all errors are said."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
import difflib
from functools import partial
import math
from typing import Any, TypeVar

from lg_husky_sim.errors import LgHuskyError, ModelFileError, SEVERAL
from lg_husky_sim.husky.by_hand import bounds_of, Number, SIZES
from lg_husky_sim.husky.effects import (
    catalogue,
    check_distinct,
    descriptions,
    Effect,
    LATER,
    Onset,
    OnsetKind,
)
from lg_husky_sim.husky.model import Drivetrain, Structure
from lg_husky_sim.husky.model_schema import (
    EFFECT,
    IMPLIED,
    ONSET,
    PARAMETER,
    SCHEMA,
    STRUCTURE,
    TOP,
)
from lg_husky_sim.husky.parameters import Parameter, Parameters
from lg_husky_sim.husky.robot_size import HUSKY, RobotSize, size_of
from lg_husky_sim.husky.together import check_together
from lg_husky_sim.yaml_files import shown, wrong_schema

MOST_ERRORS = 20
"""So many errors of a file are listed."""

NOT_TOLD = 'not told'
"""Source of a parameter whose file tells none."""

_Read = TypeVar('_Read')


def read_model(data: object, nominal: Parameters | None
               ) -> tuple[Structure, Parameters, str]:
    """
    Read a model out of parsed YAML.

    Parameters
    ----------
    data : object
        As ``yaml.safe_load`` gives it.
    nominal : Parameters or None
        The packaged robot's, all of which a model must hold, and whose units, tolerances and
        bounds (in proportion) it has where it tells none; None for the packaged robot itself.

    Returns
    -------
    structure : Structure
    parameters : Parameters
    about : str

    Raises
    ------
    ModelFileError
        If something is missing, unknown or of the wrong type; one line each for all of it.

    """
    errors: list[str] = []
    content = _mapping('the file', data)
    wrong = wrong_schema(content, SCHEMA)
    if wrong:
        raise ModelFileError(wrong)
    _known(errors, '', content, TOP['properties'])
    about = _tried(errors, lambda: _text('about', content.get('about'))) or ''
    drivetrain, onset = _structure(errors, content.get('structure', {}))
    entries, robot = _parameters(errors, content.get('parameters'), nominal)
    effects = _effects(errors, content.get('effects'), {e.name for e in entries}, robot)
    if not errors:
        made = _tried(errors, lambda: (
            Structure(drivetrain, tuple(effect for effect, _ in effects), onset),
            Parameters(tuple(entries)).with_entries(*(p for _, group in effects for p in group))))
        if made is not None:
            return *made, about
    raise ModelFileError(_listed(errors))


def _listed(errors: list[str]) -> str:
    if len(errors) == 1:
        return errors[0]
    more = [f'and {len(errors) - MOST_ERRORS} more'] if len(errors) > MOST_ERRORS else []
    return SEVERAL.join([f'{len(errors)} errors', *errors[:MOST_ERRORS], *more])


def _tried(errors: list[str], read: Callable[[], _Read]) -> _Read | None:
    # What is wrong is kept, and the rest of the file is read all the same.
    try:
        return read()
    except LgHuskyError as error:
        errors.append(str(error))
        return None


def _number(name: str, key: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ModelFileError(f'{name}: {key} = {shown(value)} is not a number')
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise ModelFileError(f'{name}: {key} = {shown(value)} is not finite')
    return number


def _text(what: str, value: object) -> str:
    # A key without a value is an empty text.
    if isinstance(value, (dict, list)):
        raise ModelFileError(f'{what} = {shown(value)} is not a text')
    return '' if value is None else str(value)


def _flag(what: str, key: str, value: object) -> bool:
    if not isinstance(value, bool):
        raise ModelFileError(f'{what}: {key} = {shown(value)} is neither true nor false')
    return value


def _mapping(what: str, value: object) -> dict[str, Any]:
    if not isinstance(value, dict) or not all(isinstance(key, str) for key in value):
        raise ModelFileError(f'{what} is not a mapping of names')
    return value


def _near(name: str, known: Iterable[str]) -> str:
    near = difflib.get_close_matches(name, list(known), n=1)
    return near[0] if near else ''


def _hint(near: str, known: Iterable[str]) -> str:
    return f'; did you mean {near}?' if near else f' (known: {", ".join(known)})'


def _known(errors: list[str], where: str, given: Iterable[str], allowed: Iterable[str],
           what: str = 'key') -> set[str]:
    # Complain of names that are none; return those that were meant by them.
    meant = set()
    for name in given:
        if name not in allowed:
            near = _near(name, allowed)
            meant.add(near)
            errors.append(f'{where}: '.removeprefix(': ') + f'unknown {what} {shown(name)}'
                          + _hint(near, allowed))
    return meant


def _structure(errors: list[str], data: object) -> tuple[Drivetrain, Onset | None]:
    structure = _tried(errors, lambda: _mapping('structure', data)) or {}
    _known(errors, 'structure', structure, STRUCTURE['properties'])
    drivetrains = [d.value for d in Drivetrain]
    drivetrain = structure.get('drivetrain', 'simplified')
    if drivetrain not in drivetrains:
        errors.append(f'structure.drivetrain = {shown(drivetrain)} is not one of '
                      f'{", ".join(drivetrains)}')
        drivetrain = 'simplified'
    return Drivetrain(drivetrain), _tried(errors, lambda: _onset(errors, structure.get('onset')))


def _onset(errors: list[str], data: object) -> Onset | None:
    if data is None:
        return None
    entry = _mapping('structure.onset', data)
    _known(errors, 'structure.onset', entry, ONSET['properties'])
    kinds = [kind.value for kind in OnsetKind]
    if entry.get('kind') not in kinds:
        raise ModelFileError(
            f'structure.onset.kind = {shown(entry.get("kind"))} is not one of {", ".join(kinds)}')
    earlier = [] if entry.get('earlier') is None else entry['earlier']
    if not isinstance(earlier, list) or not all(isinstance(name, str) for name in earlier):
        raise ModelFileError('structure.onset.earlier is not a list of names of recordings')
    return Onset(OnsetKind(entry['kind']), _number('structure.onset', 'value',
                                                   entry.get('value')),
                 _text('structure.onset.recording', entry.get('recording')), tuple(earlier))


def _parameters(errors: list[str], data: object, nominal: Parameters | None
                ) -> tuple[list[Parameter], RobotSize]:
    given = _tried(errors, lambda: _mapping('parameters', data))
    if given is None:
        return [], HUSKY
    if nominal is None:
        found = [_parameter(errors, name, entry, None) for name, entry in given.items()]
        return [one for one in found if one is not None], HUSKY
    templates: Mapping[str, Parameter | None] = {
        **dict.fromkeys(_of_effects()), **{entry.name: entry for entry in nominal.entries}}
    meant = {name: _near(name, nominal) for name in given if name not in templates}
    errors += [f'unknown parameter {shown(name)}{_hint(near, nominal)}'
               for name, near in meant.items()]
    errors += [f'parameter {name} is missing' for name in nominal
               if name not in (*given, *IMPLIED) and name not in meant.values()]
    robot = _size(given, nominal)
    found = [_parameter(errors, name, entry, templates[name], robot)
             for name, entry in given.items() if name in templates]
    found += [nominal.entry(name) for name in IMPLIED if name in nominal and name not in given]
    read = {one.name: one for one in found if one is not None}
    if read.keys() >= set(nominal):
        _tried(errors, lambda: check_together(
            {name: one.value for name, one in read.items()},
            {name: one.unit for name, one in read.items()}, given,
            [name for name, entry in given.items()
             if isinstance(entry, dict) and not entry.keys().isdisjoint(('lower', 'upper'))]))
    return list(read.values()), robot


def _of_effects() -> set[str]:
    # Of every effect, whether a model has it or not: a file may have lost one.
    kinds = {**catalogue(), **descriptions()}.values()
    return {f'{p.name}{again}' for kind in kinds for p in kind.parameters for again in ('', LATER)}


def _size(given: Mapping[str, Any], nominal: Parameters) -> RobotSize:
    # Of what can be read; what cannot be is an error that is said elsewhere.
    values = dict(nominal)
    for name in SIZES:
        entry = given.get(name)
        value = _tried([], partial(
            _number, name, 'value', entry.get('value') if isinstance(entry, dict) else entry))
        if value is not None and value > 0.0:
            values[name] = value
    return size_of(values, nominal)


def _parameter(errors: list[str], name: str, entry: object, nominal: Parameter | None,
               robot: RobotSize | None = None) -> Parameter | None:
    """
    Read one parameter, given in full or by its value alone.

    Parameters
    ----------
    errors : list of str
        Gets a line for each thing that is wrong; then nothing is returned.
    name : str
        Of the parameter.
    entry : object
        What the file says of it: a mapping, or its value alone.
    nominal : Parameter or None
        What it is where the file tells less; without, everything has to be told.
    robot : RobotSize or None
        To which the nominal bounds are in proportion; None where they hold as they are.

    """
    before = len(errors)
    if nominal is not None and not isinstance(entry, (dict, list)):
        entry = {'value': entry}
    data = _tried(errors, lambda: _mapping(f'parameter {name}', entry))
    if data is None:
        return None
    meant = _known(errors, f'parameter {name}', data, PARAMETER['properties'])
    needed = ('value', 'unit', 'lower', 'upper', 'source') if nominal is None else (
        PARAMETER['required'])
    errors += [f'parameter {name}: {key} is missing' for key in needed
               if key not in data and key not in meant]
    told = {key: _tried(errors, partial(_value, name, key, data[key]))
            for key in data if key in PARAMETER['properties']}
    if len(errors) > before:
        return None
    return _tried(errors, lambda: _parameter_of(name, told, nominal, robot))


def _value(name: str, key: str, value: object) -> str | bool | float | None:
    match key:
        case 'unit' | 'source':
            return _text(f'{name}: {key}', value)
        case 'free':
            return _flag(f'parameter {name}', key, value)
        case 'low' | 'high' if value is None:
            return None
        case _:
            return _number(name, key, value)


def _parameter_of(name: str, told: dict[str, Any], nominal: Parameter | None,
                  robot: RobotSize | None) -> Parameter:
    if nominal is None:
        return Parameter(name, **told)
    unit = told.pop('unit', '') or nominal.unit
    if unit != nominal.unit:
        raise ModelFileError(f'{name}: unit = {shown(unit)} is not {nominal.unit}')
    if robot is None:
        return replace(nominal, **told)
    lower, upper = bounds_of(nominal, told['value'], robot, Number(
        lower=told.get('lower'), upper=told.get('upper')))
    return replace(nominal, **{'source': NOT_TOLD, **told, 'lower': lower, 'upper': upper})


def _effects(errors: list[str], listed: object, shared: set[str], robot: RobotSize
             ) -> list[tuple[Effect, tuple[Parameter, ...]]]:
    if listed is None:
        return []
    if not isinstance(listed, list):
        errors.append('effects is not a list')
        return []
    read = [_tried(errors, partial(_effect, errors, number + 1, entry, shared, robot))
            for number, entry in enumerate(listed)]
    found = [one for one in read if one is not None]
    _tried(errors, lambda: check_distinct(effect for effect, _ in found))
    return found


def _effect(errors: list[str], number: int, entry: object, shared: set[str], robot: RobotSize
            ) -> tuple[Effect, tuple[Parameter, ...]]:
    data = _mapping(f'effect {number}', entry)
    _known(errors, f'effect {number}', data, EFFECT['properties'])
    late, again = (_flag(f'effect {number}', key, data.get(key, False))
                   for key in ('late', 'again'))
    name, side, shape = (_text(f'effect {number}: {key}', data.get(key))
                         for key in ('effect', 'side', 'shape'))
    effect = Effect(name, side, shape, late, again)
    given = _mapping(f'effect {effect.id}: parameters', data.get('parameters', {}))
    known = {p.name: p for p in effect.parameters()}
    _known(errors, f'effect {effect.id}', given, known, 'parameter')
    parameters = []
    for name, usual in known.items():
        if name in given:
            sized = usual.of(robot)
            # Of another robot more or less is possible, and of none less than of a Husky.
            template = replace(usual, lower=min(usual.lower, sized.lower),
                               upper=max(usual.upper, sized.upper)).parameter()
            parameters.append(_parameter(errors, name, given[name], template))
        elif name not in shared:
            parameters.append(usual.of(robot).parameter())
    return effect, tuple(one for one in parameters if one is not None)
