# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Step and frequency responses of a linear system, as arrays, tables and pictures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TYPE_CHECKING

from lg_husky_sim.api.axes import axes_or_new
from lg_husky_sim.api.tables import page_part, Table
from lg_husky_sim.errors import ParameterError
from lg_husky_sim.extras import require
from lg_husky_sim.linear_graph.graph import suggestion
import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from lg_husky_sim.linear_graph.modes import StepFigures

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

LEAST_GAIN, LEAST_PHASE = 20.0, 90.0
"""Least ranges of gain [dB] and phase [deg] that a picture shows."""


def _lines(*texts: str) -> str:
    return '\n'.join(filter(None, texts))


def _titled(axis: Any, title: str) -> None:
    """Give axes a title, or take it from those that show something else already."""
    axis.set_title(title if axis.get_title() in ('', title) else '')


def _wide(axis: Any, least: float) -> None:
    """Show no less than a range, so that rounding of a constant is not drawn as a signal."""
    low, high = axis.get_ylim()
    if high - low < least:
        middle = (low + high) / 2.0
        axis.set_ylim(middle - least / 2.0, middle + least / 2.0)


@dataclass(frozen=True, eq=False)
class StepResponse:
    """
    The outputs after a unit step of one input, from rest.

    Parameters
    ----------
    times : numpy.ndarray, shape (n_times,)
        [s].
    values : numpy.ndarray, shape (n_times, n_outputs)
    names, units : tuple of str
        Of the outputs.
    source, source_unit : str
        The input.
    final : numpy.ndarray, shape (n_outputs,)
        What each output settles at, NaN where it does not.
    figures : sequence of StepFigures
        Of each output's whole response, whatever the times are.
    left_out : str
        What it is without, as it is not linear; '' for nothing.
    notes : str
        Which outputs have no steady state, and why, and what else to know; '' for nothing.

    """

    times: FloatArray
    values: FloatArray
    names: tuple[str, ...]
    units: tuple[str, ...]
    source: str
    source_unit: str
    final: FloatArray
    figures: Sequence[StepFigures]
    left_out: str = ''
    notes: str = ''

    def __post_init__(self) -> None:
        """Set the arrays read-only."""
        for array in (self.times, self.values, self.final):
            array.setflags(write=False)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> FloatArray:
        """Return the values."""
        return np.array(self.values, dtype=dtype)

    def column(self, name: str) -> FloatArray:
        """
        Return one output.

        Raises
        ------
        ParameterError
            If there is no such output.

        """
        if name not in self.names:
            raise ParameterError(f'no output {name!r}{suggestion(name, self.names)}')
        return self.values[:, self.names.index(name)]

    def to_pandas(self) -> Any:
        """Return the outputs as a pandas DataFrame, index ``time`` [s]."""
        require('pandas', 'make a DataFrame')
        import pandas as pd
        return pd.DataFrame(self.values.copy(), columns=list(self.names),
                            index=pd.Index(self.times.copy(), name='time'))

    def table(self) -> Table:
        """Return final value, rise and settling time, overshoot and peak of each output."""
        return Table('', ('output', 'unit', 'final value', 'rise time 10-90 % [s]',
                          'settling time 2 % [s]', 'overshoot [%]', 'peak', 'peak time [s]'),
                     tuple((name, unit, None if np.isnan(final) else float(final), one.rise,
                            one.settling, one.overshoot, one.peak, one.peak_time)
                           for name, unit, final, one in zip(
                               self.names, self.units, self.final, self.figures, strict=True)))

    def plot(self, axes: Any = None, label: str = '') -> Any:
        """
        Draw each output over time, and what it settles at.

        Parameters
        ----------
        axes : matplotlib Axes, or a sequence of one for each output, optional
            Where to draw; a new figure if not given.
        label : str
            Name in the legend, to tell several responses apart.

        Returns
        -------
        numpy.ndarray of matplotlib Axes, shape (n_outputs,)

        Raises
        ------
        ParameterError
            If there are not as many axes as outputs.

        """
        count = len(self.names)
        found = axes_or_new(axes, (count, 1), f'a step response of {count} outputs',
                            (7.0, 1.0 + 2.0 * count), share=True)
        for axis, name, unit, final in zip(found, self.names, self.units, self.final, strict=True):
            line, = axis.plot(self.times, self.column(name), label=label or None)
            if not np.isnan(final):
                axis.axhline(final, color=line.get_color(), lw=0.8, ls=':')
            axis.set(ylabel=f'{name} [{unit}]', xlim=(self.times[0], self.times[-1]))
            axis.grid(visible=True, alpha=0.4)
            if label:
                axis.legend()
        _titled(found[0], _lines(self._title, self.left_out))
        found[-1].set_xlabel('time [s]')
        return np.array(found, dtype=object)

    @property
    def _title(self) -> str:
        return f'Step of {self.source} by 1 {self.source_unit}'

    def __str__(self) -> str:
        """Return the table as text."""
        return _lines(self._title, self.left_out, str(self.table()), self.notes)

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return page_part(self._title, [*filter(None, (self.left_out, self.notes))],
                         [self.table()])


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """
    Gain and phase of one output over one input; unpacks into the two.

    Parameters
    ----------
    rates : numpy.ndarray, shape (k,)
        Angular frequencies [rad/s].
    values : numpy.ndarray of complex, shape (k,)
        Output over input.
    phase : numpy.ndarray, shape (k,)
        [deg], without jumps.
    output, source, unit : str
        Names, and the unit of output over input; '' if it has none.
    left_out : str
        What it is without, as it is not linear; '' for nothing.
    figures : tuple of (str, float, float, float)
        Name, angular frequency [rad/s], gain [dB] and phase [deg] of the largest gain, where it
        is between the ends, and of the bandwidth: 3 dB below the gain at rest. From poles and
        zeros, whatever lies between the rates given.

    """

    rates: FloatArray
    values: ComplexArray
    phase: FloatArray
    output: str
    source: str
    unit: str
    left_out: str = ''
    figures: tuple[tuple[str, float, float, float], ...] = ()

    def __post_init__(self) -> None:
        """Set the arrays read-only."""
        for array in (self.rates, self.values, self.phase):
            array.setflags(write=False)

    @property
    def gain(self) -> FloatArray:
        """Gain [dB] of ``unit``, shape (k,)."""
        with np.errstate(divide='ignore'):
            return np.asarray(20.0 * np.log10(np.abs(self.values)), dtype=np.float64)

    def __iter__(self) -> Iterator[FloatArray]:
        """Yield gain [dB] and phase [deg]."""
        return iter((self.gain, self.phase))

    def to_pandas(self) -> Any:
        """Return gain and phase as a pandas DataFrame, index ``rate`` [rad/s]."""
        require('pandas', 'make a DataFrame')
        import pandas as pd
        return pd.DataFrame({'gain [dB]': self.gain, 'phase [deg]': self.phase},
                            index=pd.Index(self.rates.copy(), name='rate'))

    def plot(self, axes: Any = None, label: str = '') -> Any:
        """
        Draw gain [dB] and phase [deg] over a logarithmic angular frequency.

        Parameters
        ----------
        axes : sequence of two matplotlib Axes, optional
            Where to draw; a new figure if not given.
        label : str
            Name in the legend, to tell several responses apart.

        Returns
        -------
        numpy.ndarray of matplotlib Axes, shape (2,)

        Raises
        ------
        ParameterError
            If there are not two axes.

        """
        found = axes_or_new(axes, (2, 1), 'a frequency response', (7.0, 5.4), share=True)
        from matplotlib.ticker import MultipleLocator
        gain = f'gain [dB of {self.unit}]' if self.unit else 'gain [dB]'
        for axis, curve, name in zip(found, self, (gain, 'phase [deg]'),
                                     strict=True):
            axis.semilogx(self.rates, curve, label=label or None)
            axis.set_ylabel(name)
            axis.grid(visible=True, which='major', alpha=0.5)
            axis.grid(visible=True, which='minor', alpha=0.2)
            if label:
                axis.legend()
        _wide(found[0], LEAST_GAIN)
        _wide(found[1], LEAST_PHASE)
        low, high = found[1].get_ylim()
        found[1].yaxis.set_major_locator(MultipleLocator(45.0 if high - low < 300.0 else 90.0))
        _titled(found[0], _lines(self._title, self.left_out))
        found[1].set_xlabel('angular frequency [rad/s]')
        return np.array(found, dtype=object)

    def table(self) -> Table:
        """Return gain and phase at the ends, and what ``figures`` says of between."""
        order = np.argsort(self.rates)[[0, -1]]
        first, last = ((name, float(self.rates[at]), float(self.gain[at]), float(self.phase[at]))
                       for name, at in zip(('lowest frequency', 'highest frequency'), order,
                                           strict=True))
        rows = (first, *self.figures, last)
        return Table('', ('', 'angular frequency [rad/s]', 'gain [dB]', 'phase [deg]'),
                     tuple((name, rate, 'infinite' if gain == np.inf else gain, phase)
                           for name, rate, gain, phase in rows))

    @property
    def _title(self) -> str:
        return f'{self.output} over {self.source}' + (f' [{self.unit}]' if self.unit else '')

    def __str__(self) -> str:
        """Return the table as text."""
        return f'{_lines(self._title, self.left_out)}\n{self.table()}'

    __repr__ = __str__

    def _repr_html_(self) -> str:
        return page_part(self._title, [self.left_out] * bool(self.left_out), [self.table()])
