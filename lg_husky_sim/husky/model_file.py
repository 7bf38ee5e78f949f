# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Model files: parameters, structure and effects, as YAML that every tool reads and writes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
import math
import os
from pathlib import Path
import tempfile
from typing import Any

from lg_husky_sim.errors import LgHuskyError, ModelFileError, ParameterError
from lg_husky_sim.husky.effects import check_distinct, Effect, Onset, OnsetKind
from lg_husky_sim.husky.model import Drivetrain, Structure
from lg_husky_sim.husky.model_schema import EFFECT, ONSET, PARAMETER, SCHEMA, STRUCTURE, TOP
from lg_husky_sim.husky.parameters import Parameter, Parameters
from lg_husky_sim.husky.robot_size import size_of
from lg_husky_sim.resources import config_path
from lg_husky_sim.yaml_files import read_yaml, shown, yaml_text

PAPER = 'paper'
"""Name of the packaged model where a file is asked for."""


@dataclass(frozen=True)
class ModelFile:
    """
    What a model file holds.

    Parameters
    ----------
    structure : Structure
    parameters : Parameters
        Those of the robot and of all effects.
    about : str
        One line on where the model comes from.
    """

    structure: Structure
    parameters: Parameters
    about: str = ''

    def in_proportion(self) -> ModelFile:
        """Return this model with effects that it may get in proportion to its robot."""
        robot = size_of(self.parameters, load_model(default_model_path()).parameters)
        effects = tuple(replace(effect, robot=robot) for effect in self.structure.effects)
        return replace(self, structure=replace(self.structure, effects=effects, robot=robot))


def default_model_path() -> Path:
    """Return the path of the packaged Husky with the paper's parameters."""
    return config_path('husky.yaml')


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


def _mapping(what: str, value: object) -> dict[str, Any]:
    if not isinstance(value, dict) or not all(isinstance(key, str) for key in value):
        raise ModelFileError(f'{what} is not a mapping of names')
    return value


def _parameter(name: str, entry: object) -> Parameter:
    data = _mapping(f'parameter {name}', entry)
    keys = PARAMETER['properties']
    unknown = sorted(set(data) - set(keys))
    if unknown:
        raise ModelFileError(
            f'parameter {name}: unknown key {shown(unknown[0])} '
            f'(allowed: {", ".join(sorted(keys))})')
    for key in PARAMETER['required']:
        if key not in data:
            raise ModelFileError(f'parameter {name}: {key} is missing')
    free = data.get('free', False)
    if not isinstance(free, bool):
        raise ModelFileError(f'parameter {name}: free = {shown(free)} is neither true nor false')
    interval = [None if data.get(key) is None else _number(name, key, data[key])
                for key in ('low', 'high')]
    return Parameter(
        name, _number(name, 'value', data['value']), _text(f'{name}: unit', data['unit']),
        _number(name, 'lower', data['lower']), _number(name, 'upper', data['upper']),
        _text(f'{name}: source', data['source']),
        _number(name, 'tolerance', data.get('tolerance', 0.0)), free, *interval)


def _effect(index: int, entry: object, shared: set[str]
            ) -> tuple[Effect, tuple[Parameter, ...]]:
    data = _mapping(f'effect {index + 1}', entry)
    unknown = sorted(set(data) - set(EFFECT['properties']))
    if unknown:
        raise ModelFileError(f'effect {index + 1}: unknown key {shown(unknown[0])}')
    flags = {name: data.get(name, False) for name in ('late', 'again')}
    for name, flag in flags.items():
        if not isinstance(flag, bool):
            raise ModelFileError(
                f'effect {index + 1}: {name} = {shown(flag)} is neither true nor false')
    name, side, shape = (_text(f'effect {index + 1}: {key}', data.get(key))
                         for key in ('effect', 'side', 'shape'))
    effect = Effect(name, side, shape, **flags)
    given = _mapping(f'effect {effect.id}: parameters', data.get('parameters', {}))
    known = {p.name: p for p in effect.parameters()}
    parameters = []
    for name in given:
        if name not in known:
            raise ModelFileError(f'effect {effect.id}: unknown parameter {shown(name)} '
                                 f'(known: {", ".join(known)})')
    for name, template in known.items():
        if name not in given:
            if name not in shared:
                parameters.append(template.parameter())
        elif isinstance(given[name], dict):
            parameters.append(_parameter(name, given[name]))
        else:
            parameters.append(template.parameter(_number(name, 'value', given[name])))
    return effect, tuple(parameters)


def _refuse_others(where: str, entry: Mapping[str, object], allowed: Sequence[str]) -> None:
    other = next((key for key in entry if key not in allowed), None)
    if other is not None:
        raise ModelFileError(f'{where}: unknown key {shown(other)} (known: {", ".join(allowed)})')


def _onset(data: object) -> Onset | None:
    if data is None:
        return None
    entry = _mapping('structure.onset', data)
    _refuse_others('structure.onset', entry, tuple(ONSET['properties']))
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


def model_from_data(data: object, name: str) -> ModelFile:
    """
    Read a model out of parsed YAML.

    Parameters
    ----------
    data : object
        As ``yaml.safe_load`` gives it.
    name : str
        What to call it in messages.

    Returns
    -------
    ModelFile

    Raises
    ------
    ModelFileError
        If something is missing, unknown or of the wrong type.
    """
    try:
        content = _mapping('the file', data)
        if content.get('schema') != SCHEMA:
            raise ModelFileError(f'schema is {shown(content.get("schema"))}, expected {SCHEMA!r}')
        unknown = sorted(set(content) - set(TOP['properties']))
        if unknown:
            raise ModelFileError(f'unknown key {shown(unknown[0])}')
        structure = _mapping('structure', content.get('structure', {}))
        _refuse_others('structure', structure, tuple(STRUCTURE['properties']))
        drivetrains = [d.value for d in Drivetrain]
        drivetrain = structure.get('drivetrain', 'simplified')
        if drivetrain not in drivetrains:
            raise ModelFileError(f'structure.drivetrain = {shown(drivetrain)} is not one of '
                                 f'{", ".join(drivetrains)}')
        entries = [_parameter(key, entry) for key, entry in _mapping(
            'parameters', content.get('parameters')).items()]
        listed = [] if content.get('effects') is None else content['effects']
        if not isinstance(listed, list):
            raise ModelFileError('effects is not a list')
        shared = {p.name for p in entries}
        effects = [_effect(i, entry, shared) for i, entry in enumerate(listed)]
        check_distinct(effect for effect, _ in effects)
        shape = Structure(Drivetrain(drivetrain), tuple(effect for effect, _ in effects),
                          _onset(structure.get('onset')))
        parameters = Parameters(tuple(entries)).with_entries(
            *(p for _, group in effects for p in group))
        nominal = () if name == 'husky.yaml' else packaged_parameters()
        missing = [p for p in nominal if p not in parameters]
        if missing:
            raise ModelFileError(f'parameter {missing[0]} is missing')
        return ModelFile(shape, parameters, _text('about', content.get('about')))
    except LgHuskyError as error:
        raise ModelFileError(f'{name}: {error}') from error


def packaged_parameters() -> tuple[str, ...]:
    """Return the names that every model must hold."""
    return tuple(load_model(default_model_path()).parameters)


def load_model(path: str | os.PathLike[str] | None = None) -> ModelFile:
    """
    Read a model file.

    Parameters
    ----------
    path : path-like, optional
        The packaged Husky if not given; so is ``paper``, unless there is a file of that name.

    Returns
    -------
    ModelFile

    Raises
    ------
    ModelFileError
        If it cannot be read as a model; the message names file, thing, value and what is allowed.
    """
    place = Path(path) if path is not None else default_model_path()
    if place == Path(PAPER) and not place.exists():
        place = default_model_path()
    try:
        data = read_yaml(place, ModelFileError)
    except ModelFileError as error:
        raise ModelFileError(f'{place}: {error}') from error
    name = 'husky.yaml' if place == default_model_path() else str(place)
    return model_from_data(data, name)


def apply_settings(model: ModelFile, settings: Mapping[str, float]) -> ModelFile:
    """
    Return a model with parameters overridden by name (``--set NAME=VALUE``).

    Raises
    ------
    ParameterError
        If a name is unknown or a value out of bounds.
    """
    parameters = model.parameters.replacing(settings)
    return ModelFile(model.structure, parameters.with_entries(*(
        replace(parameters.entry(name), source='set by hand') for name in settings)), model.about)


def parse_settings(pairs: tuple[str, ...]) -> dict[str, float]:
    """
    Read ``NAME=VALUE`` texts.

    Raises
    ------
    ParameterError
        If a text is not of that form.
    """
    settings = {}
    for pair in pairs:
        name, equals, value = pair.partition('=')
        try:
            settings[name.strip()] = float(value)
        except ValueError:
            equals = ''
        if not equals or not name.strip():
            raise ParameterError(
                f'--set {shown(pair)} is not of the form NAME=VALUE with a number')
    return settings


def _entry(parameter: Parameter) -> dict[str, object]:
    data: dict[str, object] = {
        'value': parameter.value, 'unit': parameter.unit, 'lower': parameter.lower,
        'upper': parameter.upper, 'tolerance': parameter.tolerance, 'free': parameter.free,
        'source': parameter.source}
    if parameter.low is not None and parameter.high is not None:
        data['low'], data['high'] = parameter.low, parameter.high
    return data


def model_data(model: ModelFile) -> dict[str, object]:
    """Return a model as plain data for YAML."""
    structure: dict[str, object] = {'drivetrain': model.structure.drivetrain.value}
    onset = model.structure.onset
    if onset is not None:
        structure['onset'] = {'kind': onset.kind.value, 'value': onset.value,
                              'recording': onset.recording}
        if onset.earlier:
            structure['onset']['earlier'] = list(onset.earlier)  # type: ignore[index]
    of_effects = {p.name for e in model.structure.effects for p in e.parameters()}
    shared = packaged_parameters()
    return {
        'schema': SCHEMA, 'about': model.about, 'structure': structure,
        'parameters': {p.name: _entry(p) for p in model.parameters.entries
                       if p.name not in of_effects or p.name in shared},
        'effects': [
            {'effect': effect.id, 'side': effect.side, 'shape': effect.shape, 'late': effect.late,
             **({'again': True} if effect.again else {}),
             'parameters': {p.name: _entry(model.parameters.entry(p.name))
                            for p in effect.parameters() if p.name not in shared}}
            for effect in model.structure.effects],
    }


def save_model(model: ModelFile, path: str | os.PathLike[str]) -> None:
    """
    Write a model file, whole or not at all.

    Parameters
    ----------
    model : ModelFile
    path : path-like
        Replaced if it is there.
    """
    place = Path(path)
    place.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=place.parent, prefix=f'.{place.name}.')
    try:
        with os.fdopen(handle, 'w', encoding='utf-8') as stream:
            stream.write(yaml_text(model_data(model)))
        os.chmod(temporary, 0o644)
        os.replace(temporary, place)
    except BaseException:
        os.unlink(temporary)
        raise
