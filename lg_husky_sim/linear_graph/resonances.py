# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a frequency response has its largest gain and its bandwidth, from poles and zeros."""

from __future__ import annotations

from dataclasses import dataclass

from lg_husky_sim.linear_graph.modes import bisected, ComplexArray
from lg_husky_sim.linear_graph.state_space import FloatArray
from lg_husky_sim.linear_graph.transfer import STANDING
import numpy as np

RATES, BESIDE = 400, 8
"""Angular frequencies by default, and those on either side of a resonance."""
NARROWEST = 1e-4
"""Relative distance from a resonance of the nearest one beside it, where nothing damps it."""
BANDWIDTH = 3.0
"""Loss of gain [dB] at the bandwidth; the usual one."""


def usual_rates(roots: ComplexArray) -> FloatArray:
    """
    Return angular frequencies [rad/s], a decade and more around all poles and zeros.

    They are dense at resonances, but are never at one that nothing damps.
    """
    sizes = np.abs(roots)
    sizes = sizes[sizes > STANDING * sizes.max(initial=0.0)]
    low, high = (sizes.min(), sizes.max()) if sizes.size else (1.0, 1.0)
    found = np.geomspace(10.0 ** (np.floor(np.log10(low)) - 1.0),
                         10.0 ** (np.ceil(np.log10(high)) + 1.0), RATES)
    undamped = roots.imag[_undamped(roots)]
    found = found[~np.isin(found, undamped)]
    for root in np.unique(roots[roots.imag > 0.0]):
        width = max(abs(root.real), NARROWEST * abs(root))
        away = np.geomspace(width, abs(root), BESIDE + 1)[:-1]
        more = np.concatenate([root.imag - away, root.imag + away, [root.imag]])
        found = np.append(found, more[(more > found.min()) & ~np.isin(more, undamped)])
    return np.unique(found)


def _undamped(roots: ComplexArray) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Return which roots are on the imaginary axis."""
    return np.asarray(np.abs(roots.real) <= STANDING * np.abs(roots))


@dataclass(frozen=True, eq=False)
class Factors:
    """
    A transfer function as a gain, zeros and poles.

    Parameters
    ----------
    gain : float
        Not zero.
    zeros, poles : numpy.ndarray of complex
        [1/s].

    """

    gain: float
    zeros: ComplexArray
    poles: ComplexArray

    def decibels(self, rates: FloatArray) -> FloatArray:
        """Return the gain [dB] at angular frequencies [rad/s]; infinite at an undamped pole."""
        s = 1j * rates[:, None]
        with np.errstate(divide='ignore'):
            logs = (np.log10(abs(self.gain)) + np.log10(np.abs(s - self.zeros)).sum(1)
                    - np.log10(np.abs(s - self.poles)).sum(1))
        return np.asarray(20.0 * logs)

    def rising(self, rates: FloatArray) -> FloatArray:
        """Return the slope of the gain's logarithm over the angular frequency."""
        total = np.zeros(rates.shape)
        for sign, roots in ((1.0, self.zeros), (-1.0, self.poles)):
            away = rates[:, None] - roots.imag
            total += sign * (away / (away ** 2 + roots.real ** 2)).sum(1)
        return total

    def largest(self, rates: FloatArray) -> float | None:
        """Return where between angular frequencies the gain is largest; None if at an end."""
        low, high = float(rates.min()), float(rates.max())
        undamped = self.poles.imag[_undamped(self.poles)]
        if (inside := undamped[(undamped > low) & (undamped < high)]).size:
            return float(inside[0])
        known = usual_rates(np.concatenate([self.zeros, self.poles]))
        grid = np.unique(np.concatenate([rates, known[(known > low) & (known < high)]]))
        grid = grid[~np.isin(grid, self.zeros.imag[_undamped(self.zeros)])]
        slope = self.rising(grid)
        tops = np.flatnonzero((slope[:-1] > 0.0) & (slope[1:] <= 0.0))
        if not tops.size:
            return None
        peaks = bisected(self.rising, grid[tops], grid[tops + 1])
        sizes = self.decibels(peaks)
        best = int(sizes.argmax())
        return float(peaks[best]) if sizes[best] > self.decibels(grid[[0, -1]]).max() else None

    def bandwidth(self, rates: FloatArray) -> float | None:
        """Return where the gain first is 3 dB below that at rest; None without such a one."""
        if not (self.zeros.all() and self.poles.all()):
            return None
        level = float(self.decibels(np.zeros(1))[0]) - BANDWIDTH
        grid = np.sort(np.append(rates, 0.0))
        below = np.flatnonzero(self.decibels(grid) < level)
        if not below.size:
            return None
        at = int(below[0])
        return float(bisected(lambda rate: self.decibels(rate) - level, grid[[at - 1]],
                              grid[[at]])[0])
