# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Model files as plants with a short name each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import apply_settings, default_model_path, load_model, ModelFile
from lg_husky_sim.husky.plant import Plant


@dataclass(frozen=True, eq=False)
class NamedPlant:
    """
    A plant with the name under which it stands in tables and figures.

    Parameters
    ----------
    label : str
    path : str
        Model file.
    model : ModelFile
        As read, with the settings applied.
    plant : Plant

    """

    label: str
    path: str
    model: ModelFile
    plant: Plant


def load_plants(
    paths: Sequence[Path] = (), settings: Mapping[str, float] | None = None,
) -> tuple[NamedPlant, ...]:
    """
    Read model files and put their numbers in.

    Parameters
    ----------
    paths : sequence of path, optional
        The packaged Husky with the paper's parameters if empty.
    settings : mapping of str to float, optional
        Parameters overridden in every model.

    Returns
    -------
    tuple of NamedPlant
        Labels are the files' names, with their folder where two are the same; the packaged
        Husky is called paper as long as no setting changes it.

    Raises
    ------
    ModelFileError
        If a file cannot be read as a model.
    ParameterError
        If a setting is unknown or out of bounds.

    """
    places = tuple(paths) or (default_model_path(),)
    return tuple(_named(label, place, settings or {})
                 for label, place in zip(labels_of(places, bool(settings)), places, strict=True))


def labels_of(paths: Sequence[Path], changed: bool) -> tuple[str, ...]:
    """
    Return a short name for each model file, all different.

    The packaged Husky is called paper unless settings have changed it.
    """
    packaged = default_model_path()
    return unique_labels([Path('paper') if path == packaged and not changed else path
                          for path in paths])


def plants_in(
    plants: Sequence[NamedPlant], name: str, names: Sequence[str],
) -> tuple[NamedPlant, ...]:
    """
    Return plants as they are in one of several recordings.

    An effect that begins in a named recording is absent in those before it.

    Parameters
    ----------
    plants : sequence of NamedPlant
        Models with their labels; those without an onset stay as they are.
    name : str
        Name of the recording.
    names : sequence of str
        Names of all recordings in the order of time.

    Returns
    -------
    tuple of NamedPlant

    """
    found = []
    for named in plants:
        onset = named.plant.onset
        found.append(named if onset is None else replace(
            named, plant=named.plant.in_recording(name, onset.before(names))))
    return tuple(found)


def recordings_of(plants: Sequence[NamedPlant]) -> tuple[str, ...]:
    """Return the names of recordings between which effects of some plants begin."""
    return tuple(name for named in plants if named.plant.onset is not None
                 for name in named.plant.onset.recordings)


def unique_labels(paths: Sequence[Path]) -> tuple[str, ...]:
    """
    Return a short name for each path, all different.

    The file's name without ending; with its folder where two are the same in different ones, and
    numbered where that does not help either. What has no file, such as ``paper``, has no folder.
    """
    folders: dict[str, set[str]] = {}
    for path in paths:
        folders.setdefault(path.stem, set()).add(_folder(path))
    labels = [_folder(path) * (len(folders[path.stem]) > 1) + path.stem for path in paths]
    return tuple(
        label if labels.count(label) == 1 else f'{label} {labels[:place].count(label) + 1}'
        for place, label in enumerate(labels))


def _folder(path: Path) -> str:
    unfiled = path.parent == Path() and not path.suffix and not path.exists()
    return '' if unfiled else f'{path.resolve().parent.name}/'


def _named(label: str, path: Path, settings: Mapping[str, float]) -> NamedPlant:
    model = apply_settings(load_model(path), settings)
    plant = compile_model(model.structure).at(model.parameters)
    return NamedPlant(label, str(path), model, plant)
