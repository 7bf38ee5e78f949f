# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Each effect of the catalogue as an edit of the graph, the command stage or the sensors.

A module of this folder gives the edits of some effects, by id, in ``EDITS``. One more effect is
one module more, and an entry of the same id in ``config/effects.yaml``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
import importlib
import pkgutil

from lg_husky_sim.errors import ParameterError
from lg_husky_sim.husky.edits.network import axles, branch_of, Edit, EditedNetwork
from lg_husky_sim.husky.effects import Effect

__all__ = ['EditedNetwork', 'axles', 'branch_of', 'edit', 'edits', 'stage_of']


@cache
def edits() -> Mapping[str, Edit]:
    """
    Return the edits of all modules of this folder, by the id of the effect.

    Raises
    ------
    ParameterError
        If two modules have one for the same effect.

    """
    found: dict[str, Edit] = {}
    for module in pkgutil.iter_modules(__path__):
        own: Mapping[str, Edit] = getattr(
            importlib.import_module(f'{__name__}.{module.name}'), 'EDITS', {})
        twice = sorted(found.keys() & own.keys())
        if twice:
            raise ParameterError(f'effect {twice[0]} has a second edit, in module {module.name}')
        found.update(own)
    return found


def stage_of(effect: Effect) -> int:
    """Return when an effect's edit is made: lower ones first."""
    return edits()[effect.id].stage


def edit(network: EditedNetwork, effect: Effect) -> EditedNetwork:
    """
    Put an effect into a network.

    Parameters
    ----------
    network : EditedNetwork
        Graph with command stage and sensors, perhaps edited already.
    effect : Effect
        With its side and form.

    Returns
    -------
    EditedNetwork
        With new elements, changed values, command stage or sensors.

    Raises
    ------
    ParameterError
        If the effect does not fit the network.

    """
    # The numbers of a changed effect have other names; the edit is the same.
    return edits()[effect.id].apply(network, replace(effect, again=False))
