# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Noise of the channels: an autoregressive filter each, so that a likelihood is honest."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

from lg_husky_sim.diagnosis.before_after.prediction import CHANNELS, KINDS
from lg_husky_sim.diagnosis.before_after.settings import Settings
from lg_husky_sim.signals import FloatArray
import numpy as np


@dataclass(frozen=True, eq=False)
class Noise:
    """
    Whitening filters by channel, with variances that grow with the motion.

    What tyres do beyond the base is small while a robot drives straight ahead at an even speed,
    and large where it turns or changes its speed. With the squares q of the yaw rate and of the
    acceleration of the wheels, what a filter leaves has the variance::

        sd^2 (1 + growth . q)

    Parameters
    ----------
    filters : mapping of str to numpy.ndarray
        Coefficients of the residual 0, 1, 2, ... bins ago; the first is 1.
    sd : mapping of str to float
        Standard deviation of what the filter leaves at rest [unit of the channel].
    growth : mapping of str to numpy.ndarray, shape (2,)
        Of its variance [(rad/s)^-2, (rad/s^2)^-2]; none where it is left out.

    """

    filters: Mapping[str, FloatArray]
    sd: Mapping[str, float]
    growth: Mapping[str, FloatArray] = field(default_factory=dict)

    def white(self, rows: Mapping[str, FloatArray], vigour: Mapping[str, FloatArray]
              ) -> FloatArray:
        """Return residuals, or their derivatives, whitened and stacked along the first axis."""
        return np.concatenate(list(self.by_channel(rows, vigour).values()))

    def by_channel(self, rows: Mapping[str, FloatArray], vigour: Mapping[str, FloatArray]
                   ) -> dict[str, FloatArray]:
        """Return residuals, or their derivatives, whitened, by channel; `vigour` of the drive."""
        return {name: self._one(name, rows[stream][:, k], vigour[stream])
                for stream, names in CHANNELS.items() if stream in rows
                for k, name in enumerate(names) if name in self.sd}

    def wider(self, by: Mapping[str, float]) -> Noise:
        """Return this with standard deviations that are so many times as large."""
        return replace(self, sd={
            name: by.get(name, 1.0) * size for name, size in self.sd.items()})

    def among(self, names: Collection[str]) -> Noise:
        """Return this for channels of these names only; the others do not count."""
        filters, sd, growth = ({name: one for name, one in each.items() if name in names}
                               for each in (self.filters, self.sd, self.growth))
        return Noise(filters, sd, growth)  # type: ignore[arg-type]

    def _one(self, name: str, rows: FloatArray, vigour: FloatArray) -> FloatArray:
        found = _filtered(self.filters[name], rows)
        size = np.full(found.shape[0], self.sd[name])
        if name in self.growth:
            last = np.nan_to_num(vigour[vigour.shape[0] - found.shape[0]:])
            size *= np.sqrt(1.0 + last @ self.growth[name])
        return np.asarray(found / size.reshape((-1,) + (1,) * (found.ndim - 1)))


def _filtered(taps: FloatArray, rows: FloatArray) -> FloatArray:
    order = taps.size - 1
    count = max(rows.shape[0] - order, 0)
    found = np.zeros((count, *rows.shape[1:]))
    for lag, tap in enumerate(taps):
        found += tap * rows[order - lag:order - lag + count]
    return found


def first_noise(settings: Settings) -> Noise:
    """Return white noise of the sizes in the settings."""
    return Noise({name: np.ones(1) for name in KINDS},
                 {name: settings.noise[kind] for name, kind in KINDS.items()})


def noise_of(residuals: Sequence[Mapping[str, FloatArray]],
             vigours: Sequence[Mapping[str, FloatArray]], settings: Settings, grows: bool
             ) -> Noise:
    """
    Estimate filters and variances from residuals of a good fit.

    Parameters
    ----------
    residuals : sequence of mapping of str to numpy.ndarray
        Of each drive, by stream.
    vigours : sequence of mapping of str to numpy.ndarray
        Of each drive, by stream.
    settings : Settings
        Order of the filters, and how often variances are estimated anew.
    grows : bool
        Whether variances grow with the motion.

    Returns
    -------
    Noise
        Channels that were not measured, or not as numbers, are left out.

    """
    order, filters, sizes, growth = int(settings.fit['filter']), {}, {}, {}
    for stream, names in CHANNELS.items():
        for k, name in enumerate(names):
            pairs = [(r[stream][:, k], v[stream][order:]) for r, v in zip(
                residuals, vigours, strict=True)
                if stream in r and r[stream].shape[0] > 4 * order]
            if not pairs or not all(np.all(np.isfinite(row)) for row, _ in pairs):
                continue
            past = np.vstack([np.column_stack([row[order - lag:row.size - lag]
                                               for lag in range(1, order + 1)])
                              for row, _ in pairs])
            now = np.concatenate([row[order:] for row, _ in pairs])
            motion = np.vstack([v for _, v in pairs])
            # A robot at rest is predicted without an error, and says nothing of others.
            asked = ~np.isnan(motion[:, 0])
            past, now, motion = past[asked], now[asked], motion[asked]
            if not np.any(past):
                continue
            even = np.ones((now.size, 1))
            parts = np.hstack([even, motion]) if grows else even
            variance = np.ones(now.size)
            for _turn in range(int(settings.fit['variance_turns'])):
                gram = past.T @ (past / variance[:, None])
                gram[np.diag_indices(order)] += np.trace(gram) / order * 1e-6
                taps = np.linalg.solve(gram, past.T @ (now / variance))
                share = _shares((now - past @ taps) ** 2, parts, int(settings.fit['shares']))
                variance = parts @ share
            if share[0] > 0.0:
                filters[name] = np.concatenate([[1.0], -taps])
                sizes[name] = float(np.sqrt(share[0]))
                if grows:
                    growth[name] = share[1:] / share[0]
    return Noise(filters, sizes, growth)


def _shares(squares: FloatArray, parts: FloatArray, turns: int) -> FloatArray:
    # The likeliest s of squares with means parts @ s, by multiplicative steps that keep it >= 0.
    share = np.full(parts.shape[1], float(np.mean(squares))) / np.maximum(
        np.mean(parts, axis=0), 1e-12) / parts.shape[1]
    for _ in range(turns):
        mean = parts @ share
        if np.min(mean) <= 0.0:
            break
        share = share * (parts.T @ (squares / mean ** 2)) / np.maximum(
            parts.T @ (1.0 / mean), 1e-300)
    return np.asarray(share)


def surprise(noise: Noise, residuals: Sequence[Mapping[str, FloatArray]],
             vigours: Sequence[Mapping[str, FloatArray]]) -> float:
    """Return the negative log likelihood of residuals of this noise, to a constant [nats]."""
    total = 0.0
    for rows, vigour in zip(residuals, vigours, strict=True):
        for name, white in noise.by_channel(rows, vigour).items():
            stream = next(one for one, names in CHANNELS.items() if name in names)
            last = vigour[stream][vigour[stream].shape[0] - white.size:]
            total += 0.5 * float(white @ white) + white.size * np.log(noise.sd[name])
            if name in noise.growth:
                total += 0.5 * float(np.sum(np.log1p(np.nan_to_num(last) @ noise.growth[name])))
    return total
