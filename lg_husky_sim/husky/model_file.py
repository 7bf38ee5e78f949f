# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Model files: parameters, structure and effects, as YAML that every tool reads and writes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
import os
from pathlib import Path

from lg_husky_sim.errors import LgHuskyError, ModelFileError, ParameterError
from lg_husky_sim.folders import check_unchanged, scratch_beside, signed
from lg_husky_sim.husky.by_hand import about_of, Number, other_robot, with_numbers
from lg_husky_sim.husky.model import Structure
from lg_husky_sim.husky.model_reader import read_model
from lg_husky_sim.husky.model_schema import SCHEMA
from lg_husky_sim.husky.parameters import Parameter, Parameters
from lg_husky_sim.husky.robot_size import size_of
from lg_husky_sim.resources import config_path
from lg_husky_sim.yaml_files import read_yaml, shown, yaml_text

#: What else `Husky(...)` takes by name, so that no parameter is called so.
RESERVED = ('self', 'model', 'about')

BEGINNING = f'schema: {SCHEMA}'
"""With which every file that is written here begins."""

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
        robot = size_of(self.parameters, packaged().parameters)
        effects = tuple(replace(effect, robot=robot) for effect in self.structure.effects)
        return replace(self, structure=replace(self.structure, effects=effects, robot=robot))


def default_model_path() -> Path:
    """Return the path of the packaged Husky with the paper's parameters."""
    return config_path('husky.yaml')


def packaged() -> ModelFile:
    """Return the packaged Husky, whatever files there are."""
    return load_model(default_model_path())


def model_from_data(data: object, name: str, *, complete: bool = False) -> ModelFile:
    """
    Read a model out of parsed YAML.

    Parameters
    ----------
    data : object
        As ``yaml.safe_load`` gives it.
    name : str
        What to call it in messages.
    complete : bool
        Whether every key must be told, as of the packaged robot.

    Returns
    -------
    ModelFile

    Raises
    ------
    ModelFileError
        If something is missing, unknown or of the wrong type: all of it, a line each.

    """
    nominal = None if complete else packaged().parameters
    try:
        return ModelFile(*read_model(data, nominal))
    except LgHuskyError as error:
        raise ModelFileError(f'{name}: {error}') from error


def packaged_parameters() -> tuple[str, ...]:
    """Return the names that every model must hold."""
    return tuple(packaged().parameters)


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
    ours = place == default_model_path()
    return model_from_data(data, place.name if ours else str(place), complete=ours)


def nominal_of(model: ModelFile) -> ModelFile:
    """Return what a model is compared with: the packaged Husky, or another robot's own graph."""
    usual = packaged()
    if not other_robot(usual.parameters, model.parameters):
        return usual
    return replace(model, structure=Structure(model.structure.drivetrain),
                   about=f'{model.about}, without effects'.lstrip(', '))


def apply_settings(model: ModelFile, settings: Mapping[str, float | Number],
                   about: str | None = None) -> ModelFile:
    """
    Return a model with parameters given by hand, by name (``--set NAME=VALUE``).

    Parameters
    ----------
    model : ModelFile
        Whose parameters are set.
    settings : mapping of str to float or Number
        Bounds of the robot's own parameters stay in proportion to its size, and move where a
        value is a little beyond.
    about : str, optional
        Where the model comes from; by default what was said of it, and what was set by hand.

    Raises
    ------
    ParameterError
        If a name is unknown or a number none that the robot can have.

    """
    parameters = with_numbers(model.parameters, packaged_parameters(), settings)
    if about is None:
        about = about_of(model.about, model.parameters, parameters)
    return replace(model, parameters=parameters, about=about)


def parse_settings(pairs: tuple[str, ...]) -> dict[str, float]:
    """
    Read ``NAME=VALUE`` texts.

    Raises
    ------
    ParameterError
        If a text is not of that form, or a name is given twice.

    """
    settings = {}
    for pair in pairs:
        name, equals, value = pair.partition('=')
        if name.strip() in settings:
            raise ParameterError(f'--set {shown(pair)}: {name.strip()} is given twice')
        try:
            settings[name.strip()] = float(value)
        except ValueError:
            equals = ''
        if not equals or not name.strip():
            raise ParameterError(
                f'--set {shown(pair)} is not of the form NAME=VALUE with a number')
        if name.strip() in RESERVED:
            raise ParameterError(f'--set {shown(pair)}: {name.strip()} is no parameter')
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
        What is written, with all its parameters.
    path : path-like
        Replaced if a model file is there that was written here and not changed since.

    Raises
    ------
    SettingsError
        If something else is there.

    """
    place = Path(path)
    check_unchanged(place, BEGINNING)
    with scratch_beside(place) as scratch:
        draft = scratch / place.name
        draft.write_text(signed(yaml_text(model_data(model))), encoding='utf-8')
        os.replace(draft, place)
