# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What the paper states about its estimation and its results (``config/paper.yaml``)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from lg_husky_sim.errors import SettingsError
from lg_husky_sim.resources import config_path
from lg_husky_sim.yaml_files import read_yaml


@dataclass(frozen=True)
class SearchRange:
    """
    Bounds within which the paper searched a parameter, and what it found.

    Parameters
    ----------
    lower, upper : float
        [unit]
    result : float
        [unit]
    unit : str

    """

    lower: float
    upper: float
    result: float
    unit: str


@dataclass(frozen=True)
class Paper:
    """
    The paper's settings and results.

    Parameters
    ----------
    population, generations : int
    crossover_fraction : float
    search : mapping of str to SearchRange
        By the parameter's name.
    tracking_error : mapping of str to tuple of float
        Largest absolute errors in x and y [m] by manoeuvre.
    population_search : mapping of str to float
        What the paper leaves open, by name.

    """

    population: int
    generations: int
    crossover_fraction: float
    search: Mapping[str, SearchRange]
    tracking_error: Mapping[str, tuple[float, float]]
    population_search: Mapping[str, float]


@cache
def paper() -> Paper:
    """
    Return the content of ``config/paper.yaml``.

    Raises
    ------
    SettingsError
        If the file is of another schema.

    """
    path = config_path('paper.yaml')
    data = read_yaml(path, SettingsError)
    if data.get('schema') != 'lg_husky_sim/paper/1':
        raise SettingsError(f'{path}: schema is not lg_husky_sim/paper/1')
    genetic = data['genetic_algorithm']
    return Paper(
        int(genetic['population']), int(genetic['generations']),
        float(genetic['crossover_fraction']),
        {name: SearchRange(float(entry['lower']), float(entry['upper']),
                           float(entry['result']), str(entry['unit']))
         for name, entry in data['search'].items()},
        {name: (float(entry['x']), float(entry['y']))
         for name, entry in data['tracking_error'].items()},
        {name: float(entry['value']) for name, entry in data['population_search'].items()})
