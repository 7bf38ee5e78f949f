# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""
Limits as these drives would meet them: at what a robot exceeds for some share of the time.

A limit just below what is reached acts for moments only. One that is a little lower acts most of
the time, so that no size given beforehand leads to it.
"""

from __future__ import annotations

from collections.abc import Mapping

from lg_husky_sim.diagnosis.evidence.evidence import Evidence, Fit
from lg_husky_sim.diagnosis.evidence.observation import probe_times
from lg_husky_sim.diagnosis.hypotheses.hypothesis import Hypothesis, Numbers
from lg_husky_sim.diagnosis.settings import setting
from lg_husky_sim.signals import FloatArray
import numpy as np


def reached_of(evidence: Evidence, fit: Fit) -> Mapping[str, FloatArray]:
    """
    Return what the simulated drives exceed for some shares of the time.

    Parameters
    ----------
    evidence : Evidence
        Drives, and the noise under which the fit was made.
    fit : Fit
        Whose simulation of each drive is looked at.

    Returns
    -------
    mapping of str to numpy.ndarray, shape (n,)
        By the quantities that parameters of ``effects.yaml`` limit: voltage [V] and current [A]
        of a motor, commanded speed [m/s] and yaw rate [rad/s]; n shares from
        ``reached_least`` to ``reached_most``.

    """
    pooled: dict[str, list[FloatArray]] = {}
    for drive, motion in zip(evidence.drives, evidence.motions(fit.point, True), strict=True):
        place = np.searchsorted(drive.logged.times, probe_times(drive), side='right')
        commands = drive.logged.values[np.maximum(place - 1, 0)]
        for name in ('voltage', 'current'):
            pooled.setdefault(name, []).extend(
                np.abs(motion.column(f'{name}_{side}', 'probe')) for side in ('left', 'right'))
        for number, name in enumerate(('forward', 'yaw')):
            pooled.setdefault(name, []).append(np.abs(commands[:, number]))
    shares = np.geomspace(setting('reached_least'), setting('reached_most'),
                          int(setting('reached_steps')))
    return {name: np.quantile(np.concatenate(parts), 1.0 - shares)
            for name, parts in pooled.items()}


def limits_reached(hypothesis: Hypothesis, reached: Mapping[str, FloatArray]
                   ) -> list[list[Numbers]]:
    """
    Return groups of numbers to look at, as :meth:`Hypothesis.trials` does.

    Parameters
    ----------
    hypothesis : Hypothesis
        An effect; its free parameters say what they limit, if anything.
    reached : mapping of str to numpy.ndarray
        See :func:`reached_of`.

    Returns
    -------
    list of list of mapping
        Empty for an effect that limits nothing.

    """
    free = hypothesis.free
    if not all(p.limits in reached for p in free):
        return []
    return [[dict(zip((p.name for p in free), values, strict=True))]
            for values in zip(*(reached[p.limits].tolist() for p in free), strict=True)
            if all(p.lower < value < p.upper for p, value in zip(free, values, strict=True))]
