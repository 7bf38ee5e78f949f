# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Kinds of robots: whether there is a wheel loop is no matter of degree.

Gains of the loop are expected about those of the kind. Recordings of one robot are of one kind,
so all of them tell which.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace

from lg_husky_sim.diagnosis.before_after.base import Base
from lg_husky_sim.diagnosis.before_after.drives import Drive
from lg_husky_sim.diagnosis.before_after.fitting import fit_set, Prior, SetFit
from lg_husky_sim.diagnosis.before_after.whitening import Noise
from lg_husky_sim.signals import FloatArray
import numpy as np

#: Parameters by recording, on the scale of the estimates.
Places = Mapping[str, FloatArray]


def kinds_of(base: Base, prior: Prior, begin: FloatArray) -> list[tuple[FloatArray, Prior]]:
    """
    Return where the fits of each kind begin, and what is expected of it.

    Parameters
    ----------
    base : Base
        With its kinds.
    prior : Prior
        Of the commercial base.
    begin : numpy.ndarray, shape (n,)
        Where that one begins, on the scale of the estimates.

    Returns
    -------
    list of (numpy.ndarray, Prior)
        Kinds that are the same in the free parameters, once.

    """
    names, found = base.names, [(begin, prior)]
    for kind in base.kinds:
        start, mean = np.array(begin), np.array(prior.mean)
        for name, value in kind.items():
            k = names.index(name)
            if prior.free[k]:
                start[k] = base.place(name, value)
                if name in base.settings.of_a_kind:
                    mean[k] = start[k]
        if not any(np.array_equal(start, one) for one, _ in found):
            found.append((start, replace(prior, mean=mean)))
    return found


def of_likeliest_kind(base: Base, groups: Mapping[str, Sequence[Drive]], noise: Noise,
                      places: Places, lags: Places, prior: Prior, kinds: Sequence[Prior],
                      pool: Executor) -> tuple[Places, Prior]:
    """
    Return the kind that all recordings together are likeliest of, and their places as one of it.

    Parameters
    ----------
    base : Base
        Robot that is fitted.
    groups : mapping of str to sequence of Drive
        Drives by recording.
    noise : Noise
        What residuals are whitened with.
    places : mapping of str to numpy.ndarray, shape (n,)
        Where each recording was fitted.
    lags : mapping of str to numpy.ndarray, shape (n,)
        By how much the streams of each recording are late.
    prior : Prior
        Of the kind with which they were.
    kinds : sequence of Prior
        Of all kinds; one is that.
    pool : Executor
        Threads, one recording each.

    Returns
    -------
    places : mapping of str to numpy.ndarray, shape (n,)
        Where a few steps lead from there.
    prior : Prior

    """
    others = [kind for kind in kinds if not np.array_equal(kind.mean, prior.mean)]
    if not others:
        return places, prior
    numbers = base.settings.fit
    own = [base.names.index(name) for name in sorted(base.settings.of_a_kind)]

    def fitted(kind: Prior) -> list[SetFit]:
        def end(name: str) -> SetFit:
            begin = np.array(places[name])
            if kind is not prior:
                begin[own] = kind.mean[own]
            return fit_set(base, groups[name], replace(kind, mean=kind.mean + lags[name]), noise,
                           begin, int(numbers['kind_steps']), numbers['roughly'], map)
        return list(pool.map(end, groups))
    found = [(fitted(kind), kind) for kind in (prior, *others)]
    fits, likeliest = min(found, key=lambda one: sum(fit.cost for fit in one[0]))
    return {name: fit.z for name, fit in zip(groups, fits, strict=True)}, likeliest
