# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Likelihoods of limits, which no derivative at one place tells.

A limit that a recording does not reach has no derivative there, and where one just bites, the
likelihood is steep beside it and level beyond.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from lg_husky_sim.diagnosis.before_after.base import Base
from lg_husky_sim.diagnosis.before_after.drives import Drive
from lg_husky_sim.diagnosis.before_after.evidence import Quadratic
from lg_husky_sim.diagnosis.before_after.fitting import fit_set, Prior
from lg_husky_sim.diagnosis.before_after.prediction import CHANNELS, residual
from lg_husky_sim.diagnosis.before_after.whitening import Noise
from lg_husky_sim.signals import FloatArray
import numpy as np


def with_limits(base: Base, drives: Sequence[Drive], noise: Noise, prior: Prior,
                places: Mapping[str, FloatArray], near: Quadratic) -> Quadratic:
    """
    Return the quadratic of a recording with what the limits of the others would cost it.

    Where the lowest limit of all recordings, in place of its own, costs more than the derivatives
    say, the curvature is as large as that: the recording exceeds it, and ``lasting`` is the share
    of that cost that is left without the stretch that costs most. The highest one costs no more
    than none at all, with all else as far from its place as recordings of one robot differ.

    Parameters
    ----------
    base : Base
        Robot that was fitted, with its limits.
    drives : sequence of Drive
        Of the recording.
    noise : Noise
        What residuals are whitened with.
    prior : Prior
        Whose free parameters count.
    places : mapping of str to numpy.ndarray, shape (n,)
        Where each recording was fitted, on the scale of the estimates.
    near : Quadratic
        Of the recording, about its place.

    Returns
    -------
    Quadratic

    """
    numbers, quantities = base.settings.fit, base.settings.quantities
    z, several = places[near.recording], np.array(list(places.values()))
    wide = np.hypot([q.recording for q in quantities], numbers['drawn_least'] * prior.sd)

    def costs(at: FloatArray) -> FloatArray:
        return np.concatenate([_by_stretch(base, d, noise, at) for d in drives])
    here, upper = costs(z), base.bounds()[1]
    for k, quantity in enumerate(quantities):
        if not prior.free[k] or quantity.name not in base.settings.limits:
            continue
        lower, higher = several[:, k].min() - z[k], several[:, k].max() - z[k]
        if -lower > prior.sd[k] * numbers['limit_apart']:
            there = np.where(np.arange(z.size) == k, z[k] + lower, z)
            more = costs(there) - here
            whole, most = float(np.sum(more)), float(np.max(more))
            if whole > 0.0:
                near = near.curved(k, z[k], 2.0 * whole / lower ** 2,
                                   max(1.0 - most / whole, 0.0))
        others = prior.free & (np.arange(z.size) != k)
        promised = 0.5 * _profile(near.curvature, k, others, wide) * higher ** 2
        if promised > numbers['enough']:
            about = Prior(np.where(others | ~prior.free, z, upper), wide, others)
            fit = fit_set(base, drives, about, noise, about.mean, int(numbers['steps']),
                          numbers['enough'], map)
            costs_more = fit.cost - float(np.sum(here))
            near = near.flatter(k, float(np.clip(costs_more / promised, 0.0, 1.0)))
    return near


def _by_stretch(base: Base, drive: Drive, noise: Noise, at: FloatArray) -> FloatArray:
    # Negative log likelihood of each stretch of a drive.
    found = np.zeros(int(drive.steps * base.settings.simulation['step']
                         / base.settings.fit['block']) + 2)
    for name, white in noise.by_channel(residual(base, drive, at), drive.vigour).items():
        stream = next(one for one, names in CHANNELS.items() if name in names)
        centres = drive.bins[stream].centres()[-white.size:]
        found += np.bincount(((centres - drive.start) / base.settings.fit['block']).astype(
            np.intp), 0.5 * white ** 2, found.size)
    return found


def _profile(curvature: FloatArray, k: int, others: np.typing.NDArray[np.bool_], wide: FloatArray
             ) -> float:
    # Curvature along a parameter with the others, of so wide a prior, at their best.
    inner = curvature[np.ix_(others, others)] + np.diag(wide[others] ** -2.0)
    across = curvature[others, k]
    return float(curvature[k, k] - across @ np.linalg.solve(inner, across))
