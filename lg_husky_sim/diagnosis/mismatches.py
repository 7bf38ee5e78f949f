# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Where in time and in which channel a model is off."""

from __future__ import annotations

from lg_husky_sim.diagnosis.result import Mismatch
from lg_husky_sim.identification.noise import spread
from lg_husky_sim.identification.problem import Observations
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Smoothing of the residual [s], and the deviations from which a stretch counts.
SMOOTH = 0.8
STRONG = 4.0
#: Stretches nearer than this are one [s]; most stretches that are listed.
JOIN = 1.5
MOST = 40
#: Channel to the subsystem whose balance it belongs to, where nothing better is known.
_PART = {'wheel_left': 'drivetrain', 'wheel_right': 'drivetrain', 'yaw_rate': 'rotation',
         'turn': 'rotation', 'advance': 'translation'}


def _smoothed(values: FloatArray, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    # Mean over a sliding window and how many values it has.
    total = np.concatenate([[0.0], np.cumsum(values)])
    first = np.searchsorted(times, times - 0.5 * SMOOTH, side='left')
    last = np.searchsorted(times, times + 0.5 * SMOOTH, side='right')
    count = (last - first).astype(float)
    return (total[last] - total[first]) / count, count


def mismatches(observations: Observations, residual: FloatArray, reference: FloatArray,
               subsystem: str | None = None) -> tuple[Mismatch, ...]:
    """
    Return the stretches where a smoothed residual is beyond its noise.

    Parameters
    ----------
    observations : Observations
    residual : numpy.ndarray, shape (n_values,)
        Of the plain model.
    reference : numpy.ndarray, shape (n_values,)
        Residual of the best model: the noise that is left when all is explained.
    subsystem : str, optional
        Culprit, if it is known; else the part that the channel belongs to.

    Returns
    -------
    tuple of Mismatch
        Strongest first.
    """
    found: list[Mismatch] = []
    noise: dict[str, float] = {}
    for name in observations.channels:
        parts = [_smoothed(reference[s.first:s.last], observations.times[s.first:s.last])[0]
                 for s in observations.slices if s.channel == name and s.last > s.first]
        noise[name] = max(spread(np.concatenate(parts)), 1e-6)
    for one in observations.slices:
        times = observations.times[one.first:one.last]
        if times.size < 5:
            continue
        smooth, _ = _smoothed(residual[one.first:one.last], times)
        strength = np.abs(smooth) / noise[one.channel]
        recording = observations.pieces[one.piece].recording
        part = subsystem or _PART[one.channel]
        for begin, end in _stretches(times, strength > STRONG):
            inside = (times >= begin) & (times <= end)
            found.append(Mismatch(recording, one.channel, round(float(begin), 3),
                                  round(float(end), 3),
                                  round(float(np.max(strength[inside])), 2), part))
    found.sort(key=lambda m: -m.strength * (m.end - m.start + SMOOTH))
    return tuple(found[:MOST])


def _stretches(times: FloatArray, on: np.typing.NDArray[np.bool_]) -> list[tuple[float, float]]:
    stretches: list[tuple[float, float]] = []
    for index in np.flatnonzero(on):
        moment = float(times[index])
        if stretches and moment - stretches[-1][1] <= JOIN:
            stretches[-1] = (stretches[-1][0], moment)
        else:
            stretches.append((moment, moment))
    return stretches
