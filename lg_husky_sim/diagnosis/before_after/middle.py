# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Where recordings of one robot lie in the middle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from lg_husky_sim.diagnosis.before_after.base import Base
from lg_husky_sim.diagnosis.before_after.evidence import Quadratic
from lg_husky_sim.diagnosis.before_after.fitting import Prior
from lg_husky_sim.signals import FloatArray
import numpy as np


def middle(base: Base, prior: Prior, apart: FloatArray, places: Mapping[str, FloatArray],
           quadratics: Sequence[Quadratic]) -> FloatArray:
    """
    Return the likeliest mean of recordings that are where they are, each parameter by itself.

    A recording that says little of a parameter, as a straight drive does of the turns, counts
    little. With places p, of which the recordings say c, and deviations of d about the mean m of
    prior m0 and s::

        m = (m0 / s^2 + sum of w p) / (1 / s^2 + sum of w),  w = 1 / (d^2 + 1 / c)

    What all of them together say by their derivatives would outweigh the prior of what is nearly
    free, and lead it far away. A limit is that of the recording which reaches furthest.

    Parameters
    ----------
    base : Base
        Robot, with the bounds of its parameters and which of them are limits.
    prior : Prior
        Of the mean; what is not free stays at its mean.
    apart : numpy.ndarray, shape (n,)
        Standard deviations of a recording about the mean.
    places : mapping of str to numpy.ndarray, shape (n,)
        Where each recording is likeliest, on the scale of the estimates.
    quadratics : sequence of Quadratic
        The likelihood of each recording about its place.

    Returns
    -------
    numpy.ndarray, shape (n,)

    """
    index = np.flatnonzero(prior.free)
    several = np.array([places[one.recording] for one in quadratics])
    told = np.array([one.among(index).told(prior.sd[index]) for one in quadratics])
    each, known = told / (1.0 + apart[index] ** 2 * told), prior.sd[index] ** -2
    found = np.array(prior.mean)
    found[index] = (known * found[index] + (each * several[:, index]).sum(axis=0)) / (
        known + each.sum(axis=0))
    for k in index:
        if base.settings.quantities[k].name in base.settings.limits:
            found[k] = several[:, k].max()
    return np.clip(found, *base.bounds())
