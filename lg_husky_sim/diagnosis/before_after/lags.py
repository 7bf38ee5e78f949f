# Copyright 2026 lg_husky_sim contributors
# SPDX-License-Identifier: Apache-2.0
"""How late a stream of a recording is, as the streams say of each other, without a model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from lg_husky_sim.diagnosis.before_after.prediction import Base
from lg_husky_sim.diagnosis.sensors.faults import faults
from lg_husky_sim.diagnosis.sensors.relations import relations
from lg_husky_sim.diagnosis.wording import LATENESS
from lg_husky_sim.recording import Recording, segments
from lg_husky_sim.signals import FloatArray
import numpy as np


def lags_of(recordings: Sequence[Recording], baseline: Sequence[Recording], base: Base
            ) -> tuple[Base, Mapping[str, FloatArray]]:
    """
    Return where the delays of each recording are.

    Parameters
    ----------
    recordings, baseline : sequence of Recording
        After and before the change.
    base : Base

    Returns
    -------
    Base
        Whose stream of reference is as late as in the baseline.
    mapping of str to numpy.ndarray, shape (n,)
        By recording, how late its streams are beyond that, on the scale of the estimates; zero
        where no stream is at fault, and for all but delays.
    """
    lags = {one.name: _lags(one, base) for one in (*baseline, *recordings)}
    usual = np.zeros(base.start.size)
    usual[base.reference] = np.median([lags[one.name][base.reference] for one in baseline])
    return (replace(base, start=base.start + usual),
            {name: lag - usual for name, lag in lags.items()})


def _lags(recording: Recording, base: Base) -> FloatArray:
    found = np.zeros(base.start.size)
    for fault in faults(relations(segments(recording))):
        number = fault.number
        if fault.stream and number is not None and number.name == LATENESS:
            found[base.names.index(f'{fault.stream}_late')] = number.value
    return found
