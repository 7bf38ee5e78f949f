# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Which sensor or manoeuvre tells effects apart that a recording cannot."""

from __future__ import annotations

from collections.abc import Sequence
import itertools

from lg_husky_sim.husky.effects import catalogue


def separated_by(effects: Sequence[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """
    Return what would separate effects.

    Parameters
    ----------
    effects : sequence of str
        Ids.

    Returns
    -------
    tuple of str
        Sensors that see one of them and not all in the same way.
    tuple of str
        Manoeuvres that bring one of them out.

    """
    kinds = [kind for kind in catalogue().values() if kind.id in effects]
    seen = [kind.sensors for kind in kinds]
    sensors = [one for one in _each(seen) if not all(one in own for own in seen)]
    return tuple(sensors or _each(seen)), _each([kind.manoeuvres for kind in kinds])


def _each(lists: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
    # All entries once, in the order of the catalogue.
    return tuple(dict.fromkeys(itertools.chain.from_iterable(lists)))
