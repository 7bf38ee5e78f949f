# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What is added to the model for a real base: ``config/evaluation.yaml``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from lg_husky_sim.errors import SettingsError
from lg_husky_sim.resources import config_path
from lg_husky_sim.yaml_files import read_yaml


@dataclass(frozen=True)
class Extension:
    """
    What the model of a base has beside the graph.

    Parameters
    ----------
    effects : tuple of str
        As ``identify`` takes them.
    free : tuple of str
        Parameters that are estimated; empty for those that are free by default.

    """

    effects: tuple[str, ...]
    free: tuple[str, ...] = ()


@cache
def extensions() -> Mapping[str, Extension]:
    """
    Return the entries of ``config/evaluation.yaml`` by name.

    Raises
    ------
    SettingsError
        If the file is of another schema.

    """
    path = config_path('evaluation.yaml')
    data = read_yaml(path, SettingsError)
    if data.get('schema') != 'lg_husky_sim/evaluation/1':
        raise SettingsError(f'{path}: schema is not lg_husky_sim/evaluation/1')
    return {name: Extension(tuple(entry['effects']), tuple(entry.get('free', ())))
            for name, entry in data.items() if name != 'schema'}
