# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What is said of the sensors and of whose robot it is, before any fit and beside one."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from lg_husky_sim.diagnosis.sensors.faults import Fault, faults
from lg_husky_sim.diagnosis.sensors.relations import Relation, relations
from lg_husky_sim.diagnosis.sensors.robot import differences
from lg_husky_sim.husky.by_hand import other_robot
from lg_husky_sim.husky.model_file import ModelFile, packaged
from lg_husky_sim.recording import Segment
from lg_husky_sim.reporting.words import capitalised


def sensor_warnings(parts: Sequence[Segment], related: Sequence[Relation], model: ModelFile,
                    nuisance: Collection[str] = ()) -> tuple[str, ...]:
    """
    Say what is wrong with the sensors, or with the robot for one of the model.

    Parameters
    ----------
    parts : sequence of Segment
        The streams.
    related : sequence of Relation
        What comparing each stream with the others that see the same motion gave.
    model : ModelFile
        A fault that it has as an effect is none.
    nuisance : collection of str
        Unknowns of the recordings that are estimated: they are no faults either.

    """
    said = [one.statement for one in faults(related, parts)
            if not _accounted(one, model, nuisance)]
    robot = 'the robot of the model' if other_robot(
        packaged().parameters, model.parameters) else 'a Husky'
    for one in differences(related, model.parameters):
        said.append(one.statement if not one.comparable else (
            f'this is not {robot}: {one.statement} (or wheel rates are scaled); give its '
            'dimensions in a model file of its own'))
    return tuple(map(capitalised, said))


def _accounted(fault: Fault, model: ModelFile, nuisance: Collection[str]) -> bool:
    effect = fault.effect
    if effect is None:  # stamps of two streams, where nothing says which are late
        return not fault.stream and any(name.startswith('delay_') for name in nuisance)
    return (
        (effect.id, effect.shape) in [(one.id, one.shape) for one in model.structure.effects]
        or not {effect.id, f'delay_{effect.shape}'}.isdisjoint(nuisance))


def warnings_of(parts: Sequence[Segment], model: ModelFile, nuisance: Collection[str] = ()
                ) -> tuple[str, ...]:
    """Return the same of segments, by recording where there are several."""
    names = list(dict.fromkeys(part.recording for part in parts))
    return tuple(f'{name}: {said}' if len(names) > 1 else said for name in names
                 for said in _warnings(
                     [part for part in parts if part.recording == name], model, nuisance))


def _warnings(parts: Sequence[Segment], model: ModelFile, nuisance: Collection[str]
              ) -> tuple[str, ...]:
    return sensor_warnings(parts, relations(parts), model, nuisance)
