# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What a diagnosis says, as values and as ``diagnosis.json``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
import enum
import math
from typing import Any

from lg_husky_sim.diagnosis.decision.strain import implausible_words, Strained
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.husky.effects import Onset, OnsetKind, Subsystem
from lg_husky_sim.husky.model_file import ModelFile
from lg_husky_sim.reporting.words import quantity_with_unit

SCHEMA = 'lg_husky_sim/diagnosis/1'
#: Errors that stand in the JSON even where they cannot be told, as null.
MAIN_ERRORS = ('position_rmse_m', 'yaw_rate_rmse', 'wheel_speed_rmse')
#: Below it a p value is given as less than it.
LEAST_CHANCE = 1e-99


class Verdict(enum.Enum):
    """What a diagnosis ends in."""

    NOTHING_MISSING = 'nothing_missing'
    KNOWN = 'known'
    UNKNOWN = 'unknown'


@dataclass(frozen=True)
class Estimate:
    """
    One number of a finding.

    Parameters
    ----------
    name : str
    value, low, high : float
        Estimate and 95 % interval [unit].
    unit : str

    """

    name: str
    value: float
    unit: str
    low: float
    high: float


@dataclass(frozen=True)
class Rivalry:
    """A rival of a finding with its gain in log posterior [nats]."""

    effect: str
    side: str
    held_out_gain: float


@dataclass(frozen=True)
class Finding:
    """
    One thing that is missing.

    Parameters
    ----------
    effect : str
        Id of the catalogue, or ``unknown``.
    side : str
        left, right, both or none.
    subsystem : str
    elements : tuple of str
        Of the linear graph.
    regime : str
        When it shows, in words.
    onset : Onset or None
    parameters : tuple of Estimate
    held_out_gain : float
        Gain in log posterior on all data under one noise [nats].
    p_value : float
        Of the largest gain on a robot that lacks nothing, corrected for the number of hypotheses;
        not a number where the finding has no such chance.
    share : float
        Share of the gains of all findings.
    rivals : tuple of Rivalry
    statement : str
        One plain sentence with numbers.

    """

    effect: str
    side: str
    subsystem: str
    elements: tuple[str, ...]
    regime: str
    onset: Onset | None
    parameters: tuple[Estimate, ...]
    held_out_gain: float
    p_value: float
    share: float
    rivals: tuple[Rivalry, ...]
    statement: str

    @property
    def chance(self) -> str:
        """Return the p value in words; empty where there is none."""
        if math.isnan(self.p_value):
            return ''
        return f'p = {self.p_value:.1g}' if self.p_value > LEAST_CHANCE else (
            f'p < {LEAST_CHANCE:.0g}')


@dataclass(frozen=True)
class Indistinguishable:
    """Effects that the data cannot tell apart, and what would."""

    effects: tuple[str, ...]
    sensors: tuple[str, ...]
    manoeuvres: tuple[str, ...]


@dataclass(frozen=True)
class Mismatch:
    """A stretch of a recording where the plain model is off in a channel."""

    recording: str
    channel: str
    start: float
    end: float
    strength: float
    subsystem: str


@dataclass(frozen=True)
class Diagnosis:
    """
    The whole answer.

    Parameters
    ----------
    verdict : Verdict
    confidence : float
        Probability that the verdict and the first name are right, by the evidence.
    findings : tuple of Finding
    indistinguishable : tuple of Indistinguishable
    mismatch : tuple of Mismatch
        Strongest first.
    recalibration : tuple of Estimate
        Nominal parameters that moved, with intervals.
    plain, augmented : mapping of str to float
        Root mean square errors on all data.
    held_out_plain, held_out_augmented : mapping of str to float
        The same on recordings or halves that were not fitted.
    remaining : str
        What is still unexplained, in words.
    model : ModelFile
        Recalibrated, with what was found.
    plain_model : ModelFile
        Recalibrated only.
    notes : tuple of str
    features : mapping of str to float
        What the confidence was made of, by name.
    sensors : tuple of str
        What streams say of each other where they contradict, without a model.
    fits : bool
        Whether the model is one of this robot at all.
    nominal, held_out_nominal : mapping of str to float
        Errors of the model as it was given, on all data and on those held out.
    strained_plain, strained : tuple of Strained
        Parameters that are beyond their tolerances, in the recalibrated model and in the one
        with what was found.

    """

    verdict: Verdict
    confidence: float
    findings: tuple[Finding, ...]
    indistinguishable: tuple[Indistinguishable, ...]
    mismatch: tuple[Mismatch, ...]
    recalibration: tuple[Estimate, ...]
    plain: Mapping[str, float]
    augmented: Mapping[str, float]
    held_out_plain: Mapping[str, float]
    held_out_augmented: Mapping[str, float]
    remaining: str
    model: ModelFile
    plain_model: ModelFile
    notes: tuple[str, ...] = field(default=())
    features: Mapping[str, float] = field(default_factory=dict)
    sensors: tuple[str, ...] = ()
    fits: bool = True
    nominal: Mapping[str, float] = field(default_factory=dict)
    held_out_nominal: Mapping[str, float] = field(default_factory=dict)
    strained_plain: tuple[Strained, ...] = ()
    strained: tuple[Strained, ...] = ()

    @property
    def misfit(self) -> str:
        """Return what does not fit where the model is of another robot, a stream or all of it."""
        stream = bool(self.findings) and self.findings[0].subsystem == Subsystem.SENSOR.value
        return ('A stream of these recordings cannot be right' if stream
                else 'This model does not fit this robot')

    @property
    def added(self) -> bool:
        """Whether ``model.yaml`` has something of a finding that ``plain.yaml`` lacks."""
        return bool(self.findings) and (self.model.structure, self.model.parameters) != (
            self.plain_model.structure, self.plain_model.parameters)

    @property
    def refitted(self) -> bool:
        """Whether a model fitted here describes the robot: none does that fits by mistake."""
        return self.fits or self.added

    @property
    def warnings(self) -> tuple[str, ...]:
        """Return what speaks against the answer: held-out losses, implausible parameters."""
        return (*self._losses(), *(
            implausible_words(self.strained, self.added) if self.fits else ()))

    def _losses(self) -> tuple[str, ...]:
        before, after = self.held_out_plain, self.held_out_augmented
        worse = [f'{quantity_with_unit(name)} from {value:.3g} to {after[name]:.3g}'
                 for name, value in before.items() if name in grown(before, after)]
        model = 'the model with the finding' if self.fits else 'the commercial base'
        return () if not worse or self.model == self.plain_model else (
            f'on held-out data, {model} predicts worse than the recalibrated one: '
            f'{", ".join(worse)}; use plain.yaml where these matter',)


def grown(before: Mapping[str, float], after: Mapping[str, float]) -> list[str]:
    """Return the names of errors that grow by more than counts."""
    return [name for name, value in before.items()
            if name in after and after[name] > (1.0 + setting('worse')) * value]


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _numbers(values: Mapping[str, float]) -> dict[str, float | None]:
    return {name: _number(value) for name, value in values.items()}


def _errors(values: Mapping[str, float]) -> dict[str, float | None]:
    # The main ones are there whatever was recorded.
    return {**dict.fromkeys(MAIN_ERRORS), **_numbers(values)}


def onset_data(onset: Onset | None) -> dict[str, Any]:
    """Return an onset as it stands in the JSON."""
    if onset is None:
        return {'kind': 'none', 'recording': None, 'time_s': None, 'x_m': None}
    if onset.kind is OnsetKind.TIME:
        return {'kind': 'time', 'recording': onset.recording or None,
                'time_s': onset.value, 'x_m': None}
    side = 'above' if onset.kind is OnsetKind.PLACE_ABOVE else 'below'
    return {'kind': 'place', 'recording': None, 'time_s': None, 'x_m': onset.value,
            'side': side}


def _estimate_data(estimate: Estimate) -> dict[str, Any]:
    return {'name': estimate.name, 'value': _number(estimate.value), 'unit': estimate.unit,
            'low': _number(estimate.low), 'high': _number(estimate.high)}


def _finding_data(finding: Finding) -> dict[str, Any]:
    return {
        'effect': finding.effect, 'side': finding.side, 'subsystem': finding.subsystem,
        'elements': list(finding.elements), 'regime': finding.regime,
        'onset': onset_data(finding.onset),
        'parameters': [_estimate_data(p) for p in finding.parameters],
        'evidence': {'held_out_gain_nats': _number(finding.held_out_gain),
                     'p_value': _number(max(finding.p_value, LEAST_CHANCE)),
                     'share_explained': _number(finding.share)},
        'rivals': [{'effect': r.effect, 'side': r.side,
                    'held_out_gain_nats': _number(r.held_out_gain)} for r in finding.rivals],
        'statement': finding.statement,
    }


def diagnosis_data(diagnosis: Diagnosis) -> dict[str, Any]:
    """
    Return a diagnosis as plain data for JSON.

    Parameters
    ----------
    diagnosis : Diagnosis
        With whatever was found; also a change between recordings.

    Returns
    -------
    dict
        Numbers that are not finite are null.

    """
    return {
        'schema': SCHEMA,
        'verdict': diagnosis.verdict.value,
        'confidence': _number(diagnosis.confidence),
        'confidence_from': _numbers(diagnosis.features),
        'findings': [_finding_data(f) for f in diagnosis.findings],
        'indistinguishable': [
            {'effects': list(i.effects), 'separated_by': {
                'sensors': list(i.sensors), 'manoeuvres': list(i.manoeuvres)}}
            for i in diagnosis.indistinguishable],
        'mismatch': [
            {'recording': m.recording, 'channel': m.channel, 'start_s': m.start, 'end_s': m.end,
             'strength_sigma': _number(m.strength), 'subsystem': m.subsystem}
            for m in diagnosis.mismatch],
        'implausible': {'plain': [one.data() for one in diagnosis.strained_plain],
                        'augmented': [one.data() for one in diagnosis.strained]},
        'recalibration': [_estimate_data(e) for e in diagnosis.recalibration],
        'fit': {'nominal': _errors(diagnosis.nominal),
                'plain': _errors(diagnosis.plain), 'augmented': _errors(diagnosis.augmented),
                'held_out': {'nominal': _errors(diagnosis.held_out_nominal),
                             'plain': _errors(diagnosis.held_out_plain),
                             'augmented': _errors(diagnosis.held_out_augmented)}},
        'remaining': diagnosis.remaining,
        'sensors': list(diagnosis.sensors),
        'model_fits_robot': diagnosis.fits,
        'warnings': list(diagnosis.warnings),
        'notes': list(diagnosis.notes),
    }
