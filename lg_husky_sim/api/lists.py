# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What can be chosen from: the catalogue of effects, the built-in manoeuvres."""

from __future__ import annotations

import re

from lg_husky_sim.api.recordings import PathLike
from lg_husky_sim.api.robots import as_husky, Husky
from lg_husky_sim.api.tables import Table
from lg_husky_sim.husky.effects import catalogue
from lg_husky_sim.manoeuvres import builtin_manoeuvres


def list_effects(name: str | None = None, model: PathLike | Husky | None = None) -> Table:
    """
    List the catalogue of effects, or the parameters of one and what to do about it.

    Parameters
    ----------
    name : str, optional
        Id of an effect.
    model : path-like or Husky, optional
        Of the robot whose sizes the parameters have; the packaged Husky by default.

    Returns
    -------
    Table
        With ``to_pandas()``; printed as text.

    Raises
    ------
    ParameterError
        If there is no effect of that id; a near one is suggested.

    """
    if name is None:
        return Table('', ('effect', 'part', 'what it is', 'sides', 'forms'), tuple(
            (kind.id, kind.subsystem.value, kind.title, _words(kind.sides), _words(kind.shapes))
            for kind in catalogue().values()))
    from lg_husky_sim.husky.effects import effect_kind
    kind, robot = effect_kind(name), as_husky(model).model.in_proportion().structure.robot
    advice = kind.advice
    notes = {
        'Drives that bring it out': kind.manoeuvres,
        'Sensors that see it directly': kind.sensors,
        'On the robot, where it is found': tuple(map(_open, advice.robot)),
        'In the simulator': tuple(map(_open, advice.simulator)),
        'Parameters of sim_node that do nearly the same': tuple(map(_open, advice.instead))}
    if any('<' in sentence for sentences in notes.values() for sentence in sentences):
        notes['In angle brackets'] = ('numbers and words that the report of a diagnosis fills in',)
    return Table(f'{kind.id}: {kind.title}',
                 ('parameter', 'unit', 'typical', 'lower', 'upper', 'estimated', 'source'),
                 tuple((p.name, p.unit, p.starts[0], p.lower, p.upper,
                        not p.fixed, p.source)
                       for p in (one.of(robot) for one in kind.parameters)), notes)


def _open(sentence: str) -> str:
    # What a finding fills in, as <dry_torque>.
    return re.sub(r'{(\w+)[^}]*}', r'<\1>', sentence)


def _words(names: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(name for name in names if name not in ('', 'none'))


def list_manoeuvres() -> Table:
    """
    List the built-in manoeuvres.

    Returns
    -------
    Table
        With ``to_pandas()``; printed as text.

    """
    return Table('', ('manoeuvre', 'length [s]', 'fastest [m/s]', 'fastest turn [rad/s]',
                      'what it is'), tuple(
        (one.name, round(one.duration, 1), max(abs(step.forward) for step in one.steps),
         max(abs(step.yaw) for step in one.steps), one.about)
        for one in builtin_manoeuvres().values()))
