# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Numbers of the files in ``config``, each with unit, meaning and source there."""

from __future__ import annotations

from collections.abc import Mapping

from lg_husky_sim.errors import SettingsError
from lg_husky_sim.resources import config_path
from lg_husky_sim.yaml_files import read_yaml


def numbers(file: str, schema: str) -> Mapping[str, float]:
    """
    Return the numbers of a file, of all its sections, by name.

    Parameters
    ----------
    file : str
        In ``config``.
    schema : str
        That it has to say it has.

    Raises
    ------
    SettingsError
        If the file is not one of these.

    """
    path = config_path(file)
    data = read_yaml(path, SettingsError)
    if data.get('schema') != schema:
        raise SettingsError(f'{path}: schema is not {schema}')
    return {name: float(entry['value'])
            for section, entries in data.items() if section != 'schema'
            for name, entry in entries.items()}
