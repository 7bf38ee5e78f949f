# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Values that cross the seams between the parts; SI units, angles in radians."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from lg_husky_sim.errors import RecordingError
from lg_husky_sim.extras import require
import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class BodyTwist:
    """
    Velocity of the base in its own frame (REP-103).

    Parameters
    ----------
    forward : float
        Forward speed [m/s], positive ahead.
    yaw : float
        Yaw rate [rad/s], positive counter-clockwise (to the left).

    """

    forward: float = 0.0
    yaw: float = 0.0


@dataclass(frozen=True)
class Pose:
    """
    Planar pose of the base in the odometry frame.

    Parameters
    ----------
    x, y : float
        Position [m].
    heading : float
        Angle of the base's x axis against the frame's [rad], not wrapped.

    """

    x: float = 0.0
    y: float = 0.0
    heading: float = 0.0


def _frozen(values: ArrayLike) -> FloatArray:
    array: FloatArray = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


@dataclass(frozen=True, eq=False)
class TimeSeries:
    """
    Samples of named channels on one clock.

    Parameters
    ----------
    times : array_like, shape (n_times,)
        Stamps [s], finite and not decreasing.
    values : array_like, shape (n_times, n_channels)
        One row a stamp.
    names : tuple of str
        One name a column.

    Raises
    ------
    RecordingError
        If shapes do not agree, or stamps are not finite or go backwards.

    """

    times: FloatArray = field()
    values: FloatArray = field()
    names: tuple[str, ...] = field()

    def __post_init__(self) -> None:
        """Copy the arrays, set them read-only and check them."""
        times, values = _frozen(self.times), _frozen(self.values)
        label = '/'.join(self.names)
        if times.ndim != 1 or values.shape != (times.size, len(self.names)):
            raise RecordingError(
                f'series {label}: values of shape {values.shape} do not fit '
                f'{times.size} stamps and {len(self.names)} names')
        if not np.all(np.isfinite(times)) or np.any(np.diff(times) < 0.0):
            raise RecordingError(f'series {label}: stamps must be finite and not decreasing')
        object.__setattr__(self, 'times', times)
        object.__setattr__(self, 'values', values)

    def __len__(self) -> int:
        """Return the number of stamps."""
        return int(self.times.size)

    def column(self, name: str) -> FloatArray:
        """
        Return one channel.

        Parameters
        ----------
        name : str
            One of ``names``.

        Returns
        -------
        numpy.ndarray, shape (n_times,)

        Raises
        ------
        RecordingError
            If there is no such channel.

        """
        if name not in self.names:
            raise RecordingError(f'no channel {name!r}; there are {", ".join(self.names)}')
        return self.values[:, self.names.index(name)]

    def slice(self, start: float, end: float) -> TimeSeries:  # noqa: A003
        """Return the samples with start <= stamp <= end [s]."""
        first = int(np.searchsorted(self.times, start, side='left'))
        last = int(np.searchsorted(self.times, end, side='right'))
        return TimeSeries(self.times[first:last], self.values[first:last], self.names)

    def to_pandas(self) -> Any:
        """
        Return the samples as a pandas DataFrame.

        Returns
        -------
        pandas.DataFrame, shape (n_times, n_channels)
            Index ``time`` [s], one column a channel.

        Raises
        ------
        MissingExtraError
            If pandas is not installed.

        """
        require('pandas', 'make a DataFrame')
        import pandas as pd

        return pd.DataFrame(self.values.copy(), index=pd.Index(self.times.copy(), name='time'),
                            columns=list(self.names))

    def plot(self, ax: Any = None, **style: Any) -> Any:
        """
        Draw every channel over time.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where to draw; the current axes if not given.
        **style
            Passed on to ``Axes.plot``.

        Returns
        -------
        matplotlib Axes

        """
        require('matplotlib', 'draw figures')
        if ax is None:
            from matplotlib import pyplot
            ax = pyplot.gca()
        for name in self.names:
            ax.plot(self.times, self.column(name), **{'label': name, **style})
        ax.set_xlabel('time [s]')
        ax.legend()
        return ax
