# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Model files as plants with a short name each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
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
        Labels are the files' names, with their folder where two are the same.

    Raises
    ------
    ModelFileError
        If a file cannot be read as a model.
    ParameterError
        If a setting is unknown or out of bounds.
    """
    places = tuple(paths) or (default_model_path(),)
    return tuple(
        _named(label, place, settings or {})
        for label, place in zip(unique_labels(places), places, strict=True))


def unique_labels(paths: Sequence[Path]) -> tuple[str, ...]:
    """
    Return a short name for each path, all different.

    The file's name without ending; with its folder where two are the same, and numbered where
    that does not help either.
    """
    labels = ['paper' if path == default_model_path() else path.stem for path in paths]
    for place, path in enumerate(paths):
        if labels.count(labels[place]) > 1 and path.resolve().parent.name:
            labels[place] = f'{path.resolve().parent.name}/{path.stem}'
    return tuple(label if labels.count(label) == 1 else f'{label} {labels[:k].count(label) + 1}'
                 for k, label in enumerate(labels))


def _named(label: str, path: Path, settings: Mapping[str, float]) -> NamedPlant:
    model = apply_settings(load_model(path), settings)
    plant = compile_model(model.structure).at(model.parameters)
    return NamedPlant(label, str(path), model, plant)
