# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The numbers of a diagnosis: ``config/diagnosis.yaml``, each with unit, meaning and source."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from lg_husky_sim.errors import ModelFileError
from lg_husky_sim.resources import config_path
from lg_husky_sim.yaml_files import read_yaml


@cache
def settings() -> Mapping[str, float]:
    """
    Return the numbers of ``config/diagnosis.yaml`` by name.

    Raises
    ------
    ModelFileError
        If the file is not one of these.
    """
    path = config_path('diagnosis.yaml')
    data = read_yaml(path, ModelFileError)
    if data.get('schema') != 'lg_husky_sim/diagnosis_settings/1':
        raise ModelFileError(f'{path}: not the settings of a diagnosis '
                             '(schema lg_husky_sim/diagnosis_settings/1)')
    return {name: float(entry['value'])
            for section, entries in data.items() if section != 'schema'
            for name, entry in entries.items()}


def setting(name: str) -> float:
    """Return one number of ``config/diagnosis.yaml`` [its unit there]."""
    return settings()[name]
