# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""What an estimation found, as a value that prints itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
import enum
import math
from typing import Any

from lg_husky_sim.husky.model_file import ModelFile
from lg_husky_sim.identification.profile import Profile
from lg_husky_sim.identification.settings import least_noise, setting
from lg_husky_sim.identification.start_states import HEAD, StartState, summary
from lg_husky_sim.reporting.words import change, digits_apart, plural, quantity, with_unit
from lg_husky_sim.signals import FloatArray
import numpy as np

SCHEMA = 'lg_husky_sim/fit/1'


class Method(enum.Enum):
    """How to estimate."""

    GENETIC = 'ga'
    DIFFERENTIAL_EVOLUTION = 'de'
    LEAST_SQUARES = 'least-squares'


@dataclass(frozen=True)
class Estimated:
    """
    One estimated number.

    Parameters
    ----------
    name, unit : str
    value, low, high : float
        Estimate and 95 % interval [unit].
    start : float
        Value in the model that was given [unit].
    nuisance : bool
        Whether it belongs to the recording (a stamp's delay, an offset), not to the model.

    """

    name: str
    unit: str
    value: float
    low: float
    high: float
    start: float
    nuisance: bool = False


@dataclass(frozen=True)
class ChannelFit:
    """
    How one channel agrees before and after.

    Parameters
    ----------
    name, unit : str
    count : int
        Values.
    before, after : float
        Root mean square of measured minus predicted [unit].

    """

    name: str
    unit: str
    count: int
    before: float
    after: float


@dataclass(frozen=True)
class Start:
    """
    Where one of several starts ended.

    Parameters
    ----------
    values : mapping of str to float
    cost : float
    converged : bool

    """

    values: Mapping[str, float]
    cost: float
    converged: bool


@dataclass(frozen=True, eq=False)
class FitResult:
    """
    What an estimation found.

    Parameters
    ----------
    method : Method
    seed : int
    model : ModelFile
        With the estimates and their intervals.
    recordings : tuple of str
    estimates : tuple of Estimated
    correlation : numpy.ndarray, shape (n, n)
        Between the estimates.
    covariance : numpy.ndarray, shape (n, n)
        Of the varied quantities (logarithms, where a parameter is positive).
    condition : float
    cost : float
        Half the whitened sum of squares [nats], or eq. (23) [m].
    evaluations : int
        Simulations of all recordings.
    seconds : float
        Wall time; the only number here that differs between two runs.
    channels : tuple of ChannelFit
    starts : tuple of Start
        For least squares.
    history : numpy.ndarray, shape (n_generations + 1, 2)
        Best and mean cost of each generation, for the searches by populations.
    undetermined, warnings : tuple of str
        Sentences.
    converged : bool
    profiles : tuple of Profile
        Of the parameters that were asked for.
    start_states : tuple of StartState
        Corrections of the measured state at the start of each segment, if asked for. They are
        not among ``estimates``, whose intervals and correlations allow for them.
    driven : tuple of ChannelFit
        Both models driven by the commands alone from the start of each segment, without the
        resets of ``channels``.

    """

    method: Method
    seed: int
    model: ModelFile
    recordings: tuple[str, ...]
    estimates: tuple[Estimated, ...]
    correlation: FloatArray
    covariance: FloatArray
    condition: float
    cost: float
    evaluations: int
    seconds: float
    channels: tuple[ChannelFit, ...]
    starts: tuple[Start, ...] = ()
    history: FloatArray = field(default_factory=lambda: np.zeros((0, 2)))
    undetermined: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    converged: bool = True
    profiles: tuple[Profile, ...] = ()
    start_states: tuple[StartState, ...] = ()
    driven: tuple[ChannelFit, ...] = ()

    @property
    def losses(self) -> tuple[ChannelFit, ...]:
        """Return what the fitted model predicts worse than the one before, driven by commands."""
        return tuple(one for one in self.driven
                     if one.after > (1.0 + setting('worse')) * one.before
                     and one.after > least_noise(one.name))

    @property
    def loss(self) -> str:
        """Return these losses in a sentence; '' for nothing."""
        said = ', '.join(f'{quantity(one.name)} {_worse(one)}' for one in self.losses)
        return ('Driven by the commands alone, the fitted model predicts worse than the one '
                f'before: {said}') if said else ''

    @property
    def held(self) -> str:
        """Return in a sentence what the intervals take as exact; '' for nothing."""
        known = [p.tolerance for p in self.model.parameters.entries
                 if 0.0 < p.tolerance < 1.0 and p.name not in self.values]
        if not known:
            return ''
        low, high = f'{100.0 * min(known):g}', f'{100.0 * max(known):g}'
        return (f'The intervals take {plural(len(known), "other parameter")} of the robot as '
                f'exact, known to {low if low == high else f"{low} to {high}"} % only: where one '
                'is off, estimates may be off by about as much, which is more than their '
                'intervals say')

    @property
    def values(self) -> dict[str, float]:
        """Estimates by name."""
        return {one.name: one.value for one in self.estimates}

    def __str__(self) -> str:
        """Return the report as text."""
        lines = [f'Fit to {plural(len(self.recordings), "recording")}: '
                 f'{", ".join(self.recordings)}',
                 f'method {self.method.value}, seed {self.seed}, {self.evaluations} simulations, '
                 f'{self.seconds:.2f} s, cost {self.cost:.6g}, '
                 f'{"converged" if self.converged else "NOT CONVERGED"}',
                 *[self.loss] * bool(self.loss), '']
        width = max([9, *(len(one.name) for one in self.estimates)])
        lines.append(f'{"parameter":<{width}}  {"value":>11}  {"95 % interval":>25}  '
                     f'{"before":>11}  unit')
        for one in self.estimates:
            digits = max(5, min(8, digits_apart(one.value, one.low, one.high)))
            interval = f'{one.low:.{digits}g} to {one.high:.{digits}g}'
            note = '  (of the recording)' if one.nuisance else ''
            lines.append(f'{one.name:<{width}}  {one.value:>11.{digits}g}  {interval:>25}  '
                         f'{one.start:>11.5g}  {one.unit}{note}')
        lines += [self.held] * bool(self.held)
        if self.start_states:
            lines += ['', *_aligned([HEAD, *summary(self.start_states)])]
        width = max([width, *(len(quantity(c.name)) for c in self.channels)])
        lines += ['', f'{"channel":<{width}}  {"values":>8}  {"RMS before":>11}  {"after":>11}  '
                      'unit']
        lines += [f'{quantity(c.name):<{width}}  {c.count:>8}  {c.before:>11.4g}  '
                  f'{c.after:>11.4g}  {c.unit}' for c in self.channels]
        pairs = [(abs(self.correlation[i, j]), i, j) for i in range(len(self.estimates))
                 for j in range(i) if abs(self.correlation[i, j]) >= setting('shown_correlation')]
        if pairs:
            lines += ['', f'correlations of {setting("shown_correlation")} and more '
                          f'(condition number {self.condition:.3g}):']
            lines += [f'  {self.estimates[j].name}, {self.estimates[i].name}: '
                      f'{self.correlation[i, j]:+.3f}' for _, i, j in sorted(pairs, reverse=True)]
        if self.profiles:
            lines += ['', '95 % intervals by likelihood profile:',
                      *(f'  {p.name}: {p.low:.5g} to {p.high:.5g}' for p in self.profiles)]
        if self.undetermined:
            lines += ['', 'what these data cannot determine:',
                      *(f'  {text}' for text in self.undetermined)]
        if self.warnings:
            lines += ['', 'warnings:', *(f'  {text}' for text in self.warnings)]
        return '\n'.join(lines)

    def data(self) -> dict[str, Any]:
        """Return the report as plain data for JSON."""
        return {
            'schema': SCHEMA, 'method': self.method.value, 'seed': self.seed,
            'recordings': list(self.recordings), 'converged': self.converged,
            'cost': _finite(self.cost), 'evaluations': self.evaluations, 'seconds': self.seconds,
            'condition': self.condition,
            'parameters': [{
                'name': one.name, 'value': one.value, 'unit': one.unit, 'low': one.low,
                'high': one.high, 'before': one.start, 'nuisance': one.nuisance}
                for one in self.estimates],
            'correlation': self.correlation.tolist(), 'covariance': self.covariance.tolist(),
            'channels': _channels(self.channels), 'driven': _channels(self.driven),
            'losses': [one.name for one in self.losses],
            'starts': [{'values': dict(s.values), 'cost': _finite(s.cost),
                        'converged': s.converged} for s in self.starts],
            'history': [[_finite(cost) for cost in row] for row in self.history],
            'profiles': [{
                'name': p.name, 'low': _finite(p.low), 'high': _finite(p.high),
                'values': p.values.tolist(), 'rise': [_finite(r) for r in p.rise]}
                for p in self.profiles],
            'start_states': [asdict(s) for s in self.start_states],
            'undetermined': list(self.undetermined), 'warnings': list(self.warnings),
        }


def _worse(one: ChannelFit) -> str:
    if not math.isfinite(one.after):
        return 'beyond all bounds'
    if one.before > 0.0:
        return change(one.before, one.after)
    return f'from 0 to {with_unit(one.after, one.unit)}'


def _channels(fits: Sequence[ChannelFit]) -> list[dict[str, object]]:
    return [{'name': c.name, 'unit': c.unit, 'count': c.count, 'rms_before': c.before,
             'rms_after': c.after} for c in fits]


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ['  '.join([f'{row[0]:<{widths[0]}}', *(
        f'{cell:>{width}}' for cell, width in zip(row[1:], widths[1:], strict=True))])
        for row in rows]


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
