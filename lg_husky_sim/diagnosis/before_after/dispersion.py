# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
By how much parameters scatter more than whitened residuals promise.

A filter makes residuals white from bin to bin. What the base leaves out lasts for seconds, or is
there in turns only: what matters is how large it is where the parameters act.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor

from lg_husky_sim.diagnosis.before_after.base import Base
from lg_husky_sim.diagnosis.before_after.drives import Drive
from lg_husky_sim.diagnosis.before_after.fitting import Prior
from lg_husky_sim.diagnosis.before_after.prediction import CHANNELS, jacobian
from lg_husky_sim.diagnosis.before_after.whitening import Noise
from lg_husky_sim.signals import FloatArray
import numpy as np


def dispersed(base: Base, groups: Mapping[str, Sequence[Drive]], places: Mapping[str, FloatArray],
              noise: Noise, prior: Prior, pool: Executor) -> Noise:
    """
    Return noise whose channels count by as much as they tell.

    With the derivatives J_b of a channel and its residuals e_b in a block of time, whitened, the
    scores J_b' e_b of the blocks are independent of each other, and their covariance is that of
    white residuals times a dispersion (sandwich). On the mean over what all channels H and the
    prior P together say of the parameters::

        A = (H + P)^-1,  dispersion = sum of e_b' J_b A J_b' e_b / trace(A J' J)

    less the mean score, which the fit has made zero. All recordings share it.

    Parameters
    ----------
    base : Base
        Robot whose parameters were fitted.
    groups : mapping of str to sequence of Drive
        By recording.
    places : mapping of str to numpy.ndarray, shape (n,)
        Where each recording was fitted, on the scale of the estimates.
    noise : Noise
        Filters and standard deviations by channel, to be widened.
    prior : Prior
        Of the parameters; its precision counts beside the data.
    pool : Executor
        Threads, one recording each.

    Returns
    -------
    Noise
        With standard deviations that are larger by the root of the dispersion; none is smaller.

    """
    def parts(name: str) -> dict[str, tuple[float, float]]:
        return _scatter(base, groups[name], places[name], noise, prior)
    found: dict[str, list[tuple[float, float]]] = {}
    for one in pool.map(parts, groups):
        for channel, pair in one.items():
            found.setdefault(channel, []).append(pair)
    return noise.wider({channel: float(np.sqrt(max(sums[0] / sums[1], 1.0)))
                        for channel, pairs in found.items()
                        if (sums := np.sum(pairs, axis=0))[1] > 0.0})


def _scatter(base: Base, drives: Sequence[Drive], z: FloatArray, noise: Noise, prior: Prior
             ) -> dict[str, tuple[float, float]]:
    # Of each channel of a recording: what its scores scatter by, and what they should.
    scores: dict[str, list[FloatArray]] = {}
    grams: dict[str, FloatArray] = {}
    for drive in drives:
        rows, columns = jacobian(base, drive, z, prior.free)
        errors, derivatives = (
            noise.by_channel(one, drive.vigour) for one in (rows, columns))
        for stream, names in CHANNELS.items():
            for name in names:
                if name not in errors or not errors[name].size:
                    continue
                j = derivatives[name][:, prior.free]
                centres = drive.bins[stream].centres()[-errors[name].size:]
                blocks = ((centres - drive.start) / base.settings.fit['block']).astype(np.intp)
                edges = np.flatnonzero(np.diff(blocks, prepend=-1))
                scores.setdefault(name, []).append(
                    np.add.reduceat(j * errors[name][:, None], edges, axis=0))
                grams[name] = grams.get(name, 0.0) + j.T @ j
    if not grams:
        return {}
    precision = 1.0 / prior.sd[prior.free] ** 2
    known = np.linalg.inv(sum(grams.values()) + np.diag(precision))
    found = {}
    for name, parts in scores.items():
        every = np.vstack(parts)
        if len(every) > 1:
            off = every - every.mean(axis=0)
            share = len(every) / (len(every) - 1.0)
            found[name] = (share * float(np.sum(off @ known * off)),
                           float(np.sum(known * grams[name])))
    return found
