# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""Where fits begin: at what a robot may differ by from one that is known."""

from __future__ import annotations

from lg_husky_sim.diagnosis.before_after.base import Base
from lg_husky_sim.signals import FloatArray
import numpy as np
from numpy.typing import NDArray


def starts_from(base: Base, free: NDArray[np.bool_], begin: FloatArray) -> list[list[FloatArray]]:
    """
    Return starts by kind: the one given, and what may differ from it, each in several sizes.

    Parameters
    ----------
    base : Base
        Its settings hold the kinds of starts.
    free : numpy.ndarray of bool, shape (n,)
        Which parameters are estimated; a start that moves another one is left out.
    begin : numpy.ndarray, shape (n,)
        On the scale of the estimates.

    Returns
    -------
    list of list of numpy.ndarray, shape (n,)
        As many kinds, with as many starts each, for any `begin`.

    """
    names, (lower, upper) = base.names, base.bounds()
    found = [[begin]]
    for kind in base.settings.starts:
        several = []
        for entry in kind:
            if all(free[names.index(name)] for name in entry):
                one = np.array(begin)
                for name, value in entry.items():
                    one[names.index(name)] += value
                several.append(np.clip(one, lower, upper))
        if several:
            found.append(several)
    return found
