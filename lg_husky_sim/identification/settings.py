# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The numbers of an estimation: ``config/identification.yaml``, each with unit and source."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from lg_husky_sim.errors import SettingsError
from lg_husky_sim.resources import config_path
from lg_husky_sim.yaml_files import read_yaml


@cache
def settings() -> Mapping[str, float]:
    """
    Return the numbers of ``config/identification.yaml`` by name.

    Raises
    ------
    SettingsError
        If the file is not one of these.
    """
    path = config_path('identification.yaml')
    data = read_yaml(path, SettingsError)
    if data.get('schema') != 'lg_husky_sim/identification/1':
        raise SettingsError(f'{path}: schema is not lg_husky_sim/identification/1')
    return {name: float(entry['value']) for name, entry in data['numbers'].items()}


def setting(name: str) -> float:
    """Return one number of ``config/identification.yaml`` [its unit there]."""
    return settings()[name]
