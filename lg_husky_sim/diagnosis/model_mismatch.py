# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""The answer where a model is not one of the robot: what differs, and what runs like it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
import math

from lg_husky_sim.diagnosis.commercial_base import commercial_base, CommercialBase
from lg_husky_sim.diagnosis.evidence.evidence import Evidence
from lg_husky_sim.diagnosis.evidence.point import Point
from lg_husky_sim.diagnosis.held_out import errors, split
from lg_husky_sim.diagnosis.result import Finding
from lg_husky_sim.diagnosis.selection.rounds import Round
from lg_husky_sim.diagnosis.selection.search import Search
from lg_husky_sim.diagnosis.sensors.faults import Fault
from lg_husky_sim.diagnosis.sensors.robot import Difference
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.model import compile_model
from lg_husky_sim.husky.model_file import ModelFile
from lg_husky_sim.recording import Recording, Segment
from lg_husky_sim.reporting.words import capitalised, padded


@dataclass(frozen=True)
class ModelMismatch:
    """
    What is said of a robot that a model does not fit.

    Parameters
    ----------
    finding : Finding
    model : ModelFile or None
        That runs like the robot; None where none is better.
    held_out : dict of str to float
        Its errors on data that it was not fitted to.
    everywhere : dict of str to float
        Its errors on all data.

    """

    finding: Finding
    model: ModelFile | None
    held_out: dict[str, float]
    everywhere: dict[str, float]


def unsearched(evidence: Evidence, start: Point) -> Search:
    """Return a search that tried nothing: names of effects mean nothing on another robot."""
    plain = evidence.fit(start, rounds=int(setting('mismatch_rounds')))
    return Search(plain, plain, evidence, (Round(evidence, plain, (), False, 1.0),), ())


def model_mismatch(found: Sequence[Difference], plain_out: Mapping[str, float],
                   recordings: Sequence[Recording], parts: Sequence[Segment], nominal: ModelFile,
                   faults: Sequence[Fault], pool: Executor) -> ModelMismatch:
    """
    Say what differs, with a commercial base tried as one hypothesis.

    Parameters
    ----------
    found : sequence of Difference
        At least one.
    plain_out : mapping of str to float
        Errors of the recalibrated model on held-out data.
    recordings : sequence of Recording
        In which the parts lie.
    parts : sequence of Segment
        Segments, to be split into those to fit and those to hold out.
    nominal : ModelFile
        With what of the robot is known already.
    faults : sequence of Fault
        Of the sensors that the nominal model has in it.
    pool : Executor
        Threads to fit with.

    Returns
    -------
    ModelMismatch

    """
    first = max(found, key=lambda one: one.certainty)
    base, out, everywhere = None, {}, {}
    if all(one.comparable for one in found):
        train, test = split(parts)
        late = {}
        for fault in faults:
            if fault.number is not None:
                one = fault.number
                late[f'{fault.stream}_late' if one.unit == 's' else one.name] = one.value
        base = commercial_base(recordings, train, nominal, late, 'a commercial base', pool)
        if base is not None:
            plant = compile_model(base.model.structure).at(base.model.parameters)
            out, everywhere = errors(plant, test), errors(plant, parts)
    better = base is not None and _better(plain_out, out)
    text = ' '.join(f'{capitalised(one.statement)}.' for one in found)
    text = f'{text}{_said(base, better, plain_out, out)}'
    finding = Finding('unknown', 'none', first.subsystem, first.elements, first.regime, None, (),
                      0.5 * first.certainty ** 2, math.nan, 1.0, (), text)
    if base is None or not better:
        return ModelMismatch(finding, None, {}, {})
    return ModelMismatch(finding, base.model, out, everywhere)


def _better(plain: Mapping[str, float], base: Mapping[str, float]) -> bool:
    shared = [name for name in ('wheel_speed_rmse', 'yaw_rate_rmse', 'forward_rmse')
              if name in plain and name in base]
    return bool(shared) and math.prod(base[n] / max(plain[n], 1e-12) for n in shared) < 1.0


def _said(base: CommercialBase | None, better: bool, plain: Mapping[str, float],
          out: Mapping[str, float]) -> str:
    if base is None:
        return ''
    words = capitalised(base.words)
    if not better:
        return f' {words} was tried as one hypothesis; it does not predict better.'
    shown = ' and '.join(
        f'{padded(out[name], 2)} {unit} in {label} (recalibrated {padded(plain[name], 2)})'
        for name, label, unit in (('wheel_speed_rmse', 'wheel rates', 'rad/s'),
                                  ('yaw_rate_rmse', 'yaw rates', 'rad/s'))
        if name in out and name in plain)
    return (f' {words} was tried as one hypothesis. Its errors on held-out data are {shown}; '
            '`model.yaml` runs like it.')
