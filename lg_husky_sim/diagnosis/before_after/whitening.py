# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Noise of the channels: an autoregressive filter each, so that a likelihood is honest."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from lg_husky_sim.diagnosis.before_after.prediction import CHANNELS, KINDS
from lg_husky_sim.diagnosis.before_after.settings import Settings
from lg_husky_sim.signals import FloatArray
import numpy as np


@dataclass(frozen=True, eq=False)
class Noise:
    """
    Whitening filters by channel.

    Parameters
    ----------
    filters : mapping of str to numpy.ndarray
        Coefficients of the residual 0, 1, 2, ... bins ago; the first is 1.
    sd : mapping of str to float
        Standard deviation of what the filter leaves [unit of the channel].
    """

    filters: Mapping[str, FloatArray]
    sd: Mapping[str, float]

    def white(self, rows: Mapping[str, FloatArray]) -> FloatArray:
        """Return residuals, or their derivatives, whitened and stacked along the first axis."""
        return np.concatenate(list(self.by_channel(rows).values()))

    def by_channel(self, rows: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
        """Return residuals, or their derivatives, whitened, by channel."""
        return {name: self._one(name, rows[stream][:, k])
                for stream, names in CHANNELS.items() if stream in rows
                for k, name in enumerate(names) if name in self.sd}

    def wider(self, by: Mapping[str, float]) -> Noise:
        """Return this with standard deviations that are so many times as large."""
        return Noise(self.filters, {
            name: by.get(name, 1.0) * size for name, size in self.sd.items()})

    def among(self, names: Collection[str]) -> Noise:
        """Return this for channels of these names only; the others do not count."""
        return Noise({name: taps for name, taps in self.filters.items() if name in names},
                     {name: size for name, size in self.sd.items() if name in names})

    def _one(self, name: str, rows: FloatArray) -> FloatArray:
        taps = self.filters[name]
        order = taps.size - 1
        count = max(rows.shape[0] - order, 0)
        found = np.zeros((count, *rows.shape[1:]))
        for lag, tap in enumerate(taps):
            found += tap * rows[order - lag:order - lag + count]
        return found / self.sd[name]


def first_noise(settings: Settings) -> Noise:
    """Return white noise of the sizes in the settings."""
    return Noise({name: np.ones(1) for name in KINDS},
                 {name: settings.noise[kind] for name, kind in KINDS.items()})


def noise_of(residuals: Sequence[Mapping[str, FloatArray]], order: int) -> Noise:
    """
    Estimate the filters from residuals of a good fit.

    Parameters
    ----------
    residuals : sequence of mapping of str to numpy.ndarray
        Of each drive, by stream.
    order : int
        Bins that a filter looks back.

    Returns
    -------
    Noise
        Channels that were not measured, or not as numbers, are left out.
    """
    filters, sizes = {}, {}
    for stream, names in CHANNELS.items():
        for k, name in enumerate(names):
            rows = [r[stream][:, k] for r in residuals
                    if stream in r and r[stream].shape[0] > 4 * order]
            if not rows or not all(np.all(np.isfinite(row)) for row in rows):
                continue
            past = np.vstack([np.column_stack([row[order - lag:row.size - lag]
                                               for lag in range(1, order + 1)]) for row in rows])
            now = np.concatenate([row[order:] for row in rows])
            gram = past.T @ past
            gram[np.diag_indices(order)] += np.trace(gram) / order * 1e-6
            taps = np.linalg.solve(gram, past.T @ now)
            left = now - past @ taps
            size = float(np.sqrt(np.mean(left ** 2)))
            if size > 0.0:
                filters[name] = np.concatenate([[1.0], -taps])
                sizes[name] = size
    return Noise(filters, sizes)
