# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
What a report shows, as plain values.

Every kind of result (a diagnosis, an identification, a comparison, an evaluation) fills one
:class:`ReportData`; :func:`lg_husky_sim.reporting.write.write_report` makes the page and the
pictures of it. Nothing here knows where the values come from.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
import math

from lg_husky_sim.reporting.sections import Section, Tone
from lg_husky_sim.reporting.words import QUANTITIES
from lg_husky_sim.signals import FloatArray
import numpy as np

MEASURED = 'measured'
NOMINAL = 'nominal'
RECALIBRATED = 'recalibrated'
WITH_FINDING = 'with finding'
BEFORE = 'before'
FITTED = 'fitted'


def _frozen(values: FloatArray) -> FloatArray:
    copy: FloatArray = np.array(values, dtype=np.float64)
    copy.setflags(write=False)
    return copy


@dataclass(frozen=True, eq=False)
class Trace:
    """
    One quantity of a recording, measured and predicted.

    Parameters
    ----------
    recording : str
    channel : str
        Key of :data:`~lg_husky_sim.reporting.words.QUANTITIES`: wheel_left, wheel_right,
        forward, yaw_rate, x, y, heading.
    times : numpy.ndarray, shape (n,)
        On the recording's clock [s], in order, all finite.
    measured : numpy.ndarray, shape (n,)
        [unit of the channel]; one that is not a number breaks the line.
    predicted : mapping of str to numpy.ndarray, shape (n,)
        By column, such as :data:`NOMINAL`; not a number where a model predicts nothing.
    sigma : numpy.ndarray, shape (n,), optional
        Standard deviation expected of measured − predicted [unit of the channel].
    errors : mapping of str to numpy.ndarray, shape (n,)
        By column, of x and y: in the frame of the robot at the start of each segment.

    """

    recording: str
    channel: str
    times: FloatArray
    measured: FloatArray
    predicted: Mapping[str, FloatArray]
    sigma: FloatArray | None = None
    errors: Mapping[str, FloatArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Copy the arrays and check their lengths."""
        for name in ('times', 'measured'):
            object.__setattr__(self, name, _frozen(getattr(self, name)))
        for name in ('predicted', 'errors'):
            object.__setattr__(self, name, {
                column: _frozen(values) for column, values in getattr(self, name).items()})
        if self.sigma is not None:
            object.__setattr__(self, 'sigma', _frozen(self.sigma))
        lengths = {self.times.size, self.measured.size,
                   *(values.size for values in (*self.predicted.values(), *self.errors.values())),
                   *(() if self.sigma is None else (self.sigma.size,))}
        if len(lengths) > 1:
            raise ValueError(f'{self.channel} of {self.recording}: {sorted(lengths)} values')

    @property
    def unit(self) -> str:
        """Return the unit of the channel."""
        return QUANTITIES.get(self.channel, ('', ''))[1]


def diagnosis_trace(
    recording: str, channel: str, times: FloatArray, measured: FloatArray, nominal: FloatArray,
    recalibrated: FloatArray, with_finding: FloatArray | None = None,
    sigma: FloatArray | None = None,
) -> Trace:
    """
    Return a trace with the three columns of a diagnosis.

    Parameters
    ----------
    recording, channel : str
        Names of the recording and of the quantity.
    times, measured, nominal, recalibrated : numpy.ndarray, shape (n,)
        Stamps [s], and what was measured and predicted [unit of the channel].
    with_finding : numpy.ndarray, shape (n,), optional
        None where nothing was found.
    sigma : numpy.ndarray, shape (n,), optional
        Standard deviation expected of measured − predicted [unit of the channel].

    Returns
    -------
    Trace

    """
    predicted = {NOMINAL: nominal, RECALIBRATED: recalibrated}
    if with_finding is not None:
        predicted[WITH_FINDING] = with_finding
    return Trace(recording, channel, times, measured, predicted, sigma)


@dataclass(frozen=True)
class ErrorRow:
    """
    One error of each model.

    Parameters
    ----------
    name : str
        With its unit, as in ``yaw rate [rad/s]``.
    values : mapping of str to float
        By column; not a number, or absent, where it is not known.
    low, high : float
        95 % interval of the change from the reference to the last column, as a factor.

    """

    name: str
    values: Mapping[str, float]
    low: float = math.nan
    high: float = math.nan


@dataclass(frozen=True)
class ErrorTable:
    """
    Errors in columns, one for each model.

    Parameters
    ----------
    title : str
    rows : tuple of ErrorRow
    columns : tuple of str
    held_out : bool
        Whether the data were held out, that is, not fitted.
    compared : tuple of str and str, optional
        Columns from and to which a change is given; none for models that stand side by side.
    note : str
    folded : bool
        Whether the reader opens it first.

    """

    title: str
    rows: tuple[ErrorRow, ...]
    columns: tuple[str, ...]
    held_out: bool = False
    compared: tuple[str, str] | None = None
    note: str = ''
    folded: bool = False


@dataclass(frozen=True)
class Headline:
    """
    The answer in thirty seconds.

    Parameters
    ----------
    text : str
        One line, such as ``Missing effect found: torque ripple, left side``.
    tone : Tone
    facts : tuple of (str, str)
        Name and value: effect, side, size, confidence.
    sentences : tuple of str
    warnings : tuple of str
        What speaks against the answer; it stands above everything else.

    """

    text: str
    tone: Tone = Tone.PLAIN
    facts: tuple[tuple[str, str], ...] = ()
    sentences: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True)
class Advice:
    """What to change: where (robot, simulator), and sentences; code stands in backquotes."""

    where: str
    sentences: tuple[str, ...]


@dataclass(frozen=True)
class View:
    """
    The stretch of a signal that is shown first.

    Parameters
    ----------
    recording, channel : str
    start, end : float
        On the recording's clock [s].
    onset : float
        Marked [s]; not a number for none.

    """

    recording: str
    channel: str
    start: float
    end: float
    onset: float = math.nan


@dataclass(frozen=True)
class Mismatch:
    """A stretch of a signal that the recalibrated model misses, with its strength [σ]."""

    recording: str
    channel: str
    start: float
    end: float
    strength: float
    part: str = ''


@dataclass(frozen=True)
class ParameterRow:
    """
    An estimated parameter.

    Parameters
    ----------
    name, unit : str
    nominal, value, low, high : float
        Before the fit, after it, and its 95 % interval [unit].
    least, most : float
        What the fit allows [unit]; not a number without a bound.
    at_bound : bool

    """

    name: str
    unit: str
    nominal: float
    value: float
    low: float = math.nan
    high: float = math.nan
    least: float = math.nan
    most: float = math.nan
    at_bound: bool = False


@dataclass(frozen=True)
class Provenance:
    """
    Where a result comes from.

    Parameters
    ----------
    version : str
        Of this package.
    command : str
    inputs : tuple of (str, str, str)
        Kind (recording, model), name, and SHA-256 of the content.

    """

    version: str = ''
    command: str = ''
    inputs: tuple[tuple[str, str, str], ...] = ()


@dataclass(frozen=True)
class ReportData:
    """
    All of a report.

    Parameters
    ----------
    title : str
        Of the page: kind and recordings.
    headline : Headline
    columns : tuple of str
        Models in the order in which they are shown everywhere.
    about : tuple of (str, str)
        What each column is, in words.
    traces : tuple of Trace
    errors : tuple of ErrorTable
    advice : tuple of Advice
    view : View, optional
        Of the first picture; the longest trace if not given.
    mismatches : tuple of Mismatch
        Strongest first.
    parameters : tuple of ParameterRow
    parameters_first : bool
        Whether the parameters are the answer and stand before the signals.
    sections : tuple of Section
        Further ones, in their order.
    notes : tuple of str
    files : tuple of (str, str)
        Files beside the page, and what they are for.
    provenance : Provenance

    """

    title: str
    headline: Headline
    columns: tuple[str, ...]
    about: tuple[tuple[str, str], ...] = ()
    traces: tuple[Trace, ...] = ()
    errors: tuple[ErrorTable, ...] = ()
    advice: tuple[Advice, ...] = ()
    view: View | None = None
    mismatches: tuple[Mismatch, ...] = ()
    parameters: tuple[ParameterRow, ...] = ()
    parameters_first: bool = False
    sections: tuple[Section, ...] = ()
    notes: tuple[str, ...] = ()
    files: tuple[tuple[str, str], ...] = ()
    provenance: Provenance = field(default_factory=Provenance)

    @property
    def recordings(self) -> tuple[str, ...]:
        """Names of the recordings with traces, in their order."""
        return tuple(dict.fromkeys(trace.recording for trace in self.traces))

    def trace(self, recording: str, channel: str) -> Trace | None:
        """Return the trace of a channel of a recording, if there is one."""
        return next((one for one in self.traces
                     if (one.recording, one.channel) == (recording, channel)), None)
